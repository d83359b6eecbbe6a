// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <isa-l/crc.h>
#include <lz4frame.h>
#include <zstd.h>

#include <cstdint>
#include <cstring>
#include <string>

/// Just enough of an MCAP writer, and of CDR, for tests and seeds.
namespace takt::mcap_writing {

template <class T>
std::string raw(T value) {
  std::string out(sizeof(T), '\0');
  std::memcpy(out.data(), &value, sizeof(T));
  return out;
}
inline std::string sized(const std::string& text) {
  return raw(static_cast<std::uint32_t>(text.size())) + text;
}
inline std::string record(int op, const std::string& content) {
  return std::string(1, static_cast<char>(op)) + raw(std::uint64_t{content.size()}) + content;
}
inline const std::string magic("\x89MCAP0\r\n", 8);
inline std::string header() {
  return record(1, sized("ros2") + sized("a test"));
}
inline std::string schema(std::uint16_t id, const std::string& name, const std::string& encoding = "ros2msg",
                          const std::string& definition = "std_msgs/Header header\n") {
  return record(3, raw(id) + sized(name) + sized(encoding) + sized(definition));
}
inline std::string channel(std::uint16_t id, std::uint16_t schema_id, const std::string& topic,
                           const std::string& encoding = "cdr") {
  return record(4, raw(id) + raw(schema_id) + sized(topic) + sized(encoding) + raw(std::uint32_t{0}));
}
inline std::string message(std::uint16_t channel_id, std::uint64_t log_time, const std::string& data) {
  return record(5, raw(channel_id) + raw(std::uint32_t{0}) + raw(log_time) + raw(log_time) + data);
}
inline std::uint32_t crc(const std::string& bytes) {
  return crc32_gzip_refl(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}
inline std::string compressed(const std::string& records, const std::string& compression) {
  std::string out = records;
  if (compression == "lz4") {
    out.resize(LZ4F_compressFrameBound(records.size(), nullptr));
    out.resize(LZ4F_compressFrame(out.data(), out.size(), records.data(), records.size(), nullptr));
  }
  if (compression == "zstd") {
    out.resize(ZSTD_compressBound(records.size()));
    out.resize(ZSTD_compress(out.data(), out.size(), records.data(), records.size(), 3));
  }
  return out;
}
inline std::string chunk(const std::string& records, const std::string& compression = "") {
  const std::string data = compressed(records, compression);
  return record(6, raw(std::uint64_t{0}) + raw(std::uint64_t{0}) + raw(std::uint64_t{records.size()}) +
                       raw(crc(records)) + sized(compression) + raw(std::uint64_t{data.size()}) + data);
}
/// Closed, with an empty summary.
inline std::string file(const std::string& records) {
  const std::string data = magic + header() + records;
  return data + record(15, raw(crc(data))) + record(2, std::string(20, '\0')) + magic;
}

/// CDR, little-endian: each field aligned to its size, counted from behind the first four bytes.
class Cdr {
 public:
  template <class T>
  Cdr& put(T value) {
    while (bytes_.size() % sizeof(T) != 0) bytes_ += '\0';
    bytes_ += raw(value);
    return *this;
  }
  Cdr& text(const std::string& s) {
    put(static_cast<std::uint32_t>(s.size() + 1));
    bytes_ += s + '\0';
    return *this;
  }
  Cdr& bytes(const std::string& s) {
    put(static_cast<std::uint32_t>(s.size()));
    bytes_ += s;
    return *this;
  }
  Cdr& header(std::int32_t s, std::uint32_t ns) { return put(s).put(ns).text("cam"); }
  [[nodiscard]] std::string done() const { return std::string("\0\1\0\0", 4) + bytes_; }

 private:
  std::string bytes_;
};

inline std::string imu(std::int32_t s, std::uint32_t ns, double wx, double ax) {
  Cdr m;
  m.header(s, ns);
  for (int i = 0; i < 4 + 9; ++i) m.put(0.0);
  for (const double w : {wx, 0.2, 0.3}) m.put(w);
  for (int i = 0; i < 9; ++i) m.put(0.0);
  for (const double a : {ax, 0.5, 9.8}) m.put(a);
  for (int i = 0; i < 9; ++i) m.put(0.0);
  return m.done();
}
inline std::string image(std::int32_t s, std::uint32_t ns, std::uint32_t width, std::uint32_t height,
                         const std::string& pixels) {
  Cdr m;
  m.header(s, ns).put(height).put(width).text("mono8").put(std::uint8_t{0}).put(width).bytes(pixels);
  return m.done();
}

}  // namespace takt::mcap_writing
