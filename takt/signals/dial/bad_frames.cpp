// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/bad_frames.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "takt/math/median.h"

namespace takt::dial {
namespace {

/// How much neighbouring slots differ.
float contrast(const Profile& p) {
  float rough = 0;
  for (std::size_t i = 1; i < p.grey.size(); ++i) rough += std::abs(p.grey[i] - p.grey[i - 1]);
  return rough / static_cast<float>(p.grey.size());
}

}  // namespace

std::string Faults::words(std::size_t frames) const {
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

Faults leave_out_bad_frames(const Film& film, Readings& readings) {
  Faults faults;
  if (readings.empty()) return faults;
  std::vector<double> contrasts, mismatch, sigmas;
  for (const Profile& p : film.profiles) contrasts.push_back(contrast(p));
  for (const auto& r : readings)
    if (r) mismatch.push_back(1 - r->correlation), sigmas.push_back(r->sigma_rad);
  if (mismatch.empty()) mismatch = sigmas = {0};
  const double usual_contrast = median(contrasts), usual_mismatch = median(mismatch), usual_sigma = median(sigmas);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const Profile& p = film.profiles[i];
    auto& r = readings[i];
    const bool repeated = i > 0 && p.grey == film.profiles[i - 1].grey;
    const bool odd = r && (1 - r->correlation > 4 * usual_mismatch + 0.1 || r->sigma_rad > 5 * usual_sigma);
    if (!repeated && r && !odd) continue;
    if (p.saturated_share > 0.02)
      ++faults.glaring;
    else if (contrasts[i] < 0.6 * usual_contrast)
      ++faults.faint;
    else if (repeated)
      ++faults.repeated;
    else
      ++faults.strange;
    r.reset();
  }
  return faults;
}

}  // namespace takt::dial
