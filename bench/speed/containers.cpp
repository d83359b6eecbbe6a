// SPDX-License-Identifier: Apache-2.0
// speed_containers [GB] [FOLDER]: how fast a generated camera and IMU recording is read, against the speed at which
// its bytes can be read, decompressed and copied by the libraries alone; how long `takt inspect` takes to open it; and
// the memory that takes. Wall time is what a user waits for, with chunks decompressed ahead on a second thread; CPU
// time is what it costs, and what a busy machine tells the same; `thread` is the CPU time of the busier of two threads,
// below which two idle cores cannot go.
#include <bzlib.h>
#include <fmt/core.h>
#include <lz4frame.h>
#include <sys/resource.h>
#include <zstd.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>

#include "takt/recording/files.h"
#include "takt/recording/mcap_container.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/ros1_container.h"
#include "tests/mcap_writing.h"
#include "tests/ros1_bag_writing.h"

namespace {

using namespace takt;

struct Spent {
  double wall_s = 0, cpu_s = 0;
  double own_s = 0;  // of the CPU time, the calling thread's
};
double seconds_of(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
template <class Work>
Spent spent_on(Work work) {
  const double wall = seconds_of(CLOCK_MONOTONIC), cpu = seconds_of(CLOCK_PROCESS_CPUTIME_ID),
               own = seconds_of(CLOCK_THREAD_CPUTIME_ID);
  work();
  return {seconds_of(CLOCK_MONOTONIC) - wall, seconds_of(CLOCK_PROCESS_CPUTIME_ID) - cpu,
          seconds_of(CLOCK_THREAD_CPUTIME_ID) - own};
}
double peak_mb() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return static_cast<double>(u.ru_maxrss) / 1024;
}
/// Memory so far does not count.
void forget_peak() {
  std::ofstream("/proc/self/clear_refs") << "5";
}

/// Four bits of noise in every pixel: about as hard to compress as a camera's pictures.
const std::string& noise() {
  static const std::string bytes = [] {
    std::mt19937 random(1);
    std::string out(8'000'000, '\0');
    for (char& c : out) c = static_cast<char>(100 + (random() & 15U));
    return out;
  }();
  return bytes;
}
constexpr std::uint32_t width = 752, height = 480;
std::string pixels(std::size_t i) {
  return noise().substr((i * 7919) % (noise().size() - width * height), width * height);
}

void write_mcap(const std::string& path, const std::string& compression, double bytes) {
  namespace w = mcap_writing;
  std::ofstream out(path, std::ios::binary);
  out << w::magic << w::header();
  const std::string channels = w::schema(1, "sensor_msgs/msg/Imu") + w::channel(1, 1, "/imu") +
                               w::schema(2, "sensor_msgs/msg/Image") + w::channel(2, 2, "/cam/image_raw");
  out << channels;
  std::string indexes;
  for (std::size_t i = 0; static_cast<double>(out.tellp()) < bytes;) {
    std::string records;
    for (int k = 0; k < 3; ++k, ++i) {
      const auto s = static_cast<std::int32_t>(1000 + i / 20);
      const auto ns = static_cast<std::uint32_t>(i % 20 * 50'000'000);
      for (std::uint32_t j = 0; j < 10; ++j)
        records += w::message(1, i * 10 + j, w::imu(s, ns + j * 5'000'000, 0.1, 0.2));
      records += w::message(2, i * 10 + 9, w::image(s, ns, width, height, pixels(i)));
    }
    const auto at = static_cast<std::uint64_t>(out.tellp());
    const std::string chunk = w::chunk(records, compression);
    out << chunk;
    std::string map;
    for (const std::uint16_t id : {std::uint16_t{1}, std::uint16_t{2}}) map += w::raw(id) + w::raw(at);
    indexes += w::record(8, w::raw(std::uint64_t{0}) + w::raw(std::uint64_t{0}) + w::raw(at) +
                                w::raw(std::uint64_t{chunk.size()}) + w::sized(map) + w::raw(std::uint64_t{0}) +
                                w::sized(compression) + w::raw(std::uint64_t{0}) + w::raw(std::uint64_t{0}));
  }
  out << w::record(15, w::raw(std::uint32_t{0}));
  const auto summary_at = static_cast<std::uint64_t>(out.tellp());
  out << channels << indexes;
  out << w::record(2, w::raw(summary_at) + w::raw(std::uint64_t{0}) + w::raw(std::uint32_t{0})) << w::magic;
}

void write_bag(const std::string& path, const std::string& compression, double bytes) {
  namespace w = bag_writing;
  std::ofstream out(path, std::ios::binary);
  const std::string connections =
      w::connection(1, "/imu", "sensor_msgs/Imu") + w::connection(2, "/cam/image_raw", "sensor_msgs/Image");
  out << w::bag("");
  for (std::size_t i = 0; static_cast<double>(out.tellp()) < bytes;) {
    std::string records = i == 0 ? connections : "";
    for (int k = 0; k < 3; ++k, ++i) {
      const auto s = static_cast<std::uint32_t>(1000 + i / 20);
      for (std::uint32_t j = 0; j < 10; ++j) records += w::message(1, w::header(s, j) + std::string(296, '\1'));
      records += w::message(2, w::image(s, width, height, "mono8", width, pixels(i)));
    }
    out << w::chunk(records, compression);
  }
}

struct Sizes {
  std::uint64_t stored, plain;
};

/// Only read, decompress, copy: what no reader can go below.
Spent libraries_alone(const ByteSource& bytes, const std::string& compression, const std::vector<Sizes>& sizes,
                      const std::vector<std::uint64_t>& data_at) {
  std::vector<std::byte> stored(8U << 20), plain(8U << 20), copy(8U << 20);
  LZ4F_dctx* lz4 = nullptr;
  LZ4F_createDecompressionContext(&lz4, LZ4F_VERSION);
  ZSTD_DCtx* zstd = ZSTD_createDCtx();
  const Spent took = spent_on([&] {
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const auto in = std::span(stored).first(sizes[i].stored);
      if (!bytes.read(data_at[i], in)) std::abort();
      const std::byte* from = stored.data();
      if (compression == "lz4") {
        std::size_t room = plain.size(), taken = in.size();
        const std::size_t hint = LZ4F_decompress(lz4, plain.data(), &room, in.data(), &taken, nullptr);
        if (hint != 0 || room != sizes[i].plain) std::abort();  // all of it, or the comparison is not honest
        from = plain.data();
      } else if (compression == "zstd") {
        if (ZSTD_decompressDCtx(zstd, plain.data(), plain.size(), in.data(), in.size()) != sizes[i].plain) std::abort();
        from = plain.data();
      } else if (compression == "bz2") {
        auto room = static_cast<unsigned>(plain.size());
        const int result =
            BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(plain.data()), &room, reinterpret_cast<char*>(in.data()),
                                       static_cast<unsigned>(in.size()), 0, 0);
        if (result != BZ_OK || room != sizes[i].plain) std::abort();
        from = plain.data();
      }
      std::memcpy(copy.data(), from, sizes[i].plain);
    }
  });
  LZ4F_freeDecompressionContext(lz4);
  ZSTD_freeDCtx(zstd);
  return took;
}

