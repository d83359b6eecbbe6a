// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/calibrate_cameras.h"

#include <fmt/core.h>

#include <algorithm>
#include <numbers>

#include "takt/calibration/words.h"
#include "takt/error.h"
#include "takt/recording/kalibr_files.h"
#include "takt/recording/open_recording.h"
#include "takt/workflows/pick_named.h"
#include "takt/workflows/see_board.h"

namespace takt {

namespace {

struct PictureSize {
  int width = 0, height = 0;
};

/// From the pictures, whatever the recording says of the lens.
PictureSize picture_size(const CameraStream& camera, const std::string& where) {
  const auto frame = camera.open()->next();
  if (!frame) throw Error(fmt::format("no picture of {} can be read", camera.name), where, "");
  return {frame->image.width, frame->image.height};
}

/// One lens a camera.
std::vector<LensKind> lenses_of(const CamerasJob& job, std::size_t cameras) {
  std::vector<LensKind> out;
  for (const std::string& name : job.lenses) {
    const auto kind = std::ranges::find(lens_kinds(), name, [](const LensKind& k) { return std::string(k.name); });
    if (kind == lens_kinds().end()) throw Error(fmt::format("no lens is called {}", name), job.input, "see --help");
    out.push_back(*kind);
  }
  if (out.empty()) out.push_back(lens_kinds().front());
  if (out.size() == 1) out.resize(cameras, out.front());
  if (out.size() != cameras)
    throw Error(fmt::format("{} lenses for {} cameras", out.size(), cameras), job.input,
                "give --lens once for all of them, or once for each");
  return out;
}

/// Which cameras saw the board together, and how they stand in the chain.
void relate(CalibratedCameras& out, const std::vector<CornerStream>& seen) {
  const auto answered = [&](std::size_t i) { return out.cameras[i].found.verdict != Verdict::refused; };
  for (std::size_t i = 1; i < seen.size(); ++i)
    for (std::size_t before = 0; before < i; ++before) {
      if (!answered(i) || !answered(before)) continue;
      auto pair = batch::relate_cameras(seen[before], out.cameras[before].found, seen[i], out.cameras[i].found);
      if (!pair) continue;
      out.cameras[i].overlaps.push_back(static_cast<int>(before));
      out.cameras[before].overlaps.push_back(static_cast<int>(i));
      if (before + 1 == i) out.cameras[i].to_before = std::move(pair);
    }
}

void judge(CalibratedCameras& out) {
  const bool any = std::ranges::any_of(out.cameras, [](const auto& c) { return c.found.verdict != Verdict::refused; });
  out.verdict = any ? Verdict::trusted : Verdict::refused;
  for (std::size_t i = 0; i < out.cameras.size(); ++i) {
    const CameraAnswer& c = out.cameras[i];
    for (const std::string& why : c.found.reasons) out.reasons.push_back(fmt::format("{}: {}", c.name, why));
    if (any && c.found.verdict != Verdict::trusted) out.verdict = Verdict::weak;
    const auto refused = [&](std::size_t at) { return out.cameras[at].found.verdict == Verdict::refused; };
    if (i == 0 || c.to_before || refused(i) || refused(i - 1)) continue;
    out.reasons.push_back(
        fmt::format("{} and {} saw the board at the same time in fewer than three frames: how they "
                    "stand to each other is not known",
                    out.cameras[i - 1].name, c.name));
    out.verdict = Verdict::weak;
  }
}

}  // namespace

const std::vector<LensKind>& lens_kinds() {
  static const std::vector<LensKind> kinds{
      {"pinhole-radtan", Projection::pinhole, Distortion::radtan},
      {"pinhole-equi", Projection::pinhole, Distortion::equidistant},
      {"pinhole-fov", Projection::pinhole, Distortion::fov},
      {"pinhole-none", Projection::pinhole, Distortion::none},
      {"omni-radtan", Projection::omni, Distortion::radtan},
      {"omni-none", Projection::omni, Distortion::none},
      {"ds-none", Projection::double_sphere, Distortion::none},
      {"eucm-none", Projection::eucm, Distortion::none},
  };
  return kinds;
}

CalibratedCameras calibrate_cameras(const CamerasJob& job) {
  const Target target = read_kalibr_target_file(job.target);
  const Recording recording = open_recording(job.input, job.open);
  const std::vector<CameraStream> cameras = pick_named(recording.cameras, job.sensor, "camera", job.input);
  const std::vector<LensKind> lenses = lenses_of(job, cameras.size());
  const std::vector<CornerStream> seen = see_board(cameras, target, job.threads, job.progress);

  CalibratedCameras out;
  out.notes = recording.notes;
  out.files = recording.files;
  out.files.push_back(job.target);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const PictureSize size = picture_size(cameras[i], job.input);
    batch::IntrinsicsOptions options;
    options.projection = lenses[i].projection;
    options.distortion = lenses[i].distortion;
    options.threads = job.threads;
    out.cameras.push_back({cameras[i].name,
                           lenses[i].name,
                           batch::calibrate_intrinsics(seen[i], size.width, size.height, options),
                           {},
                           {}});
  }
  relate(out, seen);
  judge(out);
  return out;
}

