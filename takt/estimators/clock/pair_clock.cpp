// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/pair_clock.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include "takt/calibration/words.h"
#include "takt/estimators/clock/clock_model.h"

namespace takt {

namespace {

constexpr std::size_t most_windows = 4096;
constexpr std::size_t least_in_window = 64;
constexpr std::size_t least_in_bent_window = 8;  // where longer ones contradict a straight line
constexpr std::size_t blocks_of_window = 16;

Bound upper_of(const ClockPair& p) {
  return {p.device_ns, p.arrival_ns - p.device_ns};
}
Bound lower_of(const ClockPair& p) {
  return {p.device_ns, p.request_ns - p.device_ns};
}

struct Tidy {
  std::vector<ClockPair> pairs;
  std::vector<std::string> words;
};

bool representable(const ClockPair& p, bool two_way) {
  constexpr std::int64_t most = std::int64_t{1} << 62;
  const auto fits = [](std::int64_t v) { return v < most && v > -most; };
  return fits(p.device_ns) && fits(p.arrival_ns) && (!two_way || fits(p.request_ns));
}

/// In order of the device's stamps, each once, and no response before its request.
Tidy tidied(const PairStream& s) {
  Tidy out;
  std::size_t impossible = 0;
  for (const ClockPair& p : s.pairs) {
    if (!representable(p, s.two_way) || (s.two_way && p.arrival_ns < p.request_ns))
      ++impossible;
    else
      out.pairs.push_back(p);
  }
  const auto by_device = [](const ClockPair& a, const ClockPair& b) { return a.device_ns < b.device_ns; };
  std::size_t backward = 0;
  for (std::size_t i = 1; i < out.pairs.size(); ++i) backward += by_device(out.pairs[i], out.pairs[i - 1]);
  std::stable_sort(out.pairs.begin(), out.pairs.end(), by_device);
  if (impossible > 0)
    out.words.push_back(fmt::format("{} exchanges end before they begin, or are out of range; left out", impossible));
  if (backward > 0) out.words.push_back(fmt::format("{} device stamps go back; put in order", backward));
  return out;
}

/// One window's line, with all that was found on the way.
struct Window {
  std::size_t first = 0, count = 0;
  OffsetLine line;
  double offset_sigma_ns = 0, drift_sigma = 0;
  bool bent = false;  ///< no straight line runs through the blocks' least delays
  double sag_ns = 0;  ///< the parabola's middle against its chord
  bool fits = true;
};

struct Parabola {
  double t = 0, sag = 0, residual = 0;
  /// Von Neumann's ratio of what a straight line leaves: 2 ± 2/√blocks for noise, near 0 for any smooth bend.
  double roughness = 2;
};

/// Least squares of 1, x, x² over blocks; x from −1 to 1.
Parabola parabola(const std::vector<double>& x, const std::vector<double>& y) {
  const std::size_t n = x.size();
  Parabola out;
  if (n < 6) return out;
  // Orthogonal to 1 and x on the points themselves.
  const auto mean = [n](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(n);
  };
  const double mx = mean(x), my = mean(y);
  double sxx = 0, sxy = 0, sxq = 0, mq = 0;
  for (std::size_t i = 0; i < n; ++i) mq += x[i] * x[i] / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    sxx += (x[i] - mx) * (x[i] - mx);
    sxy += (x[i] - mx) * (y[i] - my);
    sxq += (x[i] - mx) * (x[i] * x[i] - mq);
  }
  double sqq = 0, sqy = 0;
  std::vector<double> q(n);
  for (std::size_t i = 0; i < n; ++i) {
    q[i] = x[i] * x[i] - mq - sxq / sxx * (x[i] - mx);
    sqq += q[i] * q[i];
    sqy += q[i] * (y[i] - my - sxy / sxx * (x[i] - mx));
  }
  if (!(sqq > 0)) return out;
  const double c = sqy / sqq;
  double rest = 0, squares = 0, steps = 0, before = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double straight = y[i] - my - sxy / sxx * (x[i] - mx), r = straight - c * q[i];
    rest += r * r;
    squares += straight * straight;
    if (i > 0) steps += (straight - before) * (straight - before);
    before = straight;
  }
  if (squares > 0) out.roughness = steps / squares * static_cast<double>(n) / static_cast<double>(n - 1);
  rest /= static_cast<double>(n - 3);
  out.residual = std::sqrt(rest);
  out.sag = c;
  out.t = c / std::sqrt(std::max(rest, 1e-6) / sqq);
  return out;
}

