// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/batch/spline_model.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "takt/math/parallel.h"

namespace takt::batch {

namespace {

constexpr int most_iterations = 20, most_rounds = 8;
/// Steps this small against what is known are the end.
constexpr double settled = 5e-3;
constexpr double small_change = 0.02, large_change = 0.3;
/// Where stamps jitter and that is not modelled yet, the large residuals slow Gauss–Newton down: no reason to wait.
constexpr double roughly_settled = 0.3;
constexpr int rough_iterations = 4;
/// The spline reaches this far beyond the outermost frames (s): room for offset, line delay and jitter to move.
constexpr double margin_s = 0.04;
/// Corners whose rows are read within this time share one evaluation of the motion (s).
constexpr double band_s = 1e-3;
constexpr int most_bands = 16;
/// Stiffness that only a stretch without any measurement feels.
constexpr double stiff_rad_s2 = 1e4, stiff_m_s2 = 1e3;
constexpr int corner_group = 0, gyro_group = 1, accel_group = 2;

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

SplineModel::SplineModel(std::vector<const CameraSession*> cameras, const ImuSession& imu, const DiscreteFit& start,
                         const SplineOptions& options)
    : cameras_(std::move(cameras)), imu_(imu), options_(options), calibration_(start.calibration) {
  noise_ = {cameras_[0]->poses.corner_sigma_px, imu.high_pass.gyro, imu.high_pass.accel, options.jitter_s};
  take_frames(start);
  double first = frames_.front().time_s, last = first;
  for (const SplineFrame& f : frames_) {
    const CameraLink& link = calibration_.cameras[static_cast<std::size_t>(f.camera)];
    first = std::min(first, link.imu_time(f.time_s, f.bands.front().mean_row));
    last = std::max(last, link.imu_time(f.time_s, f.bands.back().mean_row));
  }
  first = std::min(first, calibration_.cameras[0].imu_time(frames_.front().time_s));
  begin_s_ = first - margin_s;
  knots_ = UniformKnots<order>::covering(last - first + 2 * margin_s, options.knot_interval_s);
  start_motion(start);
  take_samples();
  lay_out();
}

void SplineModel::take_frames(const DiscreteFit& start) {
  const CameraSession& camera = *cameras_[0];
  const double line_delay = calibration_.cameras[0].line_delay_s;
  const int bands = options_.line_delay || line_delay != 0
                        ? bands_for(std::max(line_delay, options_.line_delay ? 15e-3 / camera.model().height : 0.0),
                                    camera.model().height)
                        : 1;
  frames_.clear();
  for (const ChainFrame& frame : start.chain) {
    SplineFrame f;
    f.camera = 0;
    f.time_s = frame.time_s;
    f.bands = cut_bands(camera, frame.view->corners, bands);
    f.corners = static_cast<int>(frame.view->corners.size());
    frames_.push_back(std::move(f));
  }
}

void SplineModel::start_motion(const DiscreteFit& start) {
  const CameraLink& link = start.calibration.cameras[0];
  const auto time_of = [&](std::size_t k) { return link.imu_time(start.chain[k].time_s, start.chain[k].mean_row); };
  const int n = knots_.control_points();
  std::vector<Quat> rotations(static_cast<std::size_t>(n));
  Eigen::Matrix3Xd positions(3, n);
  std::size_t k = 0;
  for (int i = 0; i < n; ++i) {
    // A control point acts most in the middle of its Order segments.
    const double t = begin_s_ + (i - 0.5 * (order - 2)) * knots_.interval_s();
    while (k + 1 < start.chain.size() && time_of(k + 1) <= t) ++k;
    const BodyState& s = start.states[k];
    const double from = time_of(k), dt = t - from;
    const BiasCurve::Place bias = start.calibration.bias.at(from);
    Quat R;
    Vec3 p;
    if (dt >= 0 && start.chain[k].joined && imu_.curve.covers(from, t)) {
      const Preintegrated step = preintegrate(imu_.curve, from, t, start.calibration.bias.gyro(bias),
                                              start.calibration.bias.accel(bias), {1, 1});
      const double scale = start.calibration.board_scale;
      R = s.R_board_imu * step.rotation;
      p = s.position + dt * s.velocity +
          (0.5 * dt * dt * start.calibration.gravity_board + s.R_board_imu * step.position) / scale;
    } else if (dt >= 0 && k + 1 < start.chain.size()) {  // across a gap
      const BodyState& next = start.states[k + 1];
      const double share = dt / (time_of(k + 1) - from);
      R = s.R_board_imu.slerp(share, next.R_board_imu);
      p = (1 - share) * s.position + share * next.position;
    } else {  // beyond the ends
      const double reach = std::clamp(dt, -margin_s, margin_s);
      const bool known = imu_.curve.covers(from, from);
      const Vec3 omega =
          known ? Vec3(imu_.curve.at(from).gyro - start.calibration.bias.gyro(bias)) : Vec3(Vec3::Zero());
      R = s.R_board_imu * exp_so3(reach * omega);
      p = s.position + reach * s.velocity;
    }
    rotations[static_cast<std::size_t>(i)] = R.normalized();
    positions.col(i) = p;
  }
  // A spline of order 6 smooths its control points: value = c + ¼·c'' (second difference). Undone to first order.
  static_assert(order == 6);
  std::vector<Quat> sharp = rotations;
  Eigen::Matrix3Xd sharp_positions = positions;
  for (int i = 1; i + 1 < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3 bend =
        log_so3(rotations[at].conjugate() * rotations[at + 1]) - log_so3(rotations[at - 1].conjugate() * rotations[at]);
    sharp[at] = rotations[at] * exp_so3(-0.25 * bend);
    sharp_positions.col(i) -= 0.25 * (positions.col(i + 1) - 2 * positions.col(i) + positions.col(i - 1));
  }
  rotation_ = RotationSpline<order>(knots_.interval_s(), std::move(sharp));
  position_ = EuclideanSpline<3, order>(knots_.interval_s(), std::move(sharp_positions));
}

void SplineModel::take_samples() {
  // Samples between joined frames only: elsewhere no camera says where the motion went.
  samples_.clear();
  const auto times = imu_.curve.times_s();
  std::size_t i = 0;
  int segment = -1;
  for (std::size_t k = 0; k + 1 < frames_.size(); ++k) {
    const CameraLink& link = calibration_.cameras[0];
    const double from = link.imu_time(frames_[k].time_s), to = link.imu_time(frames_[k + 1].time_s);
    if (to - from > longest_join_s + 0.05 || !imu_.curve.covers(from, to)) continue;
    while (i < times.size() && times[i] < from) ++i;
    for (; i < times.size() && times[i] < to; ++i) {
      const int at = knots_.locate(times[i] - begin_s_).first;
      if (at != segment || samples_.empty() || samples_.back().last != i) samples_.push_back({i, i});
      segment = at;
      samples_.back().last = i + 1;
    }
  }
}

std::size_t SplineModel::imu_samples() const {
  std::size_t n = 0;
  for (const Span& s : samples_) n += s.last - s.first;
  return n;
}

void SplineModel::lay_out() {
  layout_ = {};
  int next = 0;
  for (std::size_t c = 0; c < calibration_.cameras.size(); ++c) {
    BorderLayout::Camera at;
    at.rotation = next, at.translation = next + 3, at.offset = next + 6;
    next += 7;
    if (options_.drift) at.drift = next++;
    if (options_.line_delay) at.line_delay = next++;
    layout_.cameras.push_back(at);
  }
  layout_.gravity = next;
  layout_.board_scale = next + 3;
  layout_.bias = next + 4;
  layout_.size = layout_.bias + 6 * calibration_.bias.points();
}

SplineModel::Weights SplineModel::weights() const {
  const auto inverse = [](double sigma2) { return 1 / sigma2; };
  const double dt = imu_.curve.median_step_s();
  return {inverse(noise_.corner_px * noise_.corner_px), inverse(noise_.gyro_density * noise_.gyro_density / dt),
          inverse(noise_.accel_density * noise_.accel_density / dt)};
}

int SplineModel::window_of(const SplineFrame& f, int windows) const {
  const double first = frames_.front().time_s, last = frames_.back().time_s;
  return std::clamp(static_cast<int>((f.time_s - first) / (last - first) * windows), 0, windows - 1);
}

void SplineModel::add_frame(const SplineFrame& f, const Weights& w, const BorderLayout& layout, int window,
                            ArrowSystem& system, Sums& sums) const {
  const auto c = static_cast<std::size_t>(f.camera);
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
    sums.squares[corner_group] += n.squares;
    sums.count[corner_group] += 2 * static_cast<double>(band.corners.size());

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
    const Eigen::Matrix<double, 7, 46> weighted = w.corner * n.information * to;
    Eigen::Matrix<double, 46, 46> part;
    part.noalias() = to.transpose() * weighted;
    const Eigen::Matrix<double, 46, 1> part_g = w.corner * (to.transpose() * n.gradient);
    const int shift = 6 * (rotation.first - columns.first_knot);
    h.block<36, 36>(shift, shift) += part.topLeftCorner<36, 36>();
    h.block(shift, columns.camera(), 36, 10) += part.topRightCorner<36, 10>();
    h.block(columns.camera(), shift, 10, 36) += part.bottomLeftCorner<10, 36>();
    h.bottomRightCorner<10, 10>() += part.bottomRightCorner<10, 10>();
    g.segment<36>(shift) += part_g.head<36>();
    g.tail<10>() += part_g.tail<10>();
  }

