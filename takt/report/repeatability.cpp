// SPDX-License-Identifier: Apache-2.0
#include "takt/report/repeatability.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "takt/calibration/tree.h"
#include "takt/calibration/words.h"

namespace takt {

namespace {

void judge(Repeatability& r, const std::vector<Estimate>& results) {
  std::vector<const Estimate*> answered;
  for (const std::size_t i : r.members)
    if (results[i].answered()) answered.push_back(&results[i]);
  r.answers = answered.size();
  if (answered.empty()) return;

  // Relative to the first, so that offsets of days keep their nanoseconds.
  const auto n = static_cast<double>(answered.size());
  const Duration first = *answered.front()->offset;
  double sum = 0, squares = 0, variances = 0;
  bool all_state_sigma = true;
  for (const Estimate* e : answered) {
    const double sigma = e->sigma_s.value_or(0);
    sum += to_seconds(*e->offset - first);
    all_state_sigma = all_state_sigma && e->sigma_s.has_value();
    variances += sigma * sigma;
  }
  for (const Estimate* e : answered) squares += std::pow(to_seconds(*e->offset - first) - sum / n, 2);
  r.mean = first + from_seconds(sum / n);
  if (answered.size() > 1) r.std_s = std::sqrt(squares / (n - 1));
  if (all_state_sigma) r.sigma_s = std::sqrt(variances / n);
}

}  // namespace

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

std::string in_words(const Repeatability& r) {
  const std::string counted = fmt::format("{} answer{} of {} result{}", r.answers, r.answers == 1 ? "" : "s",
                                          r.members.size(), r.members.size() == 1 ? "" : "s");
  if (!r.std_s) return counted + ": nothing can be said about repeatability";
  const double sigma_of_mean = *r.std_s / std::sqrt(static_cast<double>(r.answers));
  std::string out = fmt::format("{}: mean {}, standard deviation {}", counted, time_words(*r.mean, sigma_of_mean),
                                rounded_time_words(*r.std_s));
  if (const auto ratio = r.scatter_over_sigma())
    out += fmt::format(", {:.2g} times what the stated σ of {} leads one to expect", *ratio,
                       rounded_time_words(*r.sigma_s));
  return out;
}

std::string to_json(const std::vector<Repeatability>& pairs) {
  using namespace tree;
  Node out_pairs = list();
  for (const Repeatability& r : pairs) {
    const auto mean = r.mean ? std::optional(static_cast<double>(r.mean->count()) / 1e9) : std::nullopt;
    Node o = object();
    o.add("sensor", text(r.sensor)).add("reference", text(r.reference));
    o.add("results", integer(std::uint64_t{r.members.size()})).add("answers", integer(std::uint64_t{r.answers}));
    o.add("mean_s", number(mean)).add("std_s", number(r.std_s)).add("sigma_s", number(r.sigma_s));
    out_pairs.add(std::move(o));
  }
  return tree::to_json(object().add("repeatability", std::move(out_pairs)));
}

}  // namespace takt
