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
  hear_third_witness(answer, other, of("correlation", 48e-3, 32e-3), true);
  EXPECT_EQ(answer.verdict, Verdict::trusted) << "a correlation that knows 48 ± 32 ms may have seen either";
  hear_third_witness(answer, other, of("correlation", 8e-3, 1e-3), true);
  EXPECT_EQ(answer.verdict, Verdict::trusted) << "it sides with the answer";
  hear_third_witness(answer, other, of("correlation", 33e-3, 5e-3), true);
  EXPECT_EQ(answer.verdict, Verdict::weak);
}

TEST(ThirdWitness, HasNothingToSayWhereTheTwoAgree) {
  Estimate answer = of("ml", 8.16e-3, 0.07e-3);
  hear_third_witness(answer, of("ml-rotation", 9e-3, 1e-3), of("correlation", 33e-3, 5e-3), true);
  EXPECT_EQ(answer.verdict, Verdict::trusted);
}

TEST(ThirdWitness, IsNotNeededByAnAnswerThatKnowsTheTranslationAndFits) {
  Estimate silent = of("ml-rotation", 0, 1);
  silent.doubt(Verdict::refused, "the fine alignment did not settle");
  Estimate answer = of("ml", 20.7e-3, 0.5e-3);
  hear_third_witness(answer, silent, of("correlation", 33e-3, 18e-3), true);
  EXPECT_EQ(answer.verdict, Verdict::trusted);
  hear_third_witness(answer, silent, of("correlation", 33e-3, 18e-3), false);
  EXPECT_EQ(answer.verdict, Verdict::weak);
}

}  // namespace
}  // namespace takt::alignment
