// SPDX-License-Identifier: Apache-2.0
// What must hold for every method on every kind of signal, whatever the numbers are.
#include <gtest/gtest.h>

#include <future>
#include <map>
#include <tuple>

#include "takt/estimators/alignment/alignment.h"
#include "tests/alignment_cases.h"

namespace takt {
namespace {

using cases::Recorded;
using cases::Scenario;
using cases::Sensor;

constexpr double sigmas = 4;

// --- What is done to a recording ---

void shift_sensor(Recorded& r, Duration by) {
  for (RotationIncrement& i : r.sensor.increments) i.from += by, i.to += by;
  for (BearingPair& p : r.sensor.pairs) p.from += by, p.to += by;
}
void shift_reference(Recorded& r, Duration by) {
  for (Stamp& t : r.reference.stamps) t += by;
}
/// The sensor mounted otherwise: its rotations seen in a frame turned by `turn`.
void turn_sensor(Recorded& r, const Quat& turn) {
  const Mat3 m = turn.toRotationMatrix();
  for (RotationIncrement& i : r.sensor.increments) {
    i.rotation = m * i.rotation, i.apparent = m * i.apparent;
    i.information = m * i.information * m.transpose();
  }
  for (BearingPair& p : r.sensor.pairs)
    for (BearingMatch& b : p.matches)
      b.from = (m * b.from.cast<double>()).cast<float>(), b.to = (m * b.to.cast<double>()).cast<float>();
}
void turn_reference(Recorded& r, const Quat& turn) {
  for (Vec3& w : r.reference.gyro_rad_s) w = turn * w;
}
void bias_reference(Recorded& r, const Vec3& bias) {
  for (Vec3& w : r.reference.gyro_rad_s) w += bias;
}
/// Takes the samples of 0.3 s out of the middle of the reference.
void open_gap(ImuStream& imu) {
  const Stamp from = imu.stamps[imu.size() / 2], to = from + from_seconds(0.3);
  ImuStream kept = imu;
  kept.stamps.clear(), kept.gyro_rad_s.clear(), kept.accel_m_s2.clear();
  for (std::size_t i = 0; i < imu.size(); ++i) {
    if (imu.stamps[i] > from && imu.stamps[i] < to) continue;
    kept.stamps.push_back(imu.stamps[i]), kept.gyro_rad_s.push_back(imu.gyro_rad_s[i]);
  }
  imu = kept;
}
/// Every tenth sample twice, as drivers that retry do.
void repeat_samples(ImuStream& imu) {
  ImuStream repeated = imu;
  repeated.stamps.clear(), repeated.gyro_rad_s.clear(), repeated.accel_m_s2.clear();
  for (std::size_t i = 0; i < imu.size(); ++i)
    for (int k = 0; k < (i % 10 == 0 ? 2 : 1); ++k)
      repeated.stamps.push_back(imu.stamps[i]), repeated.gyro_rad_s.push_back(imu.gyro_rad_s[i]);
  imu = tidy(repeated).imu;
}

// --- Answers, each worked out once for all methods ---

Scenario usual(Sensor sensor) {
  return {.name = "usual", .sensor = sensor, .duration_s = 15};
}

const Recorded& recorded(const Scenario& s, std::uint64_t seed = 1) {
  static std::map<std::tuple<std::string, Sensor, std::uint64_t>, Recorded> kept;
  const auto key = std::tuple(s.name, s.sensor, seed);
  const auto found = kept.find(key);
  return found != kept.end() ? found->second : kept.emplace(key, cases::record(s, seed)).first->second;
}

/// What one method says; a refusal before any method ran is every method's.
Estimate said_by(const Estimate& all, const std::string& method) {
  for (const Estimate& e : all.estimates)
    if (e.method == method) return e;
  return all;
}

/// `what` names the recording for the cache; `change` makes it of the scenario's.
template <class Change>
const Estimate& answers(const Scenario& s, const std::string& what, const Change& change,
                        const AlignmentOptions& options = {}) {
  static std::map<std::tuple<std::string, Sensor, std::string>, Estimate> kept;
  const auto key = std::tuple(s.name, s.sensor, what);
  const auto found = kept.find(key);
  if (found != kept.end()) return found->second;
  Recorded r = recorded(s);
  change(r);
  return kept.emplace(key, align_rotation(r.sensor, r.reference, options)).first->second;
}
const Estimate& answers(const Scenario& s) {
  return answers(s, "", [](Recorded&) {});
}

std::string words(const Estimate& e) {
  std::string out = e.method + ", " + to_string(e.verdict);
  for (const std::string& why : e.reasons) out += "; " + why;
  return out;
}

/// Nobody may be trusted and wrong; who refuses says why.
void expect_honest(const Estimate& e, const Estimate& truth) {
  if (e.verdict == Verdict::trusted) {
    ASSERT_TRUE(e.answered()) << words(e);
    EXPECT_LT(std::abs(cases::offset_error_s(e, truth)), sigmas * *e.sigma_s) << words(e);
  } else {
    EXPECT_FALSE(e.reasons.empty()) << words(e);
  }
}
/// A good recording: an answer, and a right one.
void expect_right(const Estimate& e, const Estimate& truth) {
  ASSERT_TRUE(e.answered()) << words(e);
  EXPECT_LT(std::abs(cases::offset_error_s(e, truth)), sigmas * *e.sigma_s) << words(e);
}
void expect_refused(const Estimate& e) {
  EXPECT_EQ(e.verdict, Verdict::refused) << words(e);
  EXPECT_FALSE(e.answered()) << words(e);
  ASSERT_FALSE(e.reasons.empty());
  EXPECT_GT(e.reasons.front().size(), 20u) << "a reason is a sentence";
}

// --- The laws ---

using Parameter = std::tuple<const char*, Sensor>;
class AlignmentLaws : public testing::TestWithParam<Parameter> {
 protected:
  [[nodiscard]] std::string method() const { return std::get<0>(GetParam()); }
  [[nodiscard]] Sensor sensor() const { return std::get<1>(GetParam()); }
  [[nodiscard]] Estimate said(const Estimate& all) const { return said_by(all, method()); }
  [[nodiscard]] Estimate plain() const { return said(answers(usual(sensor()))); }
  [[nodiscard]] const Estimate& truth() const { return recorded(usual(sensor())).truth; }
  template <class Change>
  [[nodiscard]] Estimate after(const std::string& what, const Change& change) const {
    return said(answers(usual(sensor()), what, change));
  }
};

TEST_P(AlignmentLaws, TheAnswerIsRight) {
  expect_right(plain(), truth());
}

TEST_P(AlignmentLaws, TheMethodAskedForIsTheOneThatAnswers) {
  const Recorded& r = recorded(usual(sensor()));
  AlignmentOptions options;
  options.method = method();
  const Estimate e = align_rotation(r.sensor, r.reference, options);
  EXPECT_EQ(e.method, method());
  EXPECT_EQ(e.offset, plain().offset);
}

TEST_P(AlignmentLaws, ShiftingTheSensorMovesTheOffsetBack) {
  const Duration by(-7'123'456'789);
  const Estimate e = after("sensor shifted", [&](Recorded& r) { shift_sensor(r, by); });
  ASSERT_TRUE(e.answered() && plain().answered()) << words(e);
  EXPECT_LE(std::abs((*e.offset + by - *plain().offset).count()), 1);
  EXPECT_EQ(e.epoch - plain().epoch, by);
  EXPECT_EQ(e.sigma_s, plain().sigma_s);
}

TEST_P(AlignmentLaws, ShiftingTheReferenceMovesTheOffset) {
  const Duration by(123'456'789);
  const Estimate e = after("reference shifted", [&](Recorded& r) { shift_reference(r, by); });
  ASSERT_TRUE(e.answered() && plain().answered()) << words(e);
  EXPECT_LE(std::abs((*e.offset - by - *plain().offset).count()), 1);
}

TEST_P(AlignmentLaws, ShiftingBothChangesNothing) {
  const Duration by(987'654'321);
  const Estimate e = after("both shifted", [&](Recorded& r) { shift_sensor(r, by), shift_reference(r, by); });
  ASSERT_TRUE(e.answered() && plain().answered()) << words(e);
  EXPECT_EQ(e.offset, plain().offset);
}

TEST_P(AlignmentLaws, ClocksMayBeDaysApart) {
  const Duration by = std::chrono::hours(24 * 11) + Duration(1);
  const Estimate e = after("days apart", [&](Recorded& r) { shift_sensor(r, by); });
  ASSERT_TRUE(e.answered() && plain().answered()) << words(e);
  EXPECT_LE(std::abs((*e.offset + by - *plain().offset).count()), 1);
}

TEST_P(AlignmentLaws, HowTheSensorIsMountedIsAllTheSame) {
  const Quat turn(Eigen::AngleAxisd(2.1, Vec3(0.3, -0.8, 0.5).normalized()));
  const Estimate e = after("sensor turned", [&](Recorded& r) { turn_sensor(r, turn); });
  ASSERT_TRUE(e.answered() && plain().answered()) << words(e);
  // Iterations end within 0.03 σ of the optimum, wherever they come from.
  EXPECT_LT(std::abs(to_seconds(*e.offset - *plain().offset)), 0.1 * *plain().sigma_s);
  ASSERT_EQ(e.T_reference_sensor.has_value(), plain().T_reference_sensor.has_value());
  if (!e.T_reference_sensor) return;
  const Mat3 R = e.T_reference_sensor->topLeftCorner<3, 3>(),
             before = plain().T_reference_sensor->topLeftCorner<3, 3>();
  EXPECT_LT(Eigen::AngleAxisd(R * turn.toRotationMatrix() * before.transpose()).angle(), 1e-3);
}

TEST_P(AlignmentLaws, HowTheReferenceIsMountedIsAllTheSame) {
  const Quat turn(Eigen::AngleAxisd(-1.7, Vec3(0.6, 0.7, -0.2).normalized()));
  const Estimate e = after("reference turned", [&](Recorded& r) { turn_reference(r, turn); });
  ASSERT_TRUE(e.answered() && plain().answered()) << words(e);
  EXPECT_LT(std::abs(to_seconds(*e.offset - *plain().offset)), 0.1 * *plain().sigma_s);
}

TEST_P(AlignmentLaws, AConstantBiasIsTolerated) {
  const Estimate e = after("biased", [](Recorded& r) { bias_reference(r, {0.05, -0.03, 0.04}); });
  ASSERT_TRUE(e.answered() && plain().answered()) << words(e);
  EXPECT_LT(std::abs(to_seconds(*e.offset - *plain().offset)), *plain().sigma_s);
  expect_right(e, truth());
}

TEST_P(AlignmentLaws, AGapInTheReferenceIsTolerated) {
  expect_right(after("gap", [](Recorded& r) { open_gap(r.reference); }), truth());
}

TEST_P(AlignmentLaws, RepeatedSamplesAreTolerated) {
  const Estimate e = after("repeated", [](Recorded& r) { repeat_samples(r.reference); });
  EXPECT_EQ(e.offset, plain().offset) << words(e);
}

TEST_P(AlignmentLaws, LostSamplesAreTolerated) {
  Scenario s = usual(sensor());
  s.name = "lost samples";
  s.frame_drop = 0.05;
  s.imu_drop = 0.02;
  expect_right(said(answers(s)), recorded(s).truth);
}

TEST_P(AlignmentLaws, NoMotionThatCannotTellIsAnswered) {
  for (const char* motion : {"still", "single_tone", "translation_only", "constant_rate"}) {
    SCOPED_TRACE(motion);
    const Scenario s{.name = motion, .motion = motion, .sensor = sensor(), .duration_s = 15};
    expect_refused(said(answers(s)));
  }
}

TEST_P(AlignmentLaws, ADriftIsFoundOrReportedButNeverAbsorbed) {
  const Scenario s{.name = "drift", .sensor = sensor(), .duration_s = 60, .drift = 50e-6};
  const Estimate e = said(answers(s));
  expect_honest(e, recorded(s).truth);
  if (e.drift) {
    ASSERT_TRUE(e.drift_sigma.has_value());
    EXPECT_LT(std::abs(*e.drift - s.drift), sigmas * *e.drift_sigma) << words(e);
  } else {
    EXPECT_FALSE(e.reasons.empty()) << words(e);
  }
}

TEST_P(AlignmentLaws, ASearchThatLeavesTheTruthOutIsNotTrusted) {
  AlignmentOptions options;
  options.search_s = 0.5;
  const Estimate e = said(answers(
      usual(sensor()), "elsewhere", [](Recorded& r) { shift_sensor(r, std::chrono::seconds(3)); }, options));
  EXPECT_NE(e.verdict, Verdict::trusted) << words(e);
}

TEST_P(AlignmentLaws, ASearchBesideTheRecordingsIsRefused) {
  AlignmentOptions options;
  options.search_s = 0.5;
  expect_refused(said(answers(
      usual(sensor()), "far off", [](Recorded& r) { shift_sensor(r, std::chrono::hours(50)); }, options)));
}

TEST_P(AlignmentLaws, AReferenceOfNothingButZerosIsRefused) {
  expect_refused(said(answers(usual(sensor()), "zeros", [](Recorded& r) {
    for (Vec3& w : r.reference.gyro_rad_s) w.setZero();
  })));
}

TEST_P(AlignmentLaws, TooShortARecordingIsRefusedOrRight) {
  for (const double length_s : {0.4, 1.0, 2.0, 4.0}) {
    SCOPED_TRACE(length_s);
    const Recorded& whole = recorded(usual(sensor()));
    RotationSignal cut = whole.sensor;
    const Stamp end = cut.increments.front().from + from_seconds(length_s);
    std::erase_if(cut.increments, [&](const RotationIncrement& i) { return i.to > end; });
    std::erase_if(cut.pairs, [&](const BearingPair& p) { return p.to > end; });
    const Estimate e = said(align_rotation(cut, whole.reference));
    expect_honest(e, whole.truth);
    if (length_s < 0.5) expect_refused(e);
  }
}

TEST_P(AlignmentLaws, TheResultDoesNotDependOnWhatElseRuns) {
  const Recorded& r = recorded(usual(sensor()));
  std::vector<std::future<Estimate>> running;
  for (int k = 0; k < 3; ++k)
    running.push_back(std::async(std::launch::async, [&] { return align_rotation(r.sensor, r.reference); }));
  for (auto& run : running) EXPECT_EQ(to_json(said(run.get())), to_json(plain()));
}

INSTANTIATE_TEST_SUITE_P(EveryMethod, AlignmentLaws,
                         testing::Combine(testing::Values("correlation", "phase", "tdicp", "ml"),
                                          testing::Values(Sensor::gyro, Sensor::tracks)),
                         [](const auto& p) {
                           return std::string(std::get<0>(p.param)) +
                                  (std::get<1>(p.param) == Sensor::gyro ? "_gyro" : "_tracks");
                         });

class SwappedRoles : public testing::TestWithParam<const char*> {};

TEST_P(SwappedRoles, InvertTheMap) {
  const cases::GyroPair pair = cases::gyro_pair(usual(Sensor::gyro), 1);
  const Estimate there = said_by(align_rotation(gyro_rotation(pair.sensor), pair.reference), GetParam());
  const Estimate back = said_by(align_rotation(gyro_rotation(pair.reference), pair.sensor), GetParam());
  ASSERT_TRUE(there.answered() && back.answered()) << words(there) << words(back);
  const auto expected = inverse(there.clock_map()).offset_at(as<ReferenceClock>(back.epoch));
  EXPECT_LT(std::abs(to_seconds(*back.offset - expected)), sigmas * std::max(*there.sigma_s, *back.sigma_s));
}

INSTANTIATE_TEST_SUITE_P(EveryMethod, SwappedRoles, testing::Values("correlation", "phase", "tdicp", "ml"),
                         [](const auto& p) { return std::string(p.param); });

}  // namespace
}  // namespace takt
