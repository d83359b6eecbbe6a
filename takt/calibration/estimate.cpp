// SPDX-License-Identifier: Apache-2.0
#include "takt/calibration/estimate.h"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace takt {

const char* to_string(Verdict v) {
  switch (v) {
    case Verdict::trusted:
      return "trusted";
    case Verdict::weak:
      return "weak";
    case Verdict::refused:
      break;
  }
  return "refused";
}

Verdict worse(Verdict a, Verdict b) {
  return a > b ? a : b;
}

Estimate Estimate::refusal(std::string method, std::string reason) {
  Estimate e;
  e.method = std::move(method);
  e.reasons.push_back(std::move(reason));
  return e;
}

void Estimate::doubt(Verdict at_best, std::string reason) {
  verdict = worse(verdict, at_best);
  reasons.push_back(std::move(reason));
  if (verdict != Verdict::refused) return;
  offset.reset();
  sigma_s.reset();
  drift.reset();
  drift_sigma.reset();
  pieces.clear();
  line_delay_s.reset();
  line_delay_sigma_s.reset();
}

Estimate inverse(const Estimate& e) {
  Estimate out = e;
  std::swap(out.sensor, out.reference);
  for (Estimate& other : out.estimates) other = inverse(other);
  if (e.T_reference_sensor) out.T_reference_sensor = e.T_reference_sensor->inverse();
  if (!e.offset) return out;
  const auto stamp = [](Instant<ReferenceClock> t) { return from_ns(to_ns(t)); };
  Estimate line = e;
  line.pieces.clear();
  const auto at_epoch = inverse(line.clock_map()).pieces().front();
  out.epoch = stamp(at_epoch.epoch);
  out.offset = at_epoch.offset;
  out.sigma_s = std::sqrt(at_epoch.offset_var_s2);
  if (e.drift) out.drift = at_epoch.drift;
  if (e.drift_sigma) out.drift_sigma = std::sqrt(at_epoch.drift_var);
  out.pieces.clear();
  if (e.pieces.empty()) return out;
  const ClockMap<ReferenceClock, SensorClock> back = inverse(e.clock_map());
  for (const auto& p : back.pieces())
    out.pieces.push_back({stamp(p.start), stamp(p.epoch), p.offset, p.drift, std::sqrt(p.offset_var_s2)});
  return out;
}

ClockMap<> Estimate::clock_map() const {
  if (!offset) throw std::logic_error("Estimate::clock_map: " + method + " gave no offset");
  if (!pieces.empty()) {
    std::vector<ClockPiece<SensorClock>> all;
    for (const OffsetPiece& p : pieces)
      all.push_back({.start = as<SensorClock>(p.start),
                     .epoch = as<SensorClock>(p.epoch),
                     .offset = p.offset,
                     .drift = p.drift,
                     .offset_var_s2 = p.sigma_s * p.sigma_s});
    return ClockMap<>(std::move(all));
  }
  ClockPiece<SensorClock> piece;
  piece.epoch = as<SensorClock>(epoch);
  piece.offset = *offset;
  piece.drift = drift.value_or(0);
  const double s = sigma_s.value_or(0), d = drift_sigma.value_or(0);
  piece.offset_var_s2 = s * s;
  piece.drift_var = d * d;
  return ClockMap<>(piece);
}

Estimate Estimate::at(Stamp when) const {
  Estimate out = *this;
  if (!offset || when == epoch) return out;
  const ClockMap<> map = clock_map();
  const auto there = as<SensorClock>(when);
  out.epoch = when;
  out.offset = map.offset_at(there);
  if (sigma_s) out.sigma_s = map.sigma_s(there);
  if (drift) out.drift = map.piece_at(there).drift;
  return out;
}

std::vector<Estimate> answers_at_one_epoch(const Estimate& e) {
  std::vector<Estimate> out;
  for (const Estimate& other : e.estimates) out.push_back(e.answered() ? other.at(e.epoch) : other);
  return out;
}

}  // namespace takt
