// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/estimators/batch/calibration.h"
#include "takt/estimators/batch/motion_start.h"
#include "takt/math/arrow_system.h"
#include "takt/motion/rotation_spline.h"
#include "takt/motion/spline.h"

/// The reference model: one continuous motion, split into a rotation and a position spline [Furgale2013, Sommer2020],
/// that every camera's corners and every IMU's rates and specific forces are compared with at their own instants.
namespace takt::batch {

/// Corners of one frame that are read at nearly the same time.
struct RowBand {
  double mean_row = 0;
  std::vector<CornerObservation> corners;
};

/// A frame as the spline uses it.
struct SplineFrame {
  std::size_t camera = 0;
  double time_s = 0;  ///< camera seconds of the reference row
  double late_s = 0;  ///< how much later than stamped it was taken, where stamps jitter
  std::vector<RowBand> bands;
  int corners = 0;
};

struct SplineOptions {
  bool drift = true;
  std::vector<bool> line_delay = {};  ///< one a camera: estimate it
  bool find_imus = true;              ///< matrices and response of IMUs whose residuals ask for them
  double knot_interval_s = 0.02;
  int threads = 0;
};

/// How the residuals of a camera and of an IMU came out.
struct CameraResiduals {
  std::vector<double> frame_t;  ///< camera seconds, frame by frame
  std::vector<double> frame_rms_px;
  /// How late each frame looks by itself, the motion taken as known.
  std::vector<double> frame_late_s, frame_late_sigma_s;
  std::vector<Vec2> at_px, off_px;  ///< of every corner: where it was seen, and predicted − seen
};
struct ImuResiduals {
  std::vector<double> t;          ///< IMU seconds
  std::vector<Vec3> gyro, accel;  ///< predicted − read, rad/s and m/s²
};
struct Residuals {
  std::vector<CameraResiduals> cameras;
  std::vector<ImuResiduals> imus;
};

struct WindowOffset {
  double centre_s = 0;  ///< camera seconds
  double offset_s = 0;  ///< of this window alone, at the camera's centre
  double sigma_s = 0;
};

/// What an IMU would gain from being more than its data sheet says: χ² of its matrices (15 numbers) and of its
/// response (3), by one linear step from the solution.
struct ImuEvidence {
  /// What chance passes once in millions, of 15 and of 3 numbers.
  static constexpr double clear_matrices = 70, clear_response = 40;
  double matrices = 0, response = 0;
};

class SplineModel {
 public:
  SplineModel(const Rig& rig, const MotionStart& start, const SplineOptions& options);

  /// Gauss–Newton, and the noise measured on the way; false with a reason in `failure` where it does not settle.
  [[nodiscard]] bool solve();

  /// Gauss–Newton alone, the noise as it is.
  [[nodiscard]] bool settle();

  [[nodiscard]] const std::string& failure() const { return failure_; }
  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  [[nodiscard]] const BorderLayout& layout() const { return layout_; }
  [[nodiscard]] const Eigen::MatrixXd& covariance() const { return covariance_; }
  [[nodiscard]] const Noise& noise() const { return noise_; }
  [[nodiscard]] double knot_interval_s() const { return knots_.interval_s(); }

  [[nodiscard]] Residuals residuals() const;
  /// One offset a window for one camera, all else shared: one linear step from the solution.
  [[nodiscard]] std::vector<WindowOffset> window_offsets(std::size_t camera, int windows) const;
  [[nodiscard]] std::vector<ImuEvidence> imu_evidence() const;

  /// Each before another solve() or settle(): at none, or to be found.
  void fix_line_delay(std::size_t camera);
  void fix_camera_drift(std::size_t camera);
  void fix_imu_drift(std::size_t imu);
  void free_matrices(std::size_t imu);

