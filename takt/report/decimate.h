// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

namespace takt::report {

/// Which of many points to draw so that the picture stays the same: of each of `buckets` equal runs the first, the
/// lowest, the highest and the last [Jugel2014, M4]. All of them when there are no more than four a bucket.
/// NaN is kept where it breaks a line. Indices ascend.
[[nodiscard]] std::vector<std::size_t> decimate(const std::vector<double>& low, const std::vector<double>& high,
                                                std::size_t buckets);

}  // namespace takt::report
