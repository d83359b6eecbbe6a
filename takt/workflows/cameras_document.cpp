// SPDX-License-Identifier: Apache-2.0
// docs/formats/result.md, "Cameras alone": from CalibratedCameras to its document.
#include "takt/calibration/provenance_tree.h"
#include "takt/workflows/calibrate_cameras.h"

namespace takt {

namespace {

using tree::Node;

Node texts(const std::vector<std::string>& list) {
  Node out = tree::list();
  for (const std::string& s : list) out.add(tree::text(s));
  return out;
}

Node numbers(const Eigen::Ref<const Eigen::VectorXd>& values) {
  Node out = tree::list();
  for (const double v : values) out.add(tree::number(v));
  return out;
}

Node count(std::size_t n) {
  return tree::integer(static_cast<std::uint64_t>(n));
}

Node intrinsics(const CameraModel& model, const Intrinsics* sigma) {
  const Intrinsics values = intrinsics_of(model);
  const std::vector<std::string> names = intrinsic_names(model);
  Node out = tree::object();
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    out.add(names[k], tree::object()
                          .add("value", tree::number(values[at]))
                          .add("sigma", sigma ? tree::number((*sigma)[at]) : Node{}));
  }
  return out;
}

Node pair(const std::optional<batch::CameraPair>& p) {
  if (!p) return {};
  const Mat4 T = p->T_cn_cnm1.matrix();
  Node rows = tree::list();
  for (int r = 0; r < 4; ++r) rows.add(numbers(Eigen::VectorXd(T.row(r).transpose())));
  return std::move(tree::object()
                       .add("T", std::move(rows))
                       .add("translation_sigma_m", numbers(Eigen::VectorXd(p->sigma.head<3>())))
                       .add("rotation_sigma_rad", numbers(Eigen::VectorXd(p->sigma.tail<3>())))
                       .add("frames", count(p->frames)));
}

Node camera(const CameraAnswer& c) {
  const bool refused = c.found.verdict == Verdict::refused;
  Node resolution = tree::list();
  resolution.add(tree::integer(std::int64_t{c.found.model.width}));
  resolution.add(tree::integer(std::int64_t{c.found.model.height}));
  const auto unless_refused = [&](double v) { return refused ? Node{} : tree::number(v); };
  Node out = tree::object();
  out.add("name", tree::text(c.name)).add("lens", tree::text(c.lens));
  out.add("verdict", tree::text(to_string(c.found.verdict))).add("reasons", texts(c.found.reasons));
  out.add("resolution", refused ? Node{} : std::move(resolution));
  out.add("intrinsics", refused ? Node{} : intrinsics(c.found.model, &c.found.sigma));
  out.add("twin", refused || !c.found.twin ? Node{} : intrinsics(*c.found.twin, nullptr));
  out.add("to_camera_before", pair(c.to_before));
  out.add("rms_px", unless_refused(c.found.rms_px));
  out.add("corner_noise_px", unless_refused(c.found.corner_sigma_px));
  out.add("systematic_px", unless_refused(c.found.systematic_px));
  out.add("frames", count(c.found.frames)).add("corners", count(c.found.corners));
  out.add("corners_left_out", count(c.found.strays));
  out.add("covered_width", unless_refused(c.found.covered_width));
  out.add("covered_height", unless_refused(c.found.covered_height));
  out.add("largest_tilt_rad", unless_refused(c.found.largest_tilt_rad));
  return out;
}

Node document(const CalibratedCameras& result) {
  Node cameras = tree::list();
  for (const CameraAnswer& c : result.cameras) cameras.add(camera(c));
  Node out = tree::object();
  out.add("schema", tree::text("takt/1-cameras"));
  out.add("verdict", tree::text(to_string(result.verdict))).add("reasons", texts(result.reasons));
  out.add("cameras", std::move(cameras)).add("notes", texts(result.notes));
  return std::move(out.add("provenance", tree::provenance(result.provenance)));
}

}  // namespace

std::string to_json(const CalibratedCameras& result) {
  return tree::to_json(document(result));
}

std::string to_yaml(const CalibratedCameras& result) {
  return tree::to_yaml(document(result));
}

}  // namespace takt
