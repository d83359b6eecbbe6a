// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/film.h"

#include <fmt/core.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "takt/error.h"
#include "takt/math/median.h"
#include "takt/math/parallel.h"

namespace takt::dial {
namespace {

constexpr std::size_t stretch = 32;  // frames that one thread decodes in a row

double usual_step(const std::vector<double>& time) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time.size(); ++i)
    if (time[i] > time[i - 1]) steps.push_back(time[i] - time[i - 1]);
  return steps.empty() ? 1 : median(std::move(steps));
}

}  // namespace

void in_parallel(std::size_t count, int threads, const std::function<void(std::size_t)>& body) {
  parallel_for(static_cast<int>((count + stretch - 1) / stretch), threads, [&](int k) {
    const std::size_t from = static_cast<std::size_t>(k) * stretch;
    for (std::size_t i = from; i < std::min(count, from + stretch); ++i) body(i);
  });
}

Film read_film(const CameraStream& camera, const Rectifier& rectify, int threads,
               const std::function<void(std::size_t done, std::size_t total)>& progress) {
  std::vector<std::optional<Profile>> seen(camera.size());
  std::vector<double> exposure_s(camera.size(), 0);
  const int workers = threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::size_t done = 0;
  std::mutex guard;
  parallel_for(workers, workers, [&](int k) {
    // A stretch belongs to one thread; a reader that cannot skip decodes the others' frames too, and they are dropped.
    const auto mine = [&](std::size_t i) {
      return static_cast<int>(i / stretch % static_cast<std::size_t>(workers)) == k;
    };
    const auto reader = camera.open();
    reader->skip_to(static_cast<std::size_t>(k) * stretch);
    while (const auto frame = reader->next()) {
      const std::size_t i = frame->index;
      if (i >= seen.size()) break;
      if (!mine(i)) {
        std::size_t next = i - i % stretch;
        while (!mine(next)) next += stretch;
        reader->skip_to(next);
        continue;
      }
      if (!rectify.fits(frame->image))
        throw Error(fmt::format("picture {} has {}x{} pixels, not the {}x{} of its camera's resolution", i,
                                frame->image.width, frame->image.height, rectify.width(), rectify.height()),
                    camera.name, "correct resolution and intrinsics in its sensor.yaml");
      seen[i] = rectify(frame->image);
      exposure_s[i] = frame->exposure_s;
      if ((i + 1) % stretch == 0) reader->skip_to(i + 1 + stretch * static_cast<std::size_t>(workers - 1));
      const std::lock_guard lock(guard);
      if (++done % 16 == 0 && progress) progress(done, seen.size());
    }
  });
  Film film;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    film.index.push_back(i);
    film.time_s.push_back(seconds_since(camera.stamps.front(), camera.stamps[i]));
    film.exposures_s.push_back(exposure_s[i]);
    film.profiles.push_back(std::move(*seen[i]));
  }
  film.interval_s = usual_step(film.time_s);
  return film;
}

}  // namespace takt::dial
