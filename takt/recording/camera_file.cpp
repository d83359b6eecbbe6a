// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/camera_file.h"

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/yaml_fields.h"

namespace takt {

CameraModel read_camera_file(const std::string& path, const std::string& camera) {
  const YamlFields file(read_file(path), path);
  const YamlFields fields = file.under(file.has(camera) ? camera : "cam0");
  std::string note;
  const auto model = camera_model(file.has("intrinsics") ? file : fields, note);
  if (!model)
    throw Error(note.empty() ? "no intrinsics in it" : note, path,
                "give an ASL sensor.yaml or a Kalibr camchain with intrinsics, resolution and distortion");
  return *model;
}

}  // namespace takt
