// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/telemetry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace takt {

namespace {

constexpr double microsecond_ns = 1000;
/// Stamps agree within some 0.1 ms, ticks of an operating system within a few ms; payloads are cut in batches of 20 ms.
constexpr double stamp_tolerance_ns = 5e6, coarse_tolerance_ns = 50e6;

std::optional<std::int64_t> stamp_us(const gpmf::Stream& s) {
  return s.stamp_us;
}
std::optional<std::int64_t> tick_us(const gpmf::Stream& s) {
  if (!s.tick_ms || *s.tick_ms <= 0 || *s.tick_ms > 1'000'000'000'000) return std::nullopt;
  return *s.tick_ms * 1000;
}

/// Streams with one sample a video frame: their payloads begin exactly at a frame, so they tie the camera's clock to
/// the media time. CORI's stamp is the frame's start by GoPro's word (gpmf-parser issue 189).
constexpr const char* frame_streams[] = {"CORI", "IORI", "SHUT", "ISOE", "ISOG"};

}  // namespace

Telemetry::Telemetry(const std::vector<MediaIndex::Payload>& payloads) {
  std::size_t damaged = 0;
  std::string problem;
  for (const MediaIndex::Payload& p : payloads) {
    const gpmf::Payload parsed = gpmf::parse(std::as_bytes(std::span(p.bytes)));
    if (!parsed.problem.empty() && damaged++ == 0) problem = parsed.problem;
    for (gpmf::Stream& s : gpmf::streams(parsed)) blocks_.push_back({p.start, p.duration, std::move(s)});
  }
  if (damaged > 0)
    notes_.push_back(fmt::format("{} of {} telemetry payloads are damaged ({}); what could be read of them is used",
                                 damaged, payloads.size(), problem));
  camera_clock_ = tie("STMP", reading_ = stamp_us);
  if (!camera_clock_) camera_clock_ = tie("TICK", reading_ = tick_us);
  if (!camera_clock_) return;
  const SampleClock& clock = camera_clock_->to_media;
  const SampleClock::Piece& piece = clock.pieces().front();
  notes_.push_back(fmt::format(
      "the camera's clock ({}) is tied to the media time by {} payloads of a stream with one sample a frame: "
      "{:+.1f} ppm, residual {:.3f} ms",
      camera_clock_->name, camera_clock_->payloads.size(), (piece.period_ns / microsecond_ns - 1) * 1e6,
      piece.residual_rms_ns * 1e-6));
  if (clock.pieces().size() > 1)
    notes_.push_back(fmt::format("the camera's clock steps or starts again {} times", clock.pieces().size() - 1));
}

std::vector<Telemetry::Block> Telemetry::blocks(const std::string& key, std::size_t columns) const {
  std::vector<Block> found;
  for (const Block& b : blocks_) {
    if (b.stream.key != key || b.stream.data.columns != columns || b.stream.data.rows == 0) continue;
    if (!found.empty() && found.front().stream.device != b.stream.device)
      continue;  // a drone's IMU beside the camera's
    found.push_back(b);
  }
  return found;
}

std::optional<Telemetry::CameraClock> Telemetry::tie(const std::string& name, Reading reading) const {
  for (const char* key : frame_streams) {
    std::vector<BlockMark> marks;
    std::vector<Stamp> payloads;
    for (const Block& b : blocks_)
      if (const auto us = reading(b.stream); us && b.stream.key == key) {
        marks.push_back({*us, to_ns(b.start)});
        payloads.push_back(b.start);
      }
    if (marks.empty()) continue;
    const double tolerance_ns = reading == stamp_us ? stamp_tolerance_ns : coarse_tolerance_ns;
    return CameraClock{name, std::move(payloads), SampleClock(marks, microsecond_ns, tolerance_ns)};
  }
  return std::nullopt;
}