KalibrCameraFiles kalibr_camera_files(const CalibratedCameras& result, bool opencv) {
  KalibrCameraFiles out;
  KalibrCamchain chain;
  std::vector<int> number(result.cameras.size(), -1);  // in the file
  for (std::size_t i = 0, n = 0; i < result.cameras.size(); ++i)
    if (result.cameras[i].found.verdict != Verdict::refused) number[i] = static_cast<int>(n++);
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    const CameraAnswer& c = result.cameras[i];
    if (number[i] < 0) continue;
    KalibrCamera camera;
    camera.model = c.found.model;
    camera.rostopic = c.name;
    camera.cam_overlaps.emplace();
    for (const int other : c.overlaps) camera.cam_overlaps->push_back(number[static_cast<std::size_t>(other)]);
    if (c.to_before) camera.T_cn_cnm1 = c.to_before->T_cn_cnm1.matrix();
    chain.push_back(std::move(camera));
  }
  out.camchain = write_kalibr_camchain(chain, opencv ? KalibrStyle::opencv : KalibrStyle::kalibr);
  out.results = "Calibration results\n===================\n" + in_words(result);
  return out;
}

std::string in_words(const CalibratedCameras& result) {
  std::string out;
  for (const CameraAnswer& c : result.cameras) {
    out += fmt::format("{} ({}): {}\n", c.name, c.lens, to_string(c.found.verdict));
    if (c.found.verdict == Verdict::refused) continue;
    const Intrinsics values = intrinsics_of(c.found.model);
    const std::vector<std::string> names = intrinsic_names(c.found.model);
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      out += fmt::format("  {:6} {}\n", names[k], value_words(values[at], c.found.sigma[at]));
    }
    out += fmt::format(
        "  {} x {} px; {} corners in {} frames, {} left out; residuals {:.3f} px rms, corner noise {:.3f} px\n",
        c.found.model.width, c.found.model.height, c.found.corners, c.found.frames, c.found.strays, c.found.rms_px,
        c.found.corner_sigma_px);
    if (!c.to_before) continue;
    const Vec3 place = c.to_before->T_cn_cnm1.translation;
    const Vec3 turn = log_so3(c.to_before->T_cn_cnm1.rotation) * (180 / std::numbers::pi);
    out += fmt::format("  to the camera before: {:.5f} {:.5f} {:.5f} m, turned by {:.4f} {:.4f} {:.4f} deg\n",
                       place.x(), place.y(), place.z(), turn.x(), turn.y(), turn.z());
  }
  for (const std::string& why : result.reasons) out += fmt::format("- {}\n", why);
  return out;
}

}  // namespace takt