std::uint64_t number(const ByteSource& file, std::uint64_t at, std::size_t size) {
  std::uint64_t value = 0;
  if (!file.read(at, std::as_writable_bytes(std::span(&value, 1)).first(size))) return 0;
  return value;
}

/// Where the compressed data of each chunk is: both layouts are known here, since this program wrote them.
void find_chunks(const ByteSource& file, bool mcap, const std::string& compression, std::vector<Sizes>& sizes,
                 std::vector<std::uint64_t>& data_at) {
  if (mcap) {
    for (std::uint64_t at = 8; at + 9 < file.size();) {
      const std::uint64_t op = number(file, at, 1), size = number(file, at + 1, 8);
      if (op == 6) {
        const std::uint64_t head = 9 + 28 + 4 + compression.size() + 8;
        sizes.push_back({number(file, at + head - 8, 8), number(file, at + 9 + 16, 8)});
        data_at.push_back(at + head);
      }
      if (op == 15) break;
      at += 9 + size;
    }
    return;
  }
  for (std::uint64_t at = 13; at + 8 < file.size();) {
    const std::uint64_t head = number(file, at, 4), size = number(file, at + 4 + head, 4);
    if (head > 20) {
      // The size is the last four bytes of the header that tests/ros1_bag_writing.h makes.
      sizes.push_back({size, number(file, at + head, 4)});
      data_at.push_back(at + 8 + head);
    }
    at += 8 + head + size;
  }
}

