// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gpmf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "takt/recording/files.h"
#include "takt/test_paths.h"
#include "tests/gpmf_writing.h"

namespace takt::gpmf {
namespace {

using namespace gpmf_writing;
using gpmf_writing::text;  // beside gpmf::text, which its argument finds

Item only(const Payload& payload) {
  EXPECT_EQ(payload.problem, "");
  EXPECT_EQ(payload.items.size(), 1u);
  return payload.items.at(0);
}

std::vector<double> values_of(const std::string& bytes, const std::string& structure = "") {
  const auto n = numbers(only(parse(bytes_of(bytes))), structure);
  return n ? n->values : std::vector<double>{};
}

std::string big(std::uint64_t value, int bytes) {
  std::string b;
  put(b, value, bytes);
  return b;
}

// DMO1 of the format's own description: one byte takes three bytes of padding, fifteen take one.
TEST(Gpmf, ItemsArePaddedToFourBytes) {
  const std::string both = item("DMO1", 'b', 1, 1, "\x05") + item("DMO2", 'b', 1, 15, std::string(15, '\x01'));
  ASSERT_EQ(both.size(), 12u + 24u);
  const Payload payload = parse(bytes_of(both));
  EXPECT_EQ(payload.problem, "");
  ASSERT_EQ(payload.items.size(), 2u);
  EXPECT_EQ(payload.items[1].key, "DMO2");
  EXPECT_EQ(payload.items[1].samples, 15u);
}

TEST(Gpmf, EveryNumberTypeIsBigEndian) {
  EXPECT_EQ(values_of(item("KEYA", 'b', 1, 2, "\xFE\x02")), (std::vector<double>{-2, 2}));
  EXPECT_EQ(values_of(item("KEYA", 'B', 1, 1, "\xFE")), (std::vector<double>{254}));
  EXPECT_EQ(values_of(s16("KEYA", 1, {-256, 258})), (std::vector<double>{-256, 258}));
  EXPECT_EQ(values_of(item("KEYA", 'S', 2, 1, big(65000, 2))), (std::vector<double>{65000}));
  EXPECT_EQ(values_of(item("KEYA", 'l', 4, 1, big(0xFFFFFFFE, 4))), (std::vector<double>{-2}));
  EXPECT_EQ(values_of(item("KEYA", 'L', 4, 1, big(0xFFFFFFFE, 4))), (std::vector<double>{4294967294.0}));
  EXPECT_EQ(values_of(f32("KEYA", 1, {-1.5F})), (std::vector<double>{-1.5}));
  EXPECT_EQ(values_of(item("KEYA", 'd', 8, 1, big(std::bit_cast<std::uint64_t>(0.1), 8))), (std::vector<double>{0.1}));
  EXPECT_EQ(values_of(item("KEYA", 'j', 8, 1, big(~std::uint64_t{6}, 8))), (std::vector<double>{-7}));
  EXPECT_EQ(values_of(u64("KEYA", 1ULL << 40)), (std::vector<double>{std::ldexp(1.0, 40)}));
  EXPECT_EQ(values_of(item("KEYA", 'q', 4, 1, big(0xFFFE8000, 4))), (std::vector<double>{-1.5}));
  EXPECT_EQ(values_of(item("KEYA", 'Q', 8, 1, big(0x0000000240000000, 8))), (std::vector<double>{2.25}));
}

TEST(Gpmf, AStructureIsSpelledOutByItsType) {
  const std::string sample =
      big(7, 4) + big(std::bit_cast<std::uint32_t>(1.5F), 4) + big(std::bit_cast<std::uint32_t>(-2.5F), 4) + big(9, 1);
  const std::string bytes = item("FACE", '?', 13, 1, sample);
  EXPECT_EQ(values_of(bytes, "Lf[2]B"), (std::vector<double>{7, 1.5, -2.5, 9}));
  EXPECT_EQ(values_of(bytes, "LffB"), (std::vector<double>{7, 1.5, -2.5, 9}));
  EXPECT_TRUE(values_of(bytes, "Lff").empty()) << "one byte short";
  for (const char* wrong : {"", "[2]", "Lf[", "Lf[0]B", "Lf[999]B", "Lf[2", "Lz"})
    EXPECT_TRUE(values_of(bytes, wrong).empty()) << wrong;
}

TEST(Gpmf, TextLosesItsPaddingAndBecomesUtf8) {
  EXPECT_EQ(text(only(parse(bytes_of(item("SIUN", 'c', 4, 1, "m/s\xB2"))))), "m/s\u00B2");
  EXPECT_EQ(text(only(parse(bytes_of(item("STNM", 'c', 1, 6, std::string("Gyro\0\0", 6)))))), "Gyro");
}

std::string gyro_stream(const std::string& before_data) {
  return nest("DEVC", text("DVNM", "HERO8 Black") +
                          nest("STRM", u32("TSMP", 202) + u64("STMP", 80577) + text("STNM", "Gyroscope (z,x,y)") +
                                           before_data + s16("GYRO", 3, {100, 200, 300, -100, -200, -300})));
}

TEST(Gpmf, AStreamCarriesWhatStandsBeforeItsData) {
  const std::string bytes = gyro_stream(text("ORIN", "zxY") + item("SIUN", 'c', 5, 1, "rad/s") + s16("SCAL", 1, {10}));
  const std::vector<Stream> all = streams(parse(bytes_of(bytes)));
  ASSERT_EQ(all.size(), 1u);
  const Stream& s = all[0];
  EXPECT_EQ(s.device, "HERO8 Black");
  EXPECT_EQ(s.key, "GYRO");
  EXPECT_EQ(s.unit, "rad/s");
  EXPECT_EQ(s.stored_axes, "zxY");
  EXPECT_EQ(s.total, 202);
  EXPECT_EQ(s.stamp_us, 80577);
  EXPECT_EQ(s.tick_ms, std::nullopt);
  ASSERT_EQ(s.data.rows, 2u);
  ASSERT_EQ(s.data.columns, 3u);
  EXPECT_EQ(s.data(0, 2), 30);
  EXPECT_EQ(s.data(1, 0), -10);
}

TEST(Gpmf, ScaleIsOneForAllOrOneAColumnAndNeverZero) {
  EXPECT_EQ(streams(parse(bytes_of(gyro_stream(s16("SCAL", 1, {10, 20, 100})))))[0].data(0, 2), 3);
  EXPECT_TRUE(streams(parse(bytes_of(gyro_stream(s16("SCAL", 1, {0}))))).empty());
  EXPECT_TRUE(streams(parse(bytes_of(gyro_stream(s16("SCAL", 1, {1, 2}))))).empty());
}

TEST(Gpmf, ACutPayloadGivesWhatStandsBeforeTheCut) {
  const std::string whole = u32("AAAA", 1) + u32("BBBB", 2);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const Payload payload = parse(bytes_of(whole.substr(0, n)));
    EXPECT_EQ(payload.items.size(), n / 12) << n;
    // Fewer than four bytes, like zeros, are padding at the end.
    EXPECT_EQ(payload.problem.empty(), n % 12 < 4) << n << ": " << payload.problem;
  }
}

TEST(Gpmf, DamageIsSaidWithItsPlace) {
  EXPECT_EQ(parse(bytes_of(item("GYRO", 's', 6, 9, "\x01\x02"))).problem, "GYRO at byte 0 claims 54 bytes, 4 are left");
  EXPECT_EQ(parse(bytes_of(u32("AAAA", 1) + "\x01\x02\x03\x04" + "12345678")).problem, "no item begins at byte 12");
  std::string deep = u32("LEAF", 1);
  for (int i = 0; i < 40; ++i) deep = nest("NEST", deep);
  EXPECT_NE(parse(bytes_of(deep)).problem.find("nests too deeply"), std::string::npos);
}

TEST(Gpmf, ZerosAtTheEndArePadding) {
  const std::string bytes = u32("AAAA", 1) + std::string(20, '\0');
  EXPECT_EQ(parse(bytes_of(bytes)).problem, "");
}

struct Real {
  const char* file;
  const char* device;
  std::size_t gyro, accel;
  std::int64_t gyro_total;
  double first_gyro;  // as stored, by hand from the bytes: value / SCAL
};

/// Counts and values as an independent reader found them in the same files.
TEST(Gpmf, RealPayloadsOfFourCameras) {
  if (!std::filesystem::exists(TAKT_DATA_DIR "/gopro")) GTEST_SKIP() << "no recordings at " TAKT_DATA_DIR "/gopro";
  for (const Real& real : {Real{"hero5", "Camera", 399, 199, 399, 185.0 / 3755},
                           Real{"hero6", "Hero6 Black", 204, 204, 807, -1211.0 / 1878},
                           Real{"karma", "Camera", 392, 196, 392, 172.0 / 3755},
                           Real{"Fusion", "Fusion", 3300, 197, 3300, -249.0 / 939}}) {
    SCOPED_TRACE(real.file);
    const std::string bytes = read_file(std::string(TAKT_DATA_DIR "/gopro/") + real.file + ".raw");
    const Payload payload = parse(bytes_of(bytes));
    EXPECT_EQ(payload.problem, "");
    bool gyro = false, accel = false;
    for (const Stream& s : streams(payload)) {
      if (s.key == "GYRO") {
        gyro = true;
        EXPECT_EQ(s.device, real.device);
        EXPECT_EQ(s.data.rows, real.gyro);
        EXPECT_EQ(s.total, real.gyro_total);
        EXPECT_EQ(s.unit, "rad/s");
        EXPECT_NEAR(s.data(0, 0), real.first_gyro, 1e-15);
      }
      if (s.key == "ACCL") {
        accel = true;
        EXPECT_EQ(s.data.rows, real.accel);
      }
    }
    EXPECT_TRUE(gyro && accel);
    for (std::size_t n = 0; n < bytes.size(); n += 7) (void)streams(parse(bytes_of(bytes).first(n)));  // no crash
  }
}

}  // namespace
}  // namespace takt::gpmf
