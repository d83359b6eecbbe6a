// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/clock_rig.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "takt/simulation/random.h"
#include "takt/simulation/receiver.h"
#include "takt/time/time_scales.h"

namespace takt {

namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

/// Phase between the seconds: straight, for an oscillator does not move within one.
class Device {
 public:
  Device(const ClockParameters& p, std::uint64_t seed) : p_(p) {
    OscillatorModel m = oscillator_model(p.oscillator);
    if (p.offset_ppm) m.offset_ppm = *p.offset_ppm;
    if (p.thermal_ppm) m.thermal_ppm = *p.thermal_ppm;
    if (p.walk_frequency_s_rt) m.walk_frequency = *p.walk_frequency_s_rt * *p.walk_frequency_s_rt;
    if (p.ramp_ppm) m.ramp_ppm = *p.ramp_ppm, m.ramp_start_s = p.duration_s / 4, m.ramp_length_s = p.duration_s / 2;
    phase_ = oscillator_phase(m, static_cast<std::size_t>(p.duration_s) + 4, 1.0, seed);
  }
  [[nodiscard]] double phase(double t) const {
    const double clamped = std::clamp(t, 0.0, static_cast<double>(phase_.size() - 2));
    const auto i = static_cast<std::size_t>(clamped);
    return phase_[i] + (phase_[i + 1] - phase_[i]) * (t - static_cast<double>(i));
  }
  [[nodiscard]] double rate(std::size_t i) const { return phase_[i + 1] - phase_[i]; }
  /// Full count at true time t, before wraps and restarts.
  [[nodiscard]] long double count(double t) const {
    return static_cast<long double>(p_.counter_start) +
           (static_cast<long double>(t) + static_cast<long double>(phase(t))) * static_cast<long double>(p_.tick_hz);
  }
  /// What the counter shows.
  [[nodiscard]] std::int64_t ticks(double t) const {
    long double c = count(t);
    if (p_.restart_at_s >= 0 && t >= p_.restart_at_s) c = count(t) - count(p_.restart_at_s);
    const auto whole = static_cast<std::int64_t>(std::floor(c));
    return p_.counter_bits >= 64 ? whole
                                 : static_cast<std::int64_t>(static_cast<std::uint64_t>(whole) &
                                                             ((std::uint64_t{1} << p_.counter_bits) - 1));
  }

