// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kitti_raw.h"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>

#include "takt/error.h"
#include "takt/recording/decimal.h"
#include "takt/recording/files.h"
#include "takt/recording/kitti_calibration.h"
#include "takt/recording/nmea.h"
#include "takt/recording/picture.h"
#include "takt/recording/text_table.h"

namespace fs = std::filesystem;

namespace takt {

namespace {

const char* const shared_clock = "kitti";  // one computer stamped everything

bool has_oxts(const fs::path& root) {
  std::error_code failed;
  return fs::exists(root / "oxts" / "timestamps.txt", failed) && fs::is_directory(root / "oxts" / "data", failed);
}

/// Files by the number that is their name.
std::map<std::size_t, std::string> numbered_files(const fs::path& folder) {
  std::map<std::size_t, std::string> out;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    const std::string stem = entry.path().stem().string();
    std::size_t number = 0;
    const auto [end, wrong] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
    if (wrong == std::errc{} && end == stem.data() + stem.size()) out.emplace(number, entry.path().string());
  }
  return out;
}

struct StampedFile {
  Stamp stamp;
  std::string path;
};

/// Line N of timestamps.txt and file N of data/; what has no partner is left out and counted.
std::vector<StampedFile> stamped_files(const fs::path& folder, const std::string& name, Recording& recording) {
  const std::string list = (folder / "timestamps.txt").string();
  recording.files.push_back(list);
  const auto stamps = read_kitti_stamps(read_file(list), list);
  const auto files = numbered_files(folder / "data");
  std::vector<StampedFile> out;
  for (const auto& [number, path] : files)
    if (number < stamps.size() && stamps[number]) out.push_back({*stamps[number], path});
  const auto stamped = static_cast<std::size_t>(
      std::count_if(stamps.begin(), stamps.end(), [](const auto& stamp) { return stamp.has_value(); }));
  if (out.size() < stamped)
    recording.notes.push_back(fmt::format("{}: {} of {} stamps have no file", name, stamped - out.size(), stamped));
  if (out.size() < files.size())
    recording.notes.push_back(fmt::format("{}: {} of {} files have no stamp and are left out", name,
                                          files.size() - out.size(), files.size()));
  if (out.empty())
    throw Error("no file in data/ has a stamp", list, "unpack the drive's pictures and oxts into the same folder");
  return out;
}

/// A calibration file of the drive, else of its day; empty fields where there is none.
KittiFields calibration(const fs::path& root, const std::string& name, Recording& recording) {
  std::error_code failed;
  const fs::path drive = fs::absolute(root, failed).lexically_normal();
  const fs::path above = drive.has_filename() ? drive.parent_path() : drive.parent_path().parent_path();
  for (const fs::path& folder : {root, above}) {
    const std::string path = (folder / name).string();
    if (!fs::exists(path, failed)) continue;
    recording.files.push_back(path);
    return {read_file(path), path};
  }
  recording.notes.push_back("no " + name + " in the drive's folder or above it");
  return {"", name};
}

CameraStream read_camera(const fs::path& folder, Recording& recording) {
  CameraStream camera;
  camera.name = folder.filename().string();
  camera.clock = shared_clock;
  std::vector<PictureFile> pictures;
  for (StampedFile& file : stamped_files(folder, camera.name, recording)) {
    pictures.push_back({camera.stamps.size(), file.stamp, 0, std::move(file.path)});
    camera.stamps.push_back(file.stamp);
  }
  camera.open = [shared = std::make_shared<const std::vector<PictureFile>>(std::move(pictures))] {
    return read_pictures(shared);
  };
  return camera;
}

/// Intrinsics and mounting, for pictures of the size that the first one has.
void give_calibration(CameraStream& camera, const KittiFields& cam_to_cam, const std::optional<Mat4>& T_cam0_imu,
                      std::vector<std::string>& notes) {
  const auto first = camera.open()->next();
  const int width = first ? first->image.width : 0, height = first ? first->image.height : 0;
  const auto found = kitti_camera(cam_to_cam, camera.name.substr(6), width, height);
  if (!found) {
    notes.push_back(fmt::format("{}: no calibration for its pictures of {} by {}, so intrinsics are unknown",
                                camera.name, width, height));
    return;
  }
  camera.model = found->model;
  camera.timing.rows = height;
  notes.push_back(camera.name + ": " + found->note);
  if (found->T_cam_cam0 && T_cam0_imu) camera.T_body_cam = (*found->T_cam_cam0 * *T_cam0_imu).inverse();
}

ImuStream read_imu(const fs::path& folder, Recording& recording) {
  ImuStream imu;
  imu.name = "oxts_imu";
  imu.clock = shared_clock;
  imu.T_body_imu = Mat4::Identity();
  for (const StampedFile& file : stamped_files(folder, imu.name, recording)) {
    const OxtsSample sample = read_oxts(read_file(file.path), file.path);
    imu.stamps.push_back(file.stamp);
    imu.gyro_rad_s.push_back(sample.gyro_rad_s);
    imu.accel_m_s2.push_back(sample.accel_m_s2);
  }
  return imu;
}

}  // namespace

