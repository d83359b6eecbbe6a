// SPDX-License-Identifier: Apache-2.0
#include "takt/report/repeatability.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "takt/calibration/tree.h"
#include "takt/calibration/words.h"
#include "takt/math/median.h"

namespace takt {

namespace {

constexpr std::size_t fewest_for_outliers = 5;
constexpr double outlier_sigmas = 5;
constexpr std::size_t fewest_for_trend = 4;
/// Temperatures that far apart begin a new bin: [Fu2021] calls ±0.5 K one temperature.
constexpr double bin_gap_k = 1;

/// Offsets relative to the first answer, so that days between clocks keep their nanoseconds.
struct Answers {
  std::vector<std::size_t> results;
  std::vector<double> offset_s;
  Duration base{0};

  [[nodiscard]] std::size_t size() const { return results.size(); }
};

Answers answers_of(const Repeatability& r, const std::vector<Estimate>& results) {
  Answers a;
  for (const std::size_t i : r.members) {
    if (!results[i].answered()) continue;
    if (a.results.empty()) a.base = *results[i].offset;
    a.results.push_back(i);
    a.offset_s.push_back(to_seconds(*results[i].offset - a.base));
  }
  return a;
}

struct MeanAndStd {
  double mean = 0;
  std::optional<double> std;
};

MeanAndStd mean_and_std(const std::vector<double>& x) {
  const auto n = static_cast<double>(x.size());
  MeanAndStd out;
  out.mean = std::accumulate(x.begin(), x.end(), 0.0) / n;
  double squares = 0;
  for (const double v : x) squares += (v - out.mean) * (v - out.mean);
  if (x.size() > 1) out.std = std::sqrt(squares / (n - 1));
  return out;
}

std::vector<std::size_t> outliers_of(const Answers& a, const std::vector<Estimate>& results) {
  std::vector<std::size_t> out;
  if (a.size() < fewest_for_outliers) return out;
  const double centre = median_of_pair(a.offset_s);
  std::vector<double> away;
  for (const double x : a.offset_s) away.push_back(std::abs(x - centre));
  const double scatter = 1.4826 * median_of_pair(away);
  for (std::size_t i = 0; i < a.size(); ++i) {
    // An answer that says itself that it is uncertain is not an outlier.
    const double expected = std::max(scatter, results[a.results[i]].sigma_s.value_or(0));
    if (away[i] > outlier_sigmas * expected) out.push_back(a.results[i]);
  }
  return out;
}

/// A line through (x, offset); nothing where x hardly changes.
std::optional<Trend> trend_of(std::string against, std::string unit, const std::vector<double>& x,
                              const std::vector<double>& offset_s) {
  if (x.size() < fewest_for_trend) return std::nullopt;
  const double mean_x = mean_and_std(x).mean, mean_y = mean_and_std(offset_s).mean;
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (offset_s[i] - mean_y);
  }
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  if (!(xx > 0)) return std::nullopt;
  Trend t{std::move(against), std::move(unit), xy / xx, 0, *high - *low, x.size()};
  double left = 0;
  for (std::size_t i = 0; i < x.size(); ++i) left += std::pow(offset_s[i] - mean_y - t.slope_s * (x[i] - mean_x), 2);
  t.sigma_s = std::sqrt(left / static_cast<double>(x.size() - 2) / xx);
  return t;
}

std::optional<double> temperature_of(const Estimate& e) {
  for (const Extra& x : e.extras)
    if (x.name == "temperature_c" && std::isfinite(x.value)) return x.value;
  return std::nullopt;
}

std::optional<Trend> trend_with_date(const Answers& a, const std::vector<Estimate>& results) {
  std::vector<double> hours;
  for (const std::size_t i : a.results)
    hours.push_back(seconds_since(results[a.results.front()].epoch, results[i].epoch) / 3600);
  const auto [low, high] = std::minmax_element(hours.begin(), hours.end());
  if (*high - *low < 48) return trend_of("date", "h", hours, a.offset_s);
  for (double& h : hours) h /= 24;
  return trend_of("date", "day", hours, a.offset_s);
}

void judge_temperatures(Repeatability& r, const Answers& a, const std::vector<Estimate>& results) {
  std::vector<std::pair<double, double>> known;  // temperature, offset
  for (std::size_t i = 0; i < a.size(); ++i)
    if (const auto t = temperature_of(results[a.results[i]])) known.emplace_back(*t, a.offset_s[i]);
  std::sort(known.begin(), known.end());
  std::vector<double> celsius, offset_s;
  for (const auto& [t, offset] : known) {
    celsius.push_back(t);
    offset_s.push_back(offset);
  }
  if (auto t = trend_of("temperature", "K", celsius, offset_s)) r.trends.push_back(std::move(*t));
  for (std::size_t from = 0, to = 0; from < known.size(); from = to) {
    for (to = from + 1; to < known.size() && celsius[to] - celsius[to - 1] < bin_gap_k;) ++to;
    const auto begin = static_cast<std::ptrdiff_t>(from), end = static_cast<std::ptrdiff_t>(to);
    const MeanAndStd s = mean_and_std({offset_s.begin() + begin, offset_s.begin() + end});
    const double mean_c = mean_and_std({celsius.begin() + begin, celsius.begin() + end}).mean;
    r.bins.push_back(
        {mean_c, 0.5 * (celsius[to - 1] - celsius[from]), to - from, a.base + from_seconds(s.mean), s.std});
  }
}

void judge(Repeatability& r, const std::vector<Estimate>& results) {
  const Answers a = answers_of(r, results);
  r.answers = a.size();
  if (a.results.empty()) return;
  const MeanAndStd s = mean_and_std(a.offset_s);
  r.mean = a.base + from_seconds(s.mean);
  r.std_s = s.std;
  double variances = 0;
  bool all_state_sigma = true;
  for (const std::size_t i : a.results) {
    variances += std::pow(results[i].sigma_s.value_or(0), 2);
    all_state_sigma = all_state_sigma && results[i].sigma_s.has_value();
  }
  if (all_state_sigma) r.sigma_s = std::sqrt(variances / static_cast<double>(a.size()));
  r.outliers = outliers_of(a, results);
  if (auto t = trend_with_date(a, results)) r.trends.push_back(std::move(*t));
  judge_temperatures(r, a, results);
}

std::string trend_words(const Trend& t) {
  return fmt::format("follows the {}: {} per {} over {:.3g} {}", t.against, time_words(t.slope_s, t.sigma_s), t.unit,
                     t.span, t.unit);
}

std::string bin_words(const TemperatureBin& b) {
  const auto sigma = b.std_s ? std::optional(*b.std_s / std::sqrt(static_cast<double>(b.answers))) : std::nullopt;
  return fmt::format("{:.1f} ± {:.1f} °C: {} of {} answer{}{}", b.mean_c, b.half_width_c, time_words(b.mean, sigma),
                     b.answers, b.answers == 1 ? "" : "s",
                     b.std_s ? ", standard deviation " + rounded_time_words(*b.std_s) : "");
}

}  // namespace

