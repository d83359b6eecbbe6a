// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/message_reader.h"

#include <gtest/gtest.h>

#include <string>

namespace takt {
namespace {

std::string bytes(std::initializer_list<int> values) {
  std::string out;
  for (const int v : values) out += static_cast<char>(v);
  return out;
}
std::span<const std::byte> view(const std::string& s) {
  return std::as_bytes(std::span(s));
}

const std::string frame = std::string("abcdef") + '\0';  // ends 19 bytes behind the first four

/// A header, then one double, 1.0, aligned to eight bytes.
const std::string little = bytes({0, 1, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 7, 0, 0, 0}) + frame + bytes({0, 0, 0, 0, 0}) +
                           bytes({0, 0, 0, 0, 0, 0, 0xf0, 0x3f});
const std::string big = bytes({0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 7}) + frame + bytes({0, 0, 0, 0, 0}) +
                        bytes({0x3f, 0xf0, 0, 0, 0, 0, 0, 0});
/// The second version of CDR aligns doubles to four bytes only.
const std::string second_version = bytes({0, 7, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 7, 0, 0, 0}) + frame + bytes({0}) +
                                   bytes({0, 0, 0, 0, 0, 0, 0xf0, 0x3f});

TEST(MessageReader, CdrInBothByteOrdersAndVersions) {
  for (const std::string& message : {little, big, second_version}) {
    MessageReader in(MessageEncoding::cdr, view(message));
    EXPECT_EQ(to_ns(*in.header()), 7'000'000'009);
    EXPECT_EQ(in.f64(), 1.0);
    EXPECT_TRUE(in.good());
    EXPECT_EQ(in.u32(), 0u);
    EXPECT_FALSE(in.good());
  }
}

TEST(MessageReader, OtherRepresentationsAreNotGuessed) {
  std::string parameters = little;
  parameters[1] = 3;  // a parameter list
  EXPECT_FALSE(MessageReader(MessageEncoding::cdr, view(parameters)).good());
}

TEST(MessageReader, StampsAreWrittenOverInTheirByteOrder) {
  for (std::string message : {little, big, second_version}) {
    const std::string before = message;
    ASSERT_TRUE(overwrite_stamp(MessageEncoding::cdr, std::as_writable_bytes(std::span(message)), from_ns(-1)));
    EXPECT_EQ(to_ns(*header_stamp(MessageEncoding::cdr, view(message))), -1);
    EXPECT_EQ(message.substr(12), before.substr(12));
  }
  std::string ros1 = bytes({5, 0, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(overwrite_stamp(MessageEncoding::ros1, std::as_writable_bytes(std::span(ros1)), from_ns(-1)));
  EXPECT_TRUE(overwrite_stamp(MessageEncoding::ros1, std::as_writable_bytes(std::span(ros1)), from_ns(8)));
  EXPECT_EQ(ros1[0], 5);
  EXPECT_EQ(to_ns(*header_stamp(MessageEncoding::ros1, view(ros1))), 8);
}

TEST(MessageReader, HeadersAreKnownByDefinition) {
  const auto begins = [](const char* type, const char* definition) {
    return begins_with_header({"/t", type, MessageEncoding::ros1, definition});
  };
  EXPECT_TRUE(begins("sensor_msgs/Imu", ""));
  EXPECT_TRUE(begins("my/Odo", "# a remark\n\nint32 KIND = 3\nHeader header\nfloat64 x\n"));
  EXPECT_TRUE(begins("my/Odo", "std_msgs/msg/Header header"));
  EXPECT_FALSE(begins("my/Odo", "float64 x\nHeader header\n"));
  EXPECT_FALSE(begins("my/Odo", ""));
}

}  // namespace
}  // namespace takt
