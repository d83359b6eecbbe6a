// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/cut.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <map>

#include "takt/error.h"
#include "takt/recording/stored_picture.h"

namespace takt {

namespace {

struct Interval {
  Stamp first = Stamp::min(), last = Stamp::max();
};

/// Calls `visit(stream)` for the streams of every kind.
template <class Visit>
void for_each_stream(Recording& r, Visit visit) {
  for (auto& s : r.imus) visit(s);
  for (auto& s : r.cameras) visit(s);
  for (auto& s : r.tracks) visit(s);
  for (auto& s : r.attitudes) visit(s);
  for (auto& s : r.angles) visit(s);
}

template <class T>
void keep(std::vector<T>& values, const std::vector<std::size_t>& kept) {
  if (values.empty()) return;
  std::size_t out = 0;
  for (const std::size_t i : kept) {
    if (out != i) values[out] = std::move(values[i]);
    ++out;
  }
  values.resize(out);
}

void keep_values(ImuStream& s, const std::vector<std::size_t>& kept) {
  keep(s.arrivals, kept);
  keep(s.gyro_rad_s, kept);
  keep(s.accel_m_s2, kept);
}
void keep_values(TrackStream& s, const std::vector<std::size_t>& kept) {
  keep(s.features, kept);
}
void keep_values(AttitudeStream& s, const std::vector<std::size_t>& kept) {
  keep(s.world_from_body, kept);
}
void keep_values(AngleStream& s, const std::vector<std::size_t>& kept) {
  keep(s.angle_rad, kept);
}

/// Passes on the frames whose index is in `kept`, renumbered.
class CutFrames : public FrameReader, public KeepsStored {
 public:
  CutFrames(std::unique_ptr<FrameReader> all, std::shared_ptr<const std::vector<std::size_t>> kept)
      : all_(std::move(all)), kept_(std::move(kept)) {}

  std::optional<Frame> next() override {
    while (place_ < kept_->size()) {
      const std::size_t before = all_->broken();
      all_->skip_to((*kept_)[place_]);
      std::optional<Frame> frame = all_->next();
      if (!frame) return std::nullopt;
      place_ = static_cast<std::size_t>(
          std::lower_bound(kept_->begin() + static_cast<std::ptrdiff_t>(place_), kept_->end(), frame->index) -
          kept_->begin());
      broken_ += all_->broken() - before;
      if (place_ == kept_->size() || (*kept_)[place_] != frame->index) continue;
      frame->index = place_++;
      return frame;
    }
    return std::nullopt;
  }
  [[nodiscard]] std::optional<StoredPicture> stored() const override { return stored_picture(*all_); }

 private:
  std::unique_ptr<FrameReader> all_;
  std::shared_ptr<const std::vector<std::size_t>> kept_;
  std::size_t place_ = 0;
};

void keep_values(CameraStream& s, const std::vector<std::size_t>& kept) {
  keep(s.arrivals, kept);
  keep(s.exposures_s, kept);
  const auto indices = std::make_shared<const std::vector<std::size_t>>(kept);
  s.open = [open = s.open, indices] { return std::make_unique<CutFrames>(open(), indices); };
}

/// `s` seconds after `t`, held at the ends of time.
Stamp after(Stamp t, double s) {
  const long double ns = static_cast<long double>(to_ns(t)) + static_cast<long double>(s) * 1e9L;
  if (ns >= static_cast<long double>(std::numeric_limits<std::int64_t>::max())) return Stamp::max();
  if (ns <= static_cast<long double>(std::numeric_limits<std::int64_t>::min())) return Stamp::min();
  return from_ns(static_cast<std::int64_t>(ns));
}

}  // namespace

void cut(Recording& recording, std::optional<double> from_s, std::optional<double> to_s) {
  if (!from_s && !to_s) return;
  std::map<std::string, Stamp> first;  // of each clock
  for_each_stream(recording, [&](const auto& s) {
    if (s.stamps.empty()) return;
    const Stamp start = *std::min_element(s.stamps.begin(), s.stamps.end());
    const auto [known, is_new] = first.emplace(s.clock, start);
    if (!is_new) known->second = std::min(known->second, start);
  });

  std::size_t left = 0;
  for_each_stream(recording, [&](auto& s) {
    if (s.stamps.empty()) return;
    Interval wanted;
    if (from_s) wanted.first = after(first.at(s.clock), *from_s);
    if (to_s) wanted.last = after(first.at(s.clock), *to_s);
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < s.stamps.size(); ++i)
      if (wanted.first <= s.stamps[i] && s.stamps[i] <= wanted.last) kept.push_back(i);
    left += kept.size();
    if (kept.size() == s.stamps.size()) return;
    keep_values(s, kept);
    keep(s.stamps, kept);
  });
  const std::string span = fmt::format("{} to {}", from_s ? fmt::format("{:g} s", *from_s) : "the start",
                                       to_s ? fmt::format("{:g} s", *to_s) : "the end");
  if (left == 0)
    throw Error("nothing was recorded from " + span, recording.path,
                "widen --from and --to: they count from the first stamp");
  recording.notes.push_back("cut: " + span + " after the first stamp");
}

}  // namespace takt
