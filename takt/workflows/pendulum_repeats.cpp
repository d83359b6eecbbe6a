// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/pendulum_repeats.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "takt/calibration/tree.h"
#include "takt/calibration/words.h"

namespace takt {
namespace {

constexpr double bin_c = 1;  // ± 0.5 °C, as tables 6 and 7

std::optional<double> temperature_of(const Estimate& e) {
  for (const Extra& x : e.extras)
    if (x.name == "temperature_c") return x.value;
  return std::nullopt;
}

/// One IMU's estimates over the runs.
struct Imu {
  std::string sensor, reference;
  std::vector<const Estimate*> runs;
};

std::vector<Imu> imus_of(const std::vector<PendulumRun>& runs) {
  std::vector<Imu> imus;
  for (const PendulumRun& run : runs)
    for (const Estimate& e : run.estimates) {
      auto imu = std::find_if(imus.begin(), imus.end(), [&](const Imu& i) { return i.reference == e.reference; });
      if (imu == imus.end()) imu = imus.insert(imus.end(), {e.sensor, e.reference, {}});
      imu->runs.push_back(&e);
    }
  return imus;
}

RepeatBin bin_of(const Imu& imu, const std::vector<const Estimate*>& runs) {
  RepeatBin bin{imu.sensor, imu.reference, std::nullopt, runs.size(), 0, 0, std::nullopt, 0};
  double warmth = 0, squares = 0;
  for (const Estimate* e : runs) {
    if (const auto t = temperature_of(*e)) warmth += *t / static_cast<double>(runs.size()), bin.temperature_c = warmth;
    if (!e->answered()) continue;
    ++bin.answers;
    bin.mean_s += to_seconds(*e->offset);
    squares += e->sigma_s.value_or(0) * e->sigma_s.value_or(0);
  }
  if (bin.answers == 0) return bin;
  const auto n = static_cast<double>(bin.answers);
  bin.mean_s /= n;
  bin.sigma_s = std::sqrt(squares / n);
  if (bin.answers < 2) return bin;
  double scatter = 0;
  for (const Estimate* e : runs)
    if (e->answered()) scatter += std::pow(to_seconds(*e->offset) - bin.mean_s, 2);
  bin.std_s = std::sqrt(scatter / (n - 1));
  return bin;
}

std::vector<RepeatBin> bins_of(const Imu& imu) {
  std::vector<const Estimate*> runs = imu.runs;
  const auto warmth = [](const Estimate* e) {
    return temperature_of(*e).value_or(std::numeric_limits<double>::infinity());
  };
  std::stable_sort(runs.begin(), runs.end(),
                   [&](const Estimate* a, const Estimate* b) { return warmth(a) < warmth(b); });
  std::vector<RepeatBin> bins;
  for (std::size_t from = 0, to = 0; from < runs.size(); from = to) {
    while (to < runs.size() &&
           (warmth(runs[to]) == warmth(runs[from]) || warmth(runs[to]) - warmth(runs[from]) <= bin_c * (1 + 1e-9)))
      ++to;
    bins.push_back(bin_of(
        imu, {runs.begin() + static_cast<std::ptrdiff_t>(from), runs.begin() + static_cast<std::ptrdiff_t>(to)}));
  }
  return bins;
}

/// The mean of one IMU's runs, and how sure it is: by their scatter where that is larger than they admit.
Estimate mean_of(const Imu& imu, const std::vector<RepeatBin>& bins) {
  const RepeatBin all = bin_of(imu, imu.runs);
  if (all.answers == 0) {
    Estimate e = Estimate::refusal("mean of repeats", "none of the recordings has an answer");
    e.sensor = imu.sensor, e.reference = imu.reference;
    return e;
  }
  const auto first = std::find_if(imu.runs.begin(), imu.runs.end(), [](const Estimate* e) { return e->answered(); });
  Estimate e;
  e.method = "mean of repeats";
  e.sensor = imu.sensor, e.reference = imu.reference;
  e.verdict = Verdict::trusted;
  e.offset = from_seconds(all.mean_s);
  e.epoch = (*first)->epoch;
  e.frame_instant = (*first)->frame_instant, e.frame_row = (*first)->frame_row;
  const double n = std::sqrt(static_cast<double>(all.answers));
  e.sigma_s = std::max(all.sigma_s, all.std_s.value_or(0)) / n;
  e.extras.push_back({"runs", static_cast<double>(all.answers), std::nullopt});
  if (all.std_s) e.extras.push_back({"repeat_std_s", *all.std_s, std::nullopt});
  std::size_t doubtful = 0;
  for (const Estimate* run : imu.runs) doubtful += run->verdict != Verdict::trusted;
  if (doubtful > 0)
    e.doubt(Verdict::weak, fmt::format("{} of {} recordings are weak or refused", doubtful, imu.runs.size()));
  if (bins.size() > 1) {
    double low = 1e9, high = -1e9, noise = 0;
    for (const RepeatBin& b : bins) {
      if (b.answers == 0) continue;
      low = std::min(low, b.mean_s), high = std::max(high, b.mean_s);
      noise = std::max(noise, std::max(b.sigma_s, b.std_s.value_or(0)) / std::sqrt(static_cast<double>(b.answers)));
    }
    if (high - low > 4 * noise) {
      // No one number holds for all temperatures: the uncertainty covers them.
      e.sigma_s = std::max(*e.sigma_s, all.std_s.value_or(0));
      e.doubt(Verdict::trusted,
              fmt::format("the delay changes by {} between {:.1f} and {:.1f} °C; take the row of your "
                          "temperature",
                          rounded_time_words(high - low), bins.front().temperature_c.value_or(NAN),
                          bins.back().temperature_c.value_or(NAN)));
    }
  }
  return e;
}

Panel repeats_panel(const std::vector<Imu>& imus) {
  std::size_t most = 0;
  for (const Imu& imu : imus) most = std::max(most, imu.runs.size());
  Panel p{"repeats",
          "points",
          "Delay of each recording",
          "Repeats should scatter by no more than their bars.",
          {"recording", "", {}, {}},
          {},
          {}};
  for (std::size_t i = 0; i < most; ++i) p.x.values.push_back(static_cast<double>(i + 1));
  for (const Imu& imu : imus) {
    Series s{imu.reference, "ms", std::vector<double>(most, NAN), std::vector<double>(most, NAN)};
    for (std::size_t i = 0; i < imu.runs.size(); ++i) {
      if (!imu.runs[i]->answered()) continue;
      s.values[i] = to_seconds(*imu.runs[i]->offset) * 1e3;
      s.sigma[i] = imu.runs[i]->sigma_s.value_or(0) * 1e3;
    }
    p.y.push_back(std::move(s));
  }
  return p;
}

/// As [Fu2021] fig. 11. Series share the x axis, so each has gaps at the others' temperatures.
Panel temperature_panel(const std::vector<Imu>& imus, const std::vector<RepeatBin>& bins) {
  Panel p{"delay_by_temperature",
          "points",
          "Delay against temperature",
          "Mean of the recordings at each temperature, with their standard deviation.",
          {"temperature", "°C", {}, {}},
          {},
          {}};
  for (const Imu& imu : imus) p.y.push_back({imu.reference, "ms", {}, {}});
  std::vector<RepeatBin> known;
  for (const RepeatBin& b : bins)
    if (b.temperature_c && b.answers > 0) known.push_back(b);
  std::stable_sort(known.begin(), known.end(),
                   [](const RepeatBin& a, const RepeatBin& b) { return *a.temperature_c < *b.temperature_c; });
  for (const RepeatBin& b : known) {
    p.x.values.push_back(*b.temperature_c);
    for (Series& s : p.y) {
      const bool own = s.name == b.reference;
      s.values.push_back(own ? b.mean_s * 1e3 : NAN);
      s.sigma.push_back(own ? b.std_s.value_or(b.sigma_s) * 1e3 : NAN);
    }
  }
  return p;
}

}  // namespace

std::vector<RepeatBin> repeat_bins(const std::vector<PendulumRun>& runs) {
  std::vector<RepeatBin> out;
  for (const Imu& imu : imus_of(runs)) {
    const std::vector<RepeatBin> bins = bins_of(imu);
    out.insert(out.end(), bins.begin(), bins.end());
  }
  return out;
}

std::string repeat_words(const std::vector<RepeatBin>& bins) {
  std::string out =
      fmt::format("{:<8} {:>8} {:>6}   {:<20} {:<14} {}\n", "IMU", "°C", "runs", "mean", "std", "stated σ of one run");
  for (const RepeatBin& b : bins) {
    const std::string warmth = b.temperature_c ? fmt::format("{:.1f}", *b.temperature_c) : "–";
    if (b.answers == 0) {
      out += fmt::format("{:<8} {:>7} {:>6}   no answer\n", b.reference, warmth, fmt::format("0/{}", b.runs));
      continue;
    }
    const double of_mean = std::max(b.sigma_s, b.std_s.value_or(0)) / std::sqrt(static_cast<double>(b.answers));
    const std::string count = b.answers == b.runs ? fmt::format("{}", b.runs) : fmt::format("{}/{}", b.answers, b.runs);
    out +=
        fmt::format("{:<8} {:>7} {:>6}   {:<20} {:<14} {}\n", b.reference, warmth, count, time_words(b.mean_s, of_mean),
                    b.std_s ? rounded_time_words(*b.std_s) : "–", rounded_time_words(b.sigma_s));
  }
  return out;
}

Estimate repeat_estimate(const std::vector<PendulumRun>& runs) {
  const std::vector<Imu> imus = imus_of(runs);
  const std::vector<RepeatBin> bins = repeat_bins(runs);
  std::vector<Estimate> means;
  for (const Imu& imu : imus) means.push_back(mean_of(imu, bins_of(imu)));
  Estimate whole = means.front();
  for (const Estimate& mean : means) whole.estimates.push_back(mean);
  for (const PendulumRun& run : runs)
    for (Estimate e : run.estimates) {
      e.method += " of " + run.name;
      e.evidence = {};
      e.estimates.clear();
      whole.estimates.push_back(std::move(e));
    }
  for (const Estimate& mean : means)
    if (mean.verdict != whole.verdict && worse(mean.verdict, whole.verdict) == mean.verdict && whole.answered() &&
        !mean.reasons.empty())
      whole.doubt(Verdict::weak, mean.reference + ": " + mean.reasons.front());
  for (const RepeatBin& b : bins)
    if (b.temperature_c && b.answers > 0)
      whole.extras.push_back({fmt::format("{}_at_{:.1f}_c_s", b.reference, *b.temperature_c), b.mean_s, b.std_s});
  whole.evidence.panels.push_back(repeats_panel(imus));
  if (Panel p = temperature_panel(imus, bins); p.x.values.size() > 1) whole.evidence.panels.push_back(std::move(p));
  return whole;
}

std::string repeat_json(const Estimate& whole, const std::vector<RepeatBin>& bins) {
  using namespace tree;
  Node list_of_bins = list();
  for (const RepeatBin& b : bins) {
    const bool answered = b.answers > 0;
    Node o = object();
    o.add("sensor", text(b.sensor)).add("reference", text(b.reference));
    o.add("temperature_c", number(b.temperature_c));
    o.add("results", integer(std::uint64_t{b.runs})).add("answers", integer(std::uint64_t{b.answers}));
    o.add("mean_s", number(answered ? std::optional(b.mean_s) : std::nullopt)).add("std_s", number(b.std_s));
    o.add("sigma_s", number(answered ? std::optional(b.sigma_s) : std::nullopt));
    list_of_bins.add(std::move(o));
  }
  Node root = from_json(to_json(whole), "");
  root.add("repeatability", std::move(list_of_bins));
  return tree::to_json(root);
}

}  // namespace takt
