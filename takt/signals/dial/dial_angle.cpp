// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/dial_angle.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "takt/signals/dial/film.h"
#include "takt/signals/dial/follow.h"
#include "takt/signals/dial/self_calibration.h"

namespace takt {
namespace {

using namespace dial;
constexpr double deg = std::numbers::pi / 180;
constexpr std::size_t frames_for_calibration = 120, frames_for_mosaic = 1500;

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

int bands_for(const CameraStream& camera, const DialOptions& options) {
  if (options.bands < 0) throw std::invalid_argument(fmt::format("DialOptions: {} bands", options.bands));
  if (options.bands > 0) return options.bands;
  return camera.timing.shutter == Shutter::rolling ? 4 : 1;
}

/// A camera's pictures on their way to readings.
struct Work {
  Film film;
  SlotMap map;
  Patterns print;
  double pixel_rad;
  int threads;
  std::vector<Readings> bands;  ///< one a band of rows, the same reading's registrations
};

/// Evenly chosen frames that have a reading.
std::vector<Placed> chosen(const Work& w, const Readings& readings, int band, std::size_t most) {
  std::vector<std::size_t> with;
  for (std::size_t i = 0; i < readings.size(); ++i)
    if (readings[i]) with.push_back(i);
  std::vector<Placed> out;
  const std::size_t step = std::max<std::size_t>(1, with.size() / most);
  for (std::size_t k = 0; k < with.size(); k += step)
    out.push_back({&w.film.profiles[with[k]], *readings[with[k]], band});
  return out;
}

std::vector<Placed> chosen_of_all_bands(const Work& w, std::size_t most) {
  std::vector<Placed> out;
  for (std::size_t b = 0; b < w.bands.size(); ++b) {
    const std::vector<Placed> more = chosen(w, w.bands[b], static_cast<int>(b), most);
    out.insert(out.end(), more.begin(), more.end());
  }
  return out;
}

/// Readings again, each near what it was.
void register_again(const Work& w, Readings& readings, const Patterns& patterns, const Part& part) {
  in_parallel(readings.size(), w.threads, [&](std::size_t i) {
    if (readings[i])
      readings[i] = register_profile(w.film.profiles[i], w.map, patterns, readings[i]->reading_rad, part);
  });
}

/// Slots' angles and light from the print: from the middle outwards, for far from the axis a wrong scale is a wrong
/// line. Returns the scale found.
double calibrate(Work& w, Readings& readings) {
  double scale = 1, widest = 0;
  for (const Slot& s : w.map.slots) widest = std::max(widest, std::abs(s.angle_rad));
  for (const double share : {0.25, 0.4, 0.7, 1.0, 1.0, 1.0}) {
    std::vector<Placed> frames = chosen(w, readings, -1, frames_for_calibration);
    in_parallel(frames.size(), w.threads, [&](std::size_t i) {
      frames[i].at =
          register_profile(*frames[i].profile, w.map, w.print, frames[i].at.reading_rad, {.reach_rad = share * widest});
    });
    scale *= 1 + refine_angles(w.map, frames, w.print, share * widest, share < 0.6);
  }
  return scale;
}

/// The range of what was read.
double reach_of(const Readings& readings) {
  double low = 1e9, high = -1e9;
  for (const auto& r : readings)
    if (r) low = std::min(low, r->reading_rad), high = std::max(high, r->reading_rad);
  return high - low;
}

/// What all frames together show takes the place of the print: paper, ink and light as they are.
void refine_by_mosaic(Work& w) {
  for (int round = 0; round < 2; ++round) {
    const std::vector<Placed> frames = chosen_of_all_bands(w, frames_for_mosaic);
    refine_light(w.map, frames, w.print);
    w.print = mosaic(w.map, frames, w.print);
    for (std::size_t b = 0; b < w.bands.size(); ++b)
      register_again(w, w.bands[b], w.print, {.band = static_cast<int>(b)});
  }
}

double middle_of(const Readings& readings) {
  double low = 1e9, high = -1e9;
  for (const auto& r : readings)
    if (r) low = std::min(low, r->reading_rad), high = std::max(high, r->reading_rad);
  return 0.5 * (low + high);
}

void split_into_bands(Work& w, const Readings& whole, int bands) {
  w.bands.assign(static_cast<std::size_t>(bands), whole);
  if (bands > 1)
    for (std::size_t b = 0; b < w.bands.size(); ++b)
      register_again(w, w.bands[b], w.print, {.band = static_cast<int>(b)});
}

/// Bands see one dial: what is constant between them is mounting (a roll of a few minutes of arc), what goes with the
/// speed is the shutter's. The constant goes.
void align_bands(Work& w) {
  const std::size_t n = w.film.index.size();
  std::vector<std::optional<double>> mean(n);
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0;
    bool all = true;
    for (const Readings& band : w.bands) {
      all = all && band[i].has_value();
      if (all) sum += band[i]->reading_rad;
    }
    if (all) mean[i] = sum / static_cast<double>(w.bands.size());
  }
  for (Readings& band : w.bands) {
    double count = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t i = 1; i + 1 < n; ++i) {
      if (!mean[i - 1] || !mean[i] || !mean[i + 1]) continue;
      const double speed =
          (*mean[i + 1] - *mean[i - 1]) / static_cast<double>(w.film.index[i + 1] - w.film.index[i - 1]);
      const double away = band[i]->reading_rad - *mean[i];
      ++count, x += speed, y += away, xx += speed * speed, xy += speed * away;
    }
    const double spread = count * xx - x * x;
    if (count < 10 || !(spread > 0)) continue;
    const double constant = (y * xx - x * xy) / spread;
    for (auto& r : band)
      if (r) r->reading_rad -= constant;
  }
}

