// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/online/first_motion.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "takt/motion/trajectory.h"

namespace takt::online {

namespace {

constexpr std::size_t fewest_sightings = 4, most_tracks = 120, fewest_tracks = 8;

struct Track {
  std::size_t camera = 0;
  std::vector<std::pair<std::size_t, const Sighting*>> seen;  ///< frame
};

std::vector<Track> longest_tracks(std::span<const BearingFrame* const> frames) {
  std::map<std::pair<std::size_t, std::int64_t>, Track> by_id;
  for (std::size_t i = 0; i < frames.size(); ++i)
    for (const SeenFeature& f : frames[i]->features) {
      Track& t = by_id[{frames[i]->camera, f.id}];
      t.camera = frames[i]->camera;
      t.seen.emplace_back(i, &f.sighting);
    }
  std::vector<Track> out;
  for (auto& [id, t] : by_id)
    if (t.seen.size() >= fewest_sightings) out.push_back(std::move(t));
  std::stable_sort(out.begin(), out.end(),
                   [](const Track& a, const Track& b) { return a.seen.size() > b.seen.size(); });
  if (out.size() > most_tracks) out.resize(most_tracks);
  return out;
}

double frame_time(const BearingFrame& f, const FirstMotion::Camera& c) {
  return f.t_s + c.offset_s;
}

/// min gᵀ·M·g/2 − nᵀ·g on the sphere |g| = G: (M − λ)·g = n with λ below M's least eigenvalue.
Vec3 on_sphere(const Mat3& M, const Vec3& n, double G) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eig(M);
  const Vec3 m = eig.eigenvalues(), c = eig.eigenvectors().transpose() * n;
  const auto length = [&](double lambda) { return (c.array() / (m.array() - lambda)).matrix().norm(); };
  double high = m[0] - 1e-12 * (std::abs(m[2]) + 1), low = m[0] - c.norm() / G - 1;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (length(middle) > G ? high : low) = middle;
  }
  const Vec3 g = eig.eigenvectors() * (c.array() / (m.array() - 0.5 * (low + high))).matrix();
  return g.norm() > 0 ? Vec3(G * g.normalized()) : Vec3(0, 0, -G);
}

/// Velocity and gravity in the IMU's frame at t0. Linear in both and in the points; rows are weighed by the points'
/// distances of the round before.
Motion linear_start(std::span<const BearingFrame* const> frames, const std::vector<Track>& tracks,
                    const ImuHistory& imu, const BeforehandKnown& known, double t0) {
  std::vector<Increment> by(frames.size());
  double t_before = t0;
  Increment sum;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double t = std::max(t_before, frame_time(*frames[i], known.cameras[frames[i]->camera]));
    const Increment step = increment(imu, t_before, t, known.gyro_bias, known.accel_bias);
    sum.dp += step.dt * sum.dv + sum.dR * step.dp;
    sum.dv += sum.dR * step.dv;
    sum.dR = (sum.dR * step.dR).normalized();
    sum.dt += step.dt;
    by[i] = sum;
    t_before = t;
  }
  using Mat6 = Eigen::Matrix<double, 6, 6>;
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  Vec3 v = Vec3::Zero(), g = Vec3::Zero();
  std::vector<double> distance(tracks.size(), 1);
  for (int round = 0; round < 3; ++round) {
    Mat6 A = Mat6::Zero();
    Vec6 b = Vec6::Zero();
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const FirstMotion::Camera& c = known.cameras[tracks[i].camera];
      Mat3 Aff = Mat3::Zero();
      Eigen::Matrix<double, 3, 6> Afx = Eigen::Matrix<double, 3, 6>::Zero();
      Mat6 Axx = Mat6::Zero();
      Vec3 bf = Vec3::Zero();
      Vec6 bx = Vec6::Zero();
      for (const auto& [frame, z] : tracks[i].seen) {
        const Increment& m = by[frame];
        const Mat2x3 M =
            (1 / distance[i]) * z->misfit * c.extrinsics.R_imu_cam.transpose() * m.dR.toRotationMatrix().transpose();
        Eigen::Matrix<double, 2, 6> X;
        X << -m.dt * M, (-0.5 * m.dt * m.dt) * M;
        const Vec2 y = M * (m.dp + m.dR * c.extrinsics.p_imu_cam);
        Aff += M.transpose() * M, Afx += M.transpose() * X, Axx += X.transpose() * X;
        bf += M.transpose() * y, bx += X.transpose() * y;
      }
      Aff.diagonal().array() += 1e-9 * Aff.trace();
      const Mat3 inverse = Aff.inverse();
      A += Axx - Afx.transpose() * inverse * Afx;
      b += bx - Afx.transpose() * inverse * bf;
    }
    A.diagonal().array() += 1e-12 * A.trace();
    const Mat3 Avv = A.topLeftCorner<3, 3>(), Avg = A.topRightCorner<3, 3>();
    const Eigen::LDLT<Mat3> by_velocity(Avv);
    const Mat3 reduced = A.bottomRightCorner<3, 3>() - Avg.transpose() * by_velocity.solve(Avg);
    const Vec3 n = b.tail<3>() - Avg.transpose() * by_velocity.solve(b.head<3>());
    g = on_sphere(0.5 * (reduced + reduced.transpose()), n, gravity_world().norm());
    v = by_velocity.solve(b.head<3>() - Avg * g);
    // Distances for the next round's weights.
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      const FirstMotion::Camera& c = known.cameras[tracks[i].camera];
      Mat3 Aff = 1e-12 * Mat3::Identity();
      Vec3 bf = Vec3::Zero();
      const auto centre = [&](std::size_t frame) -> Vec3 {
        const Increment& m = by[frame];
        return m.dt * v + 0.5 * m.dt * m.dt * g + m.dp + m.dR * c.extrinsics.p_imu_cam;
      };
      for (const auto& [frame, z] : tracks[i].seen) {
        const Mat2x3 M = z->misfit * c.extrinsics.R_imu_cam.transpose() * by[frame].dR.toRotationMatrix().transpose();
        Aff += M.transpose() * M, bf += M.transpose() * (M * centre(frame));
      }
      Aff.diagonal().array() += 1e-9 * Aff.trace();
      const Vec3 f = Aff.inverse() * bf;
      distance[i] = std::clamp((f - centre(tracks[i].seen.front().first)).norm(), 0.1, 1e3);
    }
  }
  Motion out;
  out.R = Quat::FromTwoVectors(g, gravity_world()).normalized();
  out.v = out.R * v;
  out.gyro_bias = known.gyro_bias, out.accel_bias = known.accel_bias;
  return out;
}

