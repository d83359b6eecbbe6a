// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/clock/bound_hull.h"
#include "takt/streams/clock_events.h"

/// The relation between a device's and a host's clock from exchanges of stamps [Harrison2011].
/// Sensor: the device; reference: the host.
namespace takt {

struct PairOptions {
  std::string method = "auto";          ///< hull, kalman, or auto: hull with kalman beside
  std::optional<double> window_s;       ///< length over which the drift is taken as constant; nothing: found
  std::optional<double> least_delay_s;  ///< of one-way stamps: known least delay, taken off
  double noise_s = 0;  ///< σ of noise that is as likely early as late (pulses), where the bounds stand on its tails
};

template <class Visitor>
void describe(PairOptions& o, Visitor& v) {
  v("window_s", o.window_s, "length over which a clock's drift is taken as constant");
  v("least_delay_s", o.least_delay_s, "least delay of one-way stamps, where it is known: it is taken off");
}

/// Offset, drift, bounds, pieces where the drift moves. Refused where no clock fits the exchanges.
[[nodiscard]] Estimate relate_pairs(const PairStream& pairs, const PairOptions& options = {});

/// Device stamps on the host's clock as they come, from arrivals alone. Two hulls: while one window's answers, the next
/// one's is being built; then they are swapped.
class OneWayClock {
 public:
  explicit OneWayClock(double window_s = 600) : half_ns_(static_cast<std::int64_t>(window_s * 0.5e9)) {}

  /// O(1) on average. Stamps must not go back; false where they do, and the exchange is left out.
  bool observe(std::int64_t device_ns, std::int64_t arrival_ns);
  /// Host time of a device stamp, too late by the least delay; nothing before two exchanges.
  [[nodiscard]] std::optional<std::int64_t> host_ns(std::int64_t device_ns) const;
  [[nodiscard]] std::optional<OffsetLine> line() const { return line_under(active_); }

 private:
  std::int64_t half_ns_;
  BoundHull active_{BoundHull::Side::upper_bounds}, pending_{BoundHull::Side::upper_bounds};
  std::optional<std::int64_t> last_ns_, pending_since_ns_;
};

/// The same from requests and responses, with guaranteed bounds as long as the drift is constant over the window.
class TwoWayClock {
 public:
  explicit TwoWayClock(double window_s = 600) : half_ns_(static_cast<std::int64_t>(window_s * 0.5e9)) {}

  bool observe(const ClockPair& exchange);
  /// Value, σ and bounds; state `ambiguous` where no line fits the window.
  [[nodiscard]] std::optional<DisciplinedStamp> host(std::int64_t device_ns) const;

 private:
  struct Window {
    BoundHull lower{BoundHull::Side::lower_bounds}, upper{BoundHull::Side::upper_bounds};
    double round_trips_ns = 0;
    void add(const ClockPair& p);
  };
  std::int64_t half_ns_;
  Window active_, pending_;
  std::optional<std::int64_t> last_ns_, pending_since_ns_;
};

}  // namespace takt
