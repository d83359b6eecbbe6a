// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/visual_rotation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "takt/signals/bearing_matches.h"
#include "takt/signals/frame_prefetch.h"

namespace takt {

namespace {

/// Scatter of a tracked position at working size (px). Only a start: the scatter is measured pair by pair.
constexpr double nominal_sigma_px = 0.15;

/// Broken streams and duplicating encoders write the same picture twice: it says nothing about the time between.
bool same_picture(const GrayImage& a, const GrayImage& b) {
  if (a.width != b.width || a.height != b.height) return false;
  if (a.pixels == b.pixels) return true;
  for (int y = 0; y < a.height; y += 8)
    if (std::memcmp(a.row(y), b.row(y), static_cast<std::size_t>(a.width)) != 0) return false;
  return true;
}

double median_step_s(const std::vector<Stamp>& stamps) {
  std::vector<Duration> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(stamps[i] - stamps[i - 1]);
  if (steps.empty()) return 0;
  const auto mid = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), mid, steps.end());
  return to_seconds(*mid);
}

/// Grows the signal frame by frame.
class Follower {
 public:
  Follower(const CameraStream& stream, const CameraModel& model, const VisualRotationOptions& options)
      : options_(options),
        timing_(stream.timing),
        bearings_(model, stream.timing, model.height),
        tracker_(options.tracker),
        longest_step_s_(std::max(options.longest_step_s, 1.5 * median_step_s(stream.stamps))) {
    signal_.name = stream.name;
    signal_.clock = stream.clock;
    signal_.source = "images";
    signal_.timing = stream.timing;
    signal_.timing.instant = ExposureInstant::middle;
    signal_.timing.rows = model.height;
    signal_.model = model;
    if (stream.T_body_cam) signal_.R_body_sensor = stream.T_body_cam->topLeftCorner<3, 3>();
  }

  void add(const Frame& frame) {
    ++frames_;
    if (frame.image.width != signal_.model->width || frame.image.height != signal_.model->height)
      throw std::invalid_argument(fmt::format("visual_rotation: the camera model of {} is for {}×{} px, frame {} has {}×{}",
                                              signal_.name, signal_.model->width, signal_.model->height, frame.index,
                                              frame.image.width, frame.image.height));
    const Stamp stamp = middle_of_exposure(frame);
    if (!last_image_.empty() && stamp <= last_stamp_) {
      ++backward_;
      return;
    }
    if (!last_image_.empty() && same_picture(frame.image, last_image_)) {
      ++repeated_;
      return;
    }
    const bool first = last_image_.empty();
    const double step_s = to_seconds(stamp - last_stamp_);
    const auto seen = tracker_.observe(frame.image, first ? FlowPrediction{} : prediction(step_s));
    if (!first) measure(seen, stamp, step_s);
    last_image_ = frame.image;
    last_stamp_ = stamp;
  }

  RotationSignal finish(std::size_t broken) {
    const std::size_t judged = signal_.increments.size() + unexplained_;
    if (judged > 0) signal_.unexplained_fraction = static_cast<double>(unexplained_) / static_cast<double>(judged);
    note(broken, "could not be decoded");
    note(repeated_, "repeat the picture before them and were left out");
    note(backward_, "are not later than the frame before them and were left out");
    note(late_, "come too long after the frame before them to be compared with it");
    note(featureless_, "had too few features in common with the frame before them (blank, blurred, or a cut)");
    note(unexplained_, "show a motion that no rotation with translation of the camera explains");
    return std::move(signal_);
  }

 private:
  Stamp middle_of_exposure(const Frame& frame) const {
    const double exposure_s = frame.exposure_s > 0 ? frame.exposure_s : timing_.exposure_s;
    return frame.stamp + from_seconds(timing_.to_exposure_middle_s(exposure_s));
  }

  /// Things are expected where the last turn, going on at its rate, puts them.
  FlowPrediction prediction(double step_s) const {
    if (!last_rate_) return {};
    const Mat3 R = exp_so3(*last_rate_ * step_s).toRotationMatrix();
    return [this, R](const Vec2& px) { return bearings_.turned(px, R); };
  }

  void measure(const std::vector<FeatureMatch>& seen, Stamp stamp, double step_s) {
    last_rate_.reset();
    if (step_s > longest_step_s_) {
      ++late_;
      return;
    }
    std::vector<BearingMatch> matches;
    matches.reserve(seen.size());
    const double sigma_px = nominal_sigma_px * tracker_.reduction();
    for (const FeatureMatch& f : seen)
      if (auto m = bearings_.match(f.from, f.to, sigma_px)) matches.push_back(*m);
    PairRotation pair = rotation_of_pair(matches, options_.pair);
    switch (pair.outcome) {
      case PairOutcome::too_few_matches:
        ++featureless_;
        return;
      case PairOutcome::unexplained:
        ++unexplained_;
        return;
      case PairOutcome::measured:
        break;
    }
    last_rate_ = pair.rotation / step_s;
    signal_.increments.push_back({last_stamp_, stamp, pair.rotation, pair.information});
    signal_.matches.push_back(spread_over_view(std::move(pair.matches), options_.pair.stored_matches));
  }

  void note(std::size_t count, const char* what) {
    if (count > 0) signal_.notes.push_back(fmt::format("{} of {} frames {}", count, frames_, what));
  }

  const VisualRotationOptions& options_;
  FrameTiming timing_;
  BearingMatches bearings_;
  FeatureTracker tracker_;
  double longest_step_s_;
  RotationSignal signal_;

  GrayImage last_image_;
  Stamp last_stamp_{};
  std::optional<Vec3> last_rate_;  ///< rad/s, of the last pair if it was measured
  std::size_t frames_ = 0, repeated_ = 0, backward_ = 0, late_ = 0, featureless_ = 0, unexplained_ = 0;
};

}  // namespace

RotationSignal visual_rotation(const CameraStream& stream, const CameraModel& model,
                               const VisualRotationOptions& options) {
  if (!stream.open) throw std::invalid_argument("visual_rotation: " + stream.name + " has no pictures to open");
  Follower follower(stream, model, options);
  FramePrefetch frames(stream.open(), options.decode_ahead);
  while (const auto frame = frames.next()) {
    if (options.to && frame->stamp > *options.to) break;
    if (options.from && frame->stamp < *options.from) continue;
    follower.add(*frame);
    if (options.progress) options.progress(frame->index + 1, stream.size());
  }
  return follower.finish(frames.broken());
}

RotationSignal visual_rotation(const CameraStream& stream, double assumed_horizontal_fov_rad,
                               const VisualRotationOptions& options) {
  if (stream.model) return visual_rotation(stream, *stream.model, options);
  if (!stream.open) throw std::invalid_argument("visual_rotation: " + stream.name + " has no pictures to open");
  const auto first = stream.open()->next();
  const CameraModel assumed = first ? CameraModel::from_horizontal_fov(first->image.width, first->image.height,
                                                                      assumed_horizontal_fov_rad)
                                    : CameraModel{};
  RotationSignal signal = visual_rotation(stream, assumed, options);
  signal.focal_assumed = true;
  signal.notes.push_back(
      fmt::format("no intrinsics: a horizontal field of view of {:.0f}° without distortion is assumed",
                  assumed_horizontal_fov_rad * 180 / 3.14159265358979));
  return signal;
}

}  // namespace takt
