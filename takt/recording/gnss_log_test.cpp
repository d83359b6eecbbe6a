// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gnss_log.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <sstream>

#include "takt/recording/files.h"
#include "takt/time/time_scales.h"
#include "tests/gnss_writing.h"
#include "tests/tools.h"

namespace takt {
namespace {

using namespace gnss_writing;
using testing_tools::complaint;

constexpr std::int64_t s = 1'000'000'000;
constexpr std::int64_t new_year_2017 = 1483228800;

LabelStream read(const std::string& bytes) {
  return read_gnss_log(bytes, "gnss.log");
}

TEST(GnssLog, SentencesNameTheirSecond) {
  const LabelStream log = read(sentence("GPRMC,000000.00,A,4404.1,N,12118.8,W,0.03,225.97,010117,,,D") +
                               sentence("GPZDA,000001.250,01,01,2017,00,00") +
                               sentence("GNGGA,000002,4404.1,N,12118.8,W,1,10,0.98,1127.7,M,-19.6,M,,"));
  ASSERT_EQ(log.labels.size(), 3U);
  EXPECT_EQ(log.labels[0].time_ns, new_year_2017 * s);
  EXPECT_TRUE(log.labels[0].valid);
  EXPECT_EQ(log.labels[1].time_ns, (new_year_2017 + 1) * s + s / 4);
  EXPECT_EQ(log.labels[2].time_ns, (new_year_2017 + 2) * s);
  EXPECT_FALSE(log.labels[0].leap_resolved.has_value());
}

TEST(GnssLog, ALeapSecondRepeatsTheSecondBefore) {
  const LabelStream log =
      read(sentence("GPRMC,235959.00,A,,,,,,,311216,,,D") + sentence("GPRMC,235960.00,A,,,,,,,311216,,,D") +
           nav_pvt({2016, 12, 31, 23, 59, 60}, 17000, 0, 7));
  ASSERT_EQ(log.labels.size(), 3U);
  EXPECT_EQ(log.labels[0].time_ns, (new_year_2017 - 1) * s);
  EXPECT_EQ(log.labels[1].time_ns, (new_year_2017 - 1) * s);
  EXPECT_TRUE(log.labels[1].leap_second);
  EXPECT_TRUE(log.labels[2].leap_second);
  EXPECT_EQ(log.labels[2].gps_minus_utc_s, 17);
}

TEST(GnssLog, AnInvalidFixIsSaid) {
  const LabelStream log =
      read(sentence("GPRMC,120000.00,V,,,,,,,010117,,,N") + sentence("GPZDA,120000.00,01,01,2017,00,00"));
  ASSERT_EQ(log.labels.size(), 2U);
  EXPECT_FALSE(log.labels[0].valid);
  EXPECT_FALSE(log.labels[1].valid) << "ZDA takes the status of the RMC before";
}

TEST(GnssLog, NonsenseDatesAreNoLabels) {
  EXPECT_TRUE(read(sentence("GPRMC,120000.00,A,,,,,,,310217,,,N")).labels.empty());
  EXPECT_TRUE(read(sentence("GPRMC,250000.00,A,,,,,,,010117,,,N")).labels.empty());
  EXPECT_TRUE(read(sentence("GPRMC,,V,,,,,,,,,,N")).labels.empty());
  EXPECT_TRUE(read(nav_pvt({2017, 13, 1, 0, 0, 0}, 0, 0, 7)).labels.empty());
}

TEST(GnssLog, AWeekBeyondAllTimeIsNoLabel) {
  const LabelStream log =
      read(tim_tp(1000, 0, 0, 60000, 0) + nav_timegps(1000, 0, 40000, 18, 7) + tim_tm2(0xcc, 1, 50000, 1, 1));
  EXPECT_TRUE(log.labels.empty());
  EXPECT_TRUE(log.events.empty());
}

TEST(GnssLog, UbxMessagesOfTime) {
  // 2023-06-28 14:52:11 UTC is GPS week 2268, time of week 312749 s.
  const LabelStream log = read(nav_pvt({2023, 6, 28, 14, 52, 11}, 312749000, -250, 7) +
                               nav_timegps(312749000, 125, 2268, 18, 7) + tim_tp(312750000, 0, -5123, 2268, 0) +
                               tim_tp(312732000, 0, 4000, 2268, 3) + tim_tp(312751000, 0, 1, 2268, 16) +
                               nav_timels(312749000, 18, 1, 3600, 3) + tim_tm2(0xcc, 17, 2268, 312749123, 4567));
  const auto utc = from_ns<Utc>(1687963931 * s);
  ASSERT_EQ(log.labels.size(), 5U);
  EXPECT_EQ(log.labels[0].time_ns, to_ns(utc) - 250);
  EXPECT_EQ(log.labels[0].gps_minus_utc_s, 18);
  EXPECT_EQ(log.labels[1].scale, LabelScale::gps);
  EXPECT_EQ(log.labels[1].time_ns, to_ns(to_gps(utc)) + 125);
  EXPECT_TRUE(log.labels[2].names_next);
  EXPECT_EQ(log.labels[2].time_ns, to_ns(to_gps(utc)) + s);
  EXPECT_EQ(log.labels[3].scale, LabelScale::utc) << "the flag timeBase says that this one counts UTC";
  EXPECT_EQ(log.labels[3].time_ns, to_ns(utc) + s);
  ASSERT_EQ(log.pulse_errors.size(), 2U) << "an invalid qErr is left out";
  EXPECT_DOUBLE_EQ(log.pulse_errors[0].error_s, -5.123e-9);
  ASSERT_EQ(log.leap_notices.size(), 1U);
  EXPECT_EQ(log.leap_notices[0].seconds_to_event, 3600);
  ASSERT_EQ(log.events.size(), 1U);
  EXPECT_TRUE(log.events[0].valid);
  EXPECT_EQ(log.events[0].rising_ns, (2268LL * 604800 + 312749) * s + 123'004'567);
}

TEST(GnssLog, ArrivalsStandBeforeSentencesOrBeside) {
  const std::string rmc = sentence("GPRMC,000000.00,A,,,,,,,010117,,,D");
  EXPECT_EQ(read("48000123," + rmc).labels[0].arrival_ticks, 48000123);
  EXPECT_EQ(read("48000123 " + rmc).labels[0].arrival_ticks, 48000123);
  const LabelStream in_seconds = read("1700000000.250000001 " + rmc);
  EXPECT_EQ(in_seconds.labels[0].arrival_ticks, 1700000000250000001);
  EXPECT_EQ(in_seconds.arrival_hz, 1e9);
  EXPECT_FALSE(read(rmc).labels[0].arrival_ticks.has_value());
  LabelStream beside = read(rmc + rmc + rmc);
  stamp_arrivals(beside, "byte,arrival\n0,1000\n" + std::to_string(rmc.size()) + ",2000\n", "a.csv");
  EXPECT_EQ(beside.labels[0].arrival_ticks, 1000);
  EXPECT_EQ(beside.labels[1].arrival_ticks, 2000);
  EXPECT_EQ(beside.labels[2].arrival_ticks, 2000);
  EXPECT_NE(complaint([&] { stamp_arrivals(beside, "byte,arrival\n5,1\n3,2\n", "a.csv"); }), "");
}

TEST(GnssLog, BrokenBytesCostNoMoreThanTheirMessage) {
  const std::string good = nav_timegps(312749000, 125, 2268, 18, 7);
  std::string flipped = good;
  flipped[9] = static_cast<char>(flipped[9] ^ 1);
  const std::string half = good.substr(0, 9);
  const std::string rmc = sentence("GPRMC,000000.00,A,,,,,,,010117,,,D");
  const LabelStream log = read(flipped + good + half + rmc + "$GPRMC,0000" + rmc + "\xb5" + good);
  EXPECT_EQ(log.labels.size(), 4U);
  EXPECT_GE(log.broken, 2U);
}

TEST(GnssLog, PiecesGiveTheSameAsTheWhole) {
  std::string bytes;
  for (int i = 0; i < 50; ++i)
    bytes += nav_timegps(312749000U + 1000U * static_cast<unsigned>(i), 1, 2268, 18, 7) + (i % 3 ? "\xd3\x01" : "") +
             sentence("GPRMC,000000.00,A,,,,,,,010117,,,D");
  const LabelStream whole = read(bytes);
  for (const std::size_t piece : {1UL, 5UL, 33UL}) {
    LabelStream out;
    GnssDecoder decoder;
    for (std::size_t i = 0; i < bytes.size(); i += piece)
      decoder.feed(bytes.substr(i, piece), static_cast<std::int64_t>(i), out);
    decoder.finish(out);
    ASSERT_EQ(out.labels.size(), whole.labels.size());
    for (std::size_t i = 0; i < out.labels.size(); ++i) {
      EXPECT_EQ(out.labels[i].byte, whole.labels[i].byte);
      EXPECT_EQ(*out.labels[i].arrival_ticks, static_cast<std::int64_t>(out.labels[i].byte / piece * piece));
    }
  }
}

TEST(GnssLog, AnOverlongSentenceIsBrokenHoweverItsBytesCome) {
  const std::string bytes = sentence("GPZDA,000001.00,01,01,2017,00,00") + "$GPRMC," + std::string(249, '7') + "," +
                            std::string(100, '8') + "\r\n";
  for (const std::size_t piece : {1UL, 7UL, 1000UL}) {
    LabelStream out;
    GnssDecoder decoder;
    for (std::size_t i = 0; i < bytes.size(); i += piece) decoder.feed(bytes.substr(i, piece), {}, out);
    decoder.finish(out);
    EXPECT_EQ(out.broken, 1U) << "in pieces of " << piece;
    EXPECT_EQ(out.labels.size(), 1U);
  }
}

TEST(GnssLog, NothingReadableIsSaid) {
  EXPECT_NE(complaint([] { (void)read_gnss_log("hello\n", "x.log"); }).find("holds no NMEA or UBX"), std::string::npos);
  EXPECT_NE(complaint([] { (void)read_gnss_log("", "x.log"); }).find("is empty"), std::string::npos);
}

// --- real recordings, against gpsd's own packet lexer (python3-gps) -------------------------------------------------

constexpr const char* counting_script = R"(
import sys, os
from collections import Counter
import gps.packet as p
lex = p.new()
fd = os.open(sys.argv[1], os.O_RDONLY)
names = {(1,7):'NAV-PVT',(1,0x20):'NAV-TIMEGPS',(1,0x21):'NAV-TIMEUTC',(1,0x22):'NAV-CLOCK',(1,0x26):'NAV-TIMELS',(13,1):'TIM-TP',(13,3):'TIM-TM2'}
c = Counter()
while True:
    n, typ, pkt, ctr = lex.get(fd)
    if n == 0: break
    if n < 0: continue
    # gpsd lets a sentence without a checksum pass (the cut-off last line of ublox-8.log); takt takes none on trust.
    if typ == p.NMEA_PACKET and b'*' in pkt: c[pkt.split(b',')[0].strip(b'$').decode('latin1')] += 1
    elif typ == p.UBX_PACKET: c[names.get((pkt[2], pkt[3]), 'UBX-%02X-%02X' % (pkt[2], pkt[3]))] += 1
for k in sorted(c): print(k, c[k])
)";

std::string output_of(const std::string& command) {
  std::string out;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return out;
  std::array<char, 4096> buffer{};
  for (std::size_t n = 0; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) out.append(buffer.data(), n);
  return pclose(pipe) == 0 ? out : "";
}

TEST(GnssLog, RealCapturesCountAsGpsdCounts) {
  TAKT_NEEDS_REAL_DATA("gnss");
  if (output_of("/usr/bin/python3 -c 'import gps.packet; print(1)' 2>/dev/null").empty())
    GTEST_SKIP() << "gpsd's python3-gps is not here";
  const testing_tools::TemporaryFolder folder;
  const std::string script = folder.file("count.py", counting_script);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(testing_tools::real_data("gnss"))) {
    if (entry.path().extension() != ".log") continue;
    ++files;
    const std::string path = entry.path().string();
    std::istringstream lines(output_of("/usr/bin/python3 " + script + " " + path));
    std::map<std::string, std::size_t> theirs, ours;
    std::string name;
    for (std::size_t count = 0; lines >> name >> count;) theirs[name] = count;
    for (const auto& c : read_gnss_log(path).counts) ours[c.message] = c.count;
    EXPECT_EQ(ours, theirs) << path;
  }
  EXPECT_EQ(files, 8U);
}

