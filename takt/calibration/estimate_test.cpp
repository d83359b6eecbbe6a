// SPDX-License-Identifier: Apache-2.0
#include "takt/calibration/estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "takt/error.h"

namespace takt {
namespace {

Estimate plain() {
  Estimate e;
  e.method = "ml";
  e.sensor = "cam0";
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  e.offset = Duration(3'177'000);
  e.sigma_s = 6.1e-6;
  e.epoch = from_ns(1'700'000'114'480'613'928);
  return e;
}

/// Any estimate that keeps the rules: texts with every kind of character, numbers over the whole range, gaps.
class Arbitrary {
 public:
  explicit Arbitrary(std::uint64_t seed) : random_(seed) {}

  Estimate estimate(bool nested = false) {
    Estimate e;
    e.method = text();
    e.sensor = text();
    e.reference = text();
    e.verdict = static_cast<Verdict>(below(3));
    while (below(2)) e.reasons.push_back(text());
    if (e.verdict != Verdict::refused) {
      e.offset = Duration(whole());
      e.sigma_s = maybe([&] { return std::abs(real()); });
      e.drift = maybe([&] { return real() * 1e-6; });
      e.drift_sigma = maybe([&] { return std::abs(real()) * 1e-6; });
      for (std::int64_t at = -100; below(2); at += 7)
        e.pieces.push_back({from_ns(at), from_ns(whole()), Duration(whole()), real() * 1e-32, std::abs(real())});
      e.line_delay_s = maybe([&] { return real(); });
      e.line_delay_sigma_s = maybe([&] { return std::abs(real()); });
    }
    e.epoch = from_ns(whole());
    e.frame_instant = maybe([&] { return std::string(std::array{"start", "middle", "end"}[below(3)]); });
    e.frame_row = maybe([&] { return std::string(std::array{"first", "middle"}[below(2)]); });
    if (below(2)) e.T_reference_sensor = Mat4::NullaryExpr([&] { return real(); });
    while (below(2))
      e.extras.push_back({"extra" + std::to_string(e.extras.size()), real(), maybe([&] { return std::abs(real()); })});
    while (below(2)) e.notes.push_back(text());
    if (nested) return e;
    while (below(2)) e.estimates.push_back(estimate(true));
    while (below(3)) e.evidence.panels.push_back(panel());
    e.provenance = {text(), text(), {}, maybe([&] { return random_(); }), {}};
    while (below(2)) e.provenance.inputs.push_back({text(), text()});
    while (below(2)) e.provenance.libraries.push_back({"lib" + std::to_string(random_()), text()});
    return e;
  }

 private:
  std::size_t below(std::size_t n) { return random_() % n; }
  std::int64_t whole() { return static_cast<std::int64_t>(random_()) >> below(64); }
  double real() {
    return std::ldexp(std::uniform_real_distribution<>(-1, 1)(random_), static_cast<int>(below(200)) - 100);
  }
  template <class Make>
  auto maybe(Make make) -> std::optional<decltype(make())> {
    return below(2) ? std::optional(make()) : std::nullopt;
  }
  std::string text() {
    static const std::vector<std::string> pieces{"a",
                                                 "cam0",
                                                 " ",
                                                 "\"",
                                                 "\\",
                                                 "\n",
                                                 "\t",
                                                 ":",
                                                 "#",
                                                 "- ",
                                                 "null",
                                                 "0x",
                                                 "1e5",
                                                 "~",
                                                 "true",
                                                 "µ",
                                                 "±",
                                                 "😀",
                                                 "{",
                                                 "]",
                                                 "'",
                                                 "&",
                                                 "*",
                                                 "!",
                                                 "%",
                                                 "\x01",
                                                 "\x7f",
                                                 "é",
                                                 "  ",
                                                 "\xC2\x85",
                                                 "\xE2\x80\xA8",
                                                 "</script>"};
    std::string s;
    while (below(4)) s += pieces[below(pieces.size())];
    return s;
  }
  Series series(std::size_t n) {
    Series s{text(), text(), {}, {}, {}};
    for (std::size_t i = 0; i < n; ++i)
      s.values.push_back(below(9) ? real() : std::numeric_limits<double>::quiet_NaN());
    if (below(2)) s.sigma.assign(n, std::abs(real()));
    if (below(2)) s.kind = text();
    return s;
  }
  Panel panel() {
    const std::size_t n = below(20);
    Panel p{text(), text(), text(), text(), series(n), {}, {}};
    while (below(2)) p.y.push_back(series(n));
    while (below(2)) p.marks.push_back({text(), real()});
    return p;
  }

  std::mt19937_64 random_;
};

void expect_same(const std::optional<double>& a, const std::optional<double>& b, double relative, const char* what) {
  ASSERT_EQ(a.has_value(), b.has_value()) << what;
  if (a) {
    EXPECT_NEAR(*a, *b, relative * std::abs(*a)) << what;
  }
}

void expect_same(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i])));
}