/// The tightest bound of each block, against the line: mid-way for exchanges.
Parabola block_test(std::span<const ClockPair> p, bool two_way, const OffsetLine& line, std::size_t blocks) {
  std::vector<double> x, y;
  for (std::size_t b = 0; b < blocks; ++b) {
    const std::size_t from = b * p.size() / blocks, to = (b + 1) * p.size() / blocks;
    long double least = 1e30L, most = -1e30L;
    std::int64_t at = p[from].device_ns;
    for (std::size_t i = from; i < to; ++i) {
      const long double u = static_cast<long double>(upper_of(p[i]).o_ns) - line.at(p[i].device_ns);
      if (u < least) least = u, at = p[i].device_ns;
      if (two_way) most = std::max(most, static_cast<long double>(lower_of(p[i]).o_ns) - line.at(p[i].device_ns));
    }
    const auto span = static_cast<double>(p.back().device_ns - p.front().device_ns);
    x.push_back(2 * static_cast<double>(at - p.front().device_ns) / std::max(span, 1.0) - 1);
    y.push_back(static_cast<double>(two_way ? 0.5L * (least + most) : least));
  }
  return parabola(x, y);
}

/// σ of the hull's line where only one side is there: how the least of a block scatters, carried over to the window.
/// For delays that fall off from their least at once the least of m times as many is m times as sharp.
double block_sigma(std::span<const ClockPair> p, bool two_way, const OffsetLine& line) {
  const std::size_t blocks = std::min(blocks_of_window, p.size() / 4);
  if (blocks < 6) return 0;
  const double coarse = block_test(p, two_way, line, blocks).residual;
  const double fine = p.size() >= 16 * blocks ? block_test(p, two_way, line, 4 * blocks).residual : 0;
  const double power = fine > 0 && coarse > 0 ? std::clamp(0.5 * std::log2(fine / coarse), 0.1, 1.0) : 0.75;
  return coarse / std::pow(static_cast<double>(blocks), power);
}

Window fit_window(std::span<const ClockPair> all, std::size_t first, std::size_t count, bool two_way, double noise_s) {
  Window w;
  w.first = first;
  w.count = count;
  const std::span<const ClockPair> p = all.subspan(first, count);
  BoundHull upper(BoundHull::Side::upper_bounds), lower(BoundHull::Side::lower_bounds);
  double round_trips = 0;
  for (const ClockPair& e : p) {
    upper.add(upper_of(e));
    if (two_way) lower.add(lower_of(e)), round_trips += static_cast<double>(e.arrival_ns - e.request_ns);
  }
  if (two_way) {
    const auto found = likely_line(lower, upper, round_trips / static_cast<double>(count));
    if (!found) {
      w.fits = false;
      return w;
    }
    w.line = found->line;
    w.offset_sigma_ns = found->offset_sigma_ns;
    w.drift_sigma = found->drift_sigma;
  } else {
    const auto found = line_under(upper);
    if (!found) {
      w.fits = false;
      return w;
    }
    w.line = *found;
  }
  const double from_blocks = block_sigma(p, two_way, w.line);
  const double span_ns = std::max(static_cast<double>(p.back().device_ns - p.front().device_ns), 1.0);
  if (!two_way) {
    double excess = 0;
    for (const ClockPair& e : p)
      excess += static_cast<double>(static_cast<long double>(upper_of(e).o_ns) - w.line.at(e.device_ns));
    // The edge over the middle rests on two of the n delays: as sharp as their mean excess over n, both ways.
    w.offset_sigma_ns = 2 * excess / static_cast<double>(count) / static_cast<double>(count);
    w.drift_sigma = 4 * w.offset_sigma_ns / span_ns;
  }
  if (from_blocks > w.offset_sigma_ns * 1.5) {
    w.drift_sigma *= from_blocks / std::max(w.offset_sigma_ns, 1e-9);
    w.offset_sigma_ns = from_blocks;
  }
  if (noise_s > 0) {
    // The middle between the extremes of n normal errors scatters by π/√(24·ln n) of theirs.
    const double extremes_ns = 1e9 * noise_s * std::numbers::pi / std::sqrt(24 * std::log(static_cast<double>(count)));
    w.offset_sigma_ns = std::max(w.offset_sigma_ns, extremes_ns);
    w.drift_sigma = std::max(w.drift_sigma, 4 * extremes_ns / span_ns);
  }
  if (w.drift_sigma <= 0) w.drift_sigma = 3.5 * std::max(w.offset_sigma_ns, 0.3) / span_ns;
  w.offset_sigma_ns = std::max(w.offset_sigma_ns, 0.3);  // stamps are whole ns
  if (count >= least_in_window) {
    const Parabola bend = block_test(p, two_way, w.line, blocks_of_window);
    w.bent = std::abs(bend.t) > 5;
    // Half a thermal cycle may be an S, which has no parabola: any smooth shape shows in finer blocks, at 4 σ.
    const std::size_t fine = std::min<std::size_t>(4 * blocks_of_window, count / 16);
    if (!w.bent && fine >= 2 * blocks_of_window)
      w.bent = block_test(p, two_way, w.line, fine).roughness < 2 - 8 / std::sqrt(static_cast<double>(fine));
    w.sag_ns = bend.sag;
  }
  return w;
}

