// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/clock.h"

#include <fmt/core.h>

#include <cmath>
#include <filesystem>

#include "takt/calibration/words.h"
#include "takt/error.h"
#include "takt/estimators/clock/matched_stamps.h"
#include "takt/math/median.h"
#include "takt/recording/gateware.h"
#include "takt/recording/gnss_log.h"
#include "takt/time/time_scales.h"
#include "takt/workflows/clock_events.h"

namespace takt {

namespace {

namespace fs = std::filesystem;

/// Sorts what IN is into the places of the named options, which win.
ClockJob with_input(ClockJob job) {
  if (job.input.empty()) return job;
  std::error_code failed;
  if (fs::is_directory(job.input, failed)) {
    const auto take = [&](const char* name, std::string& place) {
      const fs::path file = fs::path(job.input) / name;
      if (place.empty() && fs::is_regular_file(file, failed)) place = file.string();
    };
    take("pps.csv", job.pps);
    take("pairs.csv", job.pairs);
    if (job.labels.empty())
      for (const char* name : {"gnss.ubx", "gnss.nmea"})
        if (const fs::path file = fs::path(job.input) / name; fs::is_regular_file(file, failed))
          job.labels.push_back(file.string());
    if (job.pps.empty() && job.pairs.empty() && job.labels.empty())
      throw Error("holds none of pps.csv, pairs.csv, gnss.ubx, gnss.nmea", job.input,
                  "give files by --pps, --nmea, --ubx, --pairs");
    return job;
  }
  if (!fs::exists(job.input, failed))
    throw Error("does not exist", job.input, "give a folder, or files by --pps, --nmea, --ubx, --pairs");
  if (looks_like_gnss(job.input)) {
    job.labels.push_back(job.input);
    return job;
  }
  switch (clock_table_in(job.input)) {
    case ClockTable::pulses:
      if (!job.pps.empty()) throw Error("is a second table of pulses", job.input, "give one by --pps");
      job.pps = job.input;
      break;
    case ClockTable::pairs:
      if (!job.pairs.empty()) throw Error("is a second table of exchanges", job.input, "give one by --pairs");
      job.pairs = job.input;
      break;
    case ClockTable::other:
      throw Error("is neither a table of pulses or exchanges nor a receiver's log", job.input,
                  "see docs/formats/clock.md, or name its kind: --pps, --nmea, --ubx, --pairs");
  }
  return job;
}

std::vector<LabelStream> read_labels(const ClockJob& job, std::vector<std::string>& files) {
  std::vector<LabelStream> logs;
  for (const std::string& path : job.labels) {
    LabelStream log = read_gnss_log(path);
    files.push_back(path);
    std::string arrivals = job.arrivals;
    if (const std::string beside = path + ".arrivals.csv"; arrivals.empty() && fs::is_regular_file(beside))
      arrivals = beside;
    if (!arrivals.empty()) {
      stamp_arrivals(log, arrivals);
      files.push_back(arrivals);
    }
    logs.push_back(std::move(log));
  }
  return logs;
}

/// What the receiver's bytes in a capture say, each burst with the count at which it began.
LabelStream labels_in(const GatewareCapture& capture) {
  LabelStream log;
  GnssDecoder decoder;
  for (std::size_t k = 0; k < capture.bursts.size(); ++k) {
    const std::size_t from = capture.bursts[k].first;
    const std::size_t to = k + 1 < capture.bursts.size() ? capture.bursts[k + 1].first : capture.gnss_text.size();
    decoder.feed(std::string_view(capture.gnss_text).substr(from, to - from), capture.bursts[k].ticks, log);
  }
  decoder.finish(log);
  return log;
}

template <class Stream>
const Stream* named(const std::vector<Stream>& all, const std::string& name) {
  for (const Stream& s : all)
    if (s.name == name) return &s;
  return nullptr;
}

/// What the receiver says of its own clock (NAV-CLOCK). A common error of its pulses shows in nothing else.
void add_receiver_clock(const LabelStream& labels, Estimate& e) {
  if (labels.receiver_clock.empty()) return;
  std::vector<double> accuracy, drift;
  for (const ReceiverClock& c : labels.receiver_clock)
    accuracy.push_back(c.bias_sigma_s), drift.push_back(1e6 * c.drift);
  const double usual_s = median(std::move(accuracy));
  e.extras.push_back({"receiver_accuracy_s", usual_s, {}});
  e.extras.push_back({"receiver_drift_ppm", median(std::move(drift)), {}});
  e.notes.push_back(
      fmt::format("the receiver holds its time to be good to {} (NAV-CLOCK); an error that all pulses "
                  "share is not in sigma",
                  rounded_time_words(usual_s)));
}

void add_counts(const LabelStream& labels, Estimate& e) {
  for (const LabelStream::Count& c : labels.counts)
    e.extras.push_back({"messages_" + c.message, static_cast<double>(c.count), {}});
  if (!labels.counts.empty()) e.extras.push_back({"messages_broken", static_cast<double>(labels.broken), {}});
  add_receiver_clock(labels, e);
  e.notes.insert(e.notes.end(), labels.notes.begin(), labels.notes.end());
}

/// A receiver's log alone says what it holds, and that this is no relation between clocks.
Estimate labels_alone(const LabelStream& labels, const std::string& path) {
  Estimate e =
      Estimate::refusal("kalman", "a receiver's log alone: no pulses or exchanges to compare it with (--pps FILE)");
  e.sensor = "device";
  e.reference = "utc";
  std::size_t vouched = 0;
  for (const TimeLabel& l : labels.labels) vouched += l.valid;
  e.extras.push_back({"labels", static_cast<double>(labels.labels.size()), {}});
  e.extras.push_back({"labels_vouched_for", static_cast<double>(vouched), {}});
  e.extras.push_back({"pulse_errors", static_cast<double>(labels.pulse_errors.size()), {}});
  e.extras.push_back({"events", static_cast<double>(labels.events.size()), {}});
  if (!labels.events.empty())
    e.notes.push_back("the receiver stamped events (TIM-TM2): --stream prints them, --frames pairs a camera with them");
  for (const TimeLabel& l : labels.labels)
    if (l.valid) {
      const auto utc = l.scale == LabelScale::gps ? to_utc(from_ns<Gps>(l.time_ns)) : from_ns<Utc>(l.time_ns);
      e.notes.push_back(fmt::format("{}: first label {} ({})", path, to_string(utc), l.source));
      break;
    }
  return e;
}

/// The strobes of the camera that is asked for, or of the only one.
const StrobeStream& strobes_of(const GatewareCapture& capture, const ClockJob& job) {
  std::string names;
  for (const StrobeStream& s : capture.strobes) names += (names.empty() ? "" : ", ") + s.name;
  if (capture.strobes.empty())
    throw Error("holds no strobes of a camera", job.input, "is a strobe connected and enabled?");
  if (job.camera.empty() && capture.strobes.size() > 1)
    throw Error(fmt::format("holds strobes of {}", names), job.input, "choose one by --camera");
  const StrobeStream* found = job.camera.empty() ? &capture.strobes.front() : named(capture.strobes, job.camera);
  if (!found)
    throw Error(fmt::format("has no camera {}; there are {}", job.camera, names), job.input, "choose one of these");
  return *found;
}

/// Where cameras are triggered by the board: how far the middles of their exposures are apart, and what to do about it.
void add_exposure_sync(const GatewareCapture& capture, Estimate& e) {
  std::vector<StrobeStream> strobes;
  std::vector<PulseStream> triggers;
  for (const StrobeStream& s : capture.strobes)
    if (const PulseStream* t = named(capture.pulses, "trigger" + s.name.substr(3)))
      strobes.push_back(s), triggers.push_back(*t);
  const ExposureSync sync = exposure_sync(strobes, triggers);
  for (const ExposureSync::Camera& c : sync.cameras) {
    const auto n = static_cast<double>(c.frames);
    e.extras.push_back({c.name + "_exposure_s", c.exposure_s, {}});
    e.extras.push_back({c.name + "_trigger_delay_s", c.delay_s, {}});
    if (sync.cameras.size() < 2) continue;
    e.extras.push_back({c.name + "_middle_s", c.middle_s, c.middle_scatter_s / std::sqrt(n)});
    e.extras.push_back({c.name + "_advance_s", c.advance_s, {}});
  }
  if (sync.cameras.size() > 1)
    e.notes.push_back(fmt::format(
        "{}: _middle_s is how far the middles of the exposures lie behind those of {}; triggering _advance_s "
        "later than now (earlier where negative) brings the middles of usual exposures together",
        sync.cameras.size(), sync.cameras.front().name));
}

void add_exchanges(const PairStream& exchanges, const PairOptions& options, Estimate& e) {
  if (exchanges.size() < 4) return;
  Estimate found = relate_pairs(exchanges, options);
  found.evidence = {};
  found.pieces.clear();
  found.estimates.clear();
  found.method = "pairs";
  e.estimates.push_back(std::move(found));
}

ClockOutcome relate_board(const ClockJob& job) {
  ClockOutcome out;
  const GatewareCapture capture = read_gateware_capture(job.input);
  const PulseStream* pps = named(capture.pulses, "pps");
  std::vector<LabelStream> logs;
  if (!capture.gnss_text.empty()) logs.push_back(labels_in(capture));
  if (!pps && job.frames.empty())
    throw Error("holds no pulses of a receiver", job.input, "is its 1PPS connected and enabled?");
  PpsResult found;
  if (pps) found = discipline(*pps, logs, job.pulses);
  if (!job.frames.empty()) {
    const bool known = found.estimate.answered() && found.estimate.reference != "pps";
    const ClockMap<> map = known ? found.estimate.clock_map() : ClockMap<>(ClockPiece<SensorClock>{});
    const BoardToReference to_utc = [&map](std::int64_t board_ns) {
      const auto t = as<SensorClock>(from_ns(board_ns));
      return DisciplinedStamp{board_ns + map.offset_at(t).count(), map.sigma_s(t), {}, {}, ClockState::locked};
    };
    out = relate_frames(job.frames, strobes_of(capture, job), job.csv, known ? found.estimate.reference : "board",
                        known ? to_utc : BoardToReference{});
    if (pps && !known)
      out.estimate.notes.push_back("the board's own clock is the reference: its pulses name no second");
    if (known && found.estimate.verdict == Verdict::weak)
      for (const std::string& why : found.estimate.reasons) out.estimate.doubt(Verdict::weak, "board: " + why);
  } else {
    out.estimate = std::move(found.estimate);
    out.stamps = std::move(found.stamps);
  }
  out.files.insert(out.files.begin(), job.input);
  out.estimate.notes.insert(out.estimate.notes.begin(), capture.notes.begin(), capture.notes.end());
  add_exposure_sync(capture, out.estimate);
  add_exchanges(capture.exchanges, job.exchanges, out.estimate);
  for (const LabelStream& log : logs) add_counts(log, out.estimate);
  return out;
}

}  // namespace

std::string stamp_json(std::int64_t device_ns, const DisciplinedStamp& s) {
  const auto bound = [](const std::optional<std::int64_t>& b) { return b ? std::to_string(*b) : "null"; };
  const std::string value = s.state == ClockState::ambiguous ? "null" : std::to_string(s.reference_ns);
  return fmt::format(R"({{"t_ns":{},"reference_ns":{},"sigma_s":{:.4g},"lower_ns":{},"upper_ns":{},"state":"{}"}})",
                     device_ns, value, s.sigma_s, bound(s.lower_ns), bound(s.upper_ns), to_string(s.state));
}

ClockOutcome relate_clocks(const ClockJob& asked) {
  if (!asked.shared_trigger.empty()) return relate_triggered(asked);
  if (!asked.frames.empty() && !asked.strobes.empty()) {
    ClockOutcome out = relate_frames(asked.frames, read_strobes_csv(asked.strobes, asked.csv), asked.csv, "board", {});
    out.files.push_back(asked.strobes);
    return out;
  }
  if (!asked.input.empty() && fs::is_regular_file(asked.input) && looks_like_gateware(asked.input))
    return relate_board(asked);
  if (!asked.frames.empty() && asked.input.empty() && asked.labels.empty())
    throw Error("frames alone", asked.frames,
                "give a capture of the gateware, --strobes FILE, or the log of a receiver that stamped them (--ubx)");
  const ClockJob job = with_input(asked);
  ClockOutcome out;
  const std::vector<LabelStream> logs = read_labels(job, out.files);
  if (!job.frames.empty()) {
    ClockOutcome marked = relate_marked_frames(job, logs);
    marked.files.insert(marked.files.end(), out.files.begin(), out.files.end());
    for (const LabelStream& log : logs) add_counts(log, marked.estimate);
    return marked;
  }
  std::optional<PairStream> pairs;
  if (!job.pairs.empty()) {
    pairs = read_pairs_csv(job.pairs, job.csv);
    out.files.push_back(job.pairs);
  }
  if (!job.pps.empty()) {
    const PulseStream pulses = read_pulses_csv(job.pps, job.csv);
    out.files.push_back(job.pps);
    PpsResult found = discipline(pulses, logs, job.pulses);
    out.estimate = std::move(found.estimate);
    out.stamps = std::move(found.stamps);
    // The pulses are the better clock; the exchanges stand beside.
    if (pairs) add_exchanges(*pairs, job.exchanges, out.estimate);
  } else if (pairs) {
    out.estimate = relate_pairs(*pairs, job.exchanges);
    out.estimate.notes.insert(out.estimate.notes.begin(), pairs->notes.begin(), pairs->notes.end());
  } else if (!job.labels.empty()) {
    out.estimate = labels_alone(logs.front(), job.labels.front());
    out.stamps = event_stamps(job, logs.front());
  } else {
    throw Error("nothing to compare", "takt clock",
                "give a folder, or --pps FILE with --nmea or --ubx FILE, or --pairs FILE");
  }
  for (const LabelStream& log : logs) add_counts(log, out.estimate);
  return out;
}

}  // namespace takt
