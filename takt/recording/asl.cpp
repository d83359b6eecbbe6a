// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/asl.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <unordered_map>
#include <unordered_set>

#include "takt/error.h"
#include "takt/recording/csv_log.h"
#include "takt/recording/files.h"
#include "takt/recording/picture.h"
#include "takt/recording/text_table.h"
#include "takt/recording/units.h"
#include "takt/recording/yaml_fields.h"

namespace fs = std::filesystem;

namespace takt {

namespace {

const char* const shared_clock = "mav0";  // the format gives all sensors of a recording one time base

fs::path root_of(const fs::path& path) {
  std::error_code failed;
  return fs::is_directory(path / "mav0", failed) ? path / "mav0" : path;
}

/// Folders `<kind>0`, `<kind>1`, ... by number.
std::vector<fs::path> sensors(const fs::path& root, const std::string& kind) {
  std::vector<std::pair<unsigned long, fs::path>> found;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(root, failed)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kind) || name.size() > kind.size() + 6) continue;
    const std::string number = name.substr(kind.size());
    if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos) continue;
    if (fs::is_directory(entry.path(), failed)) found.emplace_back(std::stoul(number), entry.path());
  }
  std::sort(found.begin(), found.end());
  std::vector<fs::path> out;
  for (auto& [number, folder] : found) out.push_back(std::move(folder));
  return out;
}

/// Whether one of the folders holds a data.csv.
bool any_data(const std::vector<fs::path>& folders) {
  std::error_code failed;
  return std::any_of(folders.begin(), folders.end(),
                     [&](const fs::path& folder) { return fs::exists(folder / "data.csv", failed); });
}

/// The file's text, entered in `files`; empty where there is none.
std::string read_if_there(const fs::path& file, std::vector<std::string>& files) {
  std::error_code failed;
  if (!fs::exists(file, failed)) return {};
  files.push_back(file.string());
  return read_file(file.string());
}

Shutter shutter(const YamlFields& sensor) {
  const auto kind = sensor.text("shutter");
  if (!kind) return Shutter::unknown;
  if (*kind == "global") return Shutter::global;
  if (*kind != "rolling") sensor.fail("shutter", fmt::format("is '{}', not global or rolling", *kind));
  return Shutter::rolling;
}

void read_camera_sensor(CameraStream& camera, const YamlFields& sensor, std::vector<std::string>& notes) {
  camera.T_body_cam = sensor.transform("T_BS");
  std::string note;
  camera.model = camera_model(sensor, note);
  if (!note.empty()) notes.push_back(camera.name + ": " + note);
  const auto instant = exposure_instant(sensor);
  if (!instant)
    notes.push_back(camera.name + ": no key 'stamp' in its sensor.yaml; stamps taken as the middle of the exposure");
  camera.timing.instant = instant.value_or(ExposureInstant::middle);
  camera.timing.shutter = shutter(sensor);
  camera.timing.exposure_s = duration_s(sensor, "exposure_s");
  camera.timing.readout_s = duration_s(sensor, "readout_s");
  if (camera.model) camera.timing.rows = camera.model->height;
}

/// TUM-VI: `t_ns,exposure_ns` for the frames of one camera. Frames without a row keep exposure 0, "unknown".
std::vector<double> read_exposures(std::string_view text, const std::string& where, const std::vector<Stamp>& stamps) {
  std::unordered_map<std::int64_t, double> exposure_at;
  TableRows rows(text, where);
  if (rows.shape().columns < 2) throw Error("has 1 column; t_ns,exposure_ns expected", where, "export it again");
  while (rows.next()) {
    const double exposure_s = rows.number(1) * 1e-9;
    if (!(exposure_s >= 0 && exposure_s < 60))
      throw Error("exposure is not in nanoseconds", rows.place(), "0 to 6e10 expected");
    exposure_at[rows.time_ns(0, 0)] = exposure_s;
  }
  std::vector<double> exposures_s(stamps.size(), 0.0);
  for (std::size_t i = 0; i < stamps.size(); ++i)
    if (const auto found = exposure_at.find(to_ns(stamps[i])); found != exposure_at.end())
      exposures_s[i] = found->second;
  return exposures_s;
}