std::vector<Window> fit_windows(std::span<const ClockPair> p, bool two_way, std::size_t windows, double noise_s) {
  std::vector<Window> out;
  for (std::size_t k = 0; k < windows; ++k) {
    const std::size_t from = k * p.size() / windows, to = (k + 1) * p.size() / windows;
    if (to - from >= 2) out.push_back(fit_window(p, from, to - from, two_way, noise_s));
  }
  return out;
}

/// The longest windows over which a straight line is not contradicted.
std::vector<Window> choose_windows(std::span<const ClockPair> p, const PairStream& s, const PairOptions& options) {
  if (options.window_s) {
    const double span_s = 1e-9 * static_cast<double>(p.back().device_ns - p.front().device_ns);
    const double wanted = std::clamp(std::round(span_s / *options.window_s), 1.0, static_cast<double>(most_windows));
    return fit_windows(p, s.two_way, static_cast<std::size_t>(wanted), options.noise_s);
  }
  std::vector<Window> best;
  bool contradicted = false, halved = false;
  for (std::size_t k = 1; k <= most_windows; k *= 2) {
    if (k > 1 && p.size() / k < (contradicted ? least_in_bent_window : least_in_window)) break;
    std::vector<Window> now = fit_windows(p, s.two_way, k, options.noise_s);
    std::size_t bent = 0, misfit = 0;
    for (const Window& w : now) misfit += !w.fits, bent += w.fits && w.bent;
    if (best.empty() || misfit == 0) best = now;
    // What only just fits is bent by as much as the bounds are apart: half as long is bent by a quarter of that.
    const bool only_just = contradicted && misfit == 0 && !halved;
    contradicted = misfit > 0 || only_just;
    halved = halved || only_just;
    if (misfit == 0 && bent * 10 <= now.size() && !only_just) return now;
  }
  return best;
}

OffsetPiece piece_of(const Window& w, std::int64_t start_ns) {
  OffsetPiece p;
  p.start = from_ns(start_ns);
  p.epoch = from_ns(w.line.epoch_ns);
  p.offset = Duration(static_cast<std::int64_t>(std::llroundl(w.line.offset_ns)));
  p.drift = static_cast<double>(w.line.drift);
  p.sigma_s = 1e-9 * w.offset_sigma_ns;
  return p;
}

/// How far the true offset may be from a straight line within a window, D·L²/8 for a drift that changes by D: from what
/// neighbours' slopes differ by. `beyond_noise` takes off what their own errors explain.
double sag_allowance_ns(std::span<const ClockPair> p, const std::vector<Window>& windows, bool two_way,
                        bool beyond_noise) {
  std::vector<Window> parts = windows;
  if (parts.size() == 1 && p.size() >= 2 * least_in_window) parts = fit_windows(p, two_way, 2, 0);
  const Window& w = windows[windows.size() / 2];
  const auto length = static_cast<double>(p[w.first + w.count - 1].device_ns - p[w.first].device_ns);
  double most = 0, sum = 0, n = 0;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    if (!parts[i].fits || !parts[i - 1].fits) continue;
    const auto apart = static_cast<double>(parts[i].line.epoch_ns - parts[i - 1].line.epoch_ns);
    const auto change = static_cast<double>(parts[i].line.drift - parts[i - 1].line.drift);
    // Two halves alone cannot say how much of their difference is noise: a quarter of it is taken off.
    const double own = (windows.size() == 1 ? 0.25 : 1) * (parts[i].drift_sigma * parts[i].drift_sigma +
                                                           parts[i - 1].drift_sigma * parts[i - 1].drift_sigma);
    const double rate = 1 / std::max(apart, 1.0) * length * length / 8;
    most = std::max(most, std::abs(change) * rate);
    sum += (change * change - own) * rate * rate;
    n += 1;
  }
  if (!beyond_noise) return most;
  return n > 0 ? std::sqrt(std::max(sum / n, 0.0)) : 0;
}

