// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "takt/streams/audit.h"

namespace takt {

namespace {

constexpr double gap_steps = 1.5;          // a longer step than this many usual ones is a gap
constexpr std::size_t neighbourhood = 64;  // stamps that share one line: a crystal is straight over that
constexpr double sigma_of_mad = 1.482602;  // of a normal distribution
constexpr std::int64_t unix_2001_ns = 1'000'000'000'000'000'000;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The difference as unsigned, which cannot overflow even between the ends of time.
std::uint64_t step_ns(Stamp from, Stamp to) {
  return static_cast<std::uint64_t>(to_ns(to)) - static_cast<std::uint64_t>(to_ns(from));
}
double step_s(Stamp from, Stamp to) {
  return static_cast<double>(step_ns(from, to)) * 1e-9;
}

/// Residuals (s) of stamps against the least-squares line of stamp over sample number. Dropped samples are counted by
/// rounding each step to whole periods, so a hole bends no line.
void append_line_residuals(const std::vector<Stamp>& t, std::size_t begin, std::size_t end, double period_s,
                           std::vector<double>& out) {
  const auto n = static_cast<double>(end - begin);
  std::vector<double> number, time_s;
  for (std::size_t i = begin; i < end; ++i) {
    const double step = i == begin ? 0 : std::max(1.0, std::round(step_s(t[i - 1], t[i]) / period_s));
    number.push_back(number.empty() ? 0 : number.back() + step);
    time_s.push_back(step_s(t[begin], t[i]));
  }
  const double mean_number = std::accumulate(number.begin(), number.end(), 0.0) / n;
  const double mean_time = std::accumulate(time_s.begin(), time_s.end(), 0.0) / n;
  double cross = 0, square = 0;
  for (std::size_t i = 0; i < number.size(); ++i) {
    cross += (number[i] - mean_number) * (time_s[i] - mean_time);
    square += (number[i] - mean_number) * (number[i] - mean_number);
  }
  const double slope = cross / square;
  const double lost_freedom = std::sqrt(n / (n - 2));  // two parameters were fitted
  for (std::size_t i = 0; i < number.size(); ++i)
    out.push_back(lost_freedom * (time_s[i] - mean_time - slope * (number[i] - mean_number)));
}

/// Over neighbourhoods without a long gap; nothing where there is none of 8 stamps or more.
std::optional<double> jitter_s(const std::vector<Stamp>& sorted, double period_s) {
  std::vector<double> residuals;
  for (std::size_t begin = 0; begin < sorted.size();) {
    std::size_t end = begin + 1;
    while (end < sorted.size() && end - begin < neighbourhood && step_s(sorted[end - 1], sorted[end]) < 10 * period_s)
      ++end;
    if (end - begin >= 8) append_line_residuals(sorted, begin, end, period_s, residuals);
    begin = end;
  }
  if (residuals.empty()) return std::nullopt;
  for (double& r : residuals) r = std::abs(r);
  const double sigma = sigma_of_mad * median(std::move(residuals));
  return sigma < 1e-10 ? 0 : sigma;  // below a nanosecond's tenth it is the rounding of doubles
}

std::optional<Duration> resolution(const std::vector<Stamp>& distinct) {
  if (distinct.size() < 3) return std::nullopt;
  std::uint64_t step = 0;
  for (std::size_t i = 1; i < distinct.size() && step != 1; ++i)
    step = std::gcd(step, step_ns(distinct[i - 1], distinct[i]));
  return Duration(static_cast<std::int64_t>(step));
}

bool is_power_of_two(std::int64_t n) {
  return n > 0 && (n & (n - 1)) == 0;
}

void add_words(StampAudit& a) {
  const auto say = [&a](std::string sentence) { a.words.push_back(std::move(sentence)); };
  if (a.count == 0) return say("no samples");
  if (a.backward_steps > 0) say(fmt::format("{} of the stamps are before their predecessor", a.backward_steps));
  if (a.duplicates > 0) say(fmt::format("{} stamps are there twice", a.duplicates));
  if (!a.gaps.empty()) {
    const auto longest = std::max_element(a.gaps.begin(), a.gaps.end(),
                                          [](const StampGap& x, const StampGap& y) { return x.length_s < y.length_s; });
    say(fmt::format("{} gap{}, the longest of {:.3g} s at {:.3f} s", a.gaps.size(), a.gaps.size() == 1 ? "" : "s",
                    longest->length_s, step_s(a.first, longest->after)));
  }
  if (a.jitter_s && a.rate_hz && *a.jitter_s * *a.rate_hz > 0.1)
    say(fmt::format("stamps jitter by {:.0f} % of a period: are they arrival times?", 100 * *a.jitter_s * *a.rate_hz));
  if (!a.resolution) return;
  const std::int64_t step = a.resolution->count();
  if (to_ns(a.last) > unix_2001_ns && step >= 64 && step <= 1024 && is_power_of_two(step))
    say(fmt::format("stamps passed through a double: they come in steps of {} ns", step));
  const bool every_step_alike = a.jitter_s && *a.jitter_s == 0;
  if (a.rate_hz && !every_step_alike && static_cast<double>(step) * 1e-9 * *a.rate_hz > 0.05)
    say(fmt::format("stamps are coarse: steps of {:.3g} ms", static_cast<double>(step) * 1e-6));
}

}  // namespace

StampAudit audit(const std::vector<Stamp>& stamps) {
  StampAudit a;
  a.count = stamps.size();
  for (std::size_t i = 1; i < stamps.size(); ++i) a.backward_steps += stamps[i] < stamps[i - 1];
  std::vector<Stamp> sorted = stamps;
  if (a.backward_steps > 0) std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  a.duplicates = stamps.size() - sorted.size();
  if (!sorted.empty()) {
    a.first = sorted.front();
    a.last = sorted.back();
    a.span_s = step_s(a.first, a.last);
  }
  if (sorted.size() > 1) {
    std::vector<double> steps;
    for (std::size_t i = 1; i < sorted.size(); ++i) steps.push_back(step_s(sorted[i - 1], sorted[i]));
    const double period_s = median(steps);
    a.rate_hz = 1 / period_s;
    for (std::size_t i = 0; i < steps.size(); ++i)
      if (steps[i] > gap_steps * period_s) a.gaps.push_back({sorted[i], steps[i]});
    a.jitter_s = jitter_s(sorted, period_s);
    a.resolution = resolution(sorted);
  }
  add_words(a);
  return a;
}

}  // namespace takt
