// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/telemetry.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace takt {

namespace {

constexpr double microsecond_ns = 1000;
/// Marks of the camera's µs clock agree within some 0.1 ms; payload times are cut in batches of some 20 ms.
constexpr double stamp_tolerance_ns = 5e6, payload_tolerance_ns = 50e6;

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
  tie_camera_clock();
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

void Telemetry::tie_camera_clock() {
  for (const char* key : frame_streams) {
    std::vector<BlockMark> marks;
    std::vector<Stamp> starts;
    for (const Block& b : blocks_)
      if (b.stream.key == key && b.stream.stamp_us) {
        marks.push_back({*b.stream.stamp_us, to_ns(b.start)});
        starts.push_back(b.start);
      }
    if (marks.empty()) continue;
    camera_clock_.emplace(marks, microsecond_ns, stamp_tolerance_ns);
    camera_clock_marks_ = std::move(starts);
    const SampleClock::Piece& piece = camera_clock_->pieces().front();
    notes_.push_back(fmt::format(
        "the camera's clock (STMP) is tied to the media time by {}, one sample a frame: {} marks, rate {:+.1f} ppm, "
        "residual {:.3f} ms",
        key, marks.size(), (piece.period_ns / microsecond_ns - 1) * 1e6, piece.residual_rms_ns * 1e-6));
    if (const std::size_t pieces = camera_clock_->pieces().size(); pieces > 1)
      notes_.push_back(fmt::format("the camera's clock starts again or steps {} times", pieces - 1));
    return;
  }
}

std::optional<TelemetryTable> Telemetry::table(const std::string& key, std::size_t columns) const {
  const std::vector<Block> found = blocks(key, columns);
  if (found.empty()) return std::nullopt;
  const bool stamped = camera_clock_ && std::all_of(found.begin(), found.end(),
                                                    [](const Block& b) { return b.stream.stamp_us.has_value(); });
  const bool counted =
      std::all_of(found.begin(), found.end(), [](const Block& b) { return b.stream.total.has_value(); });

  std::vector<BlockMark> marks;
  std::int64_t delivered = 0;
  for (const Block& b : found) {
    const auto rows = static_cast<std::int64_t>(b.stream.data.rows);
    BlockMark mark{counted ? *b.stream.total - rows : delivered, to_ns(b.start)};
    if (stamped) {
      const auto after = std::upper_bound(camera_clock_marks_.begin(), camera_clock_marks_.end(), b.start);
      const auto place = after == camera_clock_marks_.begin() ? after : std::prev(after);
      mark.time_ns =
          camera_clock_->time_ns(static_cast<std::size_t>(place - camera_clock_marks_.begin()), *b.stream.stamp_us);
    }
    if (b.stream.delay_s) mark.time_ns -= from_seconds(*b.stream.delay_s).count();
    marks.push_back(mark);
    delivered += rows;
  }
  const Block& first = found.front();
  const double nominal_ns =
      std::max(static_cast<double>(first.duration.count()), 1e6) / static_cast<double>(first.stream.data.rows);
  const SampleClock clock(marks, nominal_ns, stamped ? stamp_tolerance_ns : payload_tolerance_ns);

  TelemetryTable table;
  table.key = key;
  table.head = first.stream;
  table.columns = columns;
  table.rate_hz = 1e9 / clock.period_ns();
  for (std::size_t k = 0; k < found.size(); ++k) {
    const gpmf::Numbers& data = found[k].stream.data;
    for (std::size_t i = 0; i < data.rows; ++i)
      table.stamps.push_back(from_ns(clock.time_ns(k, marks[k].sample + static_cast<std::int64_t>(i))));
    table.values.insert(table.values.end(), data.values.begin(), data.values.end());
  }

  const SampleClock::Piece& piece = clock.pieces().front();
  table.note =
      fmt::format("{}: {} samples at {:.4f} Hz, fitted over {} blocks by {}{}, residual {:.3f} ms", key, table.rows(),
                  table.rate_hz, found.size(), stamped ? "the camera's clock (STMP)" : "the times of the payloads",
                  counted ? " and the running count (TSMP)" : "", piece.residual_rms_ns * 1e-6);
  if (piece.outliers > 0) table.note += fmt::format(", {} blocks off the line", piece.outliers);
  for (std::size_t i = 1; i < clock.pieces().size(); ++i) {
    const std::size_t at = clock.pieces()[i].first_mark;
    table.note += fmt::format(
        "; the stamps step by {:+.1f} ms at {:.1f} s",
        static_cast<double>(clock.time_ns(at, marks[at].sample) - clock.time_ns(at - 1, marks[at].sample)) * 1e-6,
        static_cast<double>(marks[at].time_ns) * 1e-9);
  }
  if (!stamped) table.note += "; payloads say when samples were stored, so all of them may be late by some 10 ms";
  return table;
}

}  // namespace takt