/// Where two windows meet their lines must meet too: the largest step there that their errors do not explain, in ns.
double step_between(std::span<const ClockPair> p, const std::vector<Window>& windows, double sag_ns) {
  double most = 0;
  for (std::size_t k = 1; k < windows.size(); ++k) {
    const std::int64_t border = p[windows[k].first].device_ns;
    const auto error = [border](const Window& w) {
      return std::hypot(w.offset_sigma_ns, w.drift_sigma * static_cast<double>(border - w.line.epoch_ns));
    };
    const auto step = std::abs(static_cast<double>(windows[k].line.at(border) - windows[k - 1].line.at(border)));
    if (step > 10 * std::hypot(error(windows[k]), error(windows[k - 1])) + 8 * sag_ns) most = std::max(most, step);
  }
  return most;
}

/// A piece says one σ for all of its length: the offset's, the drift's over it, and what a straight line leaves out.
double over_length_s(const Window& w, std::span<const ClockPair> p, double sag_ns) {
  const auto length = static_cast<double>(p[w.first + w.count - 1].device_ns - p[w.first].device_ns);
  return 1e-9 * std::sqrt(w.offset_sigma_ns * w.offset_sigma_ns + w.drift_sigma * w.drift_sigma * length * length / 12 +
                          sag_ns * sag_ns / 5);
}

/// A gap from the window's beginning to the next one's, much longer than usual: what a bare crystal, whose rate moves
/// by 2·10⁻⁸ a second, and the line's own slope may be off by over it.
double gap_error_s(const Window& w, std::span<const ClockPair> p) {
  constexpr double most_drift_per_s = 2e-8, usual_spacings = 10;
  const std::size_t end = std::min(w.first + w.count, p.size() - 1);
  double longest_ns = 0;
  for (std::size_t i = w.first + 1; i <= end; ++i)
    longest_ns = std::max(longest_ns, static_cast<double>(p[i].device_ns - p[i - 1].device_ns));
  const auto span_ns = static_cast<double>(p[w.first + w.count - 1].device_ns - p[w.first].device_ns);
  const double usual_ns =
      std::min(span_ns / static_cast<double>(w.count),
               static_cast<double>(p.back().device_ns - p.front().device_ns) / static_cast<double>(p.size()));
  if (longest_ns <= usual_spacings * usual_ns) return 0;
  const double gap_s = 1e-9 * longest_ns;
  return std::hypot(w.drift_sigma * gap_s, 0.5 * most_drift_per_s * gap_s * gap_s);
}

Panel offset_panel(std::span<const ClockPair> p, bool two_way, const std::vector<Window>& windows,
                   const OffsetLine& line) {
  Panel panel;
  panel.name = "offset_bounds";
  panel.kind = "points";
  panel.title = "Offset: bounds and answer";
  panel.caption =
      two_way ? "Each exchange bounds the offset from both sides; the answer runs between. The mean drift is taken off."
              : "Each arrival bounds the offset from above; the answer runs along the least delays. The mean drift is "
                "taken off.";
  panel.x = {"time", "s", {}, {}, {}};
  Series upper{"upper bound", "s", {}, {}, {}}, lower{"lower bound", "s", {}, {}, {}},
      answer{"offset", "s", {}, {}, "lines"};
  const std::size_t step = std::max<std::size_t>(1, p.size() / 4000);
  std::size_t w = 0;
  for (std::size_t i = 0; i < p.size(); i += step) {
    while (w + 1 < windows.size() && i >= windows[w + 1].first) ++w;
    panel.x.values.push_back(1e-9 * static_cast<double>(p[i].device_ns - p.front().device_ns));
    const long double mean = line.at(p[i].device_ns);
    upper.values.push_back(1e-9 * static_cast<double>(static_cast<long double>(upper_of(p[i]).o_ns) - mean));
    lower.values.push_back(1e-9 * static_cast<double>(static_cast<long double>(lower_of(p[i]).o_ns) - mean));
    answer.values.push_back(1e-9 * static_cast<double>(windows[w].line.at(p[i].device_ns) - mean));
    answer.sigma.push_back(1e-9 * windows[w].offset_sigma_ns);
  }
  panel.y.push_back(std::move(upper));
  if (two_way) panel.y.push_back(std::move(lower));
  panel.y.push_back(std::move(answer));
  return panel;
}

