// SPDX-License-Identifier: Apache-2.0
// The corners' share of the spline model, and the jitter of their frames' stamps.
#include <algorithm>
#include <array>
#include <cmath>

#include "takt/estimators/batch/spline_model.h"

namespace takt::batch {

namespace {

/// Corners whose rows are read within this time share one evaluation of the motion (s).
constexpr double band_s = 1e-3;
constexpr int most_bands = 16;
using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;

/// Normal equations of a band's corners in (ξ, line delay).
struct BandNormals {
  Mat7 information = Mat7::Zero();
  Vec7 gradient = Vec7::Zero();
  double squares = 0;
  bool seen = true;
};

BandNormals band_normals(const CameraSession& camera, const RowBand& band, const Rigid& T_cam_board, const Vec6& rate,
                         double line_delay_s, bool rows_matter) {
  BandNormals out;
  if (!rows_matter) {
    PoseNormals n;
    out.seen = add_corners(camera.model(), camera.stream->board, band.corners, T_cam_board, n);
    out.information.topLeftCorner<6, 6>() = n.information;
    out.gradient.head<6>() = n.gradient;
    out.squares = n.squares;
    return out;
  }
  for (const CornerObservation& c : band.corners) {
    // The board moves on from the band's mean row to the corner's own.
    const double row = camera.row(c);
    const Rigid pose = moved(T_cam_board, (row - band.mean_row) * line_delay_s * rate);
    const Vec3 p = pose * camera.stream->board[static_cast<std::size_t>(c.corner)];
    const auto at = project_with_jacobians(camera.model(), p);
    if (!at) {
      out.seen = false;
      return out;
    }
    Eigen::Matrix<double, 2, 7> j;
    j.leftCols<3>() = at->to_point;
    j.middleCols<3>(3) = -at->to_point * hat(p);
    j.col(6) = row * (j.leftCols<6>() * rate);
    const Vec2 r = at->pixel - c.pixel;
    out.information.noalias() += j.transpose() * j;
    out.gradient.noalias() += j.transpose() * r;
    out.squares += r.squaredNorm();
  }
  return out;
}

/// Rows into bands of about equal time.
std::vector<RowBand> cut_bands(const CameraSession& camera, const std::vector<CornerObservation>& corners, int bands) {
  std::vector<RowBand> out(static_cast<std::size_t>(bands));
  const double height = std::max(1, camera.model().height);
  for (const CornerObservation& c : corners) {
    const int at = std::clamp(static_cast<int>(c.pixel.y() / height * bands), 0, bands - 1);
    RowBand& band = out[static_cast<std::size_t>(at)];
    band.corners.push_back(c);
    band.mean_row += camera.row(c);
  }
  std::erase_if(out, [](const RowBand& b) { return b.corners.empty(); });
  for (RowBand& b : out) b.mean_row /= static_cast<double>(b.corners.size());
  return out;
}

int bands_for(double line_delay_s, int rows) {
  return std::clamp(static_cast<int>(std::ceil(std::abs(line_delay_s) * rows / band_s)), 1, most_bands);
}

/// The pose of the camera before the board, and how ξ changes with each of what it depends on.
struct CameraPose {
  CameraPose(const Quat& R_board_imu, const Vec3& position, const Vec3& omega, const Vec3& velocity,
             const Rigid& T_imu_cam) {
    const Mat3 R_cam_imu = T_imu_cam.rotation.conjugate().toRotationMatrix();
    const Mat3 R_cam_board = R_cam_imu * R_board_imu.conjugate().toRotationMatrix();
    T_cam_board = (Rigid{R_board_imu, position} * T_imu_cam).inverse();
    to_rotation << R_cam_imu * hat(T_imu_cam.translation), -R_cam_imu;
    to_position << -R_cam_board, Mat3::Zero();
    to_translation << -R_cam_imu, Mat3::Zero();
    to_camera_rotation << Mat3::Zero(), -Mat3::Identity();
    rate = to_rotation * omega + to_position * velocity;
  }
  Rigid T_cam_board;
  Eigen::Matrix<double, 6, 3> to_rotation, to_position, to_camera_rotation, to_translation;
  Vec6 rate;
};

/// ξ's line of G: how (ξ, line delay) of one band moves with the unknowns of its frame.
struct FrameColumns {
  int first_knot, knots;                                  ///< control points that any of the frame's bands touches
  [[nodiscard]] int camera() const { return 6 * knots; }  ///< rotation, translation, offset, drift, line delay
  [[nodiscard]] int late() const { return camera() + 9; }
  [[nodiscard]] int size() const { return late() + 1; }
};

}  // namespace

void SplineModel::take_frames(const MotionStart& start) {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const CameraSession& camera = *cameras_[c];
    const double line_delay = calibration_.cameras[c].line_delay_s;
    const int bands = free_.line_delay[c] || line_delay != 0
                          ? bands_for(std::max(line_delay, free_.line_delay[c] ? 15e-3 / camera.model().height : 0.0),
                                      camera.model().height)
                          : 1;
    for (const ChainFrame& frame : start.chains[c]) {
      SplineFrame f;
      f.camera = c;
      f.time_s = frame.time_s;
      f.bands = cut_bands(camera, frame.view->corners, bands);
      f.corners = static_cast<int>(frame.view->corners.size());
      frames_.push_back(std::move(f));
    }
  }
}

