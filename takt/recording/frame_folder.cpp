// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/frame_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <map>

#include "takt/error.h"
#include "takt/math/median.h"
#include "takt/recording/files.h"
#include "takt/recording/picture.h"
#include "takt/recording/text_table.h"

namespace takt {

namespace fs = std::filesystem;

namespace {

constexpr int seconds_to_ns = 9;
const char* const phone_clock = "phone";

/// By number; `frames/` if it is there, else the folder itself.
std::map<std::int64_t, std::string> numbered_pictures(const fs::path& folder) {
  std::error_code failed;
  const fs::path where = fs::is_directory(folder / "frames", failed) ? folder / "frames" : folder;
  std::map<std::int64_t, std::string> pictures;
  for (const auto& entry : fs::directory_iterator(where, failed))
    if (is_picture_file(entry.path()))
      if (const auto number = number_in(entry.path().stem().string())) pictures[*number] = entry.path().string();
  return pictures;
}

std::vector<Stamp> read_stamps(const std::string& path) {
  const std::string text = read_file(path);
  std::vector<Stamp> stamps;
  for (TableRows rows(text, path); rows.next();) {
    const std::int64_t ns = rows.time_ns(0, seconds_to_ns);
    if (std::abs(ns) > 4'000'000'000'000'000'000)
      throw Error("stamp is no time in seconds", rows.place(), "check the list");
    stamps.push_back(from_ns(ns));
  }
  return stamps;
}

ImuStream read_gyro(const std::string& path) {
  const std::string text = read_file(path);
  TableRows rows(text, path);
  if (rows.shape().columns != 4)
    throw Error(fmt::format("has {} columns; x,y,z,t expected", rows.shape().columns), path,
                "export the gyro log again");
  ImuStream imu;
  imu.name = "imu0";
  imu.clock = phone_clock;
  while (rows.next()) {
    imu.gyro_rad_s.emplace_back(rows.number(0), rows.number(1), rows.number(2));
    imu.stamps.push_back(from_ns(rows.time_ns(3, seconds_to_ns)));
  }
  return imu;
}

/// Whether the recorder's own frame numbers count the stamps of the list from 1, on every frame that both have.
bool log_counts_from_one(const std::unordered_map<std::int64_t, LoggedFrame>& log, const std::vector<Stamp>& stamps) {
  std::size_t agree = 0;
  for (const auto& [number, frame] : log) {
    if (number < 1 || number > static_cast<std::int64_t>(stamps.size())) continue;
    if (std::abs((frame.start - stamps[static_cast<std::size_t>(number - 1)]).count()) > 1000) return false;
    ++agree;
  }
  return agree > 0;
}

void say_pairing(const std::vector<Stamp>& stamps, int shift, bool log_agrees, std::vector<std::string>& notes) {
  std::string note =
      shift == 0 ? std::string("picture N is paired with the N-th stamp of the list, counted from 1")
                 : fmt::format("picture N is paired with stamp N{:+d} of the list, counted from 1, as asked", shift);
  note += log_agrees ? "; the recorder's log numbers its frames the same way" : "; nothing in the folder confirms it";
  if (stamps.size() > 1) {
    std::vector<std::int64_t> steps;
    for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back((stamps[i] - stamps[i - 1]).count());
    note += fmt::format(". One more or less moves the offset by {:.1f} ms (frame shift)",
                        static_cast<double>(median(std::move(steps))) * 1e-6);
  }
  notes.push_back(note);
}

}  // namespace

std::optional<std::int64_t> number_in(std::string_view stem) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t end = stem.size();
  while (end > 0 && !is_digit(stem[end - 1])) --end;
  std::size_t begin = end;
  while (begin > 0 && is_digit(stem[begin - 1])) --begin;
  std::int64_t number = 0;
  const auto [stop, failed] = std::from_chars(stem.data() + begin, stem.data() + end, number);
  if (begin == end || failed != std::errc{}) return std::nullopt;
  return number;
}