  if (noise_.jitter_s > 0) {  // the frame's own lateness is eliminated at once
    const int late = columns.late();
    const double prior = 1 / (noise_.jitter_s * noise_.jitter_s), pivot = h(late, late) + prior;
    const Eigen::VectorXd edge = h.col(late).head(late);
    h.topLeftCorner(late, late).noalias() -= edge * edge.transpose() / pivot;
    g.head(late) -= edge * ((g[late] + prior * f.late_s) / pivot);
  }

  const int band = band_size();
  std::array<ArrowSystem::Block, 6> blocks;
  int count = 0;
  blocks[static_cast<std::size_t>(count++)] = {knot_size * columns.first_knot, 6 * columns.knots};
  blocks[static_cast<std::size_t>(count++)] = {band + at.rotation, 6};
  blocks[static_cast<std::size_t>(count++)] = {band + at.offset + (f.camera == 0 ? window : 0), 1};
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

void SplineModel::add_samples(const Span& span, const Weights& w, const BorderLayout& layout, ArrowSystem& system,
                              Sums& sums) const {
  const auto times = imu_.curve.times_s();
  const auto gyro = imu_.curve.gyro();
  const auto accel = imu_.curve.accel();
  const Vec3& gravity = calibration_.gravity_board;
  const double scale = calibration_.board_scale;
  const BiasCurve::Place bias = calibration_.bias.at(0.5 * (times[span.first] + times[span.last - 1]));
  const Vec3 gyro_bias = calibration_.bias.gyro(bias), accel_bias = calibration_.bias.accel(bias);
  const double root_gyro = std::sqrt(w.gyro), root_accel = std::sqrt(w.accel);

  // Columns: rotation 18, gyro's bias 9 | rotation 18, position 18, gravity and scale 4, accelerometer's bias 9
  constexpr int gyro_columns = 27, accel_columns = 49;
  Eigen::Matrix<double, gyro_columns, gyro_columns> h_gyro = Eigen::Matrix<double, gyro_columns, gyro_columns>::Zero();
  Eigen::Matrix<double, accel_columns, accel_columns> h_accel =
      Eigen::Matrix<double, accel_columns, accel_columns>::Zero();
  Eigen::Matrix<double, gyro_columns, 1> g_gyro = Eigen::Matrix<double, gyro_columns, 1>::Zero();
  Eigen::Matrix<double, accel_columns, 1> g_accel = Eigen::Matrix<double, accel_columns, 1>::Zero();
  Eigen::Matrix<double, 3, gyro_columns> j_gyro = Eigen::Matrix<double, 3, gyro_columns>::Zero();
  Eigen::Matrix<double, 3, accel_columns> j_accel = Eigen::Matrix<double, 3, accel_columns>::Zero();
  for (int i = 0; i < BiasCurve::order; ++i) {
    j_gyro.block<3, 3>(0, 18 + 3 * i).diagonal().setConstant(root_gyro * bias.w[i]);
    j_accel.block<3, 3>(0, 40 + 3 * i).diagonal().setConstant(root_accel * bias.w[i]);
  }
  RotationSpline<order>::Jacobians jacobians;
  int first = 0;
  for (std::size_t s = span.first; s < span.last; ++s) {
    const double t = times[s] - begin_s_;
    const auto rotation = rotation_.evaluate<1>(t, jacobians);
    const auto position = position_.evaluate<2>(t);
    first = rotation.first;
    const Mat3 back = rotation.rotation.conjugate().toRotationMatrix();
    const Vec3 force = back * (scale * position.acceleration - gravity);
    const Vec3 r_gyro = rotation.velocity + gyro_bias - gyro[s], r_accel = force + accel_bias - accel[s];
    const Mat3 lever = root_accel * hat(force), weighted_back = root_accel * back;
    for (int i = 0; i < order; ++i) {
      const auto at = static_cast<std::size_t>(i);
      j_gyro.block<3, 3>(0, 3 * i) = root_gyro * jacobians.velocity[at];
      j_accel.block<3, 3>(0, 3 * i).noalias() = lever * jacobians.rotation[at];
      j_accel.block<3, 3>(0, 18 + 3 * i) = (scale * position.weights.d2[i]) * weighted_back;
    }
    j_accel.block<3, 3>(0, 36) = -weighted_back;
    j_accel.col(39) = weighted_back * position.acceleration;
    h_gyro.noalias() += j_gyro.transpose() * j_gyro;
    h_accel.noalias() += j_accel.transpose() * j_accel;
    g_gyro.noalias() += j_gyro.transpose() * (root_gyro * r_gyro);
    g_accel.noalias() += j_accel.transpose() * (root_accel * r_accel);
    sums.squares[gyro_group] += r_gyro.squaredNorm();
    sums.squares[accel_group] += r_accel.squaredNorm();
  }
  const double count = 3 * static_cast<double>(span.last - span.first);
  sums.count[gyro_group] += count;
  sums.count[accel_group] += count;

  const int band = band_size(), bias_at = band + layout.bias + 6 * bias.first;
  std::array<ArrowSystem::Block, 9> gyro_blocks;
  std::array<ArrowSystem::Block, 16> accel_blocks;
  for (int i = 0; i < order; ++i) {
    const auto at = static_cast<std::size_t>(i);
    gyro_blocks[at] = accel_blocks[at] = {knot_size * (first + i), 3};
    accel_blocks[at + 6] = {knot_size * (first + i) + 3, 3};
  }
  accel_blocks[12] = {band + layout.gravity, 4};
  for (int i = 0; i < BiasCurve::order; ++i) {
    const auto at = static_cast<std::size_t>(i);
    gyro_blocks[6 + at] = {bias_at + 6 * i, 3};
    accel_blocks[13 + at] = {bias_at + 6 * i + 3, 3};
  }
  system.accumulate(gyro_blocks, h_gyro, g_gyro);
  system.accumulate(accel_blocks, h_accel, g_accel);
}

void SplineModel::add_stiffness(ArrowSystem& system) const {
  const double h2 = knots_.interval_s() * knots_.interval_s();
  const double w_r = 1 / (stiff_rad_s2 * stiff_rad_s2 * h2 * h2), w_p = 1 / (stiff_m_s2 * stiff_m_s2 * h2 * h2);
  const auto& points = rotation_.control_points();
  const auto& places = position_.control_points();
  Eigen::Matrix<double, 18, 18> h = Eigen::Matrix<double, 18, 18>::Zero();
  constexpr double bend[3] = {1, -2, 1};
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      h.block<3, 3>(6 * a, 6 * b).diagonal().setConstant(w_r * bend[a] * bend[b]);
      h.block<3, 3>(6 * a + 3, 6 * b + 3).diagonal().setConstant(w_p * bend[a] * bend[b]);
    }
  for (int i = 1; i + 1 < knots_.control_points(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3 turn =
        log_so3(points[at].conjugate() * points[at + 1]) - log_so3(points[at - 1].conjugate() * points[at]);
    const Vec3 shift = places.col(i + 1) - 2 * places.col(i) + places.col(i - 1);
    Eigen::Matrix<double, 18, 1> g;
    for (int a = 0; a < 3; ++a) {
      g.segment<3>(6 * a) = w_r * bend[a] * turn;
      g.segment<3>(6 * a + 3) = w_p * bend[a] * shift;
    }
    const ArrowSystem::Block block[] = {{knot_size * (i - 1), 18}};
    system.accumulate(block, h, g);
  }
}

ArrowSystem SplineModel::normal_equations(const Weights& w, const BorderLayout& layout, Sums& sums) const {
  const int reach = knots_of_a_frame();
  // Always two parts, so that the sum is the same for any number of threads.
  std::vector<ArrowSystem> parts(2, ArrowSystem(band_size(), knot_size * reach - 1, layout.size));
  Sums part_sums[2];
  parallel_for(2, options_.threads, [&](int part) {
    const auto share = [part](std::size_t n, int of) { return n * static_cast<std::size_t>(part + of) / 2; };
    for (std::size_t i = share(frames_.size(), 0); i < share(frames_.size(), 1); ++i)
      add_frame(frames_[i], w, layout, layout.windows > 1 ? window_of(frames_[i], layout.windows) : 0,
                parts[static_cast<std::size_t>(part)], part_sums[part]);
    for (std::size_t i = share(samples_.size(), 0); i < share(samples_.size(), 1); ++i)
      add_samples(samples_[i], w, layout, parts[static_cast<std::size_t>(part)], part_sums[part]);
  });
  sums = part_sums[0];
  for (int g = 0; g < 3; ++g) sums.squares[g] += part_sums[1].squares[g], sums.count[g] += part_sums[1].count[g];
  parts[0].add(parts[1]);
  add_stiffness(parts[0]);
  add_priors(calibration_, layout, band_size(), parts[0]);
  return std::move(parts[0]);
}

/// Control points that one frame may touch: more than `order` where its rows are read over more than an instant.
int SplineModel::knots_of_a_frame() const {
  int most = order;
  for (const SplineFrame& f : frames_) {
    const CameraLink& link = calibration_.cameras[static_cast<std::size_t>(f.camera)];
    const double rows = f.bands.back().mean_row - f.bands.front().mean_row;
    most =
        std::max(most, order + static_cast<int>(std::ceil(std::abs(rows * link.line_delay_s) / knots_.interval_s())));
  }
  return most;
}

bool SplineModel::within_reach() const {
  return std::ranges::all_of(frames_, [&](const SplineFrame& f) {
    const CameraLink& link = calibration_.cameras[static_cast<std::size_t>(f.camera)];
    return knots_.contains(link.imu_time(f.time_s, f.bands.front().mean_row) + f.late_s - begin_s_) &&
           knots_.contains(link.imu_time(f.time_s, f.bands.back().mean_row) + f.late_s - begin_s_);
  });
}

void SplineModel::move(const Eigen::VectorXd& step) {
  const int n = knots_.control_points();
  Eigen::Matrix3Xd turns(3, n);
  for (int i = 0; i < n; ++i) {
    turns.col(i) = step.segment<3>(knot_size * i);
    position_.control_point(i) += step.segment<3>(knot_size * i + 3);
  }
  rotation_.retract(turns);
  retract(calibration_, layout_, step.tail(layout_.size));
}

/// Each frame's lateness, given all else.
void SplineModel::settle_lateness() {
  const double w = weights().corner, prior = 1 / (noise_.jitter_s * noise_.jitter_s);
  for (SplineFrame& f : frames_) {
    const TimeScore score = time_score(f);
    f.late_s -= (w * score.gradient + prior * f.late_s) / (w * score.information + prior);
  }
}

SplineModel::TimeScore SplineModel::time_score(const SplineFrame& f) const {
  const auto c = static_cast<std::size_t>(f.camera);
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

bool SplineModel::settle() {
  return iterate(settled, most_iterations);
}

bool SplineModel::iterate(double enough, int most) {
  for (int round = 0; round < most; ++round) {
    Sums sums;
    const ArrowSystem::Solution solution = normal_equations(weights(), layout_, sums).solve();
    ++iterations_;
    if (!solution.ok()) {
      failure_ = "the motion does not determine the calibration";
      return false;
    }
    if (!solution.step().allFinite()) {
      failure_ = "the fit did not settle";
      return false;
    }
    move(solution.step());
    if (!within_reach()) {
      failure_ = "the fit left the recording: camera and IMU contradict each other";
      return false;
    }
    if (noise_.jitter_s > 0) settle_lateness();
    covariance_ = solution.border_covariance();
    const double moved =
        solution.step().tail(layout_.size).cwiseQuotient(covariance_.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff();
    if (moved < enough) return true;
  }
  if (most < most_iterations) return true;
  failure_ = "the fit did not settle";
  return false;
}

/// Returns the largest relative change.
double SplineModel::measure_noise() {
  constexpr double nudge = 1e-3;
  Sums sums;
  const Weights w = weights();
  const ArrowSystem::Solution at = normal_equations(w, layout_, sums).solve();
  if (!at.ok()) return 0;
  double taken[3];
  for (const int g : {corner_group, gyro_group}) {
    Weights nudged = w;
    (g == corner_group ? nudged.corner : nudged.gyro) *= 1 + nudge;
    Sums ignored;
    const ArrowSystem::Solution moved = normal_equations(nudged, layout_, ignored).solve();
    if (!moved.ok()) return 0;
    taken[g] = (moved.log_determinant() - at.log_determinant()) / std::log1p(nudge);
  }
  taken[accel_group] = band_size() + layout_.size - taken[corner_group] - taken[gyro_group];
  double sigma[3];
  for (int g = 0; g < 3; ++g) {
    sigma[g] = std::sqrt(sums.squares[g] / std::max(0.03 * sums.count[g], sums.count[g] - taken[g]));
  }
  const double root = std::sqrt(imu_.curve.median_step_s());
  const Noise before = noise_;
  if (noise_.jitter_s > 0) measure_jitter(at.log_determinant());
  noise_.corner_px = sigma[corner_group];
  noise_.gyro_density = sigma[gyro_group] * root;
  noise_.accel_density = sigma[accel_group] * root;
  const auto changed = [](double now, double then) { return then > 0 ? std::abs(now / then - 1) : 0; };
  return std::max({changed(noise_.corner_px, before.corner_px), changed(noise_.gyro_density, before.gyro_density),
                   changed(noise_.accel_density, before.accel_density), changed(noise_.jitter_s, before.jitter_s)});
}

bool SplineModel::solve() {
  failure_.clear();
  if (!iterate(roughly_settled, rough_iterations)) return false;
  find_jitter();
  for (int round = 0; round < most_rounds; ++round) {
    if (!settle()) return false;
    if (noise_.jitter_s == 0 && round > 0 && find_jitter()) continue;
    const double changed = measure_noise();
    if (changed < small_change) return true;
    if (changed < large_change && noise_.jitter_s == 0 && !find_jitter()) return settle();
  }
  return true;
}

/// Are frames early or late by more than their corners' noise allows? A score test at no jitter: with u the derivative
/// of the cost to a frame's lateness, s its information and e its coupling to all else, u² has the mean
/// s − eᵀ·H⁻¹·e, and more with a jitter. Σ eᵀ·H⁻¹·e is what a tiny jitter takes off log det H.
bool SplineModel::find_jitter() {
  const double w = weights().corner;
  double excess = 0, information = 0, squares = 0, n = 0;
  for (const SplineFrame& f : frames_) {
    const TimeScore s = time_score(f);
    excess += w * w * s.gradient * s.gradient - w * s.information;
    information += w * s.information;
    squares += w * w * s.information * s.information;
    n += 1;
  }
  if (n < 20 || !(information > 0)) return false;
  const auto log_determinant = [&] {
    Sums ignored;
    const ArrowSystem::Solution solution = normal_equations(weights(), layout_, ignored).solve();
    return solution.ok() ? solution.log_determinant() : 0;
  };
  const double before = log_determinant();
  const double tiny2 = 1e-4 * n / information;
  noise_.jitter_s = std::sqrt(tiny2);
  const double coupled = std::max(0.0, (before - log_determinant()) / tiny2);
  noise_.jitter_s = 0;
  const double left = std::max(0.02, 1 - coupled / information);
  jitter_evidence_ = (excess + coupled) / (left * std::sqrt(2 * squares));
  if (jitter_evidence_ < jitter_threshold) return false;
  noise_.jitter_s = std::sqrt((excess + coupled) / (left * left * squares));
  return true;
}

/// σ² = Σδ²/γ, γ being how many of the frames' latenesses are determined by the data rather than by σ itself
/// [MacKay1992]: n − Σ var(δ)/σ², the sum being ∂ log det / ∂ log σ⁻².
void SplineModel::measure_jitter(double log_determinant) {
  constexpr double nudge = 1e-3;
  const double w = weights().corner;
  const double prior = 1 / (noise_.jitter_s * noise_.jitter_s);
  double squares = 0, eliminated = 0;
  for (const SplineFrame& f : frames_) {
    const double information = w * time_score(f).information;
    squares += f.late_s * f.late_s;
    eliminated += std::log((information + prior * (1 + nudge)) / (information + prior));
  }
  const double kept = noise_.jitter_s;
  noise_.jitter_s /= std::sqrt(1 + nudge);
  Sums ignored;
  const ArrowSystem::Solution nudged = normal_equations(weights(), layout_, ignored).solve();
  noise_.jitter_s = kept;
  if (!nudged.ok()) return;
  const double n = static_cast<double>(frames_.size());
  const double loose = (nudged.log_determinant() - log_determinant + eliminated) / std::log1p(nudge);
  noise_.jitter_s = std::sqrt(squares / std::max(0.02 * n, n - loose));
}

Residuals SplineModel::residuals() const {
  Residuals out;
  const auto times = imu_.curve.times_s();
  for (const Span& span : samples_) {
    for (std::size_t s = span.first; s < span.last; ++s) {
      const double t = times[s] - begin_s_;
      const BiasCurve::Place bias = calibration_.bias.at(times[s]);
      const auto rotation = rotation_.evaluate<1>(t);
      const Vec3 acceleration = position_.evaluate<2>(t).acceleration;
      out.gyro_t.push_back(times[s]);
      out.gyro.push_back(rotation.velocity + calibration_.bias.gyro(bias) - imu_.curve.gyro()[s]);
      out.accel.push_back(rotation.rotation.conjugate() *
                              (calibration_.board_scale * acceleration - calibration_.gravity_board) +
                          calibration_.bias.accel(bias) - imu_.curve.accel()[s]);
    }
  }
  out.accel_t = out.gyro_t;
  const double w = weights().corner;
  for (const SplineFrame& f : frames_) {
    const TimeScore s = time_score(f);
    out.frame_t.push_back(f.time_s);
    out.frame_rms_px.push_back(std::sqrt(s.squares / (2 * f.corners)));
    const double information = std::max(1e-30, s.information);
    out.frame_late_s.push_back(f.late_s - s.gradient / information);
    out.frame_late_sigma_s.push_back(1 / std::sqrt(w * information));
  }
  return out;
}

std::vector<WindowOffset> SplineModel::window_offsets(int windows) const {
  BorderLayout layout = layout_;
  // Offsets in a row, at the end of the border; a drift would only blur them.
  layout.windows = windows;
  layout.cameras[0].offset = layout.size;
  layout.size += windows;
  // The old offset's place and the drift's are held by a prior that nothing moves.
  Sums sums;
  ArrowSystem system = normal_equations(weights(), layout, sums);
  using One = Eigen::Matrix<double, 1, 1>;
  const auto hold = [&](int border) {
    if (border < 0) return;
    const ArrowSystem::Block block[] = {{band_size() + border, 1}};
    system.accumulate(block, One(1e30), One(0));
  };
  hold(layout_.cameras[0].offset);
  hold(layout_.cameras[0].drift);
  const ArrowSystem::Solution solution = system.solve();
  std::vector<WindowOffset> out;
  if (!solution.ok()) return out;
  std::vector<double> sum(static_cast<std::size_t>(windows)), count = sum;
  for (const SplineFrame& f : frames_) {
    const auto at = static_cast<std::size_t>(window_of(f, windows));
    sum[at] += f.time_s;
    count[at] += 1;
  }
  for (int i = 0; i < windows; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (count[at] < 5) continue;
    const int border = layout.cameras[0].offset + i;
    out.push_back({sum[at] / count[at], calibration_.cameras[0].offset_s + solution.step()[band_size() + border],
                   std::sqrt(solution.border_covariance()(border, border))});
  }
  return out;
}

void SplineModel::fix_line_delay() {
  options_.line_delay = false;
  calibration_.cameras[0].line_delay_s = 0;
  lay_out();
}

void SplineModel::fix_drift() {
  options_.drift = false;
  calibration_.cameras[0].drift = 0;
  lay_out();
}

}  // namespace takt::batch
