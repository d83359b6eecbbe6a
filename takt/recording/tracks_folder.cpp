// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/tracks_folder.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <unordered_map>

#include "takt/error.h"
#include "takt/recording/csv_log.h"
#include "takt/recording/files.h"
#include "takt/recording/text_table.h"
#include "takt/recording/yaml_fields.h"

namespace fs = std::filesystem;

namespace takt {

namespace {

const char* const tracks_ending = "_tracks.csv";
const char* const shared_clock = "tracks";

/// Files of `folder` named `<kind>` + digits + `ending`, by name.
std::vector<fs::path> numbered_files(const fs::path& folder, const std::string& kind, const std::string& ending) {
  std::vector<fs::path> found;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kind) || !name.ends_with(ending) || name.size() <= kind.size() + ending.size()) continue;
    const std::string number = name.substr(kind.size(), name.size() - kind.size() - ending.size());
    if (number.find_first_not_of("0123456789") == std::string::npos) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// Rows -> one list of features a frame. Rows of a frame stand together, as the format writes them.
void read_rows(std::string_view text, const std::string& where, TrackStream& tracks) {
  TableRows rows(text, where);
  if (rows.shape().columns < 4)
    throw Error(fmt::format("has {} columns; t_ns,feature_id,u_px,v_px expected", rows.shape().columns), where,
                "export the tracks again");
  while (rows.next()) {
    const Stamp stamp = from_ns(rows.time_ns(0, 0));
    const TrackedFeature feature{rows.time_ns(1, 0), {rows.number(2), rows.number(3)}};
    if (tracks.stamps.empty() || tracks.stamps.back() != stamp) {
      tracks.stamps.push_back(stamp);
      tracks.features.emplace_back();
    }
    tracks.features.back().push_back(feature);
  }
}

/// Gives a new id to every feature that was not in the frame before but was seen earlier, and sorts each frame by id.
/// Says how often. A feature listed twice in one frame is an error: one landmark has one place.
std::size_t split_at_gaps(TrackStream& tracks, const std::string& where) {
  struct Track {
    std::size_t last_frame;
    std::int64_t id;
  };
  std::unordered_map<std::int64_t, Track> seen;
  std::int64_t next_id = 0;
  for (const auto& frame : tracks.features)
    for (const TrackedFeature& f : frame) next_id = std::max(next_id, f.id);
  if (next_id > std::numeric_limits<std::int64_t>::max() / 2)
    throw Error(fmt::format("feature id {} is out of range", next_id), where, "use ids that count from 0");

  std::size_t splits = 0;
  for (std::size_t frame = 0; frame < tracks.features.size(); ++frame) {
    for (TrackedFeature& f : tracks.features[frame]) {
      const auto [known, is_new] = seen.try_emplace(f.id, Track{frame, f.id});
      Track& track = known->second;
      if (!is_new && track.last_frame == frame)
        throw Error(fmt::format("feature {} is listed twice at t_ns {}", f.id, to_ns(tracks.stamps[frame])), where,
                    "keep one row for each feature and frame");
      if (!is_new && track.last_frame + 1 != frame) {
        track.id = ++next_id;
        ++splits;
      }
      track.last_frame = frame;
      f.id = track.id;
    }
    std::sort(tracks.features[frame].begin(), tracks.features[frame].end(),
              [](const TrackedFeature& a, const TrackedFeature& b) { return a.id < b.id; });
  }
  return splits;
}

void read_calibration(const YamlFields& calib, TrackStream& tracks, std::vector<std::string>& notes) {
  const YamlFields fields = calib.under(tracks.name);
  std::string note;
  const auto model = camera_model(fields, note);
  if (!note.empty()) notes.push_back(tracks.name + ": " + note);
  if (model) tracks.model = *model;
  tracks.pixel_sigma = fields.number("pixel_noise_sigma");
  if (tracks.pixel_sigma && !(*tracks.pixel_sigma > 0)) fields.fail("pixel_noise_sigma", "is not positive");
  tracks.T_body_cam = fields.transform("T_imu_cam");
  tracks.timing.rows = tracks.model.height;
  tracks.timing.instant = exposure_instant(fields).value_or(ExposureInstant::middle);
  tracks.timing.exposure_s = duration_s(fields, "exposure_s");
  const double line_delay_s = fields.number("rolling_shutter_line_delay_s").value_or(0);
  if (!(line_delay_s >= 0 && line_delay_s < 1))
    fields.fail("rolling_shutter_line_delay_s", "is not a delay in seconds");
  if (fields.has("rolling_shutter_line_delay_s"))
    tracks.timing.shutter = line_delay_s > 0 ? Shutter::rolling : Shutter::global;
  tracks.timing.readout_s = line_delay_s * tracks.timing.rows;
}

std::optional<ImuNoise> imu_noise(const YamlFields& calib, const std::string& name) {
  const YamlFields fields = calib.under(calib.has(name) ? name : "imu");
  if (!fields.has("gyro_noise_density")) return std::nullopt;
  return ImuNoise{.gyro_density = fields.number("gyro_noise_density").value_or(0),
                  .gyro_random_walk = fields.number("gyro_random_walk").value_or(0),
                  .accel_density = fields.number("accel_noise_density").value_or(0),
                  .accel_random_walk = fields.number("accel_random_walk").value_or(0)};
}

}  // namespace

