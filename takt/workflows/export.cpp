// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/export.h"

#include <fmt/core.h>

#include <algorithm>

#include "takt/error.h"
#include "takt/recording/camera_file.h"
#include "takt/streams/stream_name.h"

namespace takt {

namespace {

bool same_pair(const Estimate& a, const Estimate& b) {
  return a.sensor == b.sensor && (a.reference == b.reference || a.reference.empty() || b.reference.empty());
}

/// The result's own pair, then those of further sensors that stand in its estimates; not the other methods' answers.
std::vector<Estimate> pairs_of(const Estimate& result) {
  std::vector<Estimate> out{result};
  for (const Estimate& e : result.estimates) {
    const bool known =
        e.sensor.empty() || std::any_of(out.begin(), out.end(), [&](const Estimate& o) { return same_pair(o, e); });
    if (!known) out.push_back(e);
  }
  return out;
}

std::string names_of(const std::vector<Estimate>& pairs) {
  std::string all;
  for (const Estimate& e : pairs) all += (all.empty() ? "" : ", ") + e.sensor + " against " + e.reference;
  return all;
}

/// Moves the wanted pair out of `pairs`.
Estimate take_named(std::vector<Estimate>& pairs, const std::string& sensor) {
  const auto found = std::find_if(pairs.begin(), pairs.end(),
                                  [&](const Estimate& e) { return sensor.empty() || name_matches(sensor, e.sensor); });
  if (found == pairs.end()) throw Error("the result has no sensor of that name", sensor, "it has: " + names_of(pairs));
  if (!found->answered()) throw Error("the result has no answer for it", found->sensor, "choose another with --sensor");
  Estimate out = std::move(*found);
  pairs.erase(found);
  return out;
}

}  // namespace

ExportOutcome export_result(const ExportJob& job) {
  const ExportFormat* const format = export_format(job.as);
  if (!format) throw Error("there is no export of that name", job.as, "see takt export --help");
  std::vector<Estimate> pairs = pairs_of(job.result);
  const Estimate chosen = take_named(pairs, job.sensor);
  std::optional<CameraModel> model;
  if (!job.intrinsics.empty()) model = read_camera_file(job.intrinsics, camera_of(chosen));
  CameraToImu c = camera_to_imu(chosen, model);
  std::erase_if(pairs, of_two_imus);
  if (!pairs.empty())
    c.remarks.push_back(
        fmt::format("of {} only, not {}: each has an export of its own, by --sensor", chosen.sensor, names_of(pairs)));
  return {format->write(c), c.remarks};
}

std::vector<std::string> export_names() {
  std::vector<std::string> out;
  for (const ExportFormat& format : export_formats()) out.emplace_back(format.name);
  return out;
}

}  // namespace takt
