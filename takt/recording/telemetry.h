// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/recording/gpmf.h"
#include "takt/recording/media_index.h"
#include "takt/recording/sample_clock.h"

namespace takt {

/// One kind of sample over a whole recording, on the media time.
struct TelemetryTable {
  std::string key;    ///< "GYRO"
  gpmf::Stream head;  ///< what the first block says of it (axes, units, device); its data are those of one block
  std::vector<Stamp> stamps;  ///< one a row
  std::size_t columns = 0;
  std::vector<double> values;  ///< row after row
  double rate_hz = 0;
  std::string note;  ///< how the stamps were made: rate, residual, steps

  [[nodiscard]] std::size_t rows() const { return stamps.size(); }
  [[nodiscard]] const double* row(std::size_t i) const { return values.data() + i * columns; }
};

/// All payloads of a GPMF track. Stamps are fitted over the whole file: from the camera's own clock where it wrote one
/// (STMP in µs, or TICK in ms where that agrees with the samples better than payloads do), else from the times of the
/// payloads, which are cut in batches of some 20 ms.
class Telemetry {
 public:
  explicit Telemetry(const std::vector<MediaIndex::Payload>& payloads);

  /// The samples of the first device that has them with so many columns; nothing where there are none.
  [[nodiscard]] std::optional<TelemetryTable> table(const std::string& key, std::size_t columns) const;
  /// Damaged payloads, and what ties the camera's clock to the media time.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Block {
    Stamp start;  // of the payload
    Duration duration{0};
    gpmf::Stream stream;
  };
  /// The camera's clock against the media time: a "sample" of it is a microsecond, a mark is a payload.
  struct CameraClock {
    std::string name;
    std::vector<Stamp> payloads;
    SampleClock to_media;
  };
  struct Timing {
    std::vector<BlockMark> marks;
    SampleClock clock;
    std::string words;
  };
  using Reading = std::optional<std::int64_t> (*)(const gpmf::Stream&);
  [[nodiscard]] std::vector<Block> blocks(const std::string& key, std::size_t columns) const;
  [[nodiscard]] std::optional<CameraClock> tie(const std::string& name, Reading reading) const;
  [[nodiscard]] std::optional<Timing> time_by_camera(const std::vector<Block>& blocks) const;
  [[nodiscard]] static Timing time_by_payloads(const std::vector<Block>& blocks);

  std::vector<Block> blocks_;  // all streams of all payloads, in order
  std::optional<CameraClock> camera_clock_;
  Reading reading_ = nullptr;  // of the camera's clock, µs
  std::vector<std::string> notes_;
};

}  // namespace takt