std::vector<PictureFile> read_frame_list(std::string_view text, const fs::path& folder, CameraStream& camera) {
  const std::string where = (folder / "data.csv").string();
  TableRows rows(text, where);
  if (rows.shape().columns < 2) throw Error("has 1 column; t_ns,filename expected", where, "list the pictures' names");
  std::vector<PictureFile> pictures;
  while (rows.next()) {
    const Stamp stamp = from_ns(rows.time_ns(0, 0));
    pictures.push_back({camera.stamps.size(), stamp, 0, (folder / "data" / rows.cell(1)).string()});
    camera.stamps.push_back(stamp);
  }
  return pictures;
}

/// One look at the folder instead of one a picture.
std::size_t missing_pictures(const std::vector<PictureFile>& pictures, const fs::path& folder) {
  std::unordered_set<std::string> there;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder / "data", failed)) there.insert(entry.path().string());
  return static_cast<std::size_t>(
      std::count_if(pictures.begin(), pictures.end(), [&](const PictureFile& p) { return !there.contains(p.path); }));
}

}  // namespace

bool looks_like_asl(const std::string& path) {
  const fs::path root = root_of(path);
  return any_data(sensors(root, "cam")) || any_data(sensors(root, "imu")) || root.filename() == "mav0";
}

ImuStream read_asl_imu(std::string_view data_csv, std::string_view sensor_yaml, const std::string& name,
                       const std::string& folder, std::vector<std::string>& notes) {
  ImuStream imu = read_imu_table(data_csv, (fs::path(folder) / "data.csv").string());
  imu.name = name;
  imu.clock = shared_clock;
  if (sensor_yaml.empty()) {
    notes.push_back(name + ": no sensor.yaml, so its noise and mounting are unknown");
    return imu;
  }
  const YamlFields sensor(sensor_yaml, (fs::path(folder) / "sensor.yaml").string());
  imu.T_body_imu = sensor.transform("T_BS");
  imu.temperature_c = sensor.number("temperature_c");
  if (sensor.has("gyroscope_noise_density"))
    imu.noise = ImuNoise{.gyro_density = sensor.number("gyroscope_noise_density").value_or(0),
                         .gyro_random_walk = sensor.number("gyroscope_random_walk").value_or(0),
                         .accel_density = sensor.number("accelerometer_noise_density").value_or(0),
                         .accel_random_walk = sensor.number("accelerometer_random_walk").value_or(0)};
  return imu;
}

CameraStream read_asl_camera(const AslCameraFiles& files, const std::string& name, const std::string& folder,
                             std::vector<std::string>& notes) {
  CameraStream camera;
  camera.name = name;
  camera.clock = shared_clock;
  auto pictures = read_frame_list(files.data_csv, folder, camera);
  if (files.sensor_yaml.empty())
    notes.push_back(name + ": no sensor.yaml, so intrinsics, exposure and mounting are unknown");
  else
    read_camera_sensor(camera, YamlFields(files.sensor_yaml, (fs::path(folder) / "sensor.yaml").string()), notes);
  if (!files.exposure_csv.empty()) {
    camera.exposures_s =
        read_exposures(files.exposure_csv, (fs::path(folder) / "exposure.csv").string(), camera.stamps);
    const auto unknown = std::count(camera.exposures_s.begin(), camera.exposures_s.end(), 0.0);
    if (unknown > 0)
      notes.push_back(
          fmt::format("{}: {} of {} frames have no exposure in exposure.csv", name, unknown, camera.size()));
  }
  for (PictureFile& p : pictures)
    p.exposure_s = camera.exposures_s.empty() ? camera.timing.exposure_s : camera.exposures_s[p.index];
  if (const std::size_t missing = missing_pictures(pictures, folder); missing > 0)
    notes.push_back(fmt::format("{}: {} of {} pictures are missing", name, missing, camera.size()));
  camera.open = [shared = std::make_shared<const std::vector<PictureFile>>(std::move(pictures))] {
    return read_pictures(shared);
  };
  return camera;
}

