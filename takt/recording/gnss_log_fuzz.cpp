// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gnss_log.h"
#include "tests/fuzz.h"
#include "tests/gnss_writing.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace takt::gnss_writing;
  return takt::fuzz::plant_seeds(
      *argc, *argv,
      {"# a log\n" + sentence("GPRMC,235959.00,A,4404.1,N,12118.8,W,0.03,225.97,311216,,,D") +
           sentence("GPZDA,235960.00,31,12,2016,,"),
       "1234567,$GPGGA,202640.000,4404.1306,N,12118.8515,W,2,10,0.98,1127.7,M,-19.6,M,0000,0000*6C\r\n",
       nav_pvt({2023, 6, 28, 14, 52, 11}, 312749000, 0, 7) + nav_timegps(312749000, 0, 2268, 18, 7),
       tim_tp(312750000, 0, -5123, 2268, 0) + nav_timels(312749000, 18, 0, 0, 3) +
           tim_tm2(0xcc, 17, 2268, 312749123, 4567)});
}

/// Once at a stroke, once in pieces: both must find the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view bytes) {
    takt::LabelStream pieces;
    takt::GnssDecoder decoder;
    for (std::size_t i = 0; i < bytes.size(); i += 7) decoder.feed(bytes.substr(i, 7), {}, pieces);
    decoder.finish(pieces);
    takt::LabelStream whole;
    takt::GnssDecoder second;
    second.feed(bytes, {}, whole);
    second.finish(whole);
    if (whole.labels.size() != pieces.labels.size() || whole.broken != pieces.broken) __builtin_trap();
    (void)takt::read_gnss_log(bytes, "gnss.log");
  });
}