std::unordered_map<std::int64_t, LoggedFrame> read_frame_log(std::string_view text) {
  std::unordered_map<std::int64_t, LoggedFrame> frames;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string line(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    long long start_us = 0, number = 0;
    double exposure_s = 0;
    if (!line.starts_with("SOF")) continue;
    if (std::sscanf(line.c_str(), "SOF %lld , frameNum : %lld exp time %lf", &start_us, &number, &exposure_s) != 3)
      continue;
    if (std::abs(start_us) > 9'000'000'000'000'000 || !(exposure_s >= 0 && exposure_s < 60)) continue;
    frames[number] = {from_ns(start_us * 1000), exposure_s};
  }
  return frames;
}

bool looks_like_frame_folder(const std::string& path) {
  std::error_code failed;
  return fs::is_regular_file(fs::path(path) / "framestamp.txt", failed) &&
         fs::is_regular_file(fs::path(path) / "gyro.txt", failed);
}

Recording read_frame_folder(const std::string& path, const OpenOptions& options) {
  const fs::path folder(path);
  const std::string stamp_file = (folder / "framestamp.txt").string(), gyro_file = (folder / "gyro.txt").string(),
                    log_file = (folder / "gyro_dump.txt").string();
  const std::vector<Stamp> stamps = read_stamps(stamp_file);
  const std::map<std::int64_t, std::string> pictures = numbered_pictures(folder);
  if (pictures.empty()) throw Error("holds no numbered pictures", path, "put them into its folder frames/");

  Recording recording;
  recording.files = {stamp_file, gyro_file};
  recording.imus.push_back(read_gyro(gyro_file));
  recording.notes.push_back("gyro.txt: rates taken as rad/s, stamps as seconds of the phone's clock");
  std::unordered_map<std::int64_t, LoggedFrame> log;
  std::error_code failed;
  if (fs::is_regular_file(log_file, failed)) {
    log = read_frame_log(read_file(log_file));
    recording.files.push_back(log_file);
  }
  const bool log_agrees = log_counts_from_one(log, stamps);
  say_pairing(stamps, options.frame_shift, log_agrees, recording.notes);

  CameraStream camera;
  camera.name = "cam0";
  camera.clock = phone_clock;
  auto files = std::make_shared<std::vector<PictureFile>>();
  std::size_t without_stamp = 0;
  for (const auto& [number, file] : pictures) {
    const std::int64_t place = number + options.frame_shift;  // from 1
    if (place < 1 || place > static_cast<std::int64_t>(stamps.size())) {
      ++without_stamp;
      continue;
    }
    const Stamp stamp = stamps[static_cast<std::size_t>(place - 1)];
    const auto logged = log_agrees ? log.find(place) : log.end();
    const double exposure_s = logged == log.end() ? 0 : logged->second.exposure_s;
    files->push_back({camera.stamps.size(), stamp, exposure_s, file});
    camera.stamps.push_back(stamp);
    camera.exposures_s.push_back(exposure_s);
  }
  if (files->empty())
    throw Error(fmt::format("none of the {} pictures has a stamp among the {} of framestamp.txt", pictures.size(),
                            stamps.size()),
                path, "check the numbers in the pictures' names, or the frame shift");
  if (without_stamp > 0)
    recording.notes.push_back(
        fmt::format("{} of {} pictures have no stamp and are left out", without_stamp, pictures.size()));
  if (!log_agrees) camera.exposures_s.clear();

  // The log calls the stamp the start of the frame; without it the phone's interface means the same.
  camera.timing.instant = ExposureInstant::start;
  camera.timing.row = RowReference::first;
  camera.timing.shutter = Shutter::rolling;
  camera.timing.rows = read_picture(files->front().path).height;
  recording.notes.push_back(
      "a frame's stamp is the start of the exposure of its first row; the shutter is rolling, its readout is not "
      "given");
  camera.open = [files = std::shared_ptr<const std::vector<PictureFile>>(files)] { return read_pictures(files); };
  recording.cameras.push_back(std::move(camera));
  return recording;
}

}  // namespace takt
