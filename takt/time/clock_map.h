// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "takt/time/instant.h"

namespace takt {

/// One straight piece of a clock map, from `start` on:
///   to = from + offset + drift · (from − epoch)
/// with the covariance of (offset, drift) at `epoch`.
template <class From>
struct ClockPiece {
  Instant<From> start = Instant<From>::min();  ///< valid from here to the next piece's start
  Instant<From> epoch{};
  Duration offset{0};
  double drift = 0;               ///< s/s
  double offset_var_s2 = 0;       ///< s²
  double drift_var = 0;           ///< (s/s)²
  double offset_drift_cov_s = 0;  ///< s
};

/// The estimated relation between two clocks, piecewise linear: reference = sensor + offset + drift·(sensor − epoch).
/// Known relations (GPS to UTC) are casts in time_scales.h instead.
template <class From = SensorClock, class To = ReferenceClock>
class ClockMap {
 public:
  using Piece = ClockPiece<From>;

  /// The identity, exactly known.
  ClockMap() : pieces_{Piece{}} {}
  explicit ClockMap(Piece piece) : ClockMap(std::vector<Piece>{piece}) {}
  /// Pieces in order of their start; the first one also serves everything before it.
  explicit ClockMap(std::vector<Piece> pieces) : pieces_(std::move(pieces)) {
    if (pieces_.empty()) throw std::invalid_argument("ClockMap: no pieces");
    const auto by_start = [](const Piece& a, const Piece& b) { return a.start < b.start; };
    if (!std::is_sorted(pieces_.begin(), pieces_.end(), by_start))
      throw std::invalid_argument("ClockMap: pieces are not in order of their start");
    for (const Piece& p : pieces_)
      if (!(p.drift > -1)) throw std::invalid_argument("ClockMap: drift of −1 or less runs time backwards");
  }

  [[nodiscard]] Instant<To> operator()(Instant<From> t) const {
    const Piece& p = piece_at(t);
    return Instant<To>(t.time_since_epoch() + p.offset + drifted(p, t));
  }

  /// Standard deviation of the mapped instant, in seconds.
  [[nodiscard]] double sigma_s(Instant<From> t) const {
    const Piece& p = piece_at(t);
    const double dt = seconds_since(p.epoch, t);
    return std::sqrt(std::max(0.0, p.offset_var_s2 + 2 * dt * p.offset_drift_cov_s + dt * dt * p.drift_var));
  }

  /// What is to be added to a stamp at `t`.
  [[nodiscard]] Duration offset_at(Instant<From> t) const {
    const Piece& p = piece_at(t);
    return p.offset + drifted(p, t);
  }

  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }

  [[nodiscard]] const Piece& piece_at(Instant<From> t) const {
    const auto after = std::upper_bound(pieces_.begin(), pieces_.end(), t,
                                        [](Instant<From> s, const Piece& p) { return s < p.start; });
    return after == pieces_.begin() ? *after : *std::prev(after);
  }

 private:
  static Duration drifted(const Piece& p, Instant<From> t) {
    // Long double keeps the nanosecond over centuries, where a double would lose it after 104 days.
    const long double dt = static_cast<long double>((t - p.epoch).count());
    return Duration(static_cast<std::int64_t>(std::llroundl(dt * static_cast<long double>(p.drift))));
  }

  std::vector<Piece> pieces_;
};

/// The map back. Exact to 1 ns; the covariance is carried through to first order.
template <class From, class To>
[[nodiscard]] ClockMap<To, From> inverse(const ClockMap<From, To>& map) {
  std::vector<ClockPiece<To>> out;
  for (const auto& p : map.pieces()) {
    const double rate = 1 + p.drift;
    ClockPiece<To> q;
    q.epoch = Instant<To>(p.epoch.time_since_epoch() + p.offset);
    if (p.start != Instant<From>::min()) q.start = map(p.start);
    q.offset = -p.offset;
    q.drift = -p.drift / rate;
    q.offset_var_s2 = p.offset_var_s2 / (rate * rate);
    q.drift_var = p.drift_var / (rate * rate * rate * rate);
    q.offset_drift_cov_s = p.offset_drift_cov_s / (rate * rate * rate);
    out.push_back(q);
  }
  return ClockMap<To, From>(std::move(out));
}

/// First `first`, then `second`. Their errors are taken as independent.
template <class A, class B, class C>
[[nodiscard]] ClockMap<A, C> compose(const ClockMap<A, B>& first, const ClockMap<B, C>& second) {
  // A new piece starts wherever either map starts one.
  std::vector<Instant<A>> starts;
  for (const auto& p : first.pieces()) starts.push_back(p.start);
  const ClockMap<B, A> back = inverse(first);
  for (const auto& q : second.pieces())
    if (q.start != Instant<B>::min()) starts.push_back(back(q.start));
  std::sort(starts.begin(), starts.end());
  starts.erase(std::unique(starts.begin(), starts.end()), starts.end());

  std::vector<ClockPiece<A>> out;
  for (const Instant<A> start : starts) {
    const auto& p = first.piece_at(start);
    const bool open = start == Instant<A>::min();
    const auto& q = second.piece_at(open ? Instant<B>::min() : first(start));
    const Instant<B> mid = Instant<B>(p.epoch.time_since_epoch() + p.offset);
    const double since = seconds_since(q.epoch, mid);
    ClockPiece<A> r;
    r.start = start;
    r.epoch = p.epoch;
    const long double drifted = static_cast<long double>((mid - q.epoch).count()) * static_cast<long double>(q.drift);
    r.offset = p.offset + q.offset + Duration(static_cast<std::int64_t>(std::llroundl(drifted)));
    r.drift = p.drift + q.drift + p.drift * q.drift;
    const double rate_p = 1 + p.drift, rate_q = 1 + q.drift;
    r.offset_var_s2 = rate_q * rate_q * p.offset_var_s2 + q.offset_var_s2 + 2 * since * q.offset_drift_cov_s +
                      since * since * q.drift_var;
    r.drift_var = rate_q * rate_q * p.drift_var + rate_p * rate_p * q.drift_var;
    r.offset_drift_cov_s =
        rate_q * rate_q * p.offset_drift_cov_s + rate_p * (q.offset_drift_cov_s + since * q.drift_var);
    out.push_back(r);
  }
  return ClockMap<A, C>(std::move(out));
}

}  // namespace takt
