// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/decimal.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <random>
#include <string>

namespace takt {
namespace {

TEST(Decimal, KeepsEveryNanosecond) {
  EXPECT_EQ(decimal_to_ns("1403715273262142976", 0), 1403715273262142976);
  EXPECT_EQ(decimal_to_ns("1403715273.262142976", 9), 1403715273262142976);
  EXPECT_EQ(decimal_to_ns("1264.250902773", 9), 1264250902773);
  EXPECT_EQ(decimal_to_ns("4.328040426741000265e+06", 9), 4328040426741000);
  EXPECT_EQ(decimal_to_ns("1520531836203640.576", 3), 1520531836203640576);
  EXPECT_EQ(decimal_to_ns("-0.000000001", 9), -1);
  EXPECT_EQ(decimal_to_ns("12.", 6), 12000000);
  EXPECT_EQ(decimal_to_ns(".5", 9), 500000000);
  EXPECT_EQ(decimal_to_ns("1E-3", 9), 1000000);
}

TEST(Decimal, RoundsHalfAwayFromZero) {
  EXPECT_EQ(decimal_to_ns("0.4", 0), 0);
  EXPECT_EQ(decimal_to_ns("0.5", 0), 1);
  EXPECT_EQ(decimal_to_ns("-0.5", 0), -1);
  EXPECT_EQ(decimal_to_ns("2.4999999999999999", 0), 2);
  EXPECT_EQ(decimal_to_ns("1e-300", 9), 0);
}

TEST(Decimal, AcceptsManyDigits) {
  EXPECT_EQ(decimal_to_ns("0.3000000000000000000000000000000001", 9), 300000000);
  EXPECT_EQ(decimal_to_ns("00000000000000000000000000001.5", 9), 1500000000);
  EXPECT_EQ(decimal_to_ns("10000000000000000000000000000e-20", 9), 100000000000000000);
}

TEST(Decimal, RefusesWhatIsNoStamp) {
  for (const char* wrong :
       {"", "-", ".", "e5", "1e", "1e+-5", "1.2.3", "12a", "nan", "inf", "0x10", " 1", "1 ", "1e99999"})
    EXPECT_FALSE(decimal_to_ns(wrong, 0)) << wrong;
  EXPECT_FALSE(decimal_to_ns("9223372036854775808", 0));
  EXPECT_EQ(decimal_to_ns("9223372036854775807", 0), std::numeric_limits<std::int64_t>::max());
  EXPECT_FALSE(decimal_to_ns("1e19", 0));
  EXPECT_FALSE(decimal_to_ns("1e11", 9));
}

TEST(Decimal, AgreesWithIntegersWrittenAsSeconds) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> any(0, std::numeric_limits<std::int64_t>::max());
  for (int i = 0; i < 2000; ++i) {
    const std::int64_t ns = any(random) >> (i % 63);
    std::string digits = std::to_string(ns);
    digits.insert(0, digits.size() < 10 ? 10 - digits.size() : 0, '0');
    EXPECT_EQ(decimal_to_ns(digits.substr(0, digits.size() - 9) + "." + digits.substr(digits.size() - 9), 9), ns);
  }
}

TEST(Decimal, DoublesAreFinite) {
  EXPECT_EQ(finite_double("-1.5e3"), -1500.0);
  EXPECT_EQ(finite_double("+2"), 2.0);
  for (const char* wrong : {"nan", "inf", "-inf", "1e999", "", "1,5", "one"})
    EXPECT_FALSE(finite_double(wrong)) << wrong;
}

TEST(Decimal, NanosecondsAreWrittenExactly) {
  EXPECT_EQ(decimal_of_ns(1264250902773, 9, 0), "1264.250902773");
  EXPECT_EQ(decimal_of_ns(1264250902773, 0, 0), "1264250902773");
  EXPECT_EQ(decimal_of_ns(1264250900000, 9, 6), "1264.250900");
  EXPECT_EQ(decimal_of_ns(-5, 9, 0), "-0.000000005");
  EXPECT_EQ(decimal_of_ns(12'000'000, 6, 0), "12");
  EXPECT_EQ(decimal_of_ns(INT64_MIN, 3, 0), "-9223372036854775.808");
  for (const std::int64_t ns : {std::int64_t{0}, INT64_MAX, std::int64_t{-1}, std::int64_t{123'456'789'012}})
    for (const int exponent : {0, 3, 6, 9}) EXPECT_EQ(decimal_to_ns(decimal_of_ns(ns, exponent, 2), exponent), ns);
}

}  // namespace
}  // namespace takt
