// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/visual_rotation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "takt/signals/frame_prefetch.h"
#include "takt/signals/pixel_bearings.h"
#include "takt/signals/rotation_chain.h"

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

RotationSignal signal_of(const CameraStream& stream, const CameraModel& model) {
  RotationSignal signal;
  signal.name = stream.name;
  signal.clock = stream.clock;
  signal.source = "images";
  signal.timing = stream.timing;
  signal.timing.instant = ExposureInstant::middle;
  signal.timing.rows = model.height;
  signal.model = model;
  if (stream.T_body_cam) signal.R_body_sensor = stream.T_body_cam->topLeftCorner<3, 3>();
  return signal;
}

/// Takes the frames one by one.
class Follower {
 public:
  Follower(const CameraStream& stream, const CameraModel& model, const VisualRotationOptions& options)
      : model_(model),
        timing_(stream.timing),
        bearings_(model, stream.timing, model.height),
        tracker_(options.tracker),
        chain_(signal_of(stream, model), options.pair,
               std::max(options.longest_step_s, 1.5 * median_step_s(stream.stamps)), median_step_s(stream.stamps)) {}

  void add(const Frame& frame) {
    ++frames_;
    check_size(frame);
    const Stamp stamp = middle_of_exposure(frame);
    if (last_image_.empty()) {
      tracker_.observe(frame.image);
    } else if (stamp <= last_stamp_) {
      ++backward_;
      return;
    } else if (same_picture(frame.image, last_image_)) {
      ++repeated_;
      return;
    } else {
      follow(frame.image, stamp);
    }
    last_image_ = frame.image;
    last_stamp_ = stamp;
  }

  RotationSignal finish(std::size_t broken) {
    chain_.note(broken, frames_ + broken, "could not be decoded");
    chain_.note(repeated_, frames_, "repeat the picture before them and were left out");
    chain_.note(backward_, frames_, "are not later than the frame before them and were left out");
    return chain_.finish(frames_);
  }

 private:
  void check_size(const Frame& frame) const {
    if (frame.image.width != model_.width || frame.image.height != model_.height)
      throw std::invalid_argument(
          fmt::format("visual_rotation: the camera model is for {}×{} px, frame {} has {}×{} px", model_.width,
                      model_.height, frame.index, frame.image.width, frame.image.height));
  }

  Stamp middle_of_exposure(const Frame& frame) const {
    const double exposure_s = frame.exposure_s > 0 ? frame.exposure_s : timing_.exposure_s;
    return frame.stamp + from_seconds(timing_.to_exposure_middle_s(exposure_s));
  }

  void follow(const GrayImage& image, Stamp stamp) {
    const double step_s = to_seconds(stamp - last_stamp_);
    const auto seen = tracker_.observe(image, prediction(step_s));
    const double sigma_px = nominal_sigma_px * tracker_.reduction();
    std::vector<FollowedFeature> followed;
    followed.reserve(seen.size());
    for (const FeatureMatch& f : seen) {
      const auto from = bearings_.see(f.from, sigma_px), to = bearings_.see(f.to, sigma_px);
      if (from && to) followed.push_back({f.id, *from, *to});
    }
    std::sort(followed.begin(), followed.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    const auto rotation = chain_.add(last_stamp_, stamp, followed);
    last_rate_ = rotation ? std::optional<Vec3>(*rotation / step_s) : std::nullopt;
  }

  /// Things are expected where the last turn, going on at its rate, puts them.
  FlowPrediction prediction(double step_s) const {
    if (!last_rate_) return {};
    const Mat3 R = exp_so3(*last_rate_ * step_s).toRotationMatrix();
    return [this, R](const Vec2& px) { return bearings_.turned(px, R); };
  }

  CameraModel model_;
  FrameTiming timing_;
  PixelBearings bearings_;
  FeatureTracker tracker_;
  RotationChain chain_;

  GrayImage last_image_;
  Stamp last_stamp_{};
  std::optional<Vec3> last_rate_;  ///< rad/s over the last pair, if it was measured
  std::size_t frames_ = 0, repeated_ = 0, backward_ = 0;
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
  const CameraModel assumed =
      first ? CameraModel::from_horizontal_fov(first->image.width, first->image.height, assumed_horizontal_fov_rad)
            : CameraModel{};
  RotationSignal signal = visual_rotation(stream, assumed, options);
  signal.focal_assumed = true;
  signal.notes.push_back(
      fmt::format("no intrinsics: a horizontal field of view of {:.0f}° without distortion is assumed",
                  assumed_horizontal_fov_rad * 180 / std::numbers::pi));
  return signal;
}

}  // namespace takt
