// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/live_lines.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace takt {

namespace {

using nlohmann::json;

/// A longer line is no sample (bytes); a picture has no more features than this.
constexpr std::size_t longest_line = 1 << 22;
constexpr std::size_t most_features = 100'000;

std::optional<std::int64_t> whole(const json& object, const char* field) {
  const auto at = object.find(field);
  if (at == object.end() || !at->is_number_integer()) return std::nullopt;
  if (at->is_number_unsigned() && at->get<std::uint64_t>() > 9'000'000'000'000'000'000u) return std::nullopt;
  return at->get<std::int64_t>();
}

std::optional<Vec3> three(const json& object, const char* field) {
  const auto at = object.find(field);
  if (at == object.end() || !at->is_array() || at->size() != 3) return std::nullopt;
  Vec3 out;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(*at)[i].is_number()) return std::nullopt;
    out[static_cast<Eigen::Index>(i)] = (*at)[i].get<double>();
  }
  return out;
}

std::optional<std::vector<TrackedFeature>> features(const json& object) {
  const auto at = object.find("features");
  if (at == object.end() || !at->is_array() || at->size() > most_features) return std::nullopt;
  std::vector<TrackedFeature> out;
  out.reserve(at->size());
  for (const json& f : *at) {
    if (!f.is_array() || f.size() != 3 || !f[0].is_number_integer() || !f[1].is_number() || !f[2].is_number())
      return std::nullopt;
    out.push_back({f[0].get<std::int64_t>(), {f[1].get<double>(), f[2].get<double>()}});
  }
  return out;
}

}  // namespace

std::optional<LiveSample> read_live_line(std::string_view line, std::string& why) {
  const auto refuse = [&why](const char* reason) {
    why = reason;
    return std::nullopt;
  };
  if (line.size() > longest_line) return refuse("is longer than 4 MiB");
  const json object = json::parse(line, nullptr, false);
  if (!object.is_object()) return refuse("is no JSON object");
  const auto t_ns = whole(object, "t_ns");
  if (!t_ns) return refuse("has no whole number t_ns");
  if (const auto imu = object.find("imu"); imu != object.end()) {
    const auto gyro = three(object, "gyro"), accel = three(object, "accel");
    if (!imu->is_string() || !gyro || !accel) return refuse("is an IMU sample without three gyro and three accel");
    return LiveImuSample{imu->get<std::string>(), from_ns(*t_ns), *gyro, *accel};
  }
  if (const auto camera = object.find("cam"); camera != object.end()) {
    auto seen = features(object);
    if (!camera->is_string() || !seen) return refuse("is a frame without features [[id, u, v], ...]");
    LiveFrame frame{camera->get<std::string>(), from_ns(*t_ns), 0, std::move(*seen)};
    if (const auto exposure = object.find("exposure_s"); exposure != object.end() && exposure->is_number())
      frame.exposure_s = std::clamp(exposure->get<double>(), 0.0, 10.0);
    return frame;
  }
  return refuse("has neither imu nor cam");
}

}  // namespace takt
