// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "takt/estimators/clock/clock_model.h"
#include "takt/estimators/clock/pulse_train.h"
#include "takt/estimators/clock/second_labels.h"

namespace takt {

/// A counter disciplined as its pulses and labels come: the same filter, noise levels and rules for labels as offline,
/// from the past alone. Memory is bounded.
class LiveClock {
 public:
  /// `pulse_error_s`: no pulse is further off than this; makes hard bounds, for any crystal whose rate moves by less
  /// than 2·10⁻⁸ a second.
  explicit LiveClock(const DeviceCounter& counter, const LabelOptions& labels = {},
                     std::optional<double> pulse_error_s = {});

  /// One captured edge. True where it belongs to the train of pulses.
  bool observe_pulse(std::int64_t ticks);
  /// A message, with its arrival on the same counter.
  void observe_label(const TimeLabel& label);
  /// UTC of a captured edge; nothing before the clock has started.
  [[nodiscard]] std::optional<DisciplinedStamp> stamp(std::int64_t ticks) const;

  [[nodiscard]] ClockState state() const { return state_; }
  [[nodiscard]] const std::string& why() const { return why_; }  ///< where the second is ambiguous
  [[nodiscard]] std::size_t pulses() const { return accepted_; }
  [[nodiscard]] std::size_t rejected() const { return rejected_; }
  [[nodiscard]] std::size_t restarts() const { return restarts_; }
  [[nodiscard]] double rate_ppm() const;
  [[nodiscard]] double sigma_s() const;

 private:
  void start_over();
  bool try_to_start();
  void accept(std::int64_t second, std::int64_t ticks);
  void judge_labels();
  [[nodiscard]] double elapsed_s(std::int64_t ticks) const;
  void add_bounds(std::int64_t ticks, double whole_second_s, DisciplinedStamp& out) const;

  DeviceCounter counter_;
  LabelOptions options_;
  std::optional<double> pulse_error_s_;
  CountExtender extender_;
  std::vector<std::int64_t> waiting_;  // edges before the start, or outside the train
  std::deque<TrainPulse> recent_;      // accepted
  std::deque<PhaseSample> samples_;
  std::deque<TimeLabel> labels_;
  ClockFilter filter_;
  std::int64_t first_ticks_ = 0;  // second 0
  std::int64_t last_second_ = 0, last_ticks_ = 0;
  bool running_ = false;
  LabelledTrain scale_;
  std::optional<std::int64_t> gps_minus_count_;
  ClockState state_ = ClockState::ambiguous;
  std::string why_ = "no pulses yet";
  std::size_t accepted_ = 0, rejected_ = 0, restarts_ = 0;
  std::size_t train_pulses_ = 0;  // of this train
  std::size_t distrusted_ = 0;    // so many pulses more, since a named train has stepped: one of both is not the second
};

}  // namespace takt
