// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/export.h"

#include "takt/error.h"
#include "takt/recording/camera_file.h"

namespace takt {

ExportOutcome export_result(const ExportJob& job) {
  const ExportFormat* const format = export_format(job.as);
  if (!format) throw Error("there is no export of that name", job.as, "see takt export --help");
  std::optional<CameraModel> model;
  if (!job.intrinsics.empty()) model = read_camera_file(job.intrinsics, job.result.sensor);
  const CameraToImu c = camera_to_imu(job.result, model);
  return {format->write(c), c.remarks};
}

std::vector<std::string> export_names() {
  std::vector<std::string> out;
  for (const ExportFormat& format : export_formats()) out.emplace_back(format.name);
  return out;
}

}  // namespace takt