 private:
  static constexpr int order = 6, knot_size = 6;
  /// Frames' time scores scatter by this many standard deviations too much: a jitter.
  static constexpr double jitter_threshold = 6;
  /// 1/σ² of one number; sorts of residuals: corners of each camera, then gyro and accelerometer of each IMU.
  using Weights = std::vector<double>;
  struct Sums {
    std::vector<double> squares, count;
  };
  struct Span {
    std::size_t imu, first, last;
  };
  /// What a frame's corners say about its lateness: Σ (r + rate·δ)² in px².
  struct TimeScore {
    double information = 0, gradient = 0, squares = 0;
  };
  /// What an ideal IMU at its place feels, along its axes.
  struct Felt {
    Vec3 rate, force;
  };
  /// What is not yet free of a sensor, and is.
  struct Freedom {
    std::vector<bool> camera_drift, line_delay, imu_drift, matrices, response;
  };

  [[nodiscard]] std::size_t sorts() const { return cameras_.size() + 2 * imus_.size(); }
  [[nodiscard]] std::size_t gyro_sort(std::size_t imu) const { return cameras_.size() + 2 * imu; }
  void take_frames(const MotionStart& start);
  void take_intervals();
  void take_samples();
  void start_motion(const MotionStart& start);
  [[nodiscard]] BorderLayout lay_out(const Freedom& free) const;
  [[nodiscard]] int band_size() const { return knot_size * knots_.control_points(); }
  [[nodiscard]] Weights weights() const;
  [[nodiscard]] ArrowSystem normal_equations(const Weights& w, const BorderLayout& layout, Sums& sums) const;
  void add_frame(const SplineFrame& f, const Weights& w, const BorderLayout& layout, ArrowSystem& system,
                 Sums& sums) const;
  void add_samples(const Span& samples, const Weights& w, const BorderLayout& layout, ArrowSystem& system,
                   Sums& sums) const;
  [[nodiscard]] Felt felt(const ImuLink& imu, double t) const;
  /// The same as the IMU's matrices and response have it; biases are not in it.
  [[nodiscard]] Felt reading(const ImuLink& imu, double t) const;
  void add_corner_residuals(const SplineFrame& f, CameraResiduals& out) const;
  void add_stiffness(ArrowSystem& system) const;
  double measure_noise();
  void move(const Eigen::VectorXd& step);
  /// Until steps are below `enough` sigmas; after fewer than the usual most, however far they still are.
  [[nodiscard]] bool iterate(double enough, int most);
  void settle_lateness();
  [[nodiscard]] TimeScore time_score(const SplineFrame& f) const;
  bool free_imus();
  bool find_jitter();
  bool find_jitter(std::size_t camera, double log_determinant);
  double measure_jitter(std::size_t camera, double log_determinant);
  [[nodiscard]] bool any_jitter() const;
  [[nodiscard]] double log_determinant() const;  ///< of H; 0 where it has none
  [[nodiscard]] int window_of(const SplineFrame& f, int windows) const;
  [[nodiscard]] bool within_reach() const;
  [[nodiscard]] int knots_of_a_frame() const;

  std::vector<const CameraSession*> cameras_;
  std::vector<const ImuSession*> imus_;
  SplineOptions options_;
  Calibration calibration_;
  Freedom free_;
  BorderLayout layout_;
  Noise noise_;
  double begin_s_ = 0;  ///< body seconds of the spline's start
  UniformKnots<order> knots_{1, order};
  RotationSpline<order> rotation_{1, std::vector<Quat>(order, Quat::Identity())};
  EuclideanSpline<3, order> position_{1, Eigen::Matrix3Xd::Zero(3, order)};
  std::vector<SplineFrame> frames_;                   ///< camera by camera, in order of time
  std::vector<std::pair<double, double>> intervals_;  ///< body seconds in which IMU samples count
  std::vector<Span> samples_;                         ///< of one IMU within one knot segment each
  Eigen::MatrixXd covariance_;
  std::string failure_;
};

}  // namespace takt::batch
