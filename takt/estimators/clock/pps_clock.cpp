// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/pps_clock.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "takt/calibration/words.h"
#include "takt/estimators/clock/allan.h"
#include "takt/estimators/clock/bound_hull.h"
#include "takt/estimators/clock/clock_model.h"
#include "takt/estimators/clock/pair_clock.h"
#include "takt/time/time_scales.h"

namespace takt {

namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::size_t least_pulses = 8;
constexpr double phase_step_s = 1e-3;  // more than an oscillator does between two pulses

/// One segment on the way.
struct Piece {
  const TrainSegment* train = nullptr;
  const SegmentLabels* labels = nullptr;
  std::vector<PhaseSample> samples;  // device minus reference, since the first pulse
  ClockNoise noise;
  SmoothedClock clock;            // one a sample
  std::vector<PhaseSample> grid;  // the samples, and instants in the gaps between them
  SmoothedClock grid_clock;
  std::vector<AllanPoint> allan;
  std::int64_t first_gps_s = 0;  // of the first pulse; without labels a whole number near the device's own
  std::int64_t first_device_ns = 0;
  bool qerr_used = false;
};

/// Ticks as ns of the nominal rate, rounded.
std::int64_t device_ns(std::int64_t ticks, double tick_hz) {
  if (tick_hz == 1e9) return ticks;
  return static_cast<std::int64_t>(
      std::llroundl(static_cast<long double>(ticks) * (1e9L / static_cast<long double>(tick_hz))));
}

/// A count that has no stamp: ns since the counter's zero do not fit.
std::optional<std::int64_t> beyond_int64(const PulseStream& pulses) {
  constexpr double most_s = 9.2e9;
  for (const Pulse& p : pulses.pulses)
    if (std::abs(static_cast<double>(p.ticks)) / pulses.counter.tick_hz > most_s) return p.ticks;
  return std::nullopt;
}

/// A capture gives the last tick at or before the edge: on average the edge is half a tick later.
void take_samples(Piece& piece, double tick_hz) {
  const std::int64_t first = piece.train->pulses.front().ticks;
  for (const TrainPulse& p : piece.train->pulses) {
    const long double elapsed = static_cast<long double>(p.ticks - first) / static_cast<long double>(tick_hz);
    piece.samples.push_back({static_cast<double>(p.second),
                             static_cast<double>(elapsed - static_cast<long double>(p.second)) + 0.5 / tick_hz});
  }
}

/// Runs the clock over samples and gaps: in a gap σ grows and shrinks again, and the answer must say so.
void run_clock(Piece& p) {
  std::vector<std::size_t> slips, place;
  for (std::size_t i = 0; i < p.samples.size(); ++i) {
    if (i > 0) {
      const double from = p.samples[i - 1].t_s, length = p.samples[i].t_s - from;
      const double instants = std::min(length, 64.0);
      for (double k = 1; k < instants; ++k) p.grid.push_back({from + std::floor(k * length / instants), std::nan("")});
    }
    if (std::binary_search(p.train->slips.begin(), p.train->slips.end(), i)) slips.push_back(p.grid.size());
    place.push_back(p.grid.size());
    p.grid.push_back(p.samples[i]);
  }
  p.grid_clock = smooth(p.grid, p.noise, slips);
  for (const std::size_t k : place) {
    p.clock.at.push_back(p.grid_clock.at[k]);
    p.clock.used.push_back(p.grid_clock.used[k]);
    p.clock.innovations_s.push_back(p.grid_clock.innovations_s[k]);
  }
}

double roughness(const std::vector<PhaseSample>& s, const std::vector<double>& off, double sign) {
  std::vector<double> d;
  for (std::size_t i = 2; i < s.size(); ++i)
    if (s[i].t_s - s[i - 2].t_s == 2) {
      const auto at = [&](std::size_t k) { return s[k].phase_s - sign * off[k]; };
      d.push_back(std::abs(at(i) - 2 * at(i - 1) + at(i - 2)));
    }
  if (d.size() < 20) return 0;
  // Mean of squares without the largest tenth: an outlier must not decide the sign.
  std::sort(d.begin(), d.end());
  d.resize(d.size() * 9 / 10);
  double sum = 0;
  for (const double x : d) sum += x * x;
  return sum / static_cast<double>(d.size());
}

/// Takes off what the receiver says of each pulse, if that makes them smoother; the sign is checked by the same means.
std::string take_off_qerr(Piece& piece, const std::vector<LabelStream>& logs, const LabelledTrain& scale,
                          const std::string& mode) {
  std::vector<PulseError> errors;
  for (const LabelStream& log : logs) errors.insert(errors.end(), log.pulse_errors.begin(), log.pulse_errors.end());
  if (mode == "off" || errors.empty() || !piece.labels->known) return "";
  std::map<std::int64_t, double> by_second;
  for (const PulseError& e : errors) {
    std::int64_t gps_s = (e.time_ns + second_ns / 2) / second_ns;
    if (e.scale == LabelScale::utc) {
      const std::int64_t unix_s = gps_s - gps_epoch_utc_s;
      gps_s = unix_s + scale.gps_minus_utc_s(unix_s + 18);
    }
    by_second[gps_s] = e.error_s;
  }
  std::vector<double> off(piece.samples.size(), 0);
  std::size_t told = 0;
  for (std::size_t i = 0; i < off.size(); ++i) {
    const auto found = by_second.find(piece.first_gps_s + static_cast<std::int64_t>(piece.samples[i].t_s));
    if (found != by_second.end()) off[i] = found->second, ++told;
  }
  if (2 * told < off.size())
    return told == 0 ? "" : fmt::format("qErr is told for {} of {} pulses only; not used", told, off.size());
  const double raw = roughness(piece.samples, off, 0), plus = roughness(piece.samples, off, 1),
               minus = roughness(piece.samples, off, -1);
  double sign = 1;
  if (mode == "auto") {
    if (raw <= 0 || std::min(plus, minus) > 0.97 * raw) return "qErr does not make the pulses any smoother; not used";
    sign = plus <= minus ? 1 : -1;
  } else {
    sign = minus < plus ? -1 : 1;
  }
  for (std::size_t i = 0; i < off.size(); ++i) piece.samples[i].phase_s -= sign * off[i];
  piece.qerr_used = true;
  return fmt::format("qErr taken off with sign {}: the scatter of the pulses falls to {:.0f} %", sign > 0 ? "+" : "−",
                     100 * std::sqrt(std::min(plus, minus) / std::max(raw, 1e-40)));
}

/// What is added to an instant on GPS time for the reference; without labels the scale is nobody's, and stays.
std::int64_t shift_ns(const Piece& p, std::int64_t gps_ns, const LabelledTrain& scale, const PpsOptions& o) {
  return p.labels->known && o.reference != "gps" ? scale.utc_ns(gps_ns) - gps_ns : 0;
}

std::int64_t reference_ns(const Piece& p, std::int64_t second, const LabelledTrain& scale, const PpsOptions& o) {
  const std::int64_t gps_ns = (p.first_gps_s + second) * second_ns;
  return gps_ns + shift_ns(p, gps_ns, scale, o);
}

/// GPS − device on the device's stamp that the smoothed clock shows at a whole second.
struct Anchor {
  std::int64_t device_ns, offset_ns;
  double sigma_s, drift;
};
Anchor anchor(const Piece& p, double t_s, const ClockPrediction& at) {
  const auto second = static_cast<std::int64_t>(t_s);
  const auto phase_ns = static_cast<std::int64_t>(std::llround(at.phase_s * 1e9));
  Anchor a{};
  a.device_ns = p.first_device_ns + second * second_ns + phase_ns;
  a.offset_ns = (p.first_gps_s + second) * second_ns - a.device_ns;
  a.sigma_s = std::max(at.phase_sigma_s, 0.3e-9);  // results are whole ns
  a.drift = -at.frequency / (1 + at.frequency);
  return a;
}

/// Of the last pulse, by the smoothed clock.
std::int64_t last_device_ns(const Piece& p) {
  return anchor(p, p.samples.back().t_s, p.clock.at.back()).device_ns;
}

/// Pieces on GPS time put on the reference: where UTC leaps within one, it is cut there.
std::vector<OffsetPiece> on_reference(const std::vector<OffsetPiece>& gps, std::int64_t end_device_ns, const Piece& p,
                                      const LabelledTrain& scale, const PpsOptions& o) {
  std::vector<OffsetPiece> out;
  for (std::size_t i = 0; i < gps.size(); ++i) {
    const OffsetPiece& g = gps[i];
    const auto gps_at = [&g](std::int64_t device_ns) {
      return device_ns + g.offset.count() + std::llround(g.drift * static_cast<double>(device_ns - to_ns(g.epoch)));
    };
    const std::int64_t from = gps_at(to_ns(g.start)),
                       to = gps_at(i + 1 < gps.size() ? to_ns(gps[i + 1].start) : end_device_ns);
    std::int64_t shift = shift_ns(p, from, scale, o);
    OffsetPiece now = g;
    now.offset += Duration(shift);
    out.push_back(now);
    if (shift_ns(p, std::max(from, to), scale, o) == shift) continue;
    for (std::int64_t s = from / second_ns + 1; s * second_ns < to; ++s) {
      const std::int64_t next = shift_ns(p, s * second_ns, scale, o);
      if (next == shift) continue;
      now.offset += Duration(next - shift);
      // The device's stamp of that second: GPS less an offset that hardly moves meanwhile.
      std::int64_t device_ns = s * second_ns - g.offset.count();
      for (int k = 0; k < 3; ++k) device_ns -= gps_at(device_ns) - s * second_ns;
      // The pulse of that second, early as it may be, is on the far side.
      const double early_s = 6 * std::sqrt(now.sigma_s * now.sigma_s + p.noise.white_phase_s2 + p.noise.wander_s2);
      now.start = from_ns(device_ns - static_cast<std::int64_t>(std::ceil(1e9 * early_s)));
      out.push_back(now);
      shift = next;
    }
  }
  return out;
}

/// Knots as far apart as straight lines between them stay within a small part of σ.
std::vector<std::size_t> knots(const Piece& p) {
  std::vector<std::size_t> out{0};
  const std::size_t n = p.grid.size();
  const auto& at = p.grid_clock.at;
  std::size_t length = 64;
  while (out.back() + 1 < n) {
    const std::size_t a = out.back();
    length = std::min(2 * length, n - 1 - a);
    while (length > 1) {
      const std::size_t b = a + length;
      const double dt = p.grid[b].t_s - p.grid[a].t_s;
      double worst = 0;
      for (std::size_t k = 1; k < 16; ++k) {
        const std::size_t m = a + k * length / 16;
        const double straight = at[a].phase_s + (at[b].phase_s - at[a].phase_s) * (p.grid[m].t_s - p.grid[a].t_s) / dt;
        worst = std::max(worst, std::abs(at[m].phase_s - straight) - std::max(0.25 * at[m].phase_sigma_s, 0.5e-9));
      }
      double least = at[a].phase_sigma_s, most = least;
      for (std::size_t m = a; m <= b; ++m)
        least = std::min(least, at[m].phase_sigma_s), most = std::max(most, at[m].phase_sigma_s);
      if (worst <= 0 && most < 2 * std::max(least, 0.3e-9)) break;
      length = length / 2;
    }
    length = std::max<std::size_t>(length, 1);
    out.push_back(a + length);
  }
  return out;
}

void add_pieces(const Piece& p, const LabelledTrain& scale, const PpsOptions& o, Estimate& e) {
  const std::vector<std::size_t> k = knots(p);
  std::vector<OffsetPiece> pieces;
  for (std::size_t i = 0; i + 1 < k.size(); ++i) {
    const Anchor a = anchor(p, p.grid[k[i]].t_s, p.grid_clock.at[k[i]]),
                 b = anchor(p, p.grid[k[i + 1]].t_s, p.grid_clock.at[k[i + 1]]);
    OffsetPiece piece;
    piece.start = from_ns(a.device_ns);
    piece.epoch = piece.start;
    piece.offset = Duration(a.offset_ns);
    piece.drift = static_cast<double>(b.offset_ns - a.offset_ns) / static_cast<double>(b.device_ns - a.device_ns);
    piece.sigma_s = std::max(a.sigma_s, b.sigma_s);
    for (std::size_t m = k[i]; m < k[i + 1]; ++m)
      piece.sigma_s = std::max(piece.sigma_s, p.grid_clock.at[m].phase_sigma_s);
    pieces.push_back(piece);
  }
  pieces = on_reference(pieces, last_device_ns(p), p, scale, o);
  e.pieces.insert(e.pieces.end(), pieces.begin(), pieces.end());
}

Panel allan_panel(const Piece& p) {
  Panel panel;
  panel.name = "allan_deviation";
  panel.kind = "lines";
  panel.title = "Allan deviation";
  panel.caption =
      "Of the counter against the pulses: at short times the pulses' own noise, at long times the oscillator's wander.";
  panel.x = {"log10 of the averaging time in s", "", {}, {}, {}};
  Series y{"log10 of the Allan deviation", "", {}, {}, {}};
  for (const AllanPoint& a : p.allan) {
    if (!(a.deviation > 0)) continue;
    panel.x.values.push_back(std::log10(a.tau_s));
    y.values.push_back(std::log10(a.deviation));
    y.sigma.push_back(a.sigma / a.deviation / std::log(10.0));
  }
  panel.y.push_back(std::move(y));
  return panel;
}

Panel residual_panel(const Piece& p) {
  Panel panel;
  panel.name = "residuals";
  panel.kind = "points";
  panel.title = "Pulses against the smoothed clock";
  panel.caption = "What is left of each pulse; outliers are left out.";
  panel.x = {"time", "s", {}, {}, {}};
  Series y{"residual", "s", {}, {}, {}};
  const std::size_t step = std::max<std::size_t>(1, p.samples.size() / 5000);
  for (std::size_t i = 0; i < p.samples.size(); i += step) {
    panel.x.values.push_back(p.samples[i].t_s);
    y.values.push_back(p.clock.used[i] ? p.samples[i].phase_s - p.clock.at[i].phase_s : std::nan(""));
  }
  panel.y.push_back(std::move(y));
  return panel;
}

Panel frequency_panel(const Piece& p) {
  Panel panel;
  panel.name = "frequency";
  panel.kind = "lines";
  panel.title = "Rate of the counter";
  panel.caption = "Against its nominal rate, smoothed by all pulses, with its σ.";
  panel.x = {"time", "s", {}, {}, {}};
  Series y{"rate error", "ppm", {}, {}, {}};
  const std::size_t step = std::max<std::size_t>(1, p.samples.size() / 2000);
  for (std::size_t i = 0; i < p.samples.size(); i += step) {
    panel.x.values.push_back(p.samples[i].t_s);
    y.values.push_back(1e6 * p.clock.at[i].frequency);
    y.sigma.push_back(1e6 * p.clock.at[i].frequency_sigma);
  }
  panel.y.push_back(std::move(y));
  return panel;
}

/// rms of the forward prediction from one pulse to the next; slips and outliers are left out.
double prediction_rms(const Piece& p) {
  std::vector<double> e;
  for (std::size_t i = std::min<std::size_t>(32, p.samples.size() / 4) + 1; i < p.samples.size(); ++i)
    if (p.clock.used[i] && p.samples[i].t_s - p.samples[i - 1].t_s == 1)
      e.push_back(std::abs(p.clock.innovations_s[i]));
  if (e.empty()) return 0;
  std::sort(e.begin(), e.end());
  const double beyond = 6 * 1.4826 * e[e.size() / 2];
  double sum = 0;
  std::size_t n = 0;
  for (; n < e.size() && (e[n] <= beyond || beyond <= 0); ++n) sum += e[n] * e[n];
  return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0;
}

/// Share of the intervals between captured edges that are not one good second, in percent.
double irregular_percent(const PulseTrain& train) {
  std::size_t good = 0;
  for (const TrainSegment& s : train.segments)
    for (std::size_t i = 1; i < s.pulses.size(); ++i)
      good += s.pulses[i].second - s.pulses[i - 1].second == 1 && s.pulses[i].index - s.pulses[i - 1].index == 1;
  return 100 - 100.0 * static_cast<double>(good) / static_cast<double>(std::max<std::size_t>(train.edges, 2) - 1);
}

/// The absolute bounds by whole seconds; rounded outward again.
void move_bounds(Estimate& e, double seconds) {
  if (seconds == 0) return;
  for (Extra& x : e.extras) {
    if (x.name == "offset_lower_s") x.value = std::nextafter(x.value + seconds, -HUGE_VAL);
    if (x.name == "offset_upper_s") x.value = std::nextafter(x.value + seconds, HUGE_VAL);
  }
}

/// Pulses as bounds on the offset: the edge lies within its tick, the pulse within its error.
Estimate by_hull(const Piece& p, const PpsResult& kalman, const PulseTrain& train, const LabelledTrain& scale,
                 const PpsOptions& o) {
  const double tick_ns = 1e9 / train.tick_hz;
  const double told_off = p.qerr_used ? 1 : 0;
  const double error_ns = o.pulse_error_s ? 1e9 * *o.pulse_error_s
                                          : 1e9 * 6 * std::sqrt(p.noise.white_phase_s2 + p.noise.wander_s2) + told_off;
  PairStream s;
  s.two_way = true;
  for (std::size_t i = 0; i < p.samples.size(); ++i) {
    if (!p.clock.used[i]) continue;
    const auto second = static_cast<std::int64_t>(p.samples[i].t_s);
    const std::int64_t gps_ns = (p.first_gps_s + second) * second_ns;
    ClockPair pair;
    // The sample stands half a tick behind the capture.
    pair.device_ns =
        p.first_device_ns + second * second_ns + static_cast<std::int64_t>(std::llround(1e9 * p.samples[i].phase_s));
    pair.request_ns = gps_ns - static_cast<std::int64_t>(std::ceil(0.5 * tick_ns + error_ns)) - 1;
    pair.arrival_ns = gps_ns + static_cast<std::int64_t>(std::ceil(0.5 * tick_ns + error_ns)) + 1;
    s.pairs.push_back(pair);
  }
  PairOptions options;
  options.method = "hull";
  options.noise_s = std::sqrt(p.noise.white_phase_s2 + p.noise.wander_s2);
  Estimate e = relate_pairs(s, options);
  if (e.answered()) {
    OffsetPiece whole;
    whole.start = from_ns(p.first_device_ns);
    whole.epoch = e.epoch;
    whole.offset = *e.offset;
    whole.drift = e.drift.value_or(0);
    whole.sigma_s = e.sigma_s.value_or(0);
    e.pieces = on_reference(e.pieces.empty() ? std::vector{whole} : e.pieces, last_device_ns(p), p, scale, o);
    if (e.pieces.size() == 1) e.pieces.clear();
    const std::int64_t shift = shift_ns(p, to_ns(e.epoch) + e.offset->count(), scale, o);
    e.offset = *e.offset + Duration(shift);
    move_bounds(e, 1e-9 * static_cast<double>(shift));
  }
  e.method = "hull";
  e.estimates.clear();
  e.sensor = kalman.estimate.sensor;
  e.reference = kalman.estimate.reference;
  e.notes.clear();
  e.notes.push_back(
      o.pulse_error_s
          ? fmt::format("bounds rest on the given pulse error of {}", rounded_time_words(*o.pulse_error_s))
          : fmt::format("bounds take no pulse to be further off than 6 σ, {} (--pulse-error to give a guarantee)",
                        rounded_time_words(1e-9 * error_ns)));
  return e;
}

/// Whatever keeps the answer from being trusted, in words.
void judge(const PulseTrain& train, const std::vector<Piece>& pieces, const Piece& main, bool labels_given,
           Estimate& e) {
  std::size_t all = 0, same = 0;
  for (const Piece& p : pieces) {
    all += p.samples.size();
    same += p.train->restarts == main.train->restarts ? p.samples.size() : 0;
  }
  const double share = static_cast<double>(main.samples.size()) / static_cast<double>(std::max<std::size_t>(all, 1));
  if (labels_given && !main.labels->known) e.doubt(Verdict::refused, "ambiguous: " + main.labels->why_not);
  if (train.two_trains)
    e.doubt(Verdict::refused,
            "ambiguous: two edges half a second apart, and nothing says which is the whole second (--falling-edge, or "
            "capture the polarity)");
  if (train.only_falling)
    e.doubt(Verdict::weak,
            "only falling edges were captured: if the pulse is active high, all stamps are late by its width");
  double largest = 0;
  for (const double step : train.steps_s) largest = std::abs(step) > std::abs(largest) ? step : largest;
  if (std::abs(largest) > phase_step_s) {
    const std::string what = fmt::format("the train of pulses steps by {}: one of its edges is not the whole second",
                                         time_words(largest, 1e-6));
    if (share < 0.9)
      e.doubt(Verdict::refused, "ambiguous: " + what);
    else
      e.doubt(Verdict::weak, what + fmt::format("; {:.0f} % of the pulses agree with the answer", 100 * share));
  }
  if (!train.slips_s.empty()) {
    double most = 0;
    for (const double slip : train.slips_s) most = std::max(most, std::abs(slip));
    e.doubt(Verdict::weak,
            fmt::format("the counter's phase slips {} time{}, by up to {}: it loses ticks, or its oscillator jumps; "
                        "the pieces follow",
                        train.slips_s.size(), train.slips_s.size() > 1 ? "s" : "", rounded_time_words(most)));
  }
  if (train.restarts > 0)
    e.doubt(
        Verdict::weak,
        fmt::format("the counter restarted {} time{}: this answer holds for the longest run, {:.0f} % of the pulses",
                    train.restarts, train.restarts > 1 ? "s" : "",
                    100.0 * static_cast<double>(same) / static_cast<double>(std::max<std::size_t>(all, 1))));
  const double bad = static_cast<double>(train.false_edges + train.missing) /
                     static_cast<double>(std::max<std::size_t>(train.edges, 1));
  if (train.false_edges > train.edges / 4)
    e.doubt(Verdict::weak, fmt::format("{:.0f} % of the edges are false or missing", 100 * bad));
  if (main.samples.size() < 30) e.doubt(Verdict::weak, fmt::format("only {} pulses", main.samples.size()));
}

void add_extras(const PulseTrain& train, const Piece& main, Estimate& e) {
  e.extras.push_back({"pulses", static_cast<double>(main.samples.size()), {}});
  e.extras.push_back({"false_edges", static_cast<double>(train.false_edges), {}});
  e.extras.push_back({"missing_pulses", static_cast<double>(train.missing), {}});
  e.extras.push_back({"rejected_percent",
                      100.0 * static_cast<double>(train.false_edges + train.missing) /
                          static_cast<double>(std::max<std::size_t>(train.edges, 1)),
                      {}});
  std::size_t outliers = 0;
  for (const char used : main.clock.used) outliers += !used;
  e.extras.push_back({"irregular_intervals_percent", irregular_percent(train), {}});
  e.extras.push_back({"slips", static_cast<double>(train.slips_s.size()), {}});
  e.extras.push_back({"outliers", static_cast<double>(outliers), {}});
  e.extras.push_back({"tick_s", 1 / train.tick_hz, {}});
  e.extras.push_back({"rate_ppm", 1e6 * main.clock.at[main.clock.at.size() / 2].frequency,
                      1e6 * main.clock.at[main.clock.at.size() / 2].frequency_sigma});
  e.extras.push_back({"prediction_rms_s", prediction_rms(main), {}});
  e.extras.push_back({"pulse_noise_s", std::sqrt(main.noise.white_phase_s2), {}});
  e.extras.push_back({"pulse_wander_s", std::sqrt(main.noise.wander_s2), {}});
  for (const AllanPoint& a : main.allan)
    e.extras.push_back({fmt::format("allan_deviation_{:.0f}s", a.tau_s), a.deviation, a.sigma});
  const ClockPrediction last = main.clock.at.back();
  for (const double t : {60.0, 600.0, 3600.0})
    e.extras.push_back(
        {fmt::format("holdover_{:.0f}s_sigma_s", t), holdover_sigma_s(last, main.noise, t, main.allan), {}});
  if (main.labels->votes > 0)
    e.extras.push_back({"labels_agreeing_percent",
                        100.0 * static_cast<double>(main.labels->agreeing) /
                            static_cast<double>(main.labels->votes + main.labels->in_guard),
                        {}});
}

}  // namespace