/// A double of seconds since 1970 is 238 ns coarse: the bounds are rounded outward, and stand relative to the answer
/// too.
void add_bounds(const OffsetBounds& b, long double offset_ns, Estimate& e) {
  constexpr double far = 1e300;
  e.extras.push_back({"offset_lower_s", std::nextafter(1e-9 * static_cast<double>(b.lower_ns), -far), {}});
  e.extras.push_back({"offset_upper_s", std::nextafter(1e-9 * static_cast<double>(b.upper_ns), far), {}});
  e.extras.push_back({"bound_below_s", 1e-9 * static_cast<double>(std::ceil(offset_ns - b.lower_ns) + 1), {}});
  e.extras.push_back({"bound_above_s", 1e-9 * static_cast<double>(std::ceil(b.upper_ns - offset_ns) + 1), {}});
}

Estimate by_hull(const Tidy& tidy, const PairStream& s, const PairOptions& options) {
  const std::span<const ClockPair> p = tidy.pairs;
  const std::vector<Window> windows = choose_windows(p, s, options);
  const std::size_t misfits =
      static_cast<std::size_t>(std::count_if(windows.begin(), windows.end(), [](const Window& w) { return !w.fits; }));
  if (misfits > 0)
    return Estimate::refusal(
        "hull", fmt::format("no clock fits {} of {} windows: a clock was stepped, or stamps are swapped", misfits,
                            windows.size()));
  Estimate e;
  e.method = "hull";
  e.verdict = Verdict::trusted;
  const std::size_t middle = windows.size() / 2;
  const Window& m = windows[middle];
  const OffsetPiece main = piece_of(m, p.front().device_ns);
  e.epoch = main.epoch;
  e.offset = main.offset;
  const double bend = sag_allowance_ns(p, windows, s.two_way, true);
  // One hull touches a bent clock in the window's middle and the other at its ends: their middle is half the sag off.
  e.sigma_s = std::hypot(main.sigma_s, 1e-9 * bend / 2);
  e.drift = main.drift;
  // A rate that moves by D over the window is off by up to D/2, 4·sag/length.
  const auto length_ns = static_cast<double>(p[m.first + m.count - 1].device_ns - p[m.first].device_ns);
  e.drift_sigma = std::hypot(m.drift_sigma, 4 * bend / std::max(length_ns, 1.0) / std::sqrt(3.0));
  if (windows.size() > 1)
    for (const Window& w : windows) {
      e.pieces.push_back(piece_of(w, p[w.first].device_ns));
      e.pieces.back().sigma_s = std::hypot(over_length_s(w, p, bend), gap_error_s(w, p));
    }
  e.evidence.panels.push_back(offset_panel(p, s.two_way, windows, m.line));
  const double length_s = 1e-9 * static_cast<double>(p.back().device_ns - p.front().device_ns);
  e.extras.push_back({"window_s", length_s / static_cast<double>(windows.size()), {}});
  if (s.two_way) {
    BoundHull upper(BoundHull::Side::upper_bounds), lower(BoundHull::Side::lower_bounds);
    for (const ClockPair& x : p.subspan(m.first, m.count)) upper.add(upper_of(x)), lower.add(lower_of(x));
    const double slack = sag_allowance_ns(p, windows, true, false);
    if (const auto bounds = bounds_at(lower, upper, m.line.epoch_ns, slack)) {
      add_bounds(*bounds, m.line.offset_ns, e);
      e.notes.push_back(
          fmt::format("the offset lies within {} of the answer whatever the delays were; the answer itself takes the "
                      "least delays of both ways as equal",
                      rounded_time_words(1e-9 * static_cast<double>(std::max(bounds->upper_ns - m.line.offset_ns,
                                                                             m.line.offset_ns - bounds->lower_ns)))));
    }
  } else {
    BoundHull upper(BoundHull::Side::upper_bounds);
    for (const ClockPair& x : p.subspan(m.first, m.count)) upper.add(upper_of(x));
    const std::size_t i = upper.edge_over(m.line.epoch_ns);
    const Bound a = upper.corners()[i];
    const long double here =
        static_cast<long double>(a.o_ns) + m.line.drift * static_cast<long double>(m.line.epoch_ns - a.s_ns);
    e.extras.push_back({"offset_upper_s",
                        1e-9 * static_cast<double>(std::ceil(here + sag_allowance_ns(p, windows, false, false) +
                                                             3 * m.offset_sigma_ns)),
                        {}});
  }
  if (const double step = step_between(p, windows, bend); step > 0)
    e.doubt(Verdict::weak, fmt::format("a clock steps by {} within the recording; the pieces follow",
                                       rounded_time_words(1e-9 * step)));
  if (p.size() < 8) e.doubt(Verdict::weak, fmt::format("only {} exchanges", p.size()));
  return e;
}