/// Gauss–Newton over the motion at t0, the cameras' offsets, and their intrinsics where those are to be refined.
class Refinement {
 public:
  Refinement(std::span<const BearingFrame* const> frames, const std::vector<Track>& tracks, const ImuHistory& imu,
             const BeforehandKnown& known, std::span<const double> pixel_sigma, double t0)
      : frames_(frames),
        tracks_(tracks),
        imu_(imu),
        known_(known),
        pixel_sigma_(pixel_sigma),
        t0_(t0),
        size_(motion_size + (1 + intrinsics_size) * static_cast<Eigen::Index>(known.cameras.size())) {}

  struct State {
    Motion motion;
    std::vector<FirstMotion::Camera> cameras;
  };
  struct Normals {
    Eigen::MatrixXd A;
    Eigen::VectorXd b;
    double cost = 0;
    double squares = 0;
    int rows = 0;
    std::size_t used = 0;
  };

  [[nodiscard]] State moved(const State& s, const Eigen::VectorXd& step) const {
    State out = s;
    out.motion.add(step.head<motion_size>());
    for (std::size_t c = 0; c < out.cameras.size(); ++c) {
      out.cameras[c].offset_s += step[motion_size + static_cast<Eigen::Index>(c)];
      out.cameras[c].intrinsics += step.segment<intrinsics_size>(at_intrinsics(c));
    }
    return out;
  }

