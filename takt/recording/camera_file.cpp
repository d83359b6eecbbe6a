// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/camera_file.h"

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/yaml_fields.h"

namespace takt {

namespace {

/// Which camera of a chain it is: by its key, which may be a part of its topic, or by its topic in the chain; the only
/// one is meant whatever it is called.
std::string key_in_chain(const YamlFields& chain, const std::string& camera, const std::string& path) {
  if (chain.has(camera)) return camera;
  if (!chain.has("cam1")) return "cam0";
  std::string all;
  for (int i = 0; chain.has("cam" + std::to_string(i)); ++i) {
    const std::string key = "cam" + std::to_string(i), topic = chain.under(key).text("rostopic").value_or("");
    if ((!topic.empty() && camera.starts_with(topic)) ||
        ("/" + camera + "/").find("/" + key + "/") != std::string::npos)
      return key;
    all += (all.empty() ? "" : ", ") + key + (topic.empty() ? "" : " (" + topic + ")");
  }
  throw Error("has several cameras and none is called " + camera, path, "it has: " + all);
}

}  // namespace

CameraModel read_camera_file(const std::string& path, const std::string& camera) {
  const YamlFields file(read_file(path), path);
  std::string note;
  const auto model = file.has("intrinsics") ? camera_model(file, note)
                                            : camera_model(file.under(key_in_chain(file, camera, path)), note);
  if (!model)
    throw Error(note.empty() ? "no intrinsics in it" : note, path,
                "give an ASL sensor.yaml or a Kalibr camchain with intrinsics, resolution and distortion");
  return *model;
}

}  // namespace takt