/// The exchange with the least delay of each block: what a Kalman filter can take for a measurement.
Estimate by_kalman(const Tidy& tidy, const PairStream& s) {
  const std::span<const ClockPair> p = tidy.pairs;
  const std::size_t blocks = std::clamp<std::size_t>(p.size() / 16, 1, 8192);
  if (blocks < 16)
    return Estimate::refusal("kalman", fmt::format("{} exchanges are too few to find noise levels from", p.size()));
  const OffsetLine rough = [&] {
    const auto offset = [&](std::size_t i) { return upper_of(p[i]).o_ns; };
    std::size_t a = 0, b = p.size() - 1;
    for (std::size_t i = 0; i < p.size() / 8; ++i) a = offset(i) < offset(a) ? i : a;
    for (std::size_t i = p.size() - p.size() / 8; i < p.size(); ++i) b = offset(i) < offset(b) ? i : b;
    OffsetLine line;
    line.epoch_ns = p[a].device_ns;
    line.offset_ns = static_cast<long double>(offset(a));
    line.drift = static_cast<long double>(offset(b) - offset(a)) /
                 static_cast<long double>(std::max<std::int64_t>(p[b].device_ns - p[a].device_ns, 1));
    return line;
  }();
  std::vector<PhaseSample> samples;
  const std::int64_t start = p.front().device_ns;
  for (std::size_t b = 0; b < blocks; ++b) {
    std::size_t best = b * p.size() / blocks;
    const auto delay = [&](std::size_t i) {
      return s.two_way ? static_cast<long double>(p[i].arrival_ns - p[i].request_ns)
                       : static_cast<long double>(upper_of(p[i]).o_ns) - rough.at(p[i].device_ns);
    };
    for (std::size_t i = best; i < (b + 1) * p.size() / blocks; ++i)
      if (delay(i) < delay(best)) best = i;
    const long double u = static_cast<long double>(upper_of(p[best]).o_ns) - rough.at(p[best].device_ns);
    const long double l =
        s.two_way ? static_cast<long double>(lower_of(p[best]).o_ns) - rough.at(p[best].device_ns) : u;
    const double t = 1e-9 * static_cast<double>(p[best].device_ns - start);
    if (samples.empty() || t > samples.back().t_s) samples.push_back({t, 1e-9 * static_cast<double>(0.5L * (u + l))});
  }
  const ClockNoise noise = fit_noise(samples, 1e-9, 4096);
  const SmoothedClock smoothed = smooth(samples, noise);
  const std::size_t k = samples.size() / 2;
  Estimate e;
  e.method = "kalman";
  e.verdict = Verdict::trusted;
  e.epoch = from_ns(start + static_cast<std::int64_t>(std::llround(samples[k].t_s * 1e9)));
  e.offset = Duration(static_cast<std::int64_t>(
      std::llroundl(rough.at(to_ns(e.epoch)) + 1e9L * static_cast<long double>(smoothed.at[k].phase_s))));
  e.sigma_s = std::max(smoothed.at[k].phase_sigma_s, 0.3e-9);
  e.drift = static_cast<double>(rough.drift) + smoothed.at[k].frequency;
  e.drift_sigma = smoothed.at[k].frequency_sigma;
  return e;
}

}  // namespace