namespace {

/// The format fixes both units. Rates in degrees are a common mistake, though, that one option mends.
void apply_units(ImuStream& imu, const OpenOptions& options, std::vector<std::string>& notes) {
  if (options.rate_unit != RateUnit::automatic)
    notes.push_back(imu.name + ": " + to_rad_per_s(imu.gyro_rad_s, "", options.rate_unit));
}

void check_time_unit(const OpenOptions& options, const std::string& where) {
  if (options.time_unit != TimeUnit::automatic && options.time_unit != TimeUnit::ns)
    throw Error("the stamps of an ASL folder are nanoseconds, whatever --time-unit says", where,
                "leave it out, or write the stamps in nanoseconds");
}

ImuStream read_imu_folder(const fs::path& folder, const OpenOptions& options, Recording& recording) {
  const std::string file = (folder / "data.csv").string(), name = folder.filename().string();
  const std::string data = read_file(file);
  recording.files.push_back(file);
  const std::string sensor = read_if_there(folder / "sensor.yaml", recording.files);
  ImuStream imu = read_asl_imu(data, sensor, name, folder.string(), recording.notes);
  apply_units(imu, options, recording.notes);
  return imu;
}

/// Folders with a data.csv; of the others it is said that they were left out.
std::vector<fs::path> with_data(const std::vector<fs::path>& folders, std::vector<std::string>& notes) {
  std::vector<fs::path> out;
  for (const fs::path& folder : folders)
    if (any_data({folder}))
      out.push_back(folder);
    else
      notes.push_back(folder.filename().string() + ": has no data.csv and was left out");
  return out;
}

/// Each on its own, so that one that cannot be read does not silence the others.
void read_imus_that_can_be(const std::vector<fs::path>& folders, const OpenOptions& options, Recording& recording,
                           std::vector<UnreadableStream>& unreadable) {
  for (const fs::path& folder : folders) try {
      recording.imus.push_back(read_imu_folder(folder, options, recording));
    } catch (const Error& e) {
      unreadable.push_back({folder.filename().string(), e});
    }
  if (!unreadable.empty() && recording.imus.empty()) throw unreadable.front().why;
}

void read_cameras(const std::vector<fs::path>& folders, Recording& recording) {
  for (const fs::path& folder : with_data(folders, recording.notes)) {
    const std::string file = (folder / "data.csv").string(), name = folder.filename().string();
    const std::string data = read_file(file);
    recording.files.push_back(file);
    const std::string sensor = read_if_there(folder / "sensor.yaml", recording.files);
    const std::string exposure = read_if_there(folder / "exposure.csv", recording.files);
    recording.cameras.push_back(read_asl_camera({data, sensor, exposure}, name, folder.string(), recording.notes));
  }
}

struct SensorFolders {
  std::vector<fs::path> imus, cameras;
};
SensorFolders sensor_folders(const std::string& path, const OpenOptions& options) {
  check_time_unit(options, path);
  const fs::path root = root_of(path);
  SensorFolders found{sensors(root, "imu"), sensors(root, "cam")};
  if (found.imus.empty() && found.cameras.empty())
    throw Error("has neither an imu0 nor a cam0 in it", root.string(), "copy the recording again, whole");
  return found;
}

}  // namespace

Recording read_asl(const std::string& path, const OpenOptions& options) {
  const SensorFolders folders = sensor_folders(path, options);
  Recording recording;
  for (const fs::path& folder : with_data(folders.imus, recording.notes))
    recording.imus.push_back(read_imu_folder(folder, options, recording));
  read_cameras(folders.cameras, recording);
  return recording;
}

Recording read_asl_in_part(const std::string& path, const OpenOptions& options,
                           std::vector<UnreadableStream>& unreadable) {
  const SensorFolders folders = sensor_folders(path, options);
  Recording recording;
  read_imus_that_can_be(folders.imus, options, recording, unreadable);
  read_cameras(folders.cameras, recording);
  return recording;
}

}  // namespace takt