  [[nodiscard]] std::optional<Normals> normals(const State& s) const {
    std::vector<Clone> poses(frames_.size());
    std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> slopes(frames_.size());
    Motion m = s.motion;
    Transition by;
    double t = t0_;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const FirstMotion::Camera& c = s.cameras[frames_[i]->camera];
      const double t_frame = frame_time(*frames_[i], c);
      if (t_frame < t || t_frame > imu_.end_s()) return std::nullopt;
      propagate(m, imu_, t, t_frame, ImuNoise{}, &by);
      t = t_frame;
      poses[i] = {m.R, m.R, m.p, m.p, {}};
      slopes[i].setZero(6, size_);
      slopes[i].leftCols<motion_size>() = by.transition.topRows<6>();
      slopes[i].col(motion_size + static_cast<Eigen::Index>(frames_[i]->camera))
          << imu_.mean(t, 0.004).gyro - m.gyro_bias,
          m.v;
      if (c.half_readout_s > 0) poses[i].readout = ReadoutMotion(imu_, m, t, c.half_readout_s);
    }
    Normals n;
    n.A.setZero(size_, size_), n.b.setZero(size_);
    add_known(s, n);
    for (const Track& track : tracks_) add(track, s, poses, slopes, n);
    if (n.used < fewest_tracks) return std::nullopt;
    return n;
  }

 private:
  static constexpr int intrinsics_size = 4;
  [[nodiscard]] Eigen::Index at_intrinsics(std::size_t camera) const {
    return motion_size + static_cast<Eigen::Index>(known_.cameras.size() + intrinsics_size * camera);
  }

  void add_known(const State& s, Normals& n) const {
    const auto about = [&n](Eigen::Index at, const Vec3& off, double sigma) {
      const double w = 1 / (sigma * sigma);
      n.A.diagonal().segment<3>(at).array() += w;
      n.b.segment<3>(at) -= w * off;
      n.cost += w * off.squaredNorm();
    };
    about(at_position, s.motion.p, 1e-4);
    about(at_velocity, s.motion.v, 50);
    about(at_gyro_bias, s.motion.gyro_bias - known_.gyro_bias, known_.gyro_bias_sigma);
    about(at_accel_bias, s.motion.accel_bias - known_.accel_bias, known_.accel_bias_sigma);
    const Vec3 up = s.motion.R.conjugate() * Vec3::UnitZ();
    n.A.block<3, 3>(at_theta, at_theta) += 1e8 * up * up.transpose();  // the heading is anybody's
    for (std::size_t c = 0; c < s.cameras.size(); ++c) {
      const auto at = motion_size + static_cast<Eigen::Index>(c);
      const double w = 1 / (known_.cameras[c].offset_sigma_s * known_.cameras[c].offset_sigma_s);
      const double off = s.cameras[c].offset_s - known_.cameras[c].offset_s;
      n.A(at, at) += w, n.b[at] -= w * off, n.cost += w * off * off;
      // Where they are kept as given they rest.
      const double sigma_px = known_.cameras[c].intrinsics_sigma_px;
      const double w_px = 1 / (sigma_px > 0 ? sigma_px * sigma_px : 1e-12);
      const Eigen::Vector4d off_px = s.cameras[c].intrinsics - known_.cameras[c].intrinsics;
      n.A.diagonal().segment<intrinsics_size>(at_intrinsics(c)).array() += w_px;
      n.b.segment<intrinsics_size>(at_intrinsics(c)) -= w_px * off_px;
      n.cost += w_px * off_px.squaredNorm();
    }
  }

  void add(const Track& track, const State& s, const std::vector<Clone>& poses,
           const std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>>& slopes, Normals& n) const {
    const FirstMotion::Camera& c = s.cameras[track.camera];
    std::vector<SeenFrom> seen;
    for (const auto& [frame, z] : track.seen) seen.push_back({z, &poses[frame], &c.extrinsics, c.line_delay_s});
    const double sigma = pixel_sigma_[track.camera];
    constexpr double unseen = 10;  // what a point behind the cameras costs, in sigmas per row
    const auto rows = static_cast<Eigen::Index>(2 * seen.size());
    const auto landmark = triangulate(seen);
    if (!landmark) {
      n.cost += unseen * unseen * static_cast<double>(rows);
      return;
    }
    Eigen::Matrix<double, Eigen::Dynamic, 3> to_landmark(rows, 3);
    Eigen::MatrixXd H(rows, size_);
    Eigen::VectorXd r(rows);
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const auto o = observe(*seen[k].sighting, *seen[k].clone, c.extrinsics, c.line_delay_s, *landmark, false);
      if (!o) return;
      const auto row = static_cast<Eigen::Index>(2 * k);
      const Mat2x4 by_intrinsics = to_intrinsics(*seen[k].sighting);
      r.segment<2>(row) = -(o->residual + by_intrinsics * c.intrinsics) / sigma;
      to_landmark.middleRows<2>(row) = o->landmark / sigma;
      H.middleRows<2>(row).noalias() = (o->pose / sigma) * slopes[track.seen[k].first];
      H.block<2, intrinsics_size>(row, at_intrinsics(track.camera)) = by_intrinsics / sigma;
    }
    project_out(to_landmark, H, r);
    const double squares = r.tail(rows - 3).squaredNorm(), free = static_cast<double>(rows - 3);
    // Huber's loss of the track as a whole.
    const double rms = std::sqrt(squares / free), bend = 2.5;
    const double w = rms > bend ? bend / rms : 1;
    n.A.noalias() += w * H.bottomRows(rows - 3).transpose() * H.bottomRows(rows - 3);
    n.b.noalias() += w * H.bottomRows(rows - 3).transpose() * r.tail(rows - 3);
    n.cost += rms > bend ? free * bend * (2 * rms - bend) : squares;
    n.squares += w * squares, n.rows += static_cast<int>(rows - 3), ++n.used;
  }

  std::span<const BearingFrame* const> frames_;
  const std::vector<Track>& tracks_;
  const ImuHistory& imu_;
  const BeforehandKnown& known_;
  std::span<const double> pixel_sigma_;
  double t0_;
  Eigen::Index size_;
};

}  // namespace

