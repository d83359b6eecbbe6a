// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/dial_rig.h"

#include <fmt/core.h>

#include <numbers>
#include <stdexcept>

#include "takt/error.h"

namespace takt {
namespace {

constexpr double deg = std::numbers::pi / 180;

/// Nothing that is measured on such a rig is a hundred metres long.
double length_m(const YamlFields& rig, const std::string& key, double value) {
  if (value > 100) rig.fail(key, fmt::format("is {:g} m: is it in millimetres?", value));
  return value;
}

double needed(const YamlFields& rig, const std::string& key) {
  const auto value = rig.number(key);
  if (!value) rig.fail(key, "is missing: it is needed to read pictures of the dial");
  return length_m(rig, key, *value);
}

DialMethod method_named(const std::string& name, DialKind kind) {
  if (name.empty()) return kind == DialKind::coded ? DialMethod::coded : DialMethod::keyframes;
  if (name == "coded") return DialMethod::coded;
  if (name == "keyframes") return DialMethod::keyframes;
  if (name == "neighbours") return DialMethod::neighbours;
  throw std::invalid_argument("there is no way to read a dial called \"" + name +
                              "\"; there are coded, keyframes, neighbours");
}

}  // namespace

DialRig dial_rig(const YamlFields& rig, const CameraStream& camera, const std::string& method) {
  DialRig out;
  const std::string kind = rig.text("dial").value_or("coded");
  if (kind != "coded" && kind != "plain") rig.fail("dial", "is \"" + kind + "\", neither coded nor plain");
  Dial& d = out.dial;
  d.kind = kind == "coded" ? DialKind::coded : DialKind::plain;
  d.radius_m = needed(rig, "dial_radius_m");
  d.height_m = length_m(rig, "dial_height_m", rig.number("dial_height_m").value_or(d.height_m));
  d.graduation_deg = rig.number("graduation_deg").value_or(d.graduation_deg);
  d.line_deg = rig.number("line_deg").value_or(d.line_deg);
  d.cell_deg = rig.number("cell_deg").value_or(d.cell_deg);
  try {
    check(d);
  } catch (const std::invalid_argument& e) {
    rig.fail("dial", fmt::format("cannot be: {}", e.what()));
  }
  DialView& v = out.view;
  if (!camera.model)
    throw Error("its camera has no intrinsics", camera.name, "write resolution and intrinsics into its sensor.yaml");
  v.camera = *camera.model;
  v.radius_m = d.radius_m;
  v.pivot_distance_m = needed(rig, "camera_distance_m");
  if (!(v.pivot_distance_m >= 0 && v.pivot_distance_m < d.radius_m))
    rig.fail("camera_distance_m", "is not between 0 and dial_radius_m");
  v.roll_rad = rig.number("roll_deg").value_or(0) * deg;
  v.yaw_rad = rig.number("yaw_deg").value_or(0) * deg;
  v.pitch_rad = rig.number("pitch_deg").value_or(0) * deg;
  v.height_m = rig.number("camera_height_m").value_or(0);
  out.options.method = method_named(method, d.kind);
  if (const auto rest = rig.number("rest_reading_deg")) out.options.rest_reading_rad = *rest * deg;
  return out;
}

}  // namespace takt
