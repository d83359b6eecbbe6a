// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "takt/estimators/batch/calibration.h"
#include "takt/estimators/batch/chain.h"
#include "takt/estimators/batch/discrete.h"
#include "takt/math/arrow_system.h"
#include "takt/motion/rotation_spline.h"
#include "takt/motion/spline.h"

/// The reference model: a continuous motion, split into a rotation and a position spline [Furgale2013, Sommer2020],
/// that every corner, rate and specific force is compared with at its own instant.
namespace takt::batch {

/// Corners of one frame that are read at nearly the same time.
struct RowBand {
  double mean_row = 0;
  std::vector<CornerObservation> corners;
};

/// A frame as the spline uses it.
struct SplineFrame {
  int camera = 0;
  double time_s = 0;  ///< camera seconds of the reference row
  double late_s = 0;  ///< how much later than stamped it was taken, where stamps jitter
  std::vector<RowBand> bands;
  int corners = 0;
};

struct SplineOptions {
  bool drift = true;
  bool line_delay = false;  ///< estimate it
  double knot_interval_s = 0.02;
  double jitter_s = 0;  ///< of the stamps, to start from; 0: none
  int threads = 0;
};

/// How the three sorts of residuals came out.
struct Residuals {
  std::vector<double> gyro_t, accel_t;  ///< IMU seconds
  std::vector<Vec3> gyro, accel;        ///< predicted − read, rad/s and m/s²
  std::vector<double> frame_t;          ///< camera seconds, frame by frame
  std::vector<double> frame_rms_px;
  std::vector<double> frame_late_s,
      frame_late_sigma_s;       ///< how late each frame looks by itself, the motion taken as known
  std::vector<Vec2> corner_px;  ///< of every corner, in order of frames
};

struct WindowOffset {
  double centre_s = 0;  ///< camera seconds
  double offset_s = 0;  ///< of this window alone, at the camera's centre
  double sigma_s = 0;
};

class SplineModel {
 public:
  /// Takes the discrete solution as its start. `cameras[0]` is the discrete model's.
  SplineModel(std::vector<const CameraSession*> cameras, const ImuSession& imu, const DiscreteFit& start,
              const SplineOptions& options);

  /// Gauss–Newton, and the noise measured on the way; false with a reason in `failure` where it does not settle.
  [[nodiscard]] bool solve();

  /// Gauss–Newton alone, the noise as it is.
  [[nodiscard]] bool settle();

  [[nodiscard]] const std::string& failure() const { return failure_; }
  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  [[nodiscard]] const BorderLayout& layout() const { return layout_; }
  [[nodiscard]] const Eigen::MatrixXd& covariance() const { return covariance_; }
  [[nodiscard]] const Noise& noise() const { return noise_; }
  [[nodiscard]] int iterations() const { return iterations_; }
  [[nodiscard]] double knot_interval_s() const { return knots_.interval_s(); }
  [[nodiscard]] std::size_t frames() const { return frames_.size(); }
  [[nodiscard]] std::size_t imu_samples() const;
  [[nodiscard]] double jitter_evidence() const { return jitter_evidence_; }

  [[nodiscard]] Residuals residuals() const;
  /// One offset a window for the first camera, all else shared: one linear step from the solution.
  [[nodiscard]] std::vector<WindowOffset> window_offsets(int windows) const;

  /// At none; before another solve().
  void fix_line_delay();
  void fix_drift();

 private:
  static constexpr int order = 6, knot_size = 6;
  /// Frames' time scores scatter by this many standard deviations too much: a jitter.
  static constexpr double jitter_threshold = 6;
  struct Weights {
    double corner, gyro, accel;  ///< 1/σ² of one number
  };
  struct Sums {
    double squares[3] = {0, 0, 0};
    double count[3] = {0, 0, 0};
  };
  struct Span {
    std::size_t first, last;
  };
  /// What a frame's corners say about its lateness: Σ (r + rate·δ)² in px².
  struct TimeScore {
    double information = 0, gradient = 0, squares = 0;
  };

  void take_frames(const DiscreteFit& start);
  void take_samples();
  void start_motion(const DiscreteFit& start);
  void lay_out();
  [[nodiscard]] int band_size() const { return knot_size * knots_.control_points(); }
  [[nodiscard]] Weights weights() const;
  [[nodiscard]] ArrowSystem normal_equations(const Weights& w, const BorderLayout& layout, Sums& sums) const;
  void add_frame(const SplineFrame& f, const Weights& w, const BorderLayout& layout, int window, ArrowSystem& system,
                 Sums& sums) const;
  void add_samples(const Span& samples, const Weights& w, const BorderLayout& layout, ArrowSystem& system,
                   Sums& sums) const;
  void add_stiffness(ArrowSystem& system) const;
  double measure_noise();
  void move(const Eigen::VectorXd& step);
  /// Until steps are below `enough` sigmas; after fewer than the usual most, however far they still are.
  [[nodiscard]] bool iterate(double enough, int most);
  void settle_lateness();
  [[nodiscard]] TimeScore time_score(const SplineFrame& f) const;
  bool find_jitter();
  void measure_jitter(double log_determinant);
  [[nodiscard]] int window_of(const SplineFrame& f, int windows) const;
  [[nodiscard]] bool within_reach() const;
  [[nodiscard]] int knots_of_a_frame() const;

  std::vector<const CameraSession*> cameras_;
  const ImuSession& imu_;
  SplineOptions options_;
  Calibration calibration_;
  BorderLayout layout_;
  Noise noise_;
  double begin_s_ = 0;  ///< IMU seconds of the spline's start
  UniformKnots<order> knots_{1, order};
  RotationSpline<order> rotation_{1, std::vector<Quat>(order, Quat::Identity())};
  EuclideanSpline<3, order> position_{1, Eigen::Matrix3Xd::Zero(3, order)};
  std::vector<SplineFrame> frames_;
  std::vector<Span> samples_;  ///< of the IMU, one span a knot segment; empty ones left out
  Eigen::MatrixXd covariance_;
  std::string failure_;
  int iterations_ = 0;
  double jitter_evidence_ = 0;
};

}  // namespace takt::batch
