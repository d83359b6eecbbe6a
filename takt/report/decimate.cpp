// SPDX-License-Identifier: Apache-2.0
#include "takt/report/decimate.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace takt::report {

std::vector<std::size_t> decimate(const std::vector<double>& low, const std::vector<double>& high,
                                  std::size_t buckets) {
  const std::size_t n = low.size();
  std::vector<std::size_t> kept;
  if (n <= 4 * buckets) {
    kept.resize(n);
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    return kept;
  }
  for (std::size_t b = 0; b < buckets; ++b) {
    const std::size_t begin = b * n / buckets, end = (b + 1) * n / buckets;
    std::size_t lowest = begin, highest = begin, gap = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isnan(low[i])) gap = std::min(gap, i);
      if (!(low[lowest] <= low[i])) lowest = std::isnan(low[i]) ? lowest : i;
      if (!(high[highest] >= high[i])) highest = std::isnan(high[i]) ? highest : i;
    }
    std::vector<std::size_t> picks{begin, lowest, highest, end - 1};
    if (gap < end) picks.push_back(gap);
    std::sort(picks.begin(), picks.end());
    picks.erase(std::unique(picks.begin(), picks.end()), picks.end());
    kept.insert(kept.end(), picks.begin(), picks.end());
  }
  return kept;
}

}  // namespace takt::report
