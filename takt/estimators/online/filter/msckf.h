// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "takt/estimators/online/method.h"
#include "takt/estimators/online/moving_offset.h"

namespace takt::online {

/// Multi-state constraint Kalman filter [Mourikis2007] with the cameras' offsets in its state [Li2014]: the motion is
/// carried to t + t_d, a clone of the pose is kept for each frame, and what several frames saw of one point constrains
/// their clones without the point becoming a state. A clone's error depends on the offset's by the pose's derivative,
///   clone error = pose error + [ω; v]·(offset error)
/// so everything the pictures say about the clones tells the offset. docs/methods/online.md.
class Msckf : public OffsetMethod {
 public:
  Msckf(const TrackingRig& rig, const TrackingOptions& options);

  void start(const FirstMotion& first) override;
  FrameReport observe(const BearingFrame& frame, const ImuHistory& imu) override;
  [[nodiscard]] OffsetBelief belief(std::size_t camera) const override;
  [[nodiscard]] Motion motion() const override { return now_; }
  [[nodiscard]] double misfit() const override { return misfit_; }

 private:
  struct Camera {
    double offset_s = 0, drift = 0, line_delay_s = 0;
    Extrinsics extrinsics;
    Eigen::Vector4d intrinsics = Eigen::Vector4d::Zero();  ///< fx, fy, cx, cy less the given ones (px)
    double pixel_sigma = 1;
    bool sigma_known = true;
    double rows_to_middle = 0;  ///< from the reference row to the middle one
    double given_line_delay_s = 0;
    int rows = 0;
    bool free_line_delay = false;
    // Where its errors stand in the state; −1 where they are not in it.
    int at_offset = -1, at_drift = -1, at_line_delay = -1, at_extrinsics = -1, at_intrinsics = -1;
  };
  struct Kept {
    std::int64_t id;
    std::size_t camera;
    Clone clone;
  };
  struct Track {
    std::vector<std::pair<std::int64_t, Sighting>> seen;  ///< clone id and what was seen from it
    std::int64_t last = -1;                               ///< clone of the last sighting, used or not
    std::size_t longest = 0;                              ///< used when it is this long
  };
  /// What all features of an update say together, whitened: residual ≈ H·error. Columns are those after the motion's.
  struct Gathered {
    Eigen::MatrixXd H;  ///< has room for more than `rows`
    Eigen::VectorXd residual;
    Eigen::Index rows = 0;
  };

  void lay_out_state();
  void carry_to(double t_s, const ImuHistory& imu);
  void clone(const BearingFrame& frame, const ImuHistory& imu);
  void follow(const BearingFrame& frame);
  [[nodiscard]] FrameSlip slip(const BearingFrame& frame, const ImuHistory& imu) const;
  void use_features(const BearingFrame& frame);
  [[nodiscard]] std::vector<SeenFrom> sightings(std::size_t camera, const Track& track) const;
  void gather(std::size_t camera, const Track& track, Gathered& all);
  void correct(const Gathered& all, bool hold_offsets);
  void stand_still(double dt_s, const ImuHistory& imu);
  void correct_dense(const Eigen::MatrixXd& H, const Eigen::VectorXd& r, const Eigen::VectorXd& variance);
  void move_state(const Eigen::VectorXd& error);
  void forget_oldest_clone();
  [[nodiscard]] int place_of(std::int64_t clone_id) const;
  [[nodiscard]] std::size_t most_clones() const;

  TrackingRig rig_;
  TrackingOptions options_;
  ImuNoise noise_;

  double t_s_ = 0, t_started_s_ = 0;
  Motion now_;
  Quat R_first_;
  Vec3 p_first_, v_first_;
  std::vector<Camera> cameras_;
  int clones_begin_ = motion_size;
  Eigen::MatrixXd P_;
  std::deque<Kept> clones_;
  std::int64_t next_clone_ = 0;
  std::vector<std::map<std::int64_t, Track>> tracks_;  ///< by camera
  double misfit_ = 1;
  StepWatch step_watch_;  ///< of camera 0
  bool stepped_ = false;
};

}  // namespace takt::online