double holdover_sigma_s(const ClockPrediction& last, const ClockNoise& n, double t,
                        const std::vector<AllanPoint>& allan) {
  const double x = last.phase_sigma_s, y = last.frequency_sigma;
  const double model = x * x + 2 * t * last.phase_frequency_cov_s + y * y * t * t + n.white_frequency * t +
                       n.walk_frequency * t * t * t / 3 + n.walk_drift * std::pow(t, 5) / 20;
  // √2·τ·σ_y(τ): a frequency known from as long before, kept as long. Beyond what was seen it grows as fast as it did.
  double seen = 0;
  if (allan.size() >= 3) {
    const AllanPoint* near = &allan.front();
    for (const AllanPoint& a : allan)
      if (a.tau_s <= t) near = &a;
    const double pulses_own = std::sqrt(3 * (n.white_phase_s2 + n.wander_s2)) / near->tau_s;
    const double own = std::sqrt(std::max(near->deviation * near->deviation - pulses_own * pulses_own, 0.0));
    seen = std::sqrt(2.0) * own * t * std::max(1.0, std::sqrt(t / near->tau_s));
  }
  return std::sqrt(std::max({model, x * x, seen * seen}));
}

PpsResult discipline(const PulseStream& pulses, const std::vector<LabelStream>& logs, const PpsOptions& options) {
  if (options.reference != "utc" && options.reference != "gps")
    throw std::invalid_argument("reference must be utc or gps, not " + options.reference);
  PpsResult out;
  if (const auto far = beyond_int64(pulses)) {
    out.estimate = Estimate::refusal(
        "kalman", fmt::format("a count of {} ticks at {:g} Hz is {:.0f} years, more than stamps of 64-bit ns hold; is "
                              "--tick-hz right?",
                              *far, pulses.counter.tick_hz,
                              std::abs(static_cast<double>(*far)) / pulses.counter.tick_hz / 3.156e7));
    out.estimate.sensor = pulses.counter.clock.empty() ? "device" : pulses.counter.clock;
    out.estimate.reference = options.reference;
    return out;
  }
  const PulseTrain train = find_pulse_train(pulses, options.falling_edge);
  const LabelledTrain scale = label_train(train, pulses, logs, options.labels);
  const bool own_labels =
      std::any_of(pulses.pulses.begin(), pulses.pulses.end(), [](const Pulse& p) { return p.label_utc_s.has_value(); });
  const bool labels_given = own_labels || !logs.empty();

  std::vector<Piece> pieces;
  std::vector<std::string> notes;
  for (std::size_t k = 0; k < train.segments.size(); ++k) {
    if (train.segments[k].pulses.size() < least_pulses) continue;
    Piece& p = pieces.emplace_back();
    p.train = &train.segments[k];
    p.labels = &scale.segments[k];
    take_samples(p, train.tick_hz);
    p.first_device_ns = device_ns(p.train->pulses.front().ticks, train.tick_hz);
    p.first_gps_s =
        p.labels->known
            ? p.labels->gps_minus_count_s
            : static_cast<std::int64_t>(std::llround(static_cast<long double>(p.first_device_ns) / second_ns));
    if (const std::string word = take_off_qerr(p, logs, scale, options.qerr); !word.empty()) notes.push_back(word);
    // Noise is found where the clock runs undisturbed: the longest stretch between two slips.
    std::size_t from = 0, to = 0, last = 0;
    std::vector<std::size_t> ends = p.train->slips;
    ends.push_back(p.samples.size());
    for (const std::size_t end : ends) {
      if (end - last > to - from) from = last, to = end;
      last = end;
    }
    p.noise = fit_noise(std::span(p.samples).subspan(from, to - from), 1 / train.tick_hz);
    run_clock(p);
    std::vector<PhaseSample> kept;
    for (std::size_t i = from; i < to; ++i)
      if (p.clock.used[i]) kept.push_back(p.samples[i]);
    p.allan = allan_deviation(kept);
  }
  Estimate& e = out.estimate;
  const std::string sensor = pulses.counter.clock.empty() ? "device" : pulses.counter.clock;
  if (pieces.empty()) {
    e = Estimate::refusal("kalman", fmt::format("no train of one pulse a second among {} edges{}", train.edges,
                                                train.edges >= least_pulses ? "; is --tick-hz right?" : ""));
    e.sensor = sensor;
    e.reference = labels_given ? options.reference : "pps";
    e.notes = train.words;
    return out;
  }
  const Piece& main = *std::max_element(
      pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.samples.size() < b.samples.size(); });
  e.method = "kalman";
  e.sensor = sensor;
  e.reference = main.labels->known ? options.reference : labels_given ? options.reference : "pps";
  e.verdict = Verdict::trusted;
  const std::size_t middle = main.samples.size() / 2;
  const Anchor a = anchor(main, main.samples[middle].t_s, main.clock.at[middle]);
  e.epoch = from_ns(a.device_ns);
  e.offset = Duration(a.offset_ns + shift_ns(main, a.device_ns + a.offset_ns, scale, options));
  e.sigma_s = a.sigma_s;
  e.drift = a.drift;
  e.drift_sigma = main.clock.at[middle].frequency_sigma;
  for (const Piece& p : pieces)
    if (p.train->restarts == main.train->restarts && (p.labels->known == main.labels->known))
      add_pieces(p, scale, options, e);
  if (e.pieces.size() == 1) e.pieces.clear();
  // The top-level line is that of the piece which holds the epoch.
  e.notes = pulses.notes;
  e.notes.insert(e.notes.end(), train.words.begin(), train.words.end());
  e.notes.insert(e.notes.end(), scale.words.begin(), scale.words.end());
  e.notes.insert(e.notes.end(), notes.begin(), notes.end());
  if (!labels_given)
    e.notes.push_back("no labels: whole seconds are unknown, the offset is to the nearest whole second of the pulses");
  else if (main.labels->known)
    e.notes.push_back(
        fmt::format("labels are taken to arrive within {:.2f} s of their pulse; one that is late by a whole second "
                    "every time cannot be told",
                    options.labels.latest_s));
  add_extras(train, main, e);
  e.evidence.panels = {residual_panel(main), frequency_panel(main), allan_panel(main)};
  judge(train, pieces, main, labels_given, e);

  for (const Piece& p : pieces)
    for (std::size_t i = 0; i < p.samples.size(); ++i) {
      const auto second = static_cast<std::int64_t>(p.samples[i].t_s);
      const Anchor at = anchor(p, p.samples[i].t_s, p.clock.at[i]);
      PulseStamp stamp;
      stamp.index = p.train->pulses[i].index;
      stamp.device_ns = device_ns(p.train->pulses[i].ticks, train.tick_hz);
      stamp.used = p.clock.used[i];
      // The edge itself on the reference: its whole second, and how far the smoothed clock has it from there. It lies
      // anywhere within its tick, on average in the middle.
      const double since_ns = static_cast<double>(stamp.device_ns - at.device_ns) + 0.5e9 / train.tick_hz;
      stamp.stamp.reference_ns = reference_ns(p, second, scale, options) + std::llround((1 + at.drift) * since_ns);
      stamp.stamp.sigma_s = std::hypot(at.sigma_s, 1 / train.tick_hz / std::sqrt(12.0));
      const bool known = p.labels->known || !labels_given;
      stamp.stamp.state = known && e.answered() ? ClockState::locked : ClockState::ambiguous;
      if (options.pulse_error_s && stamp.used) {
        const auto error = static_cast<std::int64_t>(std::ceil(1e9 * (*options.pulse_error_s + 1 / train.tick_hz)));
        stamp.stamp.lower_ns = reference_ns(p, second, scale, options) - error;
        stamp.stamp.upper_ns = reference_ns(p, second, scale, options) + error;
      }
      out.stamps.push_back(stamp);
    }
  const Estimate kalman = e;
  const Estimate hull = by_hull(main, out, train, scale, options);
  if (options.method == "hull" && e.answered()) {
    if (hull.answered()) {
      e.offset = hull.offset, e.sigma_s = hull.sigma_s, e.epoch = hull.epoch, e.drift = hull.drift,
      e.drift_sigma = hull.drift_sigma;
      e.pieces = hull.pieces;
      e.extras.insert(e.extras.end(), hull.extras.begin(), hull.extras.end());
      e.evidence.panels.insert(e.evidence.panels.begin(), hull.evidence.panels.begin(), hull.evidence.panels.end());
    } else {
      e.doubt(Verdict::refused, hull.reasons.front());
    }
    e.method = "hull";
    e.notes.insert(e.notes.end(), hull.notes.begin(), hull.notes.end());
  }
  e.estimates = {kalman, hull};
  for (Estimate& other : e.estimates) {
    if (!e.answered() && other.answered()) other.doubt(Verdict::refused, e.reasons.front());
    other.evidence = {};
    other.pieces.clear();
    other.notes.clear();
    if (other.method == "kalman") other.extras.clear();
  }
  return out;
}

}  // namespace takt
