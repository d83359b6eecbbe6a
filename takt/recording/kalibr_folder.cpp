// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kalibr_folder.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "takt/error.h"
#include "takt/recording/csv_log.h"
#include "takt/recording/files.h"
#include "takt/recording/picture.h"

namespace fs = std::filesystem;

namespace takt {

namespace {

const char* const shared_clock = "folder";  // one time base for all

/// "cam0", "cam12": a name and a number.
bool is_numbered(const std::string& name, const std::string& kind) {
  return name.starts_with(kind) && name.size() > kind.size() && name.size() < kind.size() + 4 &&
         name.find_first_not_of("0123456789", kind.size()) == std::string::npos;
}

bool any_stamped(const fs::path& folder) {
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed))
    if (is_picture_file(entry.path()) && stamp_in_name(entry.path())) return true;
  return false;
}

/// Those of a kind, by number.
std::vector<fs::path> numbered(const fs::path& root, const std::string& kind, bool folders) {
  std::vector<std::pair<int, fs::path>> found;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(root, failed)) {
    const std::string name = folders ? entry.path().filename().string() : entry.path().stem().string();
    if (!is_numbered(name, kind) || entry.is_directory(failed) != folders) continue;
    if (!folders && entry.path().extension() != ".csv") continue;
    found.emplace_back(std::stoi(name.substr(kind.size())), entry.path());
  }
  std::sort(found.begin(), found.end());
  std::vector<fs::path> out;
  for (auto& [number, path] : found) out.push_back(std::move(path));
  return out;
}

void give_pictures(CameraStream& camera, std::vector<PictureFile> files) {
  for (const PictureFile& f : files) camera.stamps.push_back(f.stamp);
  camera.open = [shared = std::make_shared<const std::vector<PictureFile>>(std::move(files))] {
    return read_pictures(shared);
  };
}

CameraStream read_camera(const fs::path& folder, std::vector<std::string>& notes) {
  CameraStream camera;
  camera.name = folder.filename().string();
  camera.clock = shared_clock;
  std::vector<PictureFile> files;
  std::size_t nameless = 0;
  for (const fs::path& file : pictures_in(folder)) {
    if (const auto stamp = stamp_in_name(file))
      files.push_back({0, *stamp, 0, file.string()});
    else
      ++nameless;
  }
  if (nameless > 0)
    notes.push_back(fmt::format("{}: {} pictures have no stamp as their name and are left out", camera.name, nameless));
  std::stable_sort(files.begin(), files.end(),
                   [](const PictureFile& a, const PictureFile& b) { return a.stamp < b.stamp; });
  for (std::size_t i = 0; i < files.size(); ++i) files[i].index = i;
  give_pictures(camera, std::move(files));
  return camera;
}

}  // namespace

std::optional<Stamp> stamp_in_name(const fs::path& picture) {
  const std::string stem = picture.stem().string();
  std::int64_t ns = 0;
  const auto [end, failed] = std::from_chars(stem.data(), stem.data() + stem.size(), ns);
  if (failed != std::errc{} || end != stem.data() + stem.size() || ns < 0) return std::nullopt;
  return from_ns(ns);
}

std::vector<fs::path> pictures_in(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed))
    if (is_picture_file(entry.path())) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<fs::path> kalibr_cameras(const fs::path& root) {
  return numbered(root, "cam", true);
}
std::vector<fs::path> kalibr_imus(const fs::path& root) {
  return numbered(root, "imu", false);
}

bool looks_like_kalibr_folder(const std::string& path) {
  for (const fs::path& folder : kalibr_cameras(path))
    if (any_stamped(folder)) return true;
  return false;
}

ImuStream read_kalibr_imu(std::string_view text, const std::string& where) {
  ImuStream imu = read_imu_table(text, where);
  imu.name = fs::path(where).stem().string();
  imu.clock = shared_clock;
  return imu;
}

Recording read_kalibr_folder(const std::string& path, const OpenOptions&) {
  Recording recording;
  for (const fs::path& folder : kalibr_cameras(path)) {
    CameraStream camera = read_camera(folder, recording.notes);
    if (camera.size() == 0) continue;
    recording.files.push_back(folder.string());
    recording.cameras.push_back(std::move(camera));
  }
  if (recording.cameras.empty())
    throw Error("no picture has a stamp as its name", path, "name them <nanoseconds>.png in cam0/, cam1/ ...");
  for (const fs::path& file : kalibr_imus(path)) {
    recording.files.push_back(file.string());
    recording.imus.push_back(read_kalibr_imu(read_file(file.string()), file.string()));
  }
  recording.notes.push_back("stamps taken as the middle of the exposure");
  return recording;
}

bool looks_like_picture_folder(const std::string& path) {
  std::error_code failed;
  if (!fs::is_directory(path, failed)) return false;
  return std::any_of(fs::directory_iterator(path, failed), fs::directory_iterator(),
                     [](const auto& entry) { return is_picture_file(entry.path()); });
}

Recording read_picture_folder(const std::string& path, const OpenOptions&) {
  Recording recording;
  CameraStream camera;
  camera.name = "cam0";
  camera.clock = shared_clock;
  const std::vector<fs::path> pictures = pictures_in(path);
  const bool stamped = std::all_of(pictures.begin(), pictures.end(), [](const fs::path& p) {
    const auto stamp = stamp_in_name(p);
    return stamp && to_ns(*stamp) > 1'000'000'000;
  });
  std::vector<PictureFile> files;
  for (const fs::path& file : pictures) {
    const Stamp stamp =
        stamped ? *stamp_in_name(file) : from_ns(1'000'000'000LL * static_cast<std::int64_t>(files.size()));
    files.push_back({files.size(), stamp, 0, file.string()});
  }
  if (files.empty()) throw Error("holds no pictures", path, "give a folder with PNG or JPEG pictures");
  if (!stamped)
    recording.notes.push_back("the pictures' names are no stamps: one second is put between them, which means nothing");
  give_pictures(camera, std::move(files));
  recording.files.push_back(path);
  recording.cameras.push_back(std::move(camera));
  return recording;
}

}  // namespace takt
