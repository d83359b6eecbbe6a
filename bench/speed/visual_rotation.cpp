// SPDX-License-Identifier: Apache-2.0
// How fast pictures become rotations: per stage, and as a whole with decoding in a second thread.
//   speed_visual_rotation                 a textured wall, 1280×720, made beforehand: no decoding
//   speed_visual_rotation RECORDING [CAM] the first (or the named) camera of a recording
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <memory>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>

#include "takt/recording/open_recording.h"
#include "takt/signals/pixel_bearings.h"
#include "takt/signals/visual_rotation.h"

namespace {

using takt::CameraModel;
using takt::CameraStream;

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double cpu_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

class ReadyFrames : public takt::FrameReader {
 public:
  ReadyFrames(std::shared_ptr<const std::vector<cv::Mat>> pictures, std::vector<takt::Stamp> stamps)
      : pictures_(std::move(pictures)), stamps_(std::move(stamps)) {}
  std::optional<takt::Frame> next() override {
    if (at_ == stamps_.size()) return std::nullopt;
    const std::size_t i = at_++, n = pictures_->size(), turn = i % (2 * n);
    const cv::Mat& m = (*pictures_)[turn < n ? turn : 2 * n - 1 - turn];  // forth and back
    return takt::Frame{i, stamps_[i], 0, {m.cols, m.rows, static_cast<std::ptrdiff_t>(m.step), m.data, pictures_}};
  }

 private:
  std::shared_ptr<const std::vector<cv::Mat>> pictures_;
  std::vector<takt::Stamp> stamps_;
  std::size_t at_ = 0;
};

/// A camera of 70° that sways before a far wall, 30 frames a second.
CameraStream wall_camera(std::size_t frames) {
  const CameraModel model = CameraModel::from_horizontal_fov(1280, 720, 70 * std::numbers::pi / 180);
  cv::RNG random(17);
  cv::Mat texture(2048, 4096, CV_32F, cv::Scalar(128));
  for (int cell = 2; cell <= 128; cell *= 2) {
    cv::Mat coarse(texture.rows / cell, texture.cols / cell, CV_32F), fine;
    random.fill(coarse, cv::RNG::NORMAL, 0, 16);
    cv::resize(coarse, fine, texture.size(), 0, 0, cv::INTER_CUBIC);
    texture += fine;
  }
  auto pictures = std::make_shared<std::vector<cv::Mat>>();
  for (int k = 0; k < 40; ++k) {
    const double yaw = 0.15 * std::sin(0.12 * k), pitch = 0.08 * std::sin(0.2 * k + 1), roll = 0.05 * std::cos(0.1 * k);
    const takt::Mat3 R = takt::exp_so3({pitch, yaw, roll}).toRotationMatrix();
    takt::Mat3 to_texture, from_pixel;
    to_texture << 1000, 0, 2048, 0, 1000, 1024, 0, 0, 1;
    from_pixel << 1 / model.fx, 0, -model.cx / model.fx, 0, 1 / model.fy, -model.cy / model.fy, 0, 0, 1;
    const takt::Mat3 H = to_texture * R * from_pixel;
    cv::Matx33d h;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) h(r, c) = H(r, c);
    cv::Mat seen, grain(model.height, model.width, CV_32F), grey;
    cv::warpPerspective(texture, seen, h, {model.width, model.height}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
    random.fill(grain, cv::RNG::NORMAL, 0, 2);
    seen += grain;
    seen.convertTo(grey, CV_8U);
    pictures->push_back(grey);
  }
  CameraStream stream;
  stream.name = "wall";
  stream.model = model;
  for (std::size_t i = 0; i < frames; ++i)
    stream.stamps.push_back(takt::from_ns(0) + takt::from_seconds(static_cast<double>(i) / 30));
  stream.open = [pictures, stamps = stream.stamps] { return std::make_unique<ReadyFrames>(pictures, stamps); };
  return stream;
}

CameraStream camera_of(const std::string& path, const std::string& name) {
  takt::Recording recording = takt::open_recording(path);
  for (CameraStream& camera : recording.cameras)
    if (name.empty() || camera.name == name) return camera;
  throw std::runtime_error(path + ": no camera " + name);
}

void print(const char* what, double seconds, const char* of, std::size_t frames) {
  std::printf("%-18s %7.2f ms/frame %s\n", what, seconds / static_cast<double>(frames) * 1e3, of);
}

/// The stages one after the other, in one thread.
void stages(const CameraStream& stream, const CameraModel& model) {
  double decode = 0, track = 0, bearing = 0, fit = 0, tracked = 0;
  std::size_t frames = 0;
  takt::FeatureTracker tracker;
  const takt::PixelBearings bearings(model, stream.timing, model.height);
  const auto reader = stream.open();
  const double cpu_start = cpu_s();
  for (;;) {
    const double t0 = wall_s();
    const auto frame = reader->next();
    const double t1 = wall_s();
    decode += t1 - t0;
    if (!frame) break;
    const auto seen = tracker.observe(frame->image);
    const double t2 = wall_s();
    std::vector<takt::BearingMatch> matches;
    for (const auto& f : seen) {
      const auto from = bearings.see(f.from, 0.15 * tracker.reduction());
      const auto to = bearings.see(f.to, 0.15 * tracker.reduction());
      if (from && to) matches.push_back(takt::match(*from, *to));
    }
    const double t3 = wall_s();
    (void)takt::rotation_of_pair(matches);
    const double t4 = wall_s();
    track += t2 - t1, bearing += t3 - t2, fit += t4 - t3;
    tracked += static_cast<double>(seen.size());
    ++frames;
  }
  std::printf("%zu frames of %d×%d px, tracked at 1/%d, %.0f features a pair\n", frames, model.width, model.height,
              tracker.reduction(), tracked / static_cast<double>(frames));
  print("  decode", decode, "wall", frames);
  print("  track", track, "wall", frames);
  print("  bearings", bearing, "wall", frames);
  print("  rotation", fit, "wall", frames);
  print("all stages", decode + track + bearing + fit, "wall", frames);
  print("all stages", cpu_s() - cpu_start, "CPU", frames);
}

void whole(const CameraStream& stream, const CameraModel& model) {
  const double wall = wall_s(), cpu = cpu_s();
  const takt::RotationSignal signal = takt::visual_rotation(stream, model);
  print("visual_rotation", wall_s() - wall, "wall", stream.size());
  print("visual_rotation", cpu_s() - cpu, "CPU", stream.size());
  if (stream.size() > 1) {
    const double seconds = takt::to_seconds(stream.stamps.back() - stream.stamps.front());
    std::printf("%.1f times real time; %zu increments from %zu frames\n", seconds / (wall_s() - wall),
                signal.increments.size(), stream.size());
  }
  for (const std::string& note : signal.notes) std::printf("note: %s\n", note.c_str());
}

}  // namespace

int main(int argc, char** argv) try {
  const CameraStream stream = argc > 1 ? camera_of(argv[1], argc > 2 ? argv[2] : "") : wall_camera(300);
  CameraModel model;
  if (stream.model) {
    model = *stream.model;
  } else if (const auto first = stream.open()->next()) {
    model = CameraModel::from_horizontal_fov(first->image.width, first->image.height, 70 * std::numbers::pi / 180);
  }
  stages(stream, model);
  whole(stream, model);
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
