// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/calibration/estimate.h"
#include "takt/simulation/oscillator.h"
#include "takt/simulation/parameters.h"
#include "takt/streams/clock_events.h"

/// A board with a counter, a GNSS receiver beside it, and a host: their logs and the truth.
namespace takt {

/// As scenario files and the command line write it. Times of faults are seconds from the beginning.
struct ClockParameters {
  double duration_s = 600;
  double start_utc_s = 1'700'000'100;
  std::string oscillator = "tcxo";
  std::optional<double> offset_ppm, thermal_ppm, ramp_ppm, walk_frequency_s_rt;
  double tick_hz = 48e6;
  int counter_bits = 64;
  double counter_start = 123'456'789;
  double pulse_noise_s = 3.7e-9, sawtooth_s = 19.1e-9, wander_s = 0, pulse_error_s = 40e-9;
  bool tell_qerr = true;
  double lost = 0, false_edges = 0;
  double lost_from_s = -1, lost_for_s = 0;
  double flip_at_s = -1, flip_for_s = 0, pulse_width_s = 0.1;
  double label_delay_s = 0.25, label_jitter_s = 0.03;
  double fix_fraction_s = 0;
  int leap = 0;
  double leap_at_s = -1;
  int wrong_leap_s = 0;
  double leap_known_at_s = -1;
  double stall_at_s = -1, stall_for_s = 0;
  double rollover_at_s = -1;
  double restart_at_s = -1;
  double byte_loss = 0;
  double exchange_rate_hz = 10, exchange_least_s = 100e-6, exchange_mean_s = 500e-6;
  double host_stall_at_s = -1, host_stall_for_s = 0;
  double fifo_at_s = -1, fifo_for_s = 0;
  double unplug_at_s = -1, unplug_for_s = 0;
  int cameras = 2;
  double camera_rate_hz = 20, frames_lost = 0.02;
};

template <class Visitor>
void describe(ClockParameters& p, Visitor& v) {
  v("duration_s", p.duration_s, "length of the recording");
  v("start_utc_s", p.start_utc_s, "Unix time of the first pulse");
  v("oscillator", p.oscillator, "ocxo, tcxo or xo");
  v("offset_ppm", p.offset_ppm, "of the oscillator's rate");
  v("thermal_ppm", p.thermal_ppm, "amplitude of its hourly thermal cycle");
  v("ramp_ppm", p.ramp_ppm, "ramp of its rate over the middle half");
  v("walk_frequency_s_rt", p.walk_frequency_s_rt, "random walk of its rate, per root second");
  v("tick_hz", p.tick_hz, "of the counter");
  v("counter_bits", p.counter_bits, "ticks are modulo 2^bits");
  v("counter_start", p.counter_start, "ticks at the beginning");
  v("pulse_noise_s", p.pulse_noise_s, "sigma of a pulse's own error");
  v("sawtooth_s", p.sawtooth_s, "period of the receiver's clock, to which pulses are rounded");
  v("tell_qerr", p.tell_qerr, "TIM-TP tells that rounding");
  v("wander_s", p.wander_s, "slow wander of the pulses");
  v("pulse_error_s", p.pulse_error_s, "no pulse is further off: larger errors are clipped");
  v("lost", p.lost, "share of pulses that are not captured");
  v("false_edges", p.false_edges, "share of seconds with a false edge");
  v("lost_from_s", p.lost_from_s, "beginning of a gap without pulses");
  v("lost_for_s", p.lost_for_s, "its length");
  v("flip_at_s", p.flip_at_s, "from here on the wrong edge is captured");
  v("flip_for_s", p.flip_for_s, "for so long");
  v("pulse_width_s", p.pulse_width_s, "of the pulse");
  v("label_delay_s", p.label_delay_s, "pulse to the first byte of its messages");
  v("label_jitter_s", p.label_jitter_s, "sigma of that");
  v("fix_fraction_s", p.fix_fraction_s, "fixes are taken so long after the whole second, and say so");
  v("leap", p.leap, "+1 or -1: a leap second at leap_at_s");
  v("leap_at_s", p.leap_at_s, "seconds from the beginning to the end of the month");
  v("wrong_leap_s", p.wrong_leap_s, "error of the receiver's leap seconds until leap_known_at_s");
  v("leap_known_at_s", p.leap_known_at_s, "when the receiver learns of them; negative: never wrong");
  v("stall_at_s", p.stall_at_s, "from here on the receiver repeats its last second");
  v("stall_for_s", p.stall_for_s, "for so long");
  v("rollover_at_s", p.rollover_at_s, "from here on dates are 1024 weeks back");
  v("restart_at_s", p.restart_at_s, "the counter starts again");
  v("byte_loss", p.byte_loss, "share of bytes lost on the receiver's line");
  v("exchange_rate_hz", p.exchange_rate_hz, "of the exchanges with the host; 0: none");
  v("exchange_least_s", p.exchange_least_s, "least delay each way");
  v("exchange_mean_s", p.exchange_mean_s, "mean delay beyond it");
  v("host_stall_at_s", p.host_stall_at_s, "the host is busy and answers late");
  v("host_stall_for_s", p.host_stall_for_s, "for so long");
  v("fifo_at_s", p.fifo_at_s, "the device's FIFO overruns: records are lost");
  v("fifo_for_s", p.fifo_for_s, "for so long");
  v("unplug_at_s", p.unplug_at_s, "the device is unplugged: nothing is recorded");
  v("unplug_for_s", p.unplug_for_s, "for so long");
  v("cameras", p.cameras, "triggered together, each with its own exposure; 0 to 4");
  v("camera_rate_hz", p.camera_rate_hz, "of the triggers");
  v("frames_lost", p.frames_lost, "share of frames that never reach the host");
}

/// A camera as the host has its frames, with the strobes that the counter captured.
struct TriggeredCamera {
  struct Frame {
    std::int64_t stamp_ns = 0;  ///< the camera's own clock
    std::int64_t arrival_ns = 0;
    double exposure_s = 0;
    std::uint32_t number = 0;  ///< of its strobe: the truth
  };
  std::vector<Frame> frames;
  StrobeStream strobes;
  PulseStream triggers;
  Estimate truth;  ///< frame stamps against UTC, where UTC does not leap
};

/// What stands in the folder, and what is true.
struct ClockRecording {
  PulseStream pulses;
  std::string nmea, ubx;                    ///< bytes
  std::string nmea_arrivals, ubx_arrivals;  ///< byte,arrival tables
  PairStream pairs;                         ///< device against host, two-way
  Estimate truth;                           ///< counter against UTC; with the pairs' truth in `estimates`
  std::vector<std::int64_t> true_utc_ns;    ///< of each captured edge
  std::vector<TriggeredCamera> cameras;
};
/// Throws std::invalid_argument for what no rig can have.
[[nodiscard]] ClockRecording simulate_clock(const ClockParameters& parameters, std::uint64_t seed);

/// The same recording as the gateware would send it (docs/formats/wire.md): heartbeats, pulses, the receiver's NMEA,
/// triggers, exposures. Empty where the gateware has no such counter.
[[nodiscard]] std::string as_gateware_capture(const ClockRecording& recording, const ClockParameters& parameters);

}  // namespace takt
