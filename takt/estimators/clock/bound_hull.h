// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

/// Convex hulls of bounds on a straight line [Harrison2011]: a clock's offset o(s) = offset + drift·(s − epoch) against
/// the device's stamps s lies below every upper bound and above every lower bound.
namespace takt {

struct Bound {
  std::int64_t s_ns = 0;  ///< device's stamp
  std::int64_t o_ns = 0;  ///< bound on the offset there
};

/// The lower hull of upper bounds, or the upper hull of lower bounds: those that a line can touch. Bounds come in order
/// of s; adding one costs O(1) on average. Cross products are exact (128 bits).
class BoundHull {
 public:
  enum class Side { upper_bounds, lower_bounds };
  explicit BoundHull(Side side) : side_(side) {}

  void add(Bound b);
  [[nodiscard]] const std::vector<Bound>& corners() const { return corners_; }
  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool empty() const { return corners_.empty(); }
  /// The corner that a line of this slope touches.
  [[nodiscard]] std::size_t touched(long double slope) const;
  /// Index of the corner at or before s; the hull's edge over s runs from there to the next corner.
  [[nodiscard]] std::size_t edge_over(std::int64_t s_ns) const;
  /// Mean of all stamps added.
  [[nodiscard]] std::int64_t mean_s_ns() const;
  void clear();

 private:
  Side side_;
  std::vector<Bound> corners_;
  std::size_t count_ = 0;
  std::int64_t first_ = 0;
  __extension__ __int128 sum_ = 0;  // of stamps since the first
};

/// o(s) = offset + drift·(s − epoch), ns and 1.
struct OffsetLine {
  std::int64_t epoch_ns = 0;
  long double offset_ns = 0;
  long double drift = 0;
  [[nodiscard]] long double at(std::int64_t s_ns) const {
    return offset_ns + drift * static_cast<long double>(s_ns - epoch_ns);
  }
};

/// Upper bounds alone: the edge over the mean stamp, the highest line there that no bound contradicts (the linear
/// programme of [Moon1999], solved by [Zhang2002]). Too high by the least delay. Nothing with fewer than two corners.
[[nodiscard]] std::optional<OffsetLine> line_under(const BoundHull& upper);

/// Both sides: the slope with the widest gap between the hulls, half-way across. Nothing where no line fits.
struct GapLine {
  OffsetLine line;
  long double gap_ns = 0;  ///< from the lower to the upper bounds along the line; negative: no line fits
};
[[nodiscard]] std::optional<GapLine> line_between(const BoundHull& lower, const BoundHull& upper);

/// The same for few exchanges: the mean of all lines, weighted by how likely exponential delays of unknown mean make
/// them and by what crystals do (Student's t with three degrees of freedom and scale `usual_drift`).
/// `mean_round_trip_ns` is that of all exchanges. Approaches line_between as exchanges come in.
struct LikelyLine {
  OffsetLine line;
  long double gap_ns = 0;
  double offset_sigma_ns = 0;  ///< at the line's epoch
  double drift_sigma = 0;
};
[[nodiscard]] std::optional<LikelyLine> likely_line(const BoundHull& lower, const BoundHull& upper,
                                                    double mean_round_trip_ns, double usual_drift = 40e-6);

/// Guaranteed bounds at s: the extremes there of all lines that fit, each bound loosened by `slack_ns`. Nothing where
/// no line fits.
struct OffsetBounds {
  long double lower_ns = 0, upper_ns = 0;
};
[[nodiscard]] std::optional<OffsetBounds> bounds_at(const BoundHull& lower, const BoundHull& upper, std::int64_t s_ns,
                                                    long double slack_ns = 0);

}  // namespace takt