int SplineModel::window_of(const SplineFrame& f, int windows) const {
  const auto [begin, end] = std::ranges::equal_range(frames_, f.camera, {}, &SplineFrame::camera);
  const double first = begin->time_s, last = (end - 1)->time_s;
  return std::clamp(static_cast<int>((f.time_s - first) / (last - first) * windows), 0, windows - 1);
}

void SplineModel::add_frame(const SplineFrame& f, const Weights& w, const BorderLayout& layout, ArrowSystem& system,
                            Sums& sums) const {
  const std::size_t c = f.camera;
  const CameraLink& link = calibration_.cameras[c];
  const BorderLayout::Camera& at = layout.cameras[c];
  const bool rows_matter = at.line_delay >= 0 || link.line_delay_s != 0;
  const auto instant = [&](const RowBand& b) { return link.imu_time(f.time_s, b.mean_row) + f.late_s - begin_s_; };
  const int first = knots_.locate(instant(f.bands.front())).first, last = knots_.locate(instant(f.bands.back())).first;
  const FrameColumns columns{std::min(first, last), std::abs(last - first) + order};

  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(columns.size(), columns.size());
  Eigen::VectorXd g = Eigen::VectorXd::Zero(columns.size());
  RotationSpline<order>::Jacobians jacobians;
  for (const RowBand& band : f.bands) {
    const auto rotation = rotation_.evaluate<1>(instant(band), jacobians);
    const auto position = position_.evaluate<1>(instant(band));
    const CameraPose pose(rotation.rotation, position.value, rotation.velocity, position.velocity, link.T_imu_cam);
    const BandNormals n = band_normals(*cameras_[c], band, pose.T_cam_board, pose.rate, link.line_delay_s, rows_matter);
    if (!n.seen) continue;
    sums.squares[c] += n.squares;
    sums.count[c] += 2 * static_cast<double>(band.corners.size());

    // Columns of this band: 36 of its knots, then the camera's nine, then the frame's lateness.
    Eigen::Matrix<double, 7, 36 + 10> to = Eigen::Matrix<double, 7, 36 + 10>::Zero();
    for (int i = 0; i < order; ++i) {
      to.block<6, 3>(0, 6 * i).noalias() = pose.to_rotation * jacobians.rotation[static_cast<std::size_t>(i)];
      to.block<6, 3>(0, 6 * i + 3) = position.weights.value[i] * pose.to_position;
    }
    to.block<6, 3>(0, 36) = pose.to_camera_rotation;
    to.block<6, 3>(0, 39) = pose.to_translation;
    to.block<6, 1>(0, 42) = pose.rate;
    to.block<6, 1>(0, 43) = (f.time_s - link.centre_s) * pose.rate;
    to(6, 44) = 1;
    to.block<6, 1>(0, 45) = pose.rate;
    const Eigen::Matrix<double, 7, 46> weighted = w[c] * n.information * to;
    Eigen::Matrix<double, 46, 46> part;
    part.noalias() = to.transpose() * weighted;
    const Eigen::Matrix<double, 46, 1> part_g = w[c] * (to.transpose() * n.gradient);
    const int shift = 6 * (rotation.first - columns.first_knot);
    h.block<36, 36>(shift, shift) += part.topLeftCorner<36, 36>();
    h.block(shift, columns.camera(), 36, 10) += part.topRightCorner<36, 10>();
    h.block(columns.camera(), shift, 10, 36) += part.bottomLeftCorner<10, 36>();
    h.bottomRightCorner<10, 10>() += part.bottomRightCorner<10, 10>();
    g.segment<36>(shift) += part_g.head<36>();
    g.tail<10>() += part_g.tail<10>();
  }

  const double jitter = noise_.cameras[c].jitter_s;
  if (jitter > 0) {  // the frame's own lateness is eliminated at once
    const int late = columns.late();
    const double prior = 1 / (jitter * jitter), pivot = h(late, late) + prior;
    const Eigen::VectorXd edge = h.col(late).head(late);
    h.topLeftCorner(late, late).noalias() -= edge * edge.transpose() / pivot;
    g.head(late) -= edge * ((g[late] + prior * f.late_s) / pivot);
  }

  const int band = band_size();
  const bool windowed = layout.windows > 1 && layout.windowed == static_cast<int>(c);
  const int window = windowed ? window_of(f, layout.windows) : 0;
  std::array<ArrowSystem::Block, 6> blocks;
  int count = 0;
  blocks[static_cast<std::size_t>(count++)] = {knot_size * columns.first_knot, 6 * columns.knots};
  blocks[static_cast<std::size_t>(count++)] = {band + at.rotation, 6};
  blocks[static_cast<std::size_t>(count++)] = {band + at.offset + window, 1};
  // What is not estimated moves out of the way: columns of drift and line delay close up.
  int used = columns.camera() + 7;
  const auto keep = [&](int border, int column) {
    if (border < 0) return;
    if (used != column) {
      h.row(used) = h.row(column).eval();
      h.col(used) = h.col(column).eval();
      h(used, used) = h(column, used);
      g[used] = g[column];
    }
    ++used;
    blocks[static_cast<std::size_t>(count++)] = {band + border, 1};
  };
  keep(at.drift, columns.camera() + 7);
  keep(at.line_delay, columns.camera() + 8);
  system.accumulate(std::span(blocks.data(), static_cast<std::size_t>(count)), h.topLeftCorner(used, used),
                    g.head(used));
}

