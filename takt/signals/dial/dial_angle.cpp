// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/dial_angle.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "takt/math/median.h"
#include "takt/signals/dial/bad_frames.h"
#include "takt/signals/dial/film.h"
#include "takt/signals/dial/follow.h"
#include "takt/signals/dial/self_calibration.h"
#include "takt/signals/dial/shutter.h"

namespace takt {
namespace {

using namespace dial;
constexpr double deg = std::numbers::pi / 180;
constexpr std::size_t frames_for_calibration = 120, frames_for_mosaic = 1500;
constexpr double rolling_strip_px = 18, margin_px = 1.2;

/// A camera's pictures on their way to readings.
struct Work {
  Film film;
  SlotMap map;
  Patterns print;
  double pixel_rad = 0;
  int threads = 0;
  bool rolling = false;     ///< rows have an instant each
  double line_delay_s = 0;  ///< as far as it is known
  Readings readings;
  std::vector<std::optional<DialMotion>> motion;  ///< where it is rolling

  /// Frames are placed with a shear of their own while the line delay is not known.
  [[nodiscard]] Part within(double reach_rad) const { return {reach_rad, rolling}; }
  [[nodiscard]] double speed(std::size_t frame) const {
    return rolling && motion[frame] ? motion[frame]->speed_rad_s : 0;
  }
  /// A frame's reading with what the line delay makes of its motion.
  [[nodiscard]] Placement sheared(std::size_t frame) const {
    Placement p{readings[frame]->reading_rad};
    if (!rolling || !motion[frame]) return p;
    p.shear_rad = line_delay_s * motion[frame]->speed_rad_s;
    p.bend_rad = line_delay_s * line_delay_s * motion[frame]->acceleration_rad_s2;
    return p;
  }
};

/// Evenly chosen frames that have a reading.
std::vector<std::size_t> chosen(const Readings& readings, std::size_t most) {
  std::vector<std::size_t> with, out;
  for (std::size_t i = 0; i < readings.size(); ++i)
    if (readings[i]) with.push_back(i);
  const std::size_t step = std::max<std::size_t>(1, with.size() / most);
  for (std::size_t k = 0; k < with.size(); k += step) out.push_back(with[k]);
  return out;
}

std::vector<Placed> placed(const Work& w, const std::vector<std::size_t>& frames) {
  std::vector<Placed> out;
  for (const std::size_t i : frames) out.push_back({&w.film.profiles[i], *w.readings[i], w.speed(i)});
  return out;
}

/// Readings again, each near what it was.
void register_again(Work& w, const Part& part) {
  in_parallel(w.readings.size(), w.threads, [&](std::size_t i) {
    auto& r = w.readings[i];
    if (r) r = register_profile(w.film.profiles[i], w.map, w.print, *r, part);
  });
}

void measure_line_delay(Work& w) {
  if (!w.rolling) return;
  w.motion = motion_of(w.film, w.readings);
  w.line_delay_s = line_through_shears(w.readings, w.motion).line_delay_s;
}

/// Slots' angles and light from the print, and the line delay: from the middle outwards, for far from the axis a wrong
/// scale is a wrong line. Returns the scale found.
double calibrate(Work& w) {
  double scale = 1, widest = 0;
  for (const Slot& s : w.map.slots) widest = std::max(widest, std::abs(s.angle_rad));
  measure_line_delay(w);
  const std::vector<std::size_t> frames = chosen(w.readings, frames_for_calibration);
  for (const double share : {0.25, 0.4, 0.7, 1.0, 1.0, 1.0}) {
    // A shear of its own in each frame and a scale cannot be told apart in a rolled camera; with one line delay for
    // all, frames that move to and fro tell them apart.
    in_parallel(frames.size(), w.threads, [&](std::size_t k) {
      auto& r = w.readings[frames[k]];
      r = register_profile(w.film.profiles[frames[k]], w.map, w.print, w.sheared(frames[k]), {share * widest, false});
    });
    const Correction found = refine_angles(w.map, placed(w, frames), w.print, {share * widest, share < 0.6, w.rolling});
    scale *= 1 + found.scale;
    w.line_delay_s += found.line_delay_s;
  }
  for (std::size_t i = 0; i < w.readings.size(); ++i)
    if (w.readings[i]) static_cast<Placement&>(*w.readings[i]) = w.sheared(i);
  return scale;
}

struct Range {
  double low = 1e9, high = -1e9;
};
Range range_of(const Readings& readings) {
  Range range;
  for (const auto& r : readings)
    if (r) range = {std::min(range.low, r->reading_rad), std::max(range.high, r->reading_rad)};
  return range;
}

/// What all frames together show takes the place of the print: paper, ink and light as they are.
void refine_by_mosaic(Work& w) {
  for (int round = 0; round < 2; ++round) {
    const std::vector<Placed> frames = placed(w, chosen(w.readings, frames_for_mosaic));
    refine_light(w.map, frames, w.print);
    w.print = mosaic(w.map, frames, w.print);
    register_again(w, w.within(9));
  }
}

/// Readings by the dial's own print, and the scale that goes with them.
double by_code(Work& w) {
  w.readings = follow_code(w.film, w.map, w.print, w.pixel_rad, w.within(100 * w.pixel_rad));
  const double scale = calibrate(w);
  register_again(w, w.within(9));
  // What was lost before the scale was known, or was led astray by the frame before.
  in_parallel(w.readings.size(), w.threads, [&](std::size_t i) {
    auto& r = w.readings[i];
    if (r && r->correlation >= least_correlation) return;
    r = search_anywhere(w.film.profiles[i], w.map, w.print, w.pixel_rad, w.within(9));
    if (r->correlation < least_correlation) r.reset();
  });
  return scale;
}

/// Changes from frame to frame, then the nearest graduations.
double by_frames(Work& w, const DialOptions& options, std::vector<std::string>& notes) {
  const bool keep = options.method == DialMethod::keyframes;
  Readings& readings = w.readings;
  readings = follow_frames(w.film, w.map, w.print.size(), w.pixel_rad, keep, w.within(9));
  const Range range = range_of(readings);
  const double offset = options.rest_reading_rad ? *options.rest_reading_rad - 0.5 * (range.low + range.high) : 0;
  if (!options.rest_reading_rad) notes.emplace_back("the rest reading is not known: angles count from the first frame");
  if (keep && options.rest_reading_rad) {
    Readings chain = readings;
    readings = follow_chain(w.film, w.map, w.print, w.pixel_rad, chain, offset, 2.2 * deg, w.within(9));
    const auto count = [](const Readings& r) {
      return std::count_if(r.begin(), r.end(), [](const auto& o) { return o.has_value(); });
    };
    if (10 * count(readings) > 9 * count(chain)) {
      const double scale = calibrate(w);
      register_again(w, w.within(9));
      return scale;
    }
    readings = std::move(chain);
    notes.emplace_back("the dial does not show the graduations that were told; its scale is the rig file's");
  }
  for (auto& r : readings)
    if (r) r->reading_rad += offset;
  if (!keep) return 1;
  // A dial of its own: what the frames show is all there is.
  measure_line_delay(w);
  for (Pattern& p : w.print) std::fill(p.grey.begin(), p.grey.end(), 0.0f);
  std::vector<Placed> frames = placed(w, chosen(readings, frames_for_mosaic));
  for (Placed& f : frames) f.at.gain = 1, f.at.level = 0;
  w.print = mosaic(w.map, frames, w.print);
  register_again(w, w.within(9));
  return 1;
}

/// One reading a frame; of a rolling shutter two, as many rows above and below the pivot row as makes their errors
/// independent of each other: together they say all that the frame says.
DialAngles handed_over(const Work& w, const CameraStream& camera) {
  DialAngles out;
  AngleStream& a = out.angles;
  a.name = camera.name;
  a.clock = camera.clock;
  a.timing = camera.timing;
  const auto add = [&](std::size_t i, double reading, double sigma) {
    a.stamps.push_back(camera.stamps[w.film.index[i]]);
    a.angle_rad.push_back(reading);
    a.exposures_s.push_back(w.film.exposures_s[i]);
    out.sigma_rad.push_back(sigma);
    out.frame.push_back(w.film.index[i]);
  };
  if (!w.rolling) {
    for (std::size_t i = 0; i < w.readings.size(); ++i)
      if (const auto& r = w.readings[i]) add(i, r->reading_rad, r->sigma_rad);
    return out;
  }
  std::vector<double> apart;
  for (const auto& r : w.readings)
    if (r && r->shear_sigma_rad > 0) apart.push_back(r->sigma_rad / r->shear_sigma_rad);
  const double rows = apart.empty() ? 0 : median(apart),
               constant = line_through_shears(w.readings, motion_of(w.film, w.readings)).constant_rad;
  const double pivot = w.map.pivot_row - (camera.timing.row == RowReference::middle ? 0.5 * camera.timing.rows : 0);
  for (std::size_t i = 0; i < w.readings.size(); ++i)
    if (const auto& r = w.readings[i])
      for (const double side : {-rows, rows}) {
        Placement p = *r;
        p.shear_rad -= constant;
        add(i, p.reading_rad + p.shift_rad(side), std::hypot(r->sigma_rad, rows * r->shear_sigma_rad));
        a.rows.push_back(pivot + side);
      }
  return out;
}

Work read_pictures(const CameraStream& camera, const Dial& dial, const DialView& view, const DialOptions& options) {
  Work w;
  w.rolling = options.rows || camera.timing.shutter == Shutter::rolling;
  w.pixel_rad = view.pixel_rad();
  w.threads = options.threads;
  const double pixel_m = w.pixel_rad * view.radius_m;
  const std::vector<Strip> parts = strips(dial, margin_px * pixel_m, w.rolling ? rolling_strip_px * pixel_m : 1e9);
  const Rectifier rectify(parts, view, w.rolling);
  w.map.slots = rectify.slots();
  double pixels = 0;
  for (const Slot& s : w.map.slots) w.map.pivot_row += s.pixels * s.row, pixels += s.pixels;
  w.map.pivot_row /= pixels;
  w.print = printed_patterns(dial, parts, w.pixel_rad);
  w.film = read_film(camera, rectify, options.threads, options.progress);
  std::vector<const Profile*> all;
  for (const Profile& p : w.film.profiles) all.push_back(&p);
  w.map.light = smooth_light(all, w.map.slots);
  return w;
}

}  // namespace

DialAngles dial_angles(const CameraStream& camera, const Dial& dial, const DialView& view, const DialOptions& options) {
  check(dial);
  if (options.method == DialMethod::coded && dial.kind != DialKind::coded)
    throw std::invalid_argument("dial: a plain dial has no code to read; use keyframes");
  Work w = read_pictures(camera, dial, view, options);
  std::vector<std::string> notes;
  const double scale = options.method == DialMethod::coded ? by_code(w) : by_frames(w, options, notes);
  const Faults faults = leave_out_bad_frames(w.film, w.readings);
  const Range range = range_of(w.readings);
  if (options.method != DialMethod::neighbours && range.high - range.low > 40 * w.pixel_rad) refine_by_mosaic(w);

  DialAngles out = handed_over(w, camera);
  const std::size_t broken = camera.size() - w.film.index.size();
  out.pixel_rad = w.pixel_rad;
  out.scale = scale;
  out.left_out = faults.all() + broken;
  if (broken > 0) notes.push_back(fmt::format("{} of {} frames could not be decoded", broken, camera.size()));
  if (faults.all() > 0) notes.push_back(faults.words(w.film.index.size()));
  if (std::abs(scale - 1) > 1e-3)
    notes.push_back(
        fmt::format("the dial's graduations stretch the rig file's angles by {:+.2f} %", 100 * (scale - 1)));
  out.notes = std::move(notes);
  return out;
}

}  // namespace takt