namespace {

/// The running number of each block's first sample: the camera's count (TSMP), else our own.
template <class Blocks>
std::vector<BlockMark> counted_marks(const Blocks& blocks) {
  const bool by_camera =
      std::all_of(blocks.begin(), blocks.end(), [](const auto& b) { return b.stream.total.has_value(); });
  std::vector<BlockMark> marks;
  std::int64_t delivered = 0;
  for (const auto& b : blocks) {
    const auto rows = static_cast<std::int64_t>(b.stream.data.rows);
    marks.push_back({by_camera ? *b.stream.total - rows : delivered, 0});
    delivered += rows;
  }
  return marks;
}

template <class Blocks>
double nominal_period_ns(const Blocks& blocks) {
  const auto& first = blocks.front();
  return std::max(static_cast<double>(first.duration.count()), 1e6) / static_cast<double>(first.stream.data.rows);
}

std::int64_t delay_ns(const gpmf::Stream& stream) {
  const double delay_s = stream.delay_s.value_or(0);
  return std::abs(delay_s) < 60 ? from_seconds(delay_s).count() : 0;  // more is no delay of a sensor
}

}  // namespace

std::optional<Telemetry::Timing> Telemetry::time_by_camera(const std::vector<Block>& blocks) const {
  if (!camera_clock_) return std::nullopt;
  std::vector<BlockMark> marks = counted_marks(blocks);
  const std::vector<Stamp>& payloads = camera_clock_->payloads;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const auto us = reading_(blocks[k].stream);
    if (!us) return std::nullopt;
    const auto after = std::upper_bound(payloads.begin(), payloads.end(), blocks[k].start);
    const auto mark = after == payloads.begin() ? 0 : after - payloads.begin() - 1;
    marks[k].time_ns =
        camera_clock_->to_media.time_ns(static_cast<std::size_t>(mark), *us) - delay_ns(blocks[k].stream);
  }
  const double tolerance_ns = reading_ == stamp_us ? stamp_tolerance_ns : coarse_tolerance_ns;
  const SampleClock clock(marks, nominal_period_ns(blocks), tolerance_ns);
  return Timing{marks, clock, fmt::format("the camera's clock ({})", camera_clock_->name)};
}

Telemetry::Timing Telemetry::time_by_payloads(const std::vector<Block>& blocks) {
  std::vector<BlockMark> marks = counted_marks(blocks);
  for (std::size_t k = 0; k < blocks.size(); ++k)
    marks[k].time_ns = to_ns(blocks[k].start) - delay_ns(blocks[k].stream);
  return {marks, SampleClock(marks, nominal_period_ns(blocks), coarse_tolerance_ns),
          "the times of the payloads, which say when samples were stored"};
}

std::optional<TelemetryTable> Telemetry::table(const std::string& key, std::size_t columns) const {
  const std::vector<Block> found = blocks(key, columns);
  if (found.empty()) return std::nullopt;
  Timing timing = time_by_payloads(found);
  const auto residual_ns = [](const Timing& t) { return t.clock.pieces().front().residual_rms_ns; };
  if (auto better = time_by_camera(found);
      better && (reading_ == stamp_us || residual_ns(*better) < residual_ns(timing)))
    timing = std::move(*better);
  const std::vector<BlockMark>& marks = timing.marks;
  const SampleClock& clock = timing.clock;

  TelemetryTable table;
  table.key = key;
  table.head = found.front().stream;
  table.columns = columns;
  table.rate_hz = 1e9 / clock.period_ns();
  for (std::size_t k = 0; k < found.size(); ++k) {
    const gpmf::Numbers& data = found[k].stream.data;
    for (std::size_t i = 0; i < data.rows; ++i)
      table.stamps.push_back(from_ns(clock.time_ns(k, marks[k].sample + static_cast<std::int64_t>(i))));
    table.values.insert(table.values.end(), data.values.begin(), data.values.end());
  }

  table.note = fmt::format("{}: {} samples at {:.4f} Hz, a straight line over {} blocks by {}, residual {:.3f} ms", key,
                           table.rows(), table.rate_hz, found.size(), timing.words, residual_ns(timing) * 1e-6);
  if (const std::size_t off = clock.pieces().front().outliers; off > 0)
    table.note += fmt::format(" ({} blocks off it)", off);
  for (std::size_t i = 1; i < clock.pieces().size(); ++i) {
    const std::size_t at = clock.pieces()[i].first_mark;
    const std::int64_t expected = clock.time_ns(at - 1, marks[at].sample);
    table.note += fmt::format("; the stamps step by {:+.1f} ms at {:.1f} s",
                              static_cast<double>(clock.time_ns(at, marks[at].sample) - expected) * 1e-6,
                              static_cast<double>(marks[at].time_ns) * 1e-9);
  }
  return table;
}

}  // namespace takt
