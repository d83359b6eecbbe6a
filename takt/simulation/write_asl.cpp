// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "takt/error.h"
#include "takt/math/parallel.h"
#include "takt/simulation/folder_writer.h"
#include "takt/simulation/yaml_text.h"
#include "takt/streams/kalibr_names.h"


namespace takt {

namespace {

/// So many pictures are in memory at a time.
constexpr int batch_size = 8;

std::string camera_yaml(const CameraStream& camera) {
  std::string out = "%YAML:1.0\nsensor_type: camera\ncomment: written by takt\n";
  if (camera.T_body_cam) out += transform_yaml("T_BS", *camera.T_body_cam);
  if (camera.size() > 1)
    out += fmt::format("rate_hz: {:.6g}\n", static_cast<double>(camera.size() - 1) /
                                                seconds_since(camera.stamps.front(), camera.stamps.back()));
  if (camera.model) {
    const CameraModel& m = *camera.model;
    const Intrinsics all = intrinsics_of(m);
    const auto coeffs = all.data() + all.size() - coeff_count(m.distortion);
    out += fmt::format("resolution: [{}, {}]\ncamera_model: {}\nintrinsics: [{}]\n", m.width, m.height,
                       kalibr_name(m.projection), fmt::join(all.data(), coeffs, ", "));
    // EuRoC's name of Kalibr's radtan.
    const std::string distortion = m.distortion == Distortion::radtan ? "radial-tangential" : kalibr_name(m.distortion);
    out += fmt::format("distortion_model: {}\n", distortion);
    out += fmt::format("distortion_coefficients: [{}]\n", fmt::join(coeffs, all.data() + all.size(), ", "));
  }
  return out + timing_yaml(camera.timing, "");
}

std::string imu_yaml(const ImuStream& imu) {
  std::string out = "%YAML:1.0\nsensor_type: imu\ncomment: written by takt\n";
  if (imu.T_body_imu) out += transform_yaml("T_BS", *imu.T_body_imu);
  if (imu.size() > 1)
    out += fmt::format("rate_hz: {:.6g}\n",
                       static_cast<double>(imu.size() - 1) / seconds_since(imu.stamps.front(), imu.stamps.back()));
  if (imu.noise)
    out += fmt::format(
        "gyroscope_noise_density: {}\ngyroscope_random_walk: {}\naccelerometer_noise_density: {}\n"
        "accelerometer_random_walk: {}\n",
        imu.noise->gyro_density, imu.noise->gyro_random_walk, imu.noise->accel_density, imu.noise->accel_random_walk);
  if (imu.temperature_c) out += fmt::format("temperature_c: {}\n", *imu.temperature_c);
  return out;
}

std::string picture_name(Stamp stamp) {
  return fmt::format("{}.png", to_ns(stamp));
}

std::string to_png(const GrayImage& image) {
  const cv::Mat1b view(image.height, image.width, const_cast<std::uint8_t*>(image.pixels),
                       static_cast<std::size_t>(image.stride));
  std::vector<std::uint8_t> png;
  if (!cv::imencode(".png", view, png, {cv::IMWRITE_PNG_COMPRESSION, 1}))
    throw std::runtime_error("OpenCV cannot encode a PNG");
  return {png.begin(), png.end()};
}

void write_pictures(const CameraStream& camera, const NewFolder& into, const std::string& folder, int threads,
                    const Progress& progress) {
  const std::unique_ptr<FrameReader> reader = camera.open();
  std::vector<Frame> batch;
  std::size_t done = 0;
  for (bool more = true; more;) {
    batch.clear();
    while (more && batch.size() < batch_size) {
      if (auto frame = reader->next())
        batch.push_back(std::move(*frame));
      else
        more = false;
    }
    parallel_for(static_cast<int>(batch.size()), threads, [&](int i) {
      const Frame& frame = batch[static_cast<std::size_t>(i)];
      into.write(folder + picture_name(frame.stamp), to_png(frame.image));
    });
    done += batch.size();
    if (progress) progress(static_cast<double>(done) / static_cast<double>(camera.size()));
  }
}

}  // namespace

void write_asl(const Recording& recording, const NewFolder& into, int threads, const Progress& progress) {
  for (const ImuStream& imu : recording.imus) {
    std::string csv =
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m "
        "s^-2],a_RS_S_z [m s^-2]\n";
    append_imu_rows(imu, csv);
    into.write("mav0/" + imu.name + "/data.csv", csv);
    into.write("mav0/" + imu.name + "/sensor.yaml", imu_yaml(imu));
  }
  for (const CameraStream& camera : recording.cameras) {
    const std::string folder = "mav0/" + camera.name + "/";
    std::string csv = "#timestamp [ns],filename\n", exposures = "#timestamp [ns],exposure time[ns]\n";
    for (std::size_t i = 0; i < camera.size(); ++i) {
      csv += fmt::format("{},{}\n", to_ns(camera.stamps[i]), picture_name(camera.stamps[i]));
      if (!camera.exposures_s.empty())
        exposures += fmt::format("{},{}\n", to_ns(camera.stamps[i]), from_seconds(camera.exposures_s[i]).count());
    }
    into.write(folder + "data.csv", csv);
    if (!camera.exposures_s.empty()) into.write(folder + "exposure.csv", exposures);
    into.write(folder + "sensor.yaml", camera_yaml(camera));
    write_pictures(camera, into, folder + "data/", threads, progress);
  }
}

}  // namespace takt
