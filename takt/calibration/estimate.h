// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/evidence.h"
#include "takt/motion/rotation.h"
#include "takt/time/clock_map.h"

/// What was concluded. The simulator's truth and an estimator's answer are this same type: a test is a subtraction.
namespace takt {

/// trusted: use it. weak: an answer, but see the reasons first. refused: the data cannot tell; there is no answer.
enum class Verdict { trusted, weak, refused };
[[nodiscard]] const char* to_string(Verdict v);
/// The worse of two.
[[nodiscard]] Verdict worse(Verdict a, Verdict b);

/// Where a result comes from, so that it can be made again.
struct Provenance {
  struct Input {
    std::string path;
    std::string sha256;
  };
  struct Library {
    std::string name;
    std::string version;
  };
  std::string version;
  std::string command;
  std::vector<Input> inputs;
  std::optional<std::uint64_t> seed;
  std::vector<Library> libraries;
};

/// A number that a method adds to its result, e.g. the focal length it found.
struct Extra {
  std::string name;  ///< with its unit as suffix: "focal_px"
  double value = 0;
  std::optional<double> sigma;
};

/// One straight piece of an offset that moves: from `start` on,
///   reference = sensor + offset + drift·(sensor − epoch)
struct OffsetPiece {
  Stamp start{};  ///< on the sensor's clock; valid until the next piece's start
  Stamp epoch{};
  Duration offset{0};
  double drift = 0;  ///< s/s
  double sigma_s = 0;
};

/// The result of every estimator (docs/formats/result.md):
///   reference = sensor + offset + drift·(sensor − epoch)
/// Unknown quantities are empty, never a plausible default.
struct Estimate {
  std::string method;
  std::string sensor;
  std::string reference;
  Verdict verdict = Verdict::refused;
  std::vector<std::string> reasons;

  std::optional<Duration> offset;  ///< at `epoch`; empty when refused
  std::optional<double> sigma_s;
  Stamp epoch{};                ///< on the sensor's clock
  std::optional<double> drift;  ///< s/s
  std::optional<double> drift_sigma;
  /// Where one straight line is not enough: the offset over the whole recording, in order of start. The first piece
  /// also serves everything before it. `offset` and `drift` above then are those of the piece that holds `epoch`.
  std::vector<OffsetPiece> pieces;

  std::optional<std::string>
      frame_instant;  ///< start, middle, end: of the exposure, which the offset is for; in files exposure_middle …
  std::optional<std::string> frame_row;  ///< first, middle
  std::optional<double> line_delay_s;
  std::optional<double> line_delay_sigma_s;
  std::optional<Mat4> T_reference_sensor;  ///< takes points sensor -> reference

  std::vector<Extra> extras;
  std::vector<std::string> notes;   ///< what was assumed or repaired on the way, in words
  std::vector<Estimate> estimates;  ///< every method that ran, the chosen one included
  Evidence evidence;
  Provenance provenance;

  [[nodiscard]] bool answered() const { return offset.has_value(); }
  /// A refusal with its reason.
  [[nodiscard]] static Estimate refusal(std::string method, std::string reason);
  /// Lowers the verdict (never raises it) and says why. Refusing removes the answer.
  void doubt(Verdict at_best, std::string reason);
  /// As a map between the clocks, with its pieces where there are any; throws std::logic_error when there is no answer.
  [[nodiscard]] ClockMap<> clock_map() const;
  /// The same answer told at another epoch: its offset and σ there.
  [[nodiscard]] Estimate at(Stamp when) const;
};

/// Every method's answer as it stands at the epoch of the result, so that the offsets of drifting clocks compare.
[[nodiscard]] std::vector<Estimate> answers_at_one_epoch(const Estimate& e);

/// The same relation with the roles exchanged: sensor = reference + offset' + …
[[nodiscard]] Estimate inverse(const Estimate& e);

/// docs/formats/result.md: one JSON object ("schema": "takt/1"), or the same as YAML.
[[nodiscard]] std::string to_json(const Estimate& e);
[[nodiscard]] std::string to_yaml(const Estimate& e);
/// Reads either; throws takt::Error naming `where` and the field that is wrong.
[[nodiscard]] Estimate estimate_from_json(const std::string& text, const std::string& where);
[[nodiscard]] Estimate estimate_from_yaml(const std::string& text, const std::string& where);

/// "cam0 is 12.34 ± 0.08 ms early against imu0 (trusted)"
[[nodiscard]] std::string sentence(const Estimate& e);

}  // namespace takt
