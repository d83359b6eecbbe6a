// SPDX-License-Identifier: Apache-2.0
#include "takt/signals/dial/film.h"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#include "takt/error.h"

namespace takt::dial {
namespace {

constexpr std::size_t stretch = 32;  // frames that one thread decodes in a row

int count_of(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// work(k) for k in [0, threads), side by side; the first exception is thrown again here.
void side_by_side(int threads, const std::function<void(int)>& work) {
  std::exception_ptr failure;
  std::mutex guard;
  const auto guarded = [&](int k) {
    try {
      work(k);
    } catch (...) {
      const std::lock_guard lock(guard);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> others;
    for (int k = 1; k < threads; ++k) others.emplace_back(guarded, k);
    guarded(0);
  }
  if (failure) std::rethrow_exception(failure);
}

double median_step(const std::vector<double>& time) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time.size(); ++i)
    if (time[i] > time[i - 1]) steps.push_back(time[i] - time[i - 1]);
  if (steps.empty()) return 1;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

}  // namespace

void in_parallel(std::size_t count, int threads, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next{0};
  side_by_side(count_of(threads), [&](int) {
    for (std::size_t from = next.fetch_add(stretch); from < count; from = next.fetch_add(stretch))
      for (std::size_t i = from; i < std::min(count, from + stretch); ++i) body(i);
  });
}

Film read_film(const CameraStream& camera, const Rectifier& rectify, int threads,
               const std::function<void(std::size_t done, std::size_t total)>& progress) {
  std::vector<std::optional<Profile>> seen(camera.size());
  std::vector<double> exposure_s(camera.size(), 0);
  const int workers = count_of(threads);
  std::size_t done = 0;
  std::mutex guard;
  side_by_side(workers, [&](int k) {
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
  film.interval_s = median_step(film.time_s);
  return film;
}

}  // namespace takt::dial
