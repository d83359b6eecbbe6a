// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <bzlib.h>
#include <lz4frame.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

/// Just enough of a ROS 1 bag writer for tests and seeds.
namespace takt::bag_writing {

/// Little-endian bytes of a number.
template <class T>
std::string raw(T value) {
  std::string out(sizeof(T), '\0');
  std::memcpy(out.data(), &value, sizeof(T));
  return out;
}
inline std::string sized(const std::string& text) {
  return raw(static_cast<std::uint32_t>(text.size())) + text;
}
inline std::string record(const std::vector<std::string>& fields, const std::string& data) {
  std::string head;
  for (const std::string& field : fields) head += sized(field);
  return sized(head) + sized(data);
}
inline std::string connection(std::uint32_t id, const std::string& topic, const std::string& type) {
  return record({"op=\x07", "conn=" + raw(id), "topic=" + topic}, sized("type=" + type) + sized("md5sum=*"));
}
inline std::string message(std::uint32_t id, const std::string& data) {
  return record({"op=\x02", "conn=" + raw(id), "time=" + std::string(8, '\0')}, data);
}
inline std::string compressed(const std::string& records, const std::string& compression) {
  std::string data = records;
  if (compression == "lz4") {
    data.resize(LZ4F_compressFrameBound(records.size(), nullptr));
    data.resize(LZ4F_compressFrame(data.data(), data.size(), records.data(), records.size(), nullptr));
  }
  if (compression == "bz2") {
    auto size = static_cast<unsigned>(records.size() + records.size() / 100 + 600);
    data.resize(size);
    BZ2_bzBuffToBuffCompress(data.data(), &size, const_cast<char*>(records.data()),
                             static_cast<unsigned>(records.size()), 9, 0, 0);
    data.resize(size);
  }
  return data;
}
inline std::string chunk(const std::string& records, const std::string& compression = "none") {
  return record({"op=\x05", "compression=" + compression, "size=" + raw(static_cast<std::uint32_t>(records.size()))},
                compressed(records, compression));
}
inline std::string bag(const std::string& records) {
  return "#ROSBAG V2.0\n" + record({"op=\x03"}, std::string(40, ' ')) + records;
}
/// std_msgs/Header and sensor_msgs/Image.
inline std::string header(std::uint32_t s, std::uint32_t ns) {
  return raw(std::uint32_t{0}) + raw(s) + raw(ns) + sized("frame");
}
inline std::string image(std::uint32_t s, std::uint32_t width, std::uint32_t height, const std::string& encoding,
                         std::uint32_t stride, const std::string& pixels) {
  return header(s, 5) + raw(height) + raw(width) + sized(encoding) + std::string(1, '\0') + raw(stride) + sized(pixels);
}

}  // namespace takt::bag_writing