Estimate relate_pairs(const PairStream& s, const PairOptions& options) {
  const Tidy tidy = tidied(s);
  Estimate e;
  if (tidy.pairs.size() < 4) {
    e = Estimate::refusal("hull", fmt::format("{} usable exchanges; at least 4 are needed", tidy.pairs.size()));
  } else if (tidy.pairs.back().device_ns == tidy.pairs.front().device_ns) {
    e = Estimate::refusal("hull", "all device stamps are the same");
  } else {
    const Estimate hull = by_hull(tidy, s, options), kalman = by_kalman(tidy, s);
    e = options.method == "kalman" ? kalman : hull;
    e.estimates = {hull, kalman};
    if (options.method == "kalman") e.evidence = hull.evidence;
    for (Estimate& other : e.estimates) {
      other.evidence = {};
      other.pieces.clear();
      other.sensor = s.device;
      other.reference = s.host;
    }
  }
  e.sensor = s.device;
  e.reference = s.host;
  if (e.answered() && !s.two_way) {
    if (options.least_delay_s) {
      const Duration off = from_seconds(*options.least_delay_s);
      e.offset = *e.offset - off;
      for (OffsetPiece& piece : e.pieces) piece.offset -= off;
      for (Estimate& other : e.estimates)
        if (other.offset) other.offset = *other.offset - off;
      e.notes.push_back(
          fmt::format("the given least delay of {} is taken off", rounded_time_words(*options.least_delay_s)));
    } else {
      e.reasons.push_back(
          "the least delay of the link is part of the offset: stamps that go one way cannot show it (--least-delay)");
    }
  }
  e.notes.insert(e.notes.begin(), tidy.words.begin(), tidy.words.end());
  return e;
}

bool OneWayClock::observe(std::int64_t device_ns, std::int64_t arrival_ns) {
  if (last_ns_ && device_ns < *last_ns_) return false;
  last_ns_ = device_ns;
  const Bound b{device_ns, arrival_ns - device_ns};
  if (!pending_since_ns_) pending_since_ns_ = device_ns;
  if (device_ns - *pending_since_ns_ >= half_ns_) {
    if (pending_.corners().size() >= 2) active_ = pending_;
    pending_.clear();
    pending_since_ns_ = device_ns;
  }
  active_.add(b);
  pending_.add(b);
  return true;
}

std::optional<std::int64_t> OneWayClock::host_ns(std::int64_t device_ns) const {
  const auto found = line_under(active_);
  if (!found) return std::nullopt;
  return device_ns + static_cast<std::int64_t>(std::llroundl(found->at(device_ns)));
}

void TwoWayClock::Window::add(const ClockPair& p) {
  upper.add(upper_of(p));
  lower.add(lower_of(p));
  round_trips_ns += static_cast<double>(p.arrival_ns - p.request_ns);
}

bool TwoWayClock::observe(const ClockPair& p) {
  if ((last_ns_ && p.device_ns < *last_ns_) || p.arrival_ns < p.request_ns) return false;
  last_ns_ = p.device_ns;
  if (!pending_since_ns_) pending_since_ns_ = p.device_ns;
  if (p.device_ns - *pending_since_ns_ >= half_ns_) {
    if (pending_.upper.size() >= 2) active_ = pending_;
    pending_ = {};
    pending_since_ns_ = p.device_ns;
  }
  active_.add(p);
  pending_.add(p);
  return true;
}

std::optional<DisciplinedStamp> TwoWayClock::host(std::int64_t device_ns) const {
  if (active_.upper.size() < 2) return std::nullopt;
  const auto found =
      likely_line(active_.lower, active_.upper, active_.round_trips_ns / static_cast<double>(active_.upper.size()));
  if (!found) return DisciplinedStamp{};
  DisciplinedStamp out;
  out.reference_ns = device_ns + static_cast<std::int64_t>(std::llroundl(found->line.at(device_ns)));
  const double away = std::abs(static_cast<double>(device_ns - found->line.epoch_ns));
  out.sigma_s = 1e-9 * std::hypot(found->offset_sigma_ns, found->drift_sigma * away);
  if (const auto b = bounds_at(active_.lower, active_.upper, device_ns)) {
    out.lower_ns = device_ns + static_cast<std::int64_t>(std::floor(b->lower_ns));
    out.upper_ns = device_ns + static_cast<std::int64_t>(std::ceil(b->upper_ns));
  }
  out.state = last_ns_ && device_ns - *last_ns_ > half_ns_ ? ClockState::holdover : ClockState::locked;
  return out;
}

}  // namespace takt