bool looks_like_tracks_folder(const std::string& path) {
  return !numbered_files(path, "cam", tracks_ending).empty();
}

TrackStream read_tracks(std::string_view tracks_csv, std::string_view calib_yaml, const std::string& name,
                        const std::string& folder, std::vector<std::string>& notes) {
  const std::string where = (fs::path(folder) / (name + tracks_ending)).string();
  TrackStream tracks;
  tracks.name = name;
  tracks.clock = shared_clock;
  read_rows(tracks_csv, where, tracks);
  const std::size_t splits = split_at_gaps(tracks, where);
  if (splits > 0)
    notes.push_back(fmt::format("{}: {} tracks that had a gap were split: the rest has a new id", name, splits));
  if (!calib_yaml.empty())
    read_calibration(YamlFields(calib_yaml, (fs::path(folder) / "calib.yaml").string()), tracks, notes);
  if (!(tracks.model.fx > 0)) notes.push_back(name + ": no intrinsics in calib.yaml");
  return tracks;
}

Recording read_tracks_folder(const std::string& path, const OpenOptions&) {
  const fs::path folder(path);
  Recording recording;
  std::string calib;
  std::error_code failed;
  if (fs::exists(folder / "calib.yaml", failed)) {
    recording.files.push_back((folder / "calib.yaml").string());
    calib = read_file(recording.files.back());
  }
  for (const fs::path& file : numbered_files(folder, "imu", ".csv")) {
    recording.files.push_back(file.string());
    ImuStream imu = read_imu_table(read_file(file.string()), file.string());
    imu.name = file.stem().string();
    imu.clock = shared_clock;
    if (!calib.empty()) imu.noise = imu_noise(YamlFields(calib, (folder / "calib.yaml").string()), imu.name);
    if (recording.imus.empty()) imu.T_body_imu = Mat4::Identity();  // T_imu_cam makes the first IMU the body
    recording.imus.push_back(std::move(imu));
  }
  for (const fs::path& file : numbered_files(folder, "cam", tracks_ending)) {
    recording.files.push_back(file.string());
    const std::string name = file.filename().string().substr(0, file.filename().string().find('_'));
    recording.tracks.push_back(read_tracks(read_file(file.string()), calib, name, path, recording.notes));
  }
  return recording;
}

Recording read_rig(std::string_view calib_yaml, const std::string& where) {
  Recording rig;
  rig.path = where;
  const YamlFields calib(calib_yaml, where);
  ImuStream imu;
  imu.name = "imu0";
  imu.clock = shared_clock;
  imu.noise = imu_noise(calib, imu.name);
  imu.T_body_imu = Mat4::Identity();
  rig.imus.push_back(std::move(imu));
  for (int n = 0; n < 16; ++n) {
    TrackStream tracks;
    tracks.name = fmt::format("cam{}", n);
    tracks.clock = shared_clock;
    if (!calib.has(tracks.name)) continue;
    read_calibration(calib, tracks, rig.notes);
    rig.tracks.push_back(std::move(tracks));
  }
  if (rig.tracks.empty()) throw Error("has no section cam0", where, "see docs/formats/stream.md");
  return rig;
}

}  // namespace takt