 private:
  ClockParameters p_;
  std::vector<double> phase_;
};

bool within(double t, double from, double length) {
  return from >= 0 && t >= from && t < from + length;
}

/// True GPS − UTC at t: the table's, and the simulated leap second.
struct Scale {
  std::int64_t first_gps_s;
  int before;
  int after;
  double leap_at_s;  // on the simulation's time: when the new value holds
  [[nodiscard]] int at(std::int64_t t) const {
    return leap_at_s >= 0 && static_cast<double>(t) >= leap_at_s ? after : before;
  }
  [[nodiscard]] bool leap_second(std::int64_t t) const {
    return leap_at_s >= 0 && after > before && static_cast<double>(t) == leap_at_s;
  }
  [[nodiscard]] std::int64_t utc_ns(std::int64_t t) const {
    return (first_gps_s + t + gps_epoch_utc_s - at(t)) * second_ns;
  }
};

Scale scale_of(const ClockParameters& p) {
  const auto start = static_cast<std::int64_t>(std::llround(p.start_utc_s));
  Scale s{};
  s.first_gps_s = to_ns(to_gps(from_ns<Utc>(start * second_ns))) / second_ns;
  s.before = static_cast<int>(s.first_gps_s + gps_epoch_utc_s - start);
  s.after = s.before + p.leap;
  s.leap_at_s = p.leap == 0 ? -1 : p.leap_at_s - (p.leap < 0 ? 1 : 0);
  if (p.leap != 0 &&
      (p.leap_at_s < 0 || std::abs(p.leap) != 1 || (start + static_cast<std::int64_t>(p.leap_at_s)) % 86400 != 0))
    throw std::invalid_argument("leap must be 1 or -1, with leap_at_s at a midnight of UTC");
  return s;
}

void check(const ClockParameters& p) {
  if (!(p.duration_s >= 10 && p.duration_s <= 1e6))
    throw std::invalid_argument("duration_s must lie between 10 and 1e6");
  if (!(p.tick_hz >= 1e3 && p.tick_hz <= 1e10)) throw std::invalid_argument("tick_hz must lie between 1e3 and 1e10");
  if (p.counter_bits < 16 || p.counter_bits > 64)
    throw std::invalid_argument("counter_bits must lie between 16 and 64");
  for (const double share : {p.lost, p.false_edges, p.byte_loss})
    if (!(share >= 0 && share < 1)) throw std::invalid_argument("lost, false_edges and byte_loss are shares below 1");
  if (!(p.fix_fraction_s >= 0 && p.fix_fraction_s < 1))
    throw std::invalid_argument("fix_fraction_s must lie within one second");
  if (!(p.cameras >= 0 && p.cameras <= 4 && p.camera_rate_hz > 0 && p.camera_rate_hz <= 1000 && p.frames_lost >= 0 &&
        p.frames_lost < 1))
    throw std::invalid_argument("cameras must be 0 to 4, camera_rate_hz 0 to 1000, frames_lost a share below 1");
  if (!(p.exchange_rate_hz >= 0 && p.exchange_least_s >= 0 && p.exchange_mean_s >= 0))
    throw std::invalid_argument("exchanges cannot have negative rates or delays");
}

void capture(const ClockParameters& p, const Device& device, const std::vector<SimulatedPulse>& errors,
             const Scale& scale, std::uint64_t seed, ClockRecording& out) {
  Random random(seed, "captures");
  out.pulses.name = "pps";
  out.pulses.counter = {"board", p.tick_hz, p.counter_bits};
  std::uint32_t sequence = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const auto t = static_cast<double>(i);
    const bool lost = random.chance(p.lost), has_false = random.chance(p.false_edges);
    const double at_false = random.uniform(0.02, 0.98);
    const auto add = [&](double when) {
      const bool overrun = within(when, p.fifo_at_s, p.fifo_for_s);
      ++sequence;
      if (overrun || within(when, p.unplug_at_s, p.unplug_for_s)) return;
      Pulse pulse;
      pulse.ticks = device.ticks(when);
      pulse.sequence = sequence;
      out.pulses.pulses.push_back(pulse);
      const double whole = std::floor(when + 0.5e-3);
      out.true_utc_ns.push_back(scale.utc_ns(static_cast<std::int64_t>(whole)) + std::llround((when - whole) * 1e9));
    };
    const double width = within(t, p.flip_at_s, p.flip_for_s) ? p.pulse_width_s : 0;
    if (!lost && !within(t, p.lost_from_s, p.lost_for_s)) add(t + errors[i].error_s + width);
    if (has_false) add(t + at_false);
  }
}

/// The receiver's messages, as bytes, with the count at which each burst began.
void talk(const ClockParameters& p, const Device& device, const std::vector<SimulatedPulse>& errors, const Scale& scale,
          std::uint64_t seed, ClockRecording& out) {
  Random random(seed, "receiver");
  out.nmea_arrivals = out.ubx_arrivals = "byte,arrival\n";
  std::int64_t said = 0;
  for (std::size_t i = 0; i + 1 < errors.size(); ++i) {
    const auto t = static_cast<std::int64_t>(i);
    const auto now = static_cast<double>(t);
    const double delay = p.label_delay_s + p.fix_fraction_s + p.label_jitter_s * random.normal();
    if (!within(now, p.stall_at_s, p.stall_for_s)) said = t;
    ReceiverSecond s;
    s.gps_s = scale.first_gps_s + said;
    const bool wrong = p.leap_known_at_s >= 0 && now < p.leap_known_at_s;
    s.gps_minus_utc_s = scale.at(said) + (wrong ? p.wrong_leap_s : 0);
    s.leap_resolved = !wrong;
    s.leap_second = scale.leap_second(said);
    if (s.leap_second) s.gps_minus_utc_s = scale.before;
    s.date_shift_s = p.rollover_at_s >= 0 && now >= p.rollover_at_s ? -1024 * 604800LL : 0;
    s.fix_fraction_s = p.fix_fraction_s;
    s.next_error_s = p.tell_qerr ? errors[i + 1].told_s : 0;
    const double arrival = now + std::max(delay, 1e-3);
    if (within(arrival, p.unplug_at_s, p.unplug_for_s)) continue;
    const auto send = [&](const std::string& bytes, double when, std::string& to, std::string& arrivals) {
      arrivals += fmt::format("{},{}\n", to.size(), device.ticks(when));
      for (const char c : bytes)
        if (!random.chance(p.byte_loss)) to += c;
    };
    send(nmea_messages(s), arrival, out.nmea, out.nmea_arrivals);
    send(ubx_messages(s), arrival + 0.02, out.ubx, out.ubx_arrivals);
  }
}

