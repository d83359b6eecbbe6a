// SPDX-License-Identifier: Apache-2.0
// Files with damage in their middle: all that stands around it is read, and restamped just as it is read.
#include <gtest/gtest.h>

#include <algorithm>

#include "takt/recording/files.h"
#include "takt/recording/mcap.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/ros1_bag.h"
#include "tests/mcap_writing.h"
#include "tests/ros1_bag_writing.h"
#include "tests/tools.h"

namespace takt {
namespace {

namespace bag = bag_writing;
namespace mc = mcap_writing;
using testing_tools::complaint;
using testing_tools::TemporaryFolder;

constexpr std::uint32_t chunks = 6, in_chunk = 5, all = chunks * in_chunk;
constexpr Duration shift(1'234'567'891);

std::string a_bag(const std::string& compression) {
  std::string records;
  for (std::uint32_t c = 0; c < chunks; ++c) {
    std::string inside = bag::connection(1, "/imu", "sensor_msgs/Imu"), index;
    for (std::uint32_t i = 0; i < in_chunk; ++i) {
      index += std::string(8, '\0') + bag::raw(static_cast<std::uint32_t>(inside.size()));
      inside += bag::message(1, bag::header(c * in_chunk + i, 7) + std::string(296, '\1'));
    }
    records += bag::chunk(inside, compression) +
               bag::record({"op=\x04", "conn=" + bag::raw(1U), "count=" + bag::raw(5U), "ver=" + bag::raw(1U)}, index);
  }
  return bag::bag(records);
}
std::string imu_messages(std::uint32_t chunk) {
  std::string out;
  for (std::uint32_t i = 0; i < in_chunk; ++i) {
    const auto n = static_cast<std::int32_t>(chunk * in_chunk + i);
    out += mc::message(1, static_cast<std::uint64_t>(n), mc::imu(n, 7, 0.1, 0.2));
  }
  return out;
}
const std::string imu_channel = mc::schema(1, "sensor_msgs/msg/Imu") + mc::channel(1, 1, "/imu");
std::string an_mcap(const std::string& compression) {
  std::string records;
  for (std::uint32_t c = 0; c < chunks; ++c)
    records += mc::chunk(imu_channel + imu_messages(c), compression) +
               mc::record(7, mc::raw(std::uint16_t{1}) + mc::sized(std::string(16 * in_chunk, '\0')));
  return mc::file(records);
}
std::string an_mcap_without_chunks() {
  std::string records = imu_channel;
  for (std::uint32_t c = 0; c < chunks; ++c) records += imu_messages(c);
  return mc::file(records);
}

struct Case {
  const char* name;
  std::string bytes;
  std::size_t most_lost;  // by damage in one place
};
std::vector<Case> cases() {
  // An opcode that is damaged may be one that is not ours to know, and hide a chunk.
  return {{"x.bag", a_bag("none"), 2},
          {"lz4.bag", a_bag("lz4"), in_chunk},
          {"bz2.bag", a_bag("bz2"), in_chunk},
          {"x.mcap", an_mcap(""), in_chunk},
          {"lz4.mcap", an_mcap("lz4"), in_chunk},
          {"zstd.mcap", an_mcap("zstd"), in_chunk},
          {"bare.mcap", an_mcap_without_chunks(), 2}};
}

Recording read(const std::string& bytes, const std::string& name) {
  const auto source = view_bytes(std::as_bytes(std::span(bytes)));
  return name.ends_with(".bag") ? read_ros1_bag(source, name) : read_mcap(source, name);
}
/// Behind the first record that says what the only channel is. Without it, and without an index, messages are nobody's.
std::size_t first_place(const Case& c) {
  return std::string(c.name) == "bare.mcap" ? mc::magic.size() + mc::header().size() + imu_channel.size()
                                            : c.bytes.size() / 5;
}

std::string joined(const std::vector<std::string>& notes) {
  std::string all_notes;
  for (const std::string& note : notes) all_notes += note + "\n";
  return all_notes;
}

TEST(Damage, CostsTheMessagesThatItHits) {
  for (const Case& c : cases()) {
    ASSERT_EQ(read(c.bytes, c.name).imus.at(0).size(), all) << c.name;
    std::size_t silent = 0;
    for (std::size_t at = first_place(c); at + 40 < c.bytes.size(); at += 3) {
      std::string bytes = c.bytes;
      for (std::size_t i = at; i < at + 4; ++i) bytes[i] = static_cast<char>(~bytes[i]);
      const Recording r = read(bytes, c.name);
      ASSERT_EQ(r.imus.size(), 1u) << c.name << " byte " << at;
      const auto& stamps = r.imus[0].stamps;
      EXPECT_GE(stamps.size() + c.most_lost, all) << c.name << " byte " << at << "\n" << joined(r.notes);
      EXPECT_LE(stamps.size(), all + 1) << c.name << " byte " << at;
      silent += stamps.size() < all && r.notes.empty();
    }
    EXPECT_EQ(silent, 0u) << c.name;
  }
}

TEST(Damage, ABlockOfGarbageIsPassedOver) {
  for (const Case& c : cases()) {
    std::string bytes = c.bytes;
    const std::size_t at = bytes.size() * 2 / 5;
    for (std::size_t i = 0; i < bytes.size() / 8; ++i) bytes[at + i] = static_cast<char>(i * 37 % 251);
    const Recording r = read(bytes, c.name);
    EXPECT_GE(r.imus.at(0).size() + 2 * in_chunk, all) << c.name;
    EXPECT_EQ(to_ns(r.imus[0].stamps.back()), 29'000'000'007) << c.name;
    EXPECT_FALSE(r.notes.empty()) << c.name;
  }
}

TEST(Damage, TheIndexTellsWhatIsLost) {
  struct Compressed {
    const char* name;
    std::string bytes, frame;  // what a compressed chunk begins with
  };
  for (const Compressed& c : {Compressed{"lz4.bag", a_bag("lz4"), "\x04\x22\x4d\x18"},
                              Compressed{"zstd.mcap", an_mcap("zstd"), "\x28\xb5\x2f\xfd"}}) {
    std::string bytes = c.bytes;
    const std::size_t at = bytes.find(c.frame, bytes.size() / 2) + 8;
    for (std::size_t i = 0; i < 24; ++i) bytes[at + i] = '\x55';
    const Recording r = read(bytes, c.name);
    const std::string notes = joined(r.notes);
    EXPECT_EQ(r.imus.at(0).size(), all - in_chunk) << notes;
    EXPECT_NE(notes.find("5 of /imu"), std::string::npos) << notes;
  }
}

TEST(Damage, TheCopyHoldsWhatCanBeRead) {
  const TemporaryFolder folder;
  for (const Case& c : cases())
    for (std::size_t n = 0; n < 12; ++n) {
      const std::size_t at = first_place(c) + (c.bytes.size() - 60 - first_place(c)) * n / 12;
      std::string bytes = c.bytes;
      for (std::size_t i = at; i < at + 9; ++i) bytes[i] = static_cast<char>(~bytes[i]);
      const std::string in = folder.file(c.name, bytes), out = in + ".out";
      const Recording before = read(bytes, c.name);
      static_cast<void>(
          restamp_recording(in, out, {.stream = "/imu", .map = [](Stamp t) { return t + shift; }, .now_means = {}}));
      std::vector<Stamp> moved = before.imus.at(0).stamps;
      for (Stamp& t : moved) t += shift;
      EXPECT_EQ(read(read_file(out), c.name).imus.at(0).stamps, moved) << c.name << " byte " << at;
    }
}

}  // namespace
}  // namespace takt
