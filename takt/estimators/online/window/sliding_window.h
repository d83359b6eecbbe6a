// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "takt/estimators/online/method.h"
#include "takt/estimators/online/moving_offset.h"
#include "takt/estimators/online/window/imu_link.h"

namespace takt::online {

/// Sliding-window optimisation [Qin2018]: the motions at the last frames, points and clocks are fitted together, again
/// with every frame; what leaves the window stays as a prior (marginalisation).
///
/// A frame's motion stands at its stamp plus the offset that was believed when it came. What the offset has moved by
/// since then moves the observation: by the feature's velocity in the picture, measured between frames, as published;
/// or, which is the default, by the motion itself. A measured velocity shares its noise with the residual and biases
/// the offset, σ²/(Δt·E|v|²); a predicted one does not. docs/methods/window.md has both, measured.
///
/// The offset is a state of every frame that may drift and wander to the next one's, so that it can be followed.
class SlidingWindow : public OffsetMethod {
 public:
  SlidingWindow(const TrackingRig& rig, const TrackingOptions& options);

  void start(const FirstMotion& first) override;
  FrameReport observe(const BearingFrame& frame, const ImuHistory& imu) override;
  [[nodiscard]] OffsetBelief belief(std::size_t camera) const override;
  [[nodiscard]] Motion motion() const override { return states_.back().motion; }
  [[nodiscard]] double misfit() const override { return misfit_; }

 private:
  /// A camera's constants and what is estimated of it for the whole window.
  struct Camera {
    double rows_to_middle = 0, given_line_delay_s = 0;
    int rows = 0;
    bool sigma_known = true, free_line_delay = false;
    double pixel_sigma = 1;
    Extrinsics extrinsics;
    double line_delay_s = 0;
    Eigen::Vector4d intrinsics = Eigen::Vector4d::Zero();  ///< fx, fy, cx, cy less the given ones (px)
    // Where they stand in the system; −1 where they are not in it.
    int at_extrinsics = -1, at_line_delay = -1, at_intrinsics = -1;
  };
  /// One camera's clock when a state was taken.
  struct Clock {
    double offset_s = 0, drift = 0;
    double slip_s = 0;  ///< of this stamp alone
  };
  struct Shot {
    std::int64_t id;
    std::size_t camera;
    double t_s;  ///< by the camera's clock
    double stamp_sigma_s;
    ReadoutMotion readout;
  };
  struct State {
    double t_s;
    Motion motion, at_prior;  ///< at_prior: where the prior's gradient is taken
    std::vector<Clock> clocks, clocks_at_prior;
    Vec3 rate = Vec3::Zero();  ///< rad/s, as the gyro reads
    std::vector<Shot> shots;
    bool still = false;
    std::optional<ImuLink> to_next;
  };
  struct Seen {
    std::int64_t shot;
    double t_s;
    Sighting sighting;
    Vec2 velocity = Vec2::Zero();  ///< px/s, by finite differences
  };
  /// How a point follows the rest: landmark step = −lead − gain·(step of its columns).
  struct Elimination {
    std::vector<int> columns;
    Eigen::Matrix<double, 3, Eigen::Dynamic> gain;
    Vec3 lead = Vec3::Zero();
    Mat3 covariance = Mat3::Zero();  ///< of the point, poses taken as exact
  };
  struct Track {
    std::vector<Seen> seen;
    std::size_t wait = 0;  ///< sightings that are passed over at first
    bool active = false;   ///< takes part in every fit, not only in the prior it leaves
    bool ended = false;
    Landmark landmark;
    Elimination elimination;
  };
  struct Normals {
    Eigen::MatrixXd H;
    Eigen::VectorXd g;
    double cost = 0;
    double squares = 0, freedom = 0;  ///< of the sightings
  };
  struct Prior {
    Eigen::MatrixXd H;
    Eigen::VectorXd g;  ///< where the states were when it was made
  };
  struct Snapshot {
    std::deque<State> states;
    std::vector<Camera> cameras;
    std::vector<std::map<std::int64_t, Track>> tracks;
  };

  void lay_out();
  [[nodiscard]] int state_size() const { return motion_size + 3 * static_cast<int>(cameras_.size()); }
  [[nodiscard]] int at_state(std::size_t i) const { return border_ + static_cast<int>(i) * state_size(); }
  [[nodiscard]] int size() const { return at_state(states_.size()); }

  [[nodiscard]] bool turned_far(double t_s, const ImuHistory& imu) const;
  void add_state(double t_s, const ImuHistory& imu);
  void add_shot(const BearingFrame& frame, const ImuHistory& imu);
  [[nodiscard]] FrameSlip slip(const BearingFrame& frame) const;
  void follow(const BearingFrame& frame);
  void choose_tracks();
  void recentre(const ImuHistory& imu);
  void relink(const ImuHistory& imu);
  void solve(const ImuHistory& imu);
  double descend(const Eigen::VectorXd& step, Normals& here);
  void drop_strangers();
  void learn_beliefs(const Normals& normals);

  [[nodiscard]] Normals assemble();
  void add_prior(Normals& n) const;
  void add_link(std::size_t i, Normals& n) const;
  void add_slips(std::size_t i, Normals& n) const;
  void add_stillness(std::size_t i, Normals& n) const;
  /// False where a sighting looks at the point from behind.
  bool add_track(std::size_t camera, Track& track, Normals& n) const;
  void move(const Eigen::VectorXd& step);
  [[nodiscard]] Eigen::VectorXd deviation() const;
  [[nodiscard]] double shift_of(const State& s, const Shot& shot) const;
  [[nodiscard]] Clone clone_of(const State& s, const Shot& shot) const;
  [[nodiscard]] std::pair<std::size_t, const Shot*> find(std::int64_t shot) const;
  [[nodiscard]] std::optional<Landmark> triangulated(std::size_t camera, const Track& track) const;
  /// Takes state i out of the window: what it and, for the oldest, its tracks say becomes part of the prior.
  void marginalise(std::size_t i);

  TrackingRig rig_;
  TrackingOptions options_;
  ImuNoise noise_;
  std::vector<Camera> cameras_, cameras_at_prior_;
  int border_ = 0;
  std::deque<State> states_;
  std::vector<std::map<std::int64_t, Track>> tracks_;  ///< by camera
  Prior prior_;
  std::vector<double> last_taken_s_;  ///< by camera, on its clock
  std::int64_t next_shot_ = 0;
  std::size_t fitted_ = 0;  ///< frames since the start
  bool marginalised_ = false;
  double misfit_ = 1;
  bool broken_ = false, stepped_ = false;
  std::vector<OffsetBelief> beliefs_;
  std::vector<OffsetAndDrift> covariances_;  ///< of the newest state's clocks
  StepWatch step_watch_;                     ///< of camera 0
};

}  // namespace takt::online