/// Frames that are there but say nothing.
struct Faults {
  std::size_t repeated = 0, glaring = 0, faint = 0, strange = 0;
  [[nodiscard]] std::size_t all() const { return repeated + glaring + faint + strange; }
  [[nodiscard]] std::string words(std::size_t frames) const {
    std::string out;
    const auto add = [&out](std::size_t n, const char* what) {
      if (n > 0) out += fmt::format("{}{} {}", out.empty() ? "" : ", ", n, what);
    };
    add(repeated, "repeat the picture before them");
    add(glaring, "are overexposed");
    add(faint, "are blurred or too dark");
    add(strange, "do not show the dial");
    return fmt::format("{} of {} frames were left out: {}", all(), frames, out);
  }
};

/// How much neighbouring slots differ.
float contrast(const Profile& p) {
  float rough = 0;
  for (std::size_t i = 1; i < p.grey.size(); ++i) rough += std::abs(p.grey[i] - p.grey[i - 1]);
  return rough / static_cast<float>(p.grey.size());
}

/// Takes away readings that stand out from the rest, and says why.
Faults leave_out(Work& w) {
  Faults faults;
  std::vector<double> contrasts, usual_mismatch, usual_sigma;
  const std::size_t n = w.film.profiles.size();
  for (std::size_t i = 0; i < n; ++i) contrasts.push_back(contrast(w.film.profiles[i]));
  const double usual_contrast = median(contrasts);
  for (const Readings& band : w.bands) {  // one may see less of the dial than another
    std::vector<double> mismatch, sigmas;
    for (const auto& r : band)
      if (r) mismatch.push_back(1 - r->correlation), sigmas.push_back(r->sigma_rad);
    usual_mismatch.push_back(median(mismatch));
    usual_sigma.push_back(median(sigmas));
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Profile& p = w.film.profiles[i];
    const bool repeated = i > 0 && p.grey == w.film.profiles[i - 1].grey;
    bool lost = false, odd = false;
    for (std::size_t b = 0; b < w.bands.size(); ++b) {
      const auto& r = w.bands[b][i];
      lost = lost || !r;
      odd = odd || (r && (1 - r->correlation > 4 * usual_mismatch[b] + 0.1 || r->sigma_rad > 5 * usual_sigma[b]));
    }
    if (!repeated && !lost && !odd) continue;
    if (p.saturated_share > 0.02)
      ++faults.glaring;
    else if (contrasts[i] < 0.6 * usual_contrast)
      ++faults.faint;
    else if (repeated)
      ++faults.repeated;
    else
      ++faults.strange;
    for (Readings& band : w.bands) band[i].reset();
  }
  return faults;
}

