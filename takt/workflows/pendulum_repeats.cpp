// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/pendulum_repeats.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "takt/calibration/tree.h"
#include "takt/calibration/words.h"
#include "takt/report/repeatability.h"
#include "takt/workflows/report.h"

namespace takt {
namespace {

/// All IMUs of all runs in one list, and which run each is of.
struct Results {
  std::vector<Estimate> estimates;
  std::vector<std::string> names;
};

Results flat(const std::vector<PendulumRun>& runs) {
  Results all;
  for (const PendulumRun& run : runs)
    for (const Estimate& e : run.estimates) {
      all.estimates.push_back(e);
      all.names.push_back(run.name);
    }
  return all;
}

/// What no one number holds for: by how much the means differ from one temperature to another, or nothing.
double change_with_temperature_s(const Repeatability& r) {
  if (r.bins.size() < 2) return 0;
  const auto [low, high] =
      std::minmax_element(r.bins.begin(), r.bins.end(), [](const auto& a, const auto& b) { return a.mean < b.mean; });
  const auto sigma = [&](const TemperatureBin& b) {
    return std::max(r.sigma_s.value_or(0), b.std_s.value_or(0)) / std::sqrt(static_cast<double>(b.answers));
  };
  const double change = to_seconds(high->mean - low->mean);
  return change > 4 * std::hypot(sigma(*low), sigma(*high)) ? change : 0;
}

/// The mean of one IMU's runs, as sure as their scatter says, or they themselves where that is less.
Estimate mean_of(const Repeatability& r, const std::vector<Estimate>& all) {
  const auto named = [&](Estimate e) {
    e.sensor = r.sensor;
    e.reference = r.reference;
    return e;
  };
  if (!r.mean) return named(Estimate::refusal("mean of repeats", "none of the recordings has an answer"));
  Estimate e = named({});
  e.method = "mean of repeats";
  e.verdict = Verdict::trusted;
  e.offset = r.mean;
  const double one = std::max(r.sigma_s.value_or(0), r.std_s.value_or(0));
  e.sigma_s = one / std::sqrt(static_cast<double>(r.answers));
  std::size_t doubtful = 0;
  for (const std::size_t i : r.members) {
    doubtful += all[i].verdict != Verdict::trusted;
    if (!all[i].answered() || e.frame_instant) continue;
    e.epoch = all[i].epoch;
    e.frame_instant = all[i].frame_instant;
    e.frame_row = all[i].frame_row;
  }
  if (doubtful > 0)
    e.doubt(Verdict::weak, fmt::format("{} of {} recordings are weak or refused", doubtful, r.members.size()));
  if (const double change = change_with_temperature_s(r); change > 0) {
    e.sigma_s = std::max(*e.sigma_s, r.std_s.value_or(0));
    e.doubt(Verdict::trusted,
            fmt::format("the delay changes by {} between {:.1f} and {:.1f} °C: take the mean of your temperature",
                        rounded_time_words(change), r.bins.front().mean_c, r.bins.back().mean_c));
  }
  e.extras.push_back({"recordings", static_cast<double>(r.answers), std::nullopt});
  if (r.std_s) e.extras.push_back({"repeat_std_s", *r.std_s, std::nullopt});
  for (const TemperatureBin& b : r.bins)
    e.extras.push_back({fmt::format("mean_at_{:.1f}_c_s", b.mean_c), to_seconds(b.mean), b.std_s});
  return e;
}

Panel repeats_panel(const std::vector<Repeatability>& pairs, const std::vector<Estimate>& all, std::size_t runs) {
  Panel p{"repeats",
          "points",
          "Delay of each recording",
          "Repeats should scatter by no more than their bars.",
          {"recording", "", {}, {}},
          {},
          {}};
  for (std::size_t i = 0; i < runs; ++i) p.x.values.push_back(static_cast<double>(i + 1));
  for (const Repeatability& r : pairs) {
    Series s{r.reference, "ms", std::vector<double>(runs, NAN), std::vector<double>(runs, NAN)};
    for (std::size_t i = 0; i < std::min(runs, r.members.size()); ++i) {
      const Estimate& e = all[r.members[i]];
      if (!e.answered()) continue;
      s.values[i] = to_seconds(*e.offset) * 1e3;
      s.sigma[i] = e.sigma_s.value_or(0) * 1e3;
    }
    p.y.push_back(std::move(s));
  }
  return p;
}

/// As [Fu2021] fig. 11. Series share the x axis, so each has gaps at the others' temperatures.
Panel temperature_panel(const std::vector<Repeatability>& pairs) {
  Panel p{"delay_by_temperature",
          "points",
          "Delay against temperature",
          "Mean of the recordings at each temperature, with their standard deviation.",
          {"temperature", "°C", {}, {}},
          {},
          {}};
  std::vector<std::pair<double, std::size_t>> places;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (const TemperatureBin& b : pairs[i].bins) places.emplace_back(b.mean_c, i);
    p.y.push_back({pairs[i].reference, "ms", {}, {}});
  }
  std::sort(places.begin(), places.end());
  for (const auto& [celsius, pair] : places) {
    p.x.values.push_back(celsius);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const auto& bins = pairs[i].bins;
      const auto b = std::find_if(bins.begin(), bins.end(), [c = celsius](const auto& x) { return x.mean_c == c; });
      const bool own = i == pair && b != bins.end();
      p.y[i].values.push_back(own ? to_seconds(b->mean) * 1e3 : NAN);
      p.y[i].sigma.push_back(own ? b->std_s.value_or(pairs[i].sigma_s.value_or(0)) * 1e3 : NAN);
    }
  }
  return p;
}

}  // namespace

Estimate repeat_estimate(const std::vector<PendulumRun>& runs) {
  const Results all = flat(runs);
  if (all.estimates.empty()) throw std::invalid_argument("repeat_estimate: no runs");
  const std::vector<Repeatability> pairs = repeatability(all.estimates);
  std::vector<Estimate> means;
  for (const Repeatability& r : pairs) means.push_back(mean_of(r, all.estimates));
  Estimate whole = means.front();
  for (std::size_t i = 1; i < means.size(); ++i)
    if (means[i].verdict != Verdict::trusted && whole.answered() && !means[i].reasons.empty())
      whole.doubt(Verdict::weak, means[i].reference + ": " + means[i].reasons.front());
  whole.estimates = means;
  for (std::size_t i = 0; i < all.estimates.size(); ++i) {
    Estimate e = all.estimates[i];
    e.method += " of " + all.names[i];
    e.evidence = {};
    e.estimates.clear();
    whole.estimates.push_back(std::move(e));
  }
  whole.evidence.panels.push_back(repeats_panel(pairs, all.estimates, runs.size()));
  if (Panel p = temperature_panel(pairs); p.x.values.size() > 1) whole.evidence.panels.push_back(std::move(p));
  return whole;
}

std::string repeat_json(const Estimate& whole, const std::vector<PendulumRun>& runs) {
  using namespace tree;
  Node root = from_json(to_json(whole), "");
  root.add("repeatability", *from_json(repeatability_json(flat(runs).estimates), "").find("repeatability"));
  return tree::to_json(root);
}

std::string repeat_words(const std::vector<PendulumRun>& runs) {
  const Results all = flat(runs);
  return repeatability_words(all.estimates, all.names);
}

}  // namespace takt