TEST(GnssLog, TheTimingReceiversMessagesAgreeWithEachOther) {
  TAKT_NEEDS_REAL_DATA("gnss");
  const LabelStream log = read_gnss_log(testing_tools::real_data("gnss/u-blox-m8t-time.log"));
  std::map<std::string, std::vector<TimeLabel>> by;
  for (const TimeLabel& l : log.labels) by[l.source].push_back(l);
  EXPECT_EQ(by["TIM-TP"].size(), 152U);
  EXPECT_EQ(log.pulse_errors.size(), 152U);
  ASSERT_EQ(by["NAV-TIMEGPS"].size(), 151U);
  ASSERT_EQ(by["NAV-TIMEUTC"].size(), 151U);
  for (std::size_t i = 0; i < 151; ++i) {
    const TimeLabel &gps = by["NAV-TIMEGPS"][i], &utc = by["NAV-TIMEUTC"][i];
    EXPECT_EQ(gps.gps_minus_utc_s, 18);
    EXPECT_EQ(utc.gps_minus_utc_s, 18);
    // Two messages of the same instant, decoded apart: they meet through the leap seconds.
    EXPECT_LT(std::abs(to_ns(to_gps(from_ns<Utc>(utc.time_ns))) - gps.time_ns), 1000) << i;
  }
  double sum = 0, squares = 0, least = 1, most = -1;
  for (const PulseError& e : log.pulse_errors) {
    sum += e.error_s;
    squares += e.error_s * e.error_s;
    least = std::min(least, e.error_s);
    most = std::max(most, e.error_s);
  }
  EXPECT_NEAR(std::sqrt(squares / 152 - sum * sum / 152 / 152), 5.52e-9, 0.05e-9);
  EXPECT_NEAR(least, -10.16e-9, 0.01e-9);
  EXPECT_NEAR(most, 10.09e-9, 0.01e-9);
}

/// A live decoder's caller takes what is new each time into a stream of its own.
TEST(GnssDecoder, EveryPieceMayHaveItsOwnStream) {
  GnssDecoder decoder;
  const std::string gga = "$GPGGA,000000.00,,,,,0,,,,,,,,*48\r\n";
  for (int i = 0; i < 50; ++i) {
    LabelStream piece;
    decoder.feed(gga, 48'000'000LL * i, piece);
    std::size_t n = piece.broken;
    for (const LabelStream::Count& c : piece.counts) n += c.count;
    EXPECT_LE(n, 2U);
    EXPECT_LE(piece.counts.size(), 1U);
  }
}

}  // namespace
}  // namespace takt