std::vector<fs::path> kitti_cameras(const fs::path& root) {
  std::vector<fs::path> found;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(root, failed)) {
    const std::string name = entry.path().filename().string();
    const bool numbered =
        name.size() == 8 && name.starts_with("image_") && name.find_first_not_of("0123456789", 6) == std::string::npos;
    if (numbered && fs::exists(entry.path() / "timestamps.txt", failed)) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::optional<Stamp> kitti_stamp(std::string_view line) {
  if (line.size() < 19 || line[4] != '-' || line[7] != '-' || line[10] != ' ' || line[13] != ':' || line[16] != ':')
    return std::nullopt;
  const auto year = whole_number(line.substr(0, 4)), month = whole_number(line.substr(5, 2)),
             day = whole_number(line.substr(8, 2));
  const auto hour = whole_number(line.substr(11, 2)), minute = whole_number(line.substr(14, 2)),
             second = whole_number(line.substr(17, 2));
  if (!year || !month || !day || !hour || !minute || !second || *hour > 23 || *minute > 59 || *second > 59)
    return std::nullopt;
  const auto days = days_from_date(*year, *month, *day);
  const auto fraction = decimal_to_ns("0" + std::string(line.substr(19)), 9);
  if (!days || !fraction || *fraction < 0 || *fraction >= 1'000'000'000) return std::nullopt;
  return from_ns((*days * 86400 + *hour * 3600 + *minute * 60 + *second) * 1'000'000'000 + *fraction);
}

bool looks_like_kitti_raw(const std::string& path) {
  return !kitti_cameras(path).empty() || has_oxts(path);
}

std::vector<std::optional<Stamp>> read_kitti_stamps(std::string_view text, const std::string& where) {
  std::vector<std::optional<Stamp>> out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    out.push_back(line.empty() ? std::nullopt : kitti_stamp(line));
    if (!line.empty() && !out.back())
      throw Error("is no date and time such as 2011-09-26 13:02:25.964389445", fmt::format("{}:{}", where, out.size()),
                  "take the file from KITTI again; it has one line for each file in data/");
  }
  return out;
}

OxtsSample read_oxts(std::string_view text, const std::string& where) {
  constexpr std::size_t accel = 11, gyro = 17;
  TableRows row(text, where);
  if (row.shape().columns < gyro + 3)
    throw Error(fmt::format("has {} numbers, 30 expected", row.shape().columns), where,
                "the file is cut off: take it from KITTI again, or delete it");
  (void)row.next();
  return {.gyro_rad_s = {row.number(gyro), row.number(gyro + 1), row.number(gyro + 2)},
          .accel_m_s2 = {row.number(accel), row.number(accel + 1), row.number(accel + 2)}};
}

Recording read_kitti_raw(const std::string& path, const OpenOptions&) {
  Recording recording;
  if (has_oxts(path)) recording.imus.push_back(read_imu(fs::path(path) / "oxts", recording));
  const std::vector<fs::path> folders = kitti_cameras(path);
  recording.notes.emplace_back("stamps taken as UTC and, of pictures, as the middle of the exposure");
  if (folders.empty()) return recording;

  const KittiFields cam_to_cam = calibration(path, "calib_cam_to_cam.txt", recording);
  const auto T_cam0_velo = calibration(path, "calib_velo_to_cam.txt", recording).transform("R", "T");
  const auto T_velo_imu = calibration(path, "calib_imu_to_velo.txt", recording).transform("R", "T");
  std::optional<Mat4> T_cam0_imu;
  if (T_cam0_velo && T_velo_imu) T_cam0_imu = *T_cam0_velo * *T_velo_imu;
  for (const fs::path& folder : folders) {
    CameraStream camera = read_camera(folder, recording);
    give_calibration(camera, cam_to_cam, T_cam0_imu, recording.notes);
    recording.cameras.push_back(std::move(camera));
  }
  return recording;
}

}  // namespace takt
