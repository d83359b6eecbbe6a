// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/alignment/verdict.h"

#include <gtest/gtest.h>

namespace takt::alignment {
namespace {

Estimate of(const char* method, double offset_s, double sigma_s) {
  Estimate e;
  e.method = method;
  e.offset = from_seconds(offset_s), e.sigma_s = sigma_s;
  e.verdict = Verdict::trusted;
  return e;
}

TEST(ThirdWitness, SpeaksOnlyWithItsOwnSigma) {
  const Estimate other = of("ml-rotation", 34.3e-3, 4.3e-3);
  Estimate answer = of("ml", 8.16e-3, 0.07e-3);
  hear_third_witness(answer, other, of("correlation", 48e-3, 32e-3));
  EXPECT_EQ(answer.verdict, Verdict::trusted) << "a correlation that knows 48 ± 32 ms may have seen either";
  hear_third_witness(answer, other, of("correlation", 8e-3, 1e-3));
  EXPECT_EQ(answer.verdict, Verdict::trusted) << "it sides with the answer";
  hear_third_witness(answer, other, of("correlation", 33e-3, 5e-3));
  EXPECT_EQ(answer.verdict, Verdict::weak);
}

TEST(ThirdWitness, HasNothingToSayWhereTheTwoAgree) {
  Estimate answer = of("ml", 8.16e-3, 0.07e-3);
  hear_third_witness(answer, of("ml-rotation", 9e-3, 1e-3), of("correlation", 33e-3, 5e-3));
  EXPECT_EQ(answer.verdict, Verdict::trusted);
}

}  // namespace
}  // namespace takt::alignment