void expect_same(const Series& a, const Series& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.unit, b.unit);
  EXPECT_EQ(a.kind, b.kind);
  expect_same(a.values, b.values);
  expect_same(a.sigma, b.sigma);
}

void expect_same(const Estimate& a, const Estimate& b) {
  EXPECT_EQ(a.method, b.method);
  EXPECT_EQ(a.sensor, b.sensor);
  EXPECT_EQ(a.reference, b.reference);
  EXPECT_EQ(a.verdict, b.verdict);
  EXPECT_EQ(a.reasons, b.reasons);
  EXPECT_EQ(a.notes, b.notes);
  EXPECT_EQ(a.offset, b.offset);
  expect_same(a.sigma_s, b.sigma_s, 0, "sigma_s");
  EXPECT_EQ(a.epoch, b.epoch);
  expect_same(a.drift, b.drift, 1e-14, "drift");  // ppm are written with 15 digits
  expect_same(a.drift_sigma, b.drift_sigma, 1e-14, "drift_sigma");
  ASSERT_EQ(a.pieces.size(), b.pieces.size());
  for (std::size_t i = 0; i < a.pieces.size(); ++i) {
    EXPECT_EQ(a.pieces[i].start, b.pieces[i].start);
    EXPECT_EQ(a.pieces[i].epoch, b.pieces[i].epoch);
    EXPECT_EQ(a.pieces[i].offset, b.pieces[i].offset);
    EXPECT_EQ(a.pieces[i].sigma_s, b.pieces[i].sigma_s);
    expect_same(a.pieces[i].drift, b.pieces[i].drift, 1e-14, "piece's drift");
  }
  EXPECT_EQ(a.frame_instant, b.frame_instant);
  EXPECT_EQ(a.frame_row, b.frame_row);
  expect_same(a.line_delay_s, b.line_delay_s, 0, "line_delay_s");
  expect_same(a.line_delay_sigma_s, b.line_delay_sigma_s, 0, "line_delay_sigma_s");
  EXPECT_EQ(a.T_reference_sensor, b.T_reference_sensor);
  ASSERT_EQ(a.extras.size(), b.extras.size());
  for (std::size_t i = 0; i < a.extras.size(); ++i) {
    EXPECT_EQ(a.extras[i].name, b.extras[i].name);
    EXPECT_EQ(a.extras[i].value, b.extras[i].value);
    EXPECT_EQ(a.extras[i].sigma, b.extras[i].sigma);
  }
  ASSERT_EQ(a.estimates.size(), b.estimates.size());
  for (std::size_t i = 0; i < a.estimates.size(); ++i) expect_same(a.estimates[i], b.estimates[i]);
  ASSERT_EQ(a.evidence.panels.size(), b.evidence.panels.size());
  for (std::size_t i = 0; i < a.evidence.panels.size(); ++i) {
    const Panel &p = a.evidence.panels[i], &q = b.evidence.panels[i];
    EXPECT_EQ(std::tie(p.name, p.kind, p.title, p.caption), std::tie(q.name, q.kind, q.title, q.caption));
    expect_same(p.x, q.x);
    ASSERT_EQ(p.y.size(), q.y.size());
    for (std::size_t k = 0; k < p.y.size(); ++k) expect_same(p.y[k], q.y[k]);
    ASSERT_EQ(p.marks.size(), q.marks.size());
    for (std::size_t k = 0; k < p.marks.size(); ++k) {
      EXPECT_EQ(p.marks[k].label, q.marks[k].label);
      EXPECT_EQ(p.marks[k].x, q.marks[k].x);
    }
  }
  EXPECT_EQ(a.provenance.version, b.provenance.version);
  EXPECT_EQ(a.provenance.command, b.provenance.command);
  EXPECT_EQ(a.provenance.seed, b.provenance.seed);
  ASSERT_EQ(a.provenance.inputs.size(), b.provenance.inputs.size());
  for (std::size_t i = 0; i < a.provenance.inputs.size(); ++i) {
    EXPECT_EQ(a.provenance.inputs[i].path, b.provenance.inputs[i].path);
    EXPECT_EQ(a.provenance.inputs[i].sha256, b.provenance.inputs[i].sha256);
  }
  ASSERT_EQ(a.provenance.libraries.size(), b.provenance.libraries.size());
  for (std::size_t i = 0; i < a.provenance.libraries.size(); ++i) {
    EXPECT_EQ(a.provenance.libraries[i].name, b.provenance.libraries[i].name);
    EXPECT_EQ(a.provenance.libraries[i].version, b.provenance.libraries[i].version);
  }
}

