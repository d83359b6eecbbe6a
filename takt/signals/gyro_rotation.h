// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "takt/streams/rotation_signal.h"
#include "takt/streams/streams.h"

namespace takt {

struct GyroRotationOptions {
  double shortest_bin_s = 0.010;
  double longest_bin_s = 0.040;
  double fewest_samples = 6;   ///< a bin holds about as many, unless the motion is too fast for that
  double bins_per_period = 6;  ///< of the motion's bandwidth: a bin is never longer than 1/(6·bandwidth)
  double dither_samples = 1;   ///< full width by which bin edges are scattered, in sample periods
  std::uint64_t seed = 1;
};

/// How a second gyro turned in short bins of time, to be aligned like a camera. Bin edges are scattered by a sample
/// period: two gyros sample on grids whose phase is anything, and the interpolation error, which depends on that phase,
/// then averages out instead of becoming an offset. Information is the integral of the gyro's own white noise, measured
/// from its data. No bin spans a gap. Throws std::invalid_argument when there are fewer than 8 usable samples.
[[nodiscard]] RotationSignal gyro_rotation(const ImuStream& gyro, const GyroRotationOptions& options = {});

/// Frequency (Hz) below which lies 99 % of the power of the rates above their noise floor; half the sampling rate at
/// most. Rates are evenly enough spaced that the median step describes them.
[[nodiscard]] double motion_bandwidth_hz(const ImuStream& gyro);

}  // namespace takt