DialAngles handed_over(const Work& w, const CameraStream& camera, bool with_rows) {
  DialAngles out;
  AngleStream& a = out.angles;
  a.name = camera.name;
  a.clock = camera.clock;
  a.timing = camera.timing;
  const double reference_row = camera.timing.row == RowReference::middle ? 0.5 * camera.timing.rows : 0;
  for (std::size_t i = 0; i < w.film.index.size(); ++i)
    for (const Readings& band : w.bands) {
      if (!band[i]) continue;
      a.stamps.push_back(camera.stamps[w.film.index[i]]);
      a.angle_rad.push_back(band[i]->reading_rad);
      a.exposures_s.push_back(w.film.exposures_s[i]);
      if (with_rows) a.rows.push_back(band[i]->row - reference_row);
      out.sigma_rad.push_back(band[i]->sigma_rad);
      out.frame.push_back(w.film.index[i]);
    }
  return out;
}

/// Readings by the dial's own print, and the map that goes with them.
Readings by_code(Work& w, double& scale) {
  const Part middle{.reach_rad = 100 * w.pixel_rad};
  Readings readings = follow_code(w.film, w.map, w.print, w.pixel_rad, middle);
  scale = calibrate(w, readings);
  return follow_code(w.film, w.map, w.print, w.pixel_rad, {});
}

/// Changes from frame to frame, then the nearest graduations.
Readings by_frames(Work& w, const DialOptions& options, double& scale, std::vector<std::string>& notes) {
  const bool keep = options.method == DialMethod::keyframes;
  Readings chain = follow_frames(w.film, w.map, w.print.size(), w.pixel_rad, keep);
  const double offset = options.rest_reading_rad ? *options.rest_reading_rad - middle_of(chain) : 0;
  if (!options.rest_reading_rad) notes.emplace_back("the rest reading is not known: angles count from the first frame");
  const auto moved = [&](Readings r) {
    for (auto& one : r)
      if (one) one->reading_rad += offset;
    return r;
  };
  if (!keep) return moved(chain);
  if (options.rest_reading_rad) {
    Readings printed = follow_chain(w.film, w.map, w.print, w.pixel_rad, chain, offset, 2.2 * deg);
    const auto count = [](const Readings& r) {
      return std::count_if(r.begin(), r.end(), [](const auto& o) { return o.has_value(); });
    };
    if (10 * count(printed) > 9 * count(chain)) {
      scale = calibrate(w, printed);
      register_again(w, printed, w.print, {});
      return printed;
    }
    notes.emplace_back("the dial does not show the graduations that were told; its scale is the rig file's");
  }
  // A dial of its own: what the frames show is all there is.
  chain = moved(std::move(chain));
  for (Pattern& p : w.print) std::fill(p.grey.begin(), p.grey.end(), 0.0f);
  std::vector<Placed> frames = chosen(w, chain, -1, frames_for_mosaic);
  for (Placed& f : frames) f.at.gain = 1, f.at.level = 0;
  w.print = mosaic(w.map, frames, w.print);
  register_again(w, chain, w.print, {});
  return chain;
}

}  // namespace

DialAngles dial_angles(const CameraStream& camera, const Dial& dial, const DialView& view, const DialOptions& options) {
  check(dial);
  if (options.method == DialMethod::coded && dial.kind != DialKind::coded)
    throw std::invalid_argument("dial: a plain dial has no code to read; use keyframes");
  const int bands = bands_for(camera, options);
  const Rectifier rectify(dial, view, bands);
  Work w;
  w.pixel_rad = view.pixel_rad();
  w.threads = options.threads;
  w.map.slots = rectify.slots();
  w.print = printed_patterns(dial, w.pixel_rad);
  w.film = read_film(camera, rectify, options.threads, options.progress);
  std::vector<const Profile*> all;
  for (const Profile& p : w.film.profiles) all.push_back(&p);
  w.map.light = smooth_light(all, w.map.slots);

  double scale = 1;
  std::vector<std::string> notes;
  const Readings whole = options.method == DialMethod::coded ? by_code(w, scale) : by_frames(w, options, scale, notes);
  split_into_bands(w, whole, bands);
  Faults faults = leave_out(w);
  if (options.method != DialMethod::neighbours && reach_of(w.bands.front()) > 40 * w.pixel_rad) refine_by_mosaic(w);
  if (bands > 1) align_bands(w);

  DialAngles out = handed_over(w, camera, bands > 1 || camera.timing.shutter != Shutter::global);
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