void measure(bool mcap, const std::string& compression, double gb, const std::string& folder) {
  const std::string path = folder + "/takt_speed." + (mcap ? "mcap" : "bag");
  const std::string ros = compression.empty() ? "none" : compression;
  if (mcap)
    write_mcap(path, compression, gb * 1e9);
  else
    write_bag(path, ros, gb * 1e9);
  const auto bytes = open_bytes(path);
  std::vector<Sizes> sizes;
  std::vector<std::uint64_t> data_at;
  find_chunks(*bytes, mcap, compression, sizes, data_at);
  std::shared_ptr<const MessageFile> file;
  if (mcap)
    file = std::make_shared<McapContainer>(bytes, path);
  else
    file = std::make_shared<Ros1Container>(bytes, path);

  std::vector<std::byte> touch(1U << 20);  // into the page cache, for both sides alike
  for (std::uint64_t at = 0; at + touch.size() < bytes->size(); at += touch.size())
    if (!bytes->read(at, touch)) std::abort();
  const Spent alone = libraries_alone(*bytes, compression, sizes, data_at);
  forget_peak();
  std::uint64_t seen = 0;
  std::size_t messages = 0;
  std::vector<std::byte> copy(1U << 20);
  const Spent read = spent_on([&] {
    (void)file->visit([](const Channel&) { return whole_message; },
                      [&](const Message& m) {
                        std::memcpy(copy.data(), m.head.data(), m.head.size());
                        seen += m.head.size();
                        ++messages;
                      });
  });
  const double read_mb = peak_mb();
  const double busiest = std::max(read.own_s, read.cpu_s - read.own_s);  // exact where there are two threads
  std::size_t pictures = 0;
  const Spent opened = spent_on([&] { pictures = open_recording(path).cameras.at(0).size(); });
  fmt::print(
      "{:5} {:5} {:5.2f} GB  {:5.2f} GB  {:5.2f} {:5.2f}  {:5.2f} {:5.2f} {:5.2f}  {:3.0f} % {:3.0f} %  {:4.0f} MB  "
      "{:5.2f} {:5.2f}  {} messages, {} pictures\n",
      mcap ? "mcap" : "bag", ros, static_cast<double>(bytes->size()) * 1e-9, static_cast<double>(seen) * 1e-9,
      alone.wall_s, alone.cpu_s, read.wall_s, read.cpu_s, busiest, 100 * alone.wall_s / read.wall_s,
      100 * alone.cpu_s / read.cpu_s, read_mb, opened.wall_s, opened.cpu_s, messages, pictures);
  std::fflush(stdout);
  std::filesystem::remove(path);
}

}  // namespace

int main(int argc, char** argv) {
  const double gb = argc > 1 ? std::atof(argv[1]) : 2.0;
  const std::string folder = argc > 2 ? argv[2] : std::filesystem::temp_directory_path().string();
  fmt::print(
      "            stored   messages libraries [s]       takt [s]      libraries/takt    peak   inspect [s]\n"
      "                             wall   cpu   wall   cpu thread  wall   cpu            wall   cpu\n");
  for (const char* compression : {"", "lz4", "zstd"}) measure(true, compression, gb, folder);
  for (const char* compression : {"", "lz4"}) measure(false, compression, gb, folder);
  measure(false, "bz2", gb / 20, folder);  // 20 MB/s, so a little has to do
}