void exchange(const ClockParameters& p, const Device& device, std::int64_t host_start_ns, std::uint64_t seed,
              ClockRecording& out) {
  if (p.exchange_rate_hz <= 0) return;
  Random random(seed, "exchanges");
  out.pairs.two_way = true;
  out.pairs.device = "board";
  const auto delay = [&](double t) {
    const double busy = within(t, p.host_stall_at_s, p.host_stall_for_s) ? random.uniform(0.02, 0.5) : 0;
    return p.exchange_least_s - p.exchange_mean_s * std::log1p(-random.uniform()) + busy;
  };
  const auto count = static_cast<std::size_t>(p.duration_s * p.exchange_rate_hz);
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / p.exchange_rate_hz;
    const double request = t - delay(t), response = t + delay(t);
    if (within(t, p.unplug_at_s, p.unplug_for_s)) continue;
    ClockPair pair;
    const long double device_s = device.count(t) / static_cast<long double>(p.tick_hz);
    pair.device_ns = static_cast<std::int64_t>(std::llroundl(device_s * 1e9L));
    // The host reads its clock before it sends and after it has received.
    pair.request_ns = host_start_ns + static_cast<std::int64_t>(std::floor(request * 1e9));
    pair.arrival_ns = host_start_ns + static_cast<std::int64_t>(std::ceil(response * 1e9));
    out.pairs.pairs.push_back(pair);
  }
}

/// Cameras with automatic exposure, triggered at once; each takes its own time to begin, and has its own clock.
void film(const ClockParameters& p, const Device& device, const Scale& scale, std::int64_t host_start_ns,
          std::uint64_t seed, ClockRecording& out) {
  const auto count = static_cast<std::size_t>(p.duration_s * p.camera_rate_hz);
  for (int c = 0; c < p.cameras; ++c) {
    Random random(seed, fmt::format("camera {}", c));
    TriggeredCamera& camera = out.cameras.emplace_back();
    camera.strobes.name = fmt::format("cam{}", c);
    camera.triggers.name = fmt::format("trigger{}", c);
    camera.strobes.counter = camera.triggers.counter = out.pulses.counter;
    const double delay = 20e-6 + 15e-6 * c, usual = 0.004 + 0.003 * c, ppm = random.uniform(-40, 40);
    const std::int64_t zero_ns = 5'000'000'000 + 1'000'000'000LL * c;
    double slow = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double t = (static_cast<double>(i) + 0.5) / p.camera_rate_hz;
      slow = 0.95 * slow + 0.05 * random.normal();
      const double exposure = usual * (1 + 0.6 * std::tanh(slow) + 0.02 * random.normal());
      const double start = t + delay, end = start + exposure;
      const double read = 20e-6 * random.normal(), late = 0.003 - 0.002 * std::log1p(-random.uniform());
      const bool lost = random.chance(p.frames_lost);
      if (within(t, p.unplug_at_s, p.unplug_for_s)) continue;
      const auto number = static_cast<std::uint32_t>(i + 1);
      camera.triggers.pulses.push_back({.ticks = device.ticks(t), .edge = Edge::rising, .sequence = number - 1});
      camera.strobes.strobes.push_back({device.ticks(start), device.ticks(end), number});
      if (lost) continue;
      const double middle = 0.5 * (start + end);
      camera.frames.push_back({zero_ns + std::llround((middle + read) * (1 + 1e-6 * ppm) * 1e9),
                               host_start_ns + std::llround((end + late) * 1e9), exposure, number});
    }
    Estimate& truth = camera.truth;
    truth.method = "truth";
    truth.sensor = camera.strobes.name;
    truth.reference = "utc";
    truth.verdict = Verdict::trusted;
    truth.sigma_s = 0;
    const double half = 0.5 * p.duration_s;
    truth.epoch = from_ns(zero_ns + std::llround(half * (1 + 1e-6 * ppm) * 1e9));
    truth.offset = Duration(scale.utc_ns(static_cast<std::int64_t>(half)) +
                            std::llround((half - std::floor(half)) * 1e9) - to_ns(truth.epoch));
    truth.drift = 1 / (1 + 1e-6 * ppm) - 1;
    truth.drift_sigma = 0;
  }
}