/// Control points that one frame may touch: more than `order` where its rows are read over more than an instant.
int SplineModel::knots_of_a_frame() const {
  int most = order;
  for (const SplineFrame& f : frames_) {
    const CameraLink& link = calibration_.cameras[f.camera];
    const double rows = f.bands.back().mean_row - f.bands.front().mean_row;
    most =
        std::max(most, order + static_cast<int>(std::ceil(std::abs(rows * link.line_delay_s) / knots_.interval_s())));
  }
  return most;
}

/// Each frame's lateness, given all else.
void SplineModel::settle_lateness() {
  const Weights w = weights();
  for (SplineFrame& f : frames_) {
    const double jitter = noise_.cameras[f.camera].jitter_s;
    if (!(jitter > 0)) continue;
    const double prior = 1 / (jitter * jitter);
    const TimeScore score = time_score(f);
    f.late_s -= (w[f.camera] * score.gradient + prior * f.late_s) / (w[f.camera] * score.information + prior);
  }
}

SplineModel::TimeScore SplineModel::time_score(const SplineFrame& f) const {
  const std::size_t c = f.camera;
  const CameraLink& link = calibration_.cameras[c];
  TimeScore out;
  for (const RowBand& band : f.bands) {
    const double t = link.imu_time(f.time_s, band.mean_row) + f.late_s - begin_s_;
    const auto rotation = rotation_.evaluate<1>(t);
    const auto position = position_.evaluate<1>(t);
    const CameraPose pose(rotation.rotation, position.value, rotation.velocity, position.velocity, link.T_imu_cam);
    const BandNormals n =
        band_normals(*cameras_[c], band, pose.T_cam_board, pose.rate, link.line_delay_s, link.line_delay_s != 0);
    if (!n.seen) continue;
    out.information += pose.rate.dot(n.information.topLeftCorner<6, 6>() * pose.rate);
    out.gradient += pose.rate.dot(n.gradient.head<6>());
    out.squares += n.squares;
  }
  return out;
}

