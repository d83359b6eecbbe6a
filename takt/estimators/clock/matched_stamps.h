// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/estimators/clock/trigger_sync.h"

namespace takt {

/// The same event on two clocks.
struct MatchedStamps {
  std::int64_t sensor_ns = 0;
  std::int64_t reference_ns = 0;
};

/// Offset and drift between two clocks that stamp the same events, by the two-clock model (clock_model.h) with its
/// noise found from the data; pieces where the offset does not run straight. Refused below 16 events.
[[nodiscard]] Estimate relate_matches(std::span<const MatchedStamps> matches, const std::string& sensor,
                                      const std::string& reference);

/// How triggered cameras expose, and when to trigger them so that the middles of their exposures coincide
/// [Nikolic2014].
struct ExposureSync {
  struct Camera {
    std::string name;
    std::size_t frames = 0;
    double exposure_s = 0;        ///< median
    double delay_s = 0;           ///< trigger to the beginning of the exposure, median
    double middle_s = 0;          ///< of the exposure after its trigger, against the first camera's, mean
    double middle_scatter_s = 0;  ///< σ of one frame's
    double advance_s = 0;         ///< trigger so much earlier than now, against the first camera
  };
  std::vector<Camera> cameras;
};
/// `triggers[k]` belongs to `strobes[k]`: each strobe to the last trigger before it. Cameras without either are left
/// out.
[[nodiscard]] ExposureSync exposure_sync(std::span<const StrobeStream> strobes, std::span<const PulseStream> triggers);

}  // namespace takt