FoundMotion find_first_motion(std::span<const BearingFrame* const> frames, const ImuHistory& imu,
                              const BeforehandKnown& known, std::span<const double> pixel_sigma) {
  FoundMotion out;
  const auto tracks = longest_tracks(frames);
  if (tracks.size() < fewest_tracks) {
    out.why_not = fmt::format("only {} features could be followed over {} frames", tracks.size(), fewest_sightings);
    return out;
  }
  double widest = 0;
  for (const auto& c : known.cameras) widest = std::max(widest, c.offset_sigma_s);
  const double t0 =
      std::max(imu.begin_s(), frame_time(*frames.front(), known.cameras[frames.front()->camera]) - 4 * widest);

  const Refinement refine(frames, tracks, imu, known, pixel_sigma, t0);
  Refinement::State state{linear_start(frames, tracks, imu, known, t0), known.cameras};
  auto here = refine.normals(state);
  if (!here) {
    out.why_not = "the frames do not fit the IMU's time";
    return out;
  }
  double damping = 1e-4;
  bool settled = false;
  for (int round = 0; round < 25 && !settled; ++round) {
    Eigen::MatrixXd A = here->A;
    A.diagonal() += damping * here->A.diagonal();
    const Eigen::VectorXd step = A.ldlt().solve(here->b);
    const auto next = refine.moved(state, step);
    auto there = refine.normals(next);
    if (!there || !(there->cost < here->cost)) {
      damping *= 10;
      settled = damping > 1e5;
      continue;
    }
    settled = here->cost - there->cost < 1e-4 * there->cost;
    state = next, here = std::move(there), damping *= 0.1;
  }
  const Eigen::MatrixXd covariance = here->A.ldlt().solve(Eigen::MatrixXd::Identity(here->A.rows(), here->A.cols()));
  out.misfit = std::sqrt(here->squares / std::max(1, here->rows - 12));
  const double widen = std::max(1.0, out.misfit * out.misfit);
  FirstMotion found;
  found.t_s = t0;
  found.motion = state.motion;
  found.covariance = widen * covariance.topLeftCorner<motion_size, motion_size>();
  found.cameras = state.cameras;
  for (std::size_t c = 0; c < found.cameras.size(); ++c) {
    const auto at = motion_size + static_cast<Eigen::Index>(c);
    found.cameras[c].offset_sigma_s = std::sqrt(widen * covariance(at, at));
  }
  const double tilt = std::sqrt(found.covariance.topLeftCorner<3, 3>().trace());
  const double speed = std::sqrt(found.covariance.block<3, 3>(at_velocity, at_velocity).trace());
  const double bias_off =
      std::max((found.motion.gyro_bias - known.gyro_bias).cwiseAbs().maxCoeff() / known.gyro_bias_sigma,
               (found.motion.accel_bias - known.accel_bias).cwiseAbs().maxCoeff() / known.accel_bias_sigma);
  if (out.misfit > 3)
    out.why_not = fmt::format("no motion explains the features: they miss by {:.1f} times their noise", out.misfit);
  else if (bias_off > 4)
    out.why_not = fmt::format("it would take an IMU bias of {:.0f} times what is usual", bias_off);
  else if (tilt > 0.03)
    out.why_not = fmt::format("the direction of gravity is known to {:.1f} degrees only", tilt * 57.29578);
  else if (speed > 0.1 + 0.2 * found.motion.v.norm())
    out.why_not = fmt::format("the speed is known to {:.2f} m/s only", speed);
  else if (!(found.cameras[0].offset_sigma_s < 0.02))
    out.why_not = "the motion does not tell the offset yet";
  else
    out.motion = std::move(found);
  return out;
}

}  // namespace takt::online
