// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/streams/streams.h"

/// What is wrong with a recording before anybody aligns it: stamps, units, stuck and clipped values.
namespace takt {

/// A step of more than 1.5 usual ones between two stamps in order of time.
struct StampGap {
  Stamp after;          ///< the last stamp before it
  double length_s = 0;  ///< to the next stamp
};

struct StampAudit {
  std::size_t count = 0;
  Stamp first{}, last{};               ///< the earliest and the latest; both 0 without stamps
  double span_s = 0;                   ///< from first to last
  std::optional<double> rate_hz;       ///< 1 / median step; nothing for fewer than two different stamps
  std::vector<StampGap> gaps;          ///< in order of time
  std::size_t duplicates = 0;          ///< stamps that are there already
  std::size_t backward_steps = 0;      ///< stamps before their predecessor in the file
  std::optional<double> jitter_s;      ///< robust σ (1.4826·MAD) of stamp minus a line through its neighbourhood
  std::optional<Duration> resolution;  ///< largest step of which all stamp differences are multiples
  std::vector<std::string> words;      ///< what a reader should know of this, as sentences
};
[[nodiscard]] StampAudit audit(const std::vector<Stamp>& stamps);

/// One row of `takt inspect`.
struct StreamAudit {
  std::string name;
  std::string kind;  ///< "imu", "camera", "tracks", "attitude", "angle"
  std::string clock;
  StampAudit stamps;
  std::vector<std::string> words;  ///< units, saturation, stuck values, NaN
};
/// Units are questioned, never changed: rates beyond any gyro look like deg/s, a mean specific force of 1 like g.
[[nodiscard]] StreamAudit audit(const ImuStream& imu);
[[nodiscard]] StreamAudit audit(const CameraStream& camera);
[[nodiscard]] StreamAudit audit(const TrackStream& tracks);
[[nodiscard]] StreamAudit audit(const AttitudeStream& attitude);
[[nodiscard]] StreamAudit audit(const AngleStream& angle);
/// Every stream, in the order imus, cameras, tracks, attitudes, angles.
[[nodiscard]] std::vector<StreamAudit> audit(const Recording& recording);

/// An IMU that estimators can walk along: in order of time, each stamp once (the first one stays), all values finite.
struct Tidied {
  ImuStream imu;
  std::vector<std::string> words;  ///< how many rows were moved or left out; empty when nothing had to be done
};
[[nodiscard]] Tidied tidy(ImuStream imu);

}  // namespace takt