TEST(Inverse, UndoesTheMapPieceByPiece) {
  Estimate e = plain();
  const std::int64_t at = to_ns(e.epoch);
  for (const bool moving : {false, true}) {
    if (moving)
      for (std::int64_t i = 0; i < 4; ++i)
        e.pieces.push_back({from_ns(at + i * 1'000'000'000), from_ns(at + i * 1'000'000'000 + 500'000'000),
                            Duration(3'000'000 + 75'000 * i), 75e-6, 1e-5});
    const Estimate back = inverse(e);
    EXPECT_EQ(back.sensor, "imu0");
    EXPECT_EQ(back.pieces.size(), e.pieces.size());
    for (std::int64_t t = at - 2'000'000'000; t < at + 6'000'000'000; t += 333'333'333) {
      const auto there = e.clock_map()(from_ns<SensorClock>(t));
      const auto again = back.clock_map()(from_ns<SensorClock>(to_ns(there)));
      EXPECT_NEAR(static_cast<double>(to_ns(again) - t), 0, 1.5) << t;
    }
    EXPECT_EQ(inverse(back).offset, e.offset);
  }
}

TEST(Epoch, AnAnswerIsCarriedWithItsDrift) {
  Estimate e = plain();
  e.drift = -2e-6;
  e.drift_sigma = 1e-6;
  const Estimate later = e.at(e.epoch + std::chrono::seconds(10));
  EXPECT_EQ(later.offset, Duration(3'157'000));
  EXPECT_DOUBLE_EQ(*later.sigma_s, std::hypot(6.1e-6, 10e-6));
  EXPECT_EQ(later.at(e.epoch).offset, e.offset);

  Estimate result = e;
  result.estimates = {e, later, Estimate::refusal("phase", "too short")};
  const auto answers = answers_at_one_epoch(result);
  EXPECT_EQ(answers[1].offset, answers[0].offset) << "one line, told at two epochs";
  EXPECT_FALSE(answers[2].answered());
}

TEST(ResultFile, AnyEstimateSurvivesJsonAndYaml) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Estimate e = Arbitrary(seed).estimate();
    expect_same(e, estimate_from_json(to_json(e), "x.json"));
    expect_same(e, estimate_from_yaml(to_yaml(e), "x.yaml"));
    EXPECT_EQ(to_json(e), to_json(estimate_from_yaml(to_yaml(e), "x.yaml")));
    if (HasFailure()) FAIL() << to_yaml(e);
  }
}

TEST(ResultFile, HasTheContractsFields) {
  Estimate e = plain();
  e.drift = 1.1e-5;
  e.frame_instant = "middle";
  e.extras.push_back({"focal_px", 458.654, 0.1});
  e.estimates.push_back(plain());
  e.provenance.libraries.push_back({"eigen", "3.4.0"});
  const auto j = nlohmann::json::parse(to_json(e));
  EXPECT_EQ(j.at("schema"), "takt/1");
  EXPECT_EQ(j.at("verdict"), "trusted");
  EXPECT_EQ(j.at("offset_s"), 0.003177);
  EXPECT_EQ(j.at("offset_ns"), 3177000);
  EXPECT_EQ(j.at("epoch_ns"), 1700000114480613928);
  EXPECT_EQ(j.at("drift_ppm"), 11.0);
  EXPECT_TRUE(j.at("drift_sigma_ppm").is_null());
  EXPECT_EQ(j.at("frame_instant"), "exposure_middle");
  EXPECT_TRUE(j.at("T_reference_sensor").is_null());
  EXPECT_EQ(j.at("extras").at("focal_px").at("sigma"), 0.1);
  EXPECT_EQ(j.at("estimates").at(0).at("sigma_s"), 6.1e-6);
  EXPECT_FALSE(j.at("estimates").at(0).contains("evidence"));
  EXPECT_EQ(j.at("provenance").at("libraries").at("eigen"), "3.4.0");
}

TEST(ResultFile, NumbersAreWrittenAsShortAsTheyRead) {
  Estimate e = plain();
  e.sigma_s = 0.00621;
  e.offset = Duration(-1'000'000'000'000'000'001);
  const std::string json = to_json(e);
  EXPECT_NE(json.find("\"sigma_s\": 0.00621,"), json.npos) << json;
  EXPECT_NE(json.find("\"offset_s\": -1000000000.000000001,"), json.npos) << json;
}

TEST(ResultFile, WhatIsNotFiniteIsNull) {
  Estimate e = plain();
  e.sigma_s = std::numeric_limits<double>::quiet_NaN();
  e.drift = std::numeric_limits<double>::infinity();
  const std::string json = to_json(e);
  const auto j = nlohmann::json::parse(json);
  EXPECT_TRUE(j.at("sigma_s").is_null());
  EXPECT_TRUE(j.at("drift_ppm").is_null());
}

TEST(ResultFile, ARefusedResultHasNoOffset) {
  Estimate e = plain();
  e.verdict = Verdict::refused;  // by hand, without doubt(): the file must still keep the rule
  EXPECT_TRUE(nlohmann::json::parse(to_json(e)).at("offset_s").is_null());
  e.verdict = Verdict::weak;
  e.offset.reset();
  EXPECT_THROW(static_cast<void>(to_json(e)), std::logic_error);
}

TEST(ResultFile, BrokenTextBecomesValidUtf8) {
  Estimate e = plain();
  e.sensor = "cam\xFF\xC0\xAF";
  EXPECT_EQ(estimate_from_json(to_json(e), "x").sensor, "cam\uFFFD\uFFFD\uFFFD");
}

TEST(ResultFile, OffsetInSecondsAloneIsReadExactly) {
  const auto read = [](const std::string& s) {
    return estimate_from_json(R"({"schema": "takt/1", "verdict": "trusted", "offset_s": )" + s + "}", "x").offset;
  };
  EXPECT_EQ(read("0.003177"), Duration(3'177'000));
  EXPECT_EQ(read("-1700000114.480613928"), Duration(-1'700'000'114'480'613'928));
  EXPECT_EQ(read("6.1e-6"), Duration(6'100));
  EXPECT_EQ(read("2"), Duration(2'000'000'000));
}

std::string complaint(const std::string& json) {
  try {
    static_cast<void>(estimate_from_json(json, "run.json"));
  } catch (const Error& e) {
    return e.what();
  }
  return "none";
}

TEST(ResultFile, ComplaintsNameFileAndField) {
  const auto starts = [](const std::string& json, const std::string& with) {
    EXPECT_TRUE(complaint(json).starts_with(with)) << complaint(json);
  };
  const std::string ok = R"({"schema": "takt/1", "verdict": "trusted", "offset_ns": 5)";
  EXPECT_EQ(complaint(ok + "}"), "none");
  starts("", "run.json:1:1: this is not JSON: the end of the file");
  starts("{\n  \"schema\": takt}", "run.json:2:14: this is not JSON");
  starts("[]", "run.json: a list found, an object expected");
  starts("{}", "run.json: schema is missing");
  starts(R"({"schema": "takt/9"})", "run.json: schema is \"takt/9\", takt/1 expected");
  starts(R"({"schema": "takt/1", "verdict": "fine"})", "run.json: verdict is \"fine\"");
  starts(R"({"schema": "takt/1", "verdict": "weak"})", "run.json: offset_s is not given, but the verdict is weak");
  starts(R"({"schema": "takt/1", "verdict": "refused", "offset_s": 0})", "run.json: offset_s is given");
  starts(R"({"schema": "takt/1", "verdict": "trusted", "offset_s": 1e300})", "run.json: offset_s is beyond 292 years");
  starts(R"({"schema": "takt/1", "verdict": "trusted", "offset_ns": 1.5})", "run.json: offset_ns is 1.5, a whole");
  starts(ok + R"(, "sigma_s": "6 ms"})", "run.json: sigma_s is a text, a number expected");
  starts(ok + R"(, "sigma_s": -1})", "run.json: sigma_s is -1, a standard deviation");
  starts(ok + R"(, "T_reference_sensor": [[1]]})", "run.json: T_reference_sensor has 1 rows");
  starts(ok + R"(, "estimates": [{"verdict": "refused"}, {"verdict": 4}]})", "run.json: estimates[1].verdict is a num");
  starts(ok + R"(, "evidence": {"panels": [{"x": {"values": [1]}, "y": [{}]}]}})",
         "run.json: evidence.panels[0].y[0] has 0 values, x has 1");
  starts(std::string(100'000, '['), "run.json: the document nests too deep");
}

TEST(ResultFile, BrokenYamlIsOneComplaint) {
  for (const char* yaml : {"", "a: [", "\t- x", "schema: takt/1\nverdict: 'tr", "? {", "*x", "%YAML 9"})
    EXPECT_THROW(static_cast<void>(estimate_from_yaml(yaml, "x.yaml")), Error) << yaml;
  std::string bomb = "a0: &a0 [1,1]\n";
  for (int i = 1; i < 30; ++i)
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [*a" + std::to_string(i - 1) + ", *a" +
            std::to_string(i - 1) + "]\n";
  EXPECT_THROW(static_cast<void>(estimate_from_yaml(bomb, "x.yaml")), Error);
}

TEST(ResultFile, EveryTruncationIsAComplaint) {
  const std::string json = to_json(Arbitrary(7).estimate());
  for (std::size_t n = 0; n + 2 < json.size(); ++n)
    EXPECT_THROW(static_cast<void>(estimate_from_json(json.substr(0, n), "x")), Error) << n;
}

}  // namespace
}  // namespace takt