bool Trend::significant() const {
  const double n = static_cast<double>(answers) - 2, t = slope_s / sigma_s;
  return (8 * n + 1) / (8 * n + 3) * std::sqrt(n * std::log1p(t * t / n)) > 3;
}

std::optional<double> Repeatability::scatter_over_sigma() const {
  return std_s && sigma_s && *sigma_s > 0 ? std::optional(*std_s / *sigma_s) : std::nullopt;
}

std::vector<Repeatability> repeatability(const std::vector<Estimate>& results) {
  std::vector<Repeatability> pairs;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const Estimate& e = results[i];
    auto pair = std::find_if(pairs.begin(), pairs.end(), [&](const Repeatability& r) {
      return r.sensor == e.sensor && r.reference == e.reference;
    });
    if (pair == pairs.end()) {
      pair = pairs.emplace(pair);
      pair->sensor = e.sensor;
      pair->reference = e.reference;
    }
    pair->members.push_back(i);
  }
  for (Repeatability& r : pairs) judge(r, results);
  return pairs;
}

std::string in_words(const Repeatability& r, const std::vector<std::string>& names) {
  const std::string counted = fmt::format("{} answer{} of {} result{}", r.answers, r.answers == 1 ? "" : "s",
                                          r.members.size(), r.members.size() == 1 ? "" : "s");
  if (!r.std_s) return counted + ": nothing can be said about repeatability";
  const double sigma_of_mean = *r.std_s / std::sqrt(static_cast<double>(r.answers));
  std::string out = fmt::format("{}: mean {}, standard deviation {}", counted, time_words(*r.mean, sigma_of_mean),
                                rounded_time_words(*r.std_s));
  if (const auto ratio = r.scatter_over_sigma())
    out += fmt::format(", {:.2g} times what the stated σ of {} leads one to expect", *ratio,
                       rounded_time_words(*r.sigma_s));
  for (const std::size_t i : r.outliers)
    out += "\n  far from the others: " + (i < names.size() ? names[i] : "result " + std::to_string(i + 1));
  for (const Trend& t : r.trends)
    if (t.significant()) out += "\n  " + trend_words(t);
  if (r.bins.size() > 1)
    for (const TemperatureBin& b : r.bins) out += "\n  at " + bin_words(b);
  return out;
}

std::string to_json(const std::vector<Repeatability>& pairs) {
  using namespace tree;
  const auto seconds = [](Duration d) { return number(static_cast<double>(d.count()) / 1e9); };
  Node out_pairs = list();
  for (const Repeatability& r : pairs) {
    Node outliers = list(), trends = list(), bins = list();
    for (const std::size_t i : r.outliers) outliers.add(integer(std::uint64_t{i}));
    for (const Trend& t : r.trends)
      trends.add(object()
                     .add("against", text(t.against))
                     .add("unit", text(t.unit))
                     .add("slope_s", number(t.slope_s))
                     .add("sigma_s", number(t.sigma_s))
                     .add("span", number(t.span))
                     .add("significant", Node{Node::Kind::boolean, t.significant() ? "true" : "false", {}}));
    for (const TemperatureBin& b : r.bins)
      bins.add(object()
                   .add("temperature_c", number(b.mean_c))
                   .add("answers", integer(std::uint64_t{b.answers}))
                   .add("mean_s", seconds(b.mean))
                   .add("std_s", number(b.std_s)));
    Node o = object();
    o.add("sensor", text(r.sensor)).add("reference", text(r.reference));
    o.add("results", integer(std::uint64_t{r.members.size()})).add("answers", integer(std::uint64_t{r.answers}));
    o.add("mean_s", r.mean ? seconds(*r.mean) : Node{}).add("std_s", number(r.std_s)).add("sigma_s", number(r.sigma_s));
    o.add("outliers", std::move(outliers)).add("trends", std::move(trends)).add("temperatures", std::move(bins));
    out_pairs.add(std::move(o));
  }
  return tree::to_json(object().add("repeatability", std::move(out_pairs)));
}

}  // namespace takt