/// reference = device + offset, in pieces of a second (longer ones in long runs).
Estimate truth_of(const ClockParameters& p, const Device& device, const Scale& scale, bool restarts) {
  Estimate truth;
  truth.method = "truth";
  truth.sensor = "board";
  truth.reference = "utc";
  truth.verdict = Verdict::trusted;
  truth.sigma_s = 0;
  // A counter that starts again has two relations; the truth is that of the longer run.
  const bool later = restarts && 2 * p.restart_at_s < p.duration_s;
  const long double base = later ? device.count(p.restart_at_s) : 0;
  const auto device_ns = [&](std::int64_t t) {
    return static_cast<std::int64_t>(
        std::llroundl((device.count(static_cast<double>(t)) - base) * (1e9L / static_cast<long double>(p.tick_hz))));
  };
  const auto first = static_cast<std::int64_t>(later ? std::ceil(p.restart_at_s) : 0);
  const auto last = static_cast<std::int64_t>(restarts && !later ? std::floor(p.restart_at_s) : p.duration_s);
  std::vector<std::int64_t> ends;
  const std::int64_t step = std::max<std::int64_t>(1, (last - first) / 20000);
  for (std::int64_t t = first; t < last; t += step) ends.push_back(t);
  if (scale.leap_at_s >= 0) ends.push_back(static_cast<std::int64_t>(scale.leap_at_s));
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  for (std::size_t k = 0; k < ends.size(); ++k) {
    const std::int64_t a = ends[k], b = k + 1 < ends.size() ? ends[k + 1] : last;
    OffsetPiece piece;
    piece.start = piece.epoch = from_ns(device_ns(a));
    piece.offset = Duration(scale.utc_ns(a) - device_ns(a));
    piece.drift = static_cast<double>((b - a) * second_ns) / static_cast<double>(device_ns(b) - device_ns(a)) - 1;
    truth.pieces.push_back(piece);
  }
  const OffsetPiece& middle = truth.pieces[truth.pieces.size() / 2];
  truth.epoch = middle.epoch;
  truth.offset = middle.offset;
  truth.drift = middle.drift;
  truth.drift_sigma = 0;
  return truth;
}

}  // namespace

ClockRecording simulate_clock(const ClockParameters& p, std::uint64_t seed) {
  check(p);
  const Scale scale = scale_of(p);
  const Device device(p, seed);
  std::vector<SimulatedPulse> errors =
      pulse_errors({.white_s = p.pulse_noise_s, .sawtooth_s = p.sawtooth_s, .corrected = true, .wander_s = p.wander_s},
                   static_cast<std::size_t>(p.duration_s), seed);
  for (SimulatedPulse& e : errors) e.error_s = std::clamp(e.error_s, -p.pulse_error_s, p.pulse_error_s);
  ClockRecording out;
  capture(p, device, errors, scale, seed, out);
  talk(p, device, errors, scale, seed, out);
  const std::int64_t host_start_ns = scale.utc_ns(0) + 7'000'000'000'000;  // the host's clock is nobody's time
  exchange(p, device, host_start_ns, seed, out);
  film(p, device, scale, host_start_ns, seed, out);
  out.truth = truth_of(p, device, scale, p.restart_at_s >= 0);
  Estimate host = truth_of(p, device, {scale.first_gps_s, scale.before, scale.before, -1}, false);
  host.reference = "host";
  for (OffsetPiece& piece : host.pieces) piece.offset += Duration(7'000'000'000'000);
  host.offset = *host.offset + Duration(7'000'000'000'000);
  out.truth.estimates = {host};
  if (p.leap == 0)
    for (const TriggeredCamera& camera : out.cameras) out.truth.estimates.push_back(camera.truth);
  return out;
}

}  // namespace takt
