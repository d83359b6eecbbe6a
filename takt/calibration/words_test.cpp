// SPDX-License-Identifier: Apache-2.0
#include "takt/calibration/words.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "takt/calibration/estimate.h"

namespace takt {
namespace {

using std::chrono::nanoseconds;

TEST(Words, SigmaDecidesTheDigits) {
  EXPECT_EQ(value_words(12.3448, 0.08), "12.34 ± 0.08");
  EXPECT_EQ(value_words(12.3448, 0.123), "12.34 ± 0.12");
  EXPECT_EQ(value_words(12.3448, 0.0996), "12.34 ± 0.10");
  EXPECT_EQ(value_words(12.3448, 0.4), "12.3 ± 0.4");
  EXPECT_EQ(value_words(1234.5, 42), "1234 ± 42");
  EXPECT_EQ(value_words(-0.001, 0.08), "0.00 ± 0.08");
  EXPECT_EQ(value_words(11.000000000000002, {}), "11");
  EXPECT_EQ(value_words(1.2234e-8, 5.3e-10), "(1.22 ± 0.05)e-08");
  EXPECT_EQ(value_words(0, 2e-9), "(0.0 ± 2.0)e-09");
}

TEST(Words, SizeDecidesTheUnit) {
  EXPECT_EQ(time_words(nanoseconds(12'340'000), 80e-6), "12.34 ± 0.08 ms");
  EXPECT_EQ(time_words(nanoseconds(3'177'000), 6.1e-6), "3.177 ± 0.006 ms");
  EXPECT_EQ(time_words(nanoseconds(-3'177), 6.1e-6), "-3 ± 6 µs");
  EXPECT_EQ(time_words(nanoseconds(12'400'000), 0.000141421356 / std::sqrt(2.0)), "12.40 ± 0.10 ms");
  EXPECT_EQ(time_words(nanoseconds(17), 4e-9), "17 ± 4 ns");
  EXPECT_EQ(time_words(nanoseconds(100), 0.3e-3), "0 ± 300 µs");
  EXPECT_EQ(time_words(nanoseconds(947'848'638'408'300), 2e-5), "947848.638408 ± 0.000020 s");
  EXPECT_EQ(time_words(nanoseconds(1'700'000'114'480'613'928), 2e-8), "1700000114.480613928 ± 0.000000020 s");
}

TEST(Words, WithoutSigmaEveryNanosecondIsSaid) {
  EXPECT_EQ(time_words(nanoseconds(7'300'000), {}), "7.3 ms");
  EXPECT_EQ(time_words(nanoseconds(0), {}), "0 s");
  EXPECT_EQ(time_words(nanoseconds(1'000'000'001), 0.0), "1.000000001 s");
  EXPECT_EQ(time_words(nanoseconds::min(), {}), "-9223372036.854775808 s");
}

TEST(Words, AScatterByItselfKeepsItsDigits) {
  EXPECT_EQ(rounded_time_words(83e-6), "83 µs");
  EXPECT_EQ(rounded_time_words(1.234e-3), "1.2 ms");
  EXPECT_EQ(rounded_time_words(0), "0 s");
}

TEST(Words, WhatIsNotANumberIsUnknown) {
  EXPECT_EQ(time_words(std::numeric_limits<double>::quiet_NaN(), {}), "unknown");
  EXPECT_EQ(time_words(0.5, std::numeric_limits<double>::quiet_NaN()), "500 ms");
}

Estimate answer(std::int64_t ns, std::optional<double> sigma) {
  Estimate e;
  e.sensor = "cam0";
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = nanoseconds(ns);
  e.sigma_s = sigma;
  return e;
}

TEST(Sentence, PositiveIsEarlyNegativeIsLate) {
  EXPECT_EQ(sentence(answer(12'340'000, 80e-6)), "cam0 is 12.34 ± 0.08 ms early against imu0 (trusted)");
  EXPECT_EQ(sentence(answer(-12'340'000, 80e-6)), "cam0 is 12.34 ± 0.08 ms late against imu0 (trusted)");
  EXPECT_EQ(sentence(answer(7'300'000, {})), "cam0 is 7.3 ms early against imu0 (trusted)");
}

TEST(Sentence, WeakAndRefusedSayWhy) {
  Estimate e = answer(12'340'000, 80e-6);
  e.doubt(Verdict::weak, "the halves disagree by 0.4 ms");
  e.doubt(Verdict::weak, "a second reason");
  EXPECT_EQ(sentence(e), "cam0 is 12.34 ± 0.08 ms early against imu0 (weak: the halves disagree by 0.4 ms)");
  Estimate r = Estimate::refusal("ml", "the camera stood still");
  r.sensor = "cam0";
  r.reference = "imu0";
  EXPECT_EQ(sentence(r), "cam0 against imu0: refused: the camera stood still");
}

TEST(Sentence, ADriftThatCountsIsSaid) {
  Estimate e = answer(12'340'000, 80e-6);
  e.drift = 50e-6;
  e.drift_sigma = 0.2e-6;
  EXPECT_EQ(sentence(e), "cam0 is 12.34 ± 0.08 ms early against imu0, drifting by 50.00 ± 0.20 ppm (trusted)");
  e.drift_sigma = 20e-6;
  EXPECT_EQ(sentence(e), "cam0 is 12.34 ± 0.08 ms early against imu0 (trusted)");
}

}  // namespace
}  // namespace takt