void SplineModel::add_corner_residuals(const SplineFrame& f, CameraResiduals& out) const {
  const CameraLink& link = calibration_.cameras[f.camera];
  const CameraSession& camera = *cameras_[f.camera];
  for (const RowBand& band : f.bands) {
    const double t = link.imu_time(f.time_s, band.mean_row) + f.late_s - begin_s_;
    const auto rotation = rotation_.evaluate<1>(t);
    const auto position = position_.evaluate<1>(t);
    const CameraPose pose(rotation.rotation, position.value, rotation.velocity, position.velocity, link.T_imu_cam);
    for (const CornerObservation& c : band.corners) {
      const Rigid own = moved(pose.T_cam_board, (camera.row(c) - band.mean_row) * link.line_delay_s * pose.rate);
      const auto at = camera.model().project(own * camera.stream->board[static_cast<std::size_t>(c.corner)]);
      if (!at) continue;
      out.at_px.push_back(c.pixel);
      out.off_px.push_back(*at - c.pixel);
    }
  }
}

bool SplineModel::any_jitter() const {
  return std::ranges::any_of(noise_.cameras, [](const CameraNoise& n) { return n.jitter_s > 0; });
}

/// Of cameras without a jitter so far: is there one after all?
bool SplineModel::find_jitter() {
  bool found = false;
  const double before = log_determinant();
  for (std::size_t c = 0; c < cameras_.size(); ++c)
    if (noise_.cameras[c].jitter_s == 0) found = find_jitter(c, before) || found;
  return found;
}

/// Are frames early or late by more than their corners' noise allows? A score test at no jitter: with u the derivative
/// of the cost to a frame's lateness, s its information and e its coupling to all else, u² has the mean
/// s − eᵀ·H⁻¹·e, and more with a jitter. Σ eᵀ·H⁻¹·e is what a tiny jitter takes off log det H.
bool SplineModel::find_jitter(std::size_t camera, double before) {
  const double w = weights()[camera];
  double excess = 0, information = 0, squares = 0, n = 0;
  for (const SplineFrame& f : frames_) {
    if (f.camera != camera) continue;
    const TimeScore s = time_score(f);
    excess += w * w * s.gradient * s.gradient - w * s.information;
    information += w * s.information;
    squares += w * w * s.information * s.information;
    n += 1;
  }
  if (n < 20 || !(information > 0)) return false;
  double& jitter = noise_.cameras[camera].jitter_s;
  const double tiny2 = 1e-4 * n / information;
  jitter = std::sqrt(tiny2);
  const double coupled = std::max(0.0, (before - log_determinant()) / tiny2);
  jitter = 0;
  const double left = std::max(0.02, 1 - coupled / information);
  const double evidence = (excess + coupled) / (left * std::sqrt(2 * squares));
  if (evidence < jitter_threshold) return false;
  jitter = std::sqrt((excess + coupled) / (left * left * squares));
  return true;
}

/// σ² = Σδ²/γ, γ being how many of the frames' latenesses are determined by the data rather than by σ itself
/// [MacKay1992]: n − Σ var(δ)/σ², the sum being ∂ log det / ∂ log σ⁻². Returns by how much that matters.
double SplineModel::measure_jitter(std::size_t camera, double before) {
  constexpr double nudge = 1e-3;
  double& jitter = noise_.cameras[camera].jitter_s;
  const double w = weights()[camera];
  const double prior = 1 / (jitter * jitter);
  double squares = 0, eliminated = 0, total = 0, n = 0;
  for (const SplineFrame& f : frames_) {
    if (f.camera != camera) continue;
    const double information = w * time_score(f).information;
    squares += f.late_s * f.late_s;
    total += information;
    eliminated += std::log((information + prior * (1 + nudge)) / (information + prior));
    n += 1;
  }
  const double kept = jitter;
  jitter /= std::sqrt(1 + nudge);
  const double nudged = log_determinant();
  jitter = kept;
  if (nudged == 0) return 0;
  const double loose = (nudged - before + eliminated) / std::log1p(nudge);
  jitter = std::sqrt(squares / std::max(0.02 * n, n - loose));
  // A change matters as far as it changes what a frame's time is worth.
  const double by_itself = n / total;
  return std::abs(std::sqrt((jitter * jitter + by_itself) / (kept * kept + by_itself)) - 1);
}

}  // namespace takt::batch
