// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <iterator>

#include "takt/simulation/folder_writer.h"
#include "takt/simulation/yaml_text.h"
#include "takt/streams/kalibr_names.h"

namespace takt {

namespace {

std::string imu_yaml(const ImuStream& imu) {
  const ImuNoise noise = imu.noise.value_or(ImuNoise{});
  const double rate_hz =
      imu.size() < 2 ? 0 : static_cast<double>(imu.size() - 1) / seconds_since(imu.stamps.front(), imu.stamps.back());
  return fmt::format(
      "imu:\n  rate_hz: {:.6g}\n  gyro_noise_density: {}  # rad/s/sqrt(Hz)\n  gyro_random_walk: {}  # "
      "rad/s^2/sqrt(Hz)\n"
      "  accel_noise_density: {}  # m/s^2/sqrt(Hz)\n  accel_random_walk: {}  # m/s^3/sqrt(Hz)\n  gravity_m_s2: 9.81\n",
      rate_hz, noise.gyro_density, noise.gyro_random_walk, noise.accel_density, noise.accel_random_walk);
}

std::string camera_yaml(const TrackStream& t) {
  std::string out = fmt::format("{}:\n  resolution: [{}, {}]\n", t.name, t.model.width, t.model.height);
  out += fmt::format("  distortion_model: {}\n  intrinsics: [{}, {}, {}, {}]  # fx fy cx cy\n",
                     kalibr_name(t.model.distortion), t.model.fx, t.model.fy, t.model.cx, t.model.cy);
  out += fmt::format("  distortion_coeffs: [{}]\n", fmt::join(t.model.coeffs, ", "));
  if (t.pixel_sigma) out += fmt::format("  pixel_noise_sigma: {}\n", *t.pixel_sigma);
  out += fmt::format("  rolling_shutter_line_delay_s: {}\n", t.timing.line_delay_s()) + timing_yaml(t.timing, "  ");
  if (t.T_body_cam) {
    out += "  T_imu_cam:  # p_imu = T p_cam\n";
    for (int r = 0; r < 4; ++r) {
      const auto row = t.T_body_cam->row(r);
      out += fmt::format("    - [{}, {}, {}, {}]\n", row[0], row[1], row[2], row[3]);
    }
  }
  return out;
}

}  // namespace

void write_tracks(const Recording& recording, const NewFolder& into) {
  std::string calib = "# simulated by takt; the true offset stands in truth.json\n";
  for (const ImuStream& imu : recording.imus) {
    std::string csv = "t_imu_ns,wx_rad_s,wy_rad_s,wz_rad_s,ax_m_s2,ay_m_s2,az_m_s2\n";
    append_imu_rows(imu, csv);
    into.write(imu.name + ".csv", csv);
    if (&imu == &recording.imus.front()) calib += imu_yaml(imu);
  }
  for (const TrackStream& tracks : recording.tracks) {
    std::string csv = "t_cam_ns,feature_id,u_px,v_px\n";
    for (std::size_t i = 0; i < tracks.size(); ++i)
      for (const TrackedFeature& f : tracks.features[i])
        fmt::format_to(std::back_inserter(csv), "{},{},{:.4f},{:.4f}\n", to_ns(tracks.stamps[i]), f.id, f.pixel.x(),
                       f.pixel.y());
    into.write(tracks.name + "_tracks.csv", csv);
    calib += camera_yaml(tracks);
  }
  into.write("calib.yaml", calib);
}

}  // namespace takt
