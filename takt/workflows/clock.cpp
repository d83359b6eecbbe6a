// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/clock.h"

#include <fmt/core.h>

#include <filesystem>

#include "takt/error.h"
#include "takt/recording/gateware.h"
#include "takt/recording/gnss_log.h"
#include "takt/time/time_scales.h"

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

/// The gateware's own recording: pulses, the receiver's bytes with the count at which each burst began, exchanges.
struct BoardLog {
  PulseStream pulses;
  std::vector<LabelStream> logs;
  PairStream exchanges;
  std::vector<std::string> notes;
};
BoardLog read_board(const std::string& path) {
  GatewareCapture capture = read_gateware_capture(path);
  BoardLog out;
  for (PulseStream& stream : capture.pulses)
    if (stream.name == "pps") out.pulses = std::move(stream);
  if (out.pulses.pulses.empty())
    throw Error("holds no pulses of a receiver", path, "is its 1PPS connected and enabled?");
  LabelStream& log = out.logs.emplace_back();
  GnssDecoder decoder;
  for (std::size_t k = 0; k < capture.bursts.size(); ++k) {
    const std::size_t from = capture.bursts[k].first;
    const std::size_t to = k + 1 < capture.bursts.size() ? capture.bursts[k + 1].first : capture.gnss_text.size();
    decoder.feed(std::string_view(capture.gnss_text).substr(from, to - from), capture.bursts[k].ticks, log);
  }
  decoder.finish(log);
  if (capture.gnss_text.empty()) out.logs.clear();
  out.exchanges = std::move(capture.exchanges);
  out.notes = std::move(capture.notes);
  return out;
}

void add_counts(const LabelStream& labels, Estimate& e) {
  for (const LabelStream::Count& c : labels.counts)
    e.extras.push_back({"messages_" + c.message, static_cast<double>(c.count), {}});
  if (!labels.counts.empty()) e.extras.push_back({"messages_broken", static_cast<double>(labels.broken), {}});
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
  for (const TimeLabel& l : labels.labels)
    if (l.valid) {
      const auto utc = l.scale == LabelScale::gps ? to_utc(from_ns<Gps>(l.time_ns)) : from_ns<Utc>(l.time_ns);
      e.notes.push_back(fmt::format("{}: first label {} ({})", path, to_string(utc), l.source));
      break;
    }
  return e;
}

ClockOutcome relate_board(const ClockJob& job) {
  ClockOutcome out;
  BoardLog board = read_board(job.input);
  out.files = {job.input};
  PpsResult found = discipline(board.pulses, board.logs, job.pulses);
  out.estimate = std::move(found.estimate);
  out.stamps = std::move(found.stamps);
  out.estimate.notes.insert(out.estimate.notes.begin(), board.notes.begin(), board.notes.end());
  if (board.exchanges.size() >= 4) {
    Estimate exchanges = relate_pairs(board.exchanges, job.exchanges);
    exchanges.evidence = {};
    exchanges.pieces.clear();
    exchanges.estimates.clear();
    exchanges.method = "pairs";
    out.estimate.estimates.push_back(std::move(exchanges));
  }
  for (const LabelStream& log : board.logs) add_counts(log, out.estimate);
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
  if (!asked.input.empty() && fs::is_regular_file(asked.input) && looks_like_gateware(asked.input))
    return relate_board(asked);
  const ClockJob job = with_input(asked);
  ClockOutcome out;
  const std::vector<LabelStream> logs = read_labels(job, out.files);
  std::optional<Estimate> exchanges;
  if (!job.pairs.empty()) {
    const PairStream pairs = read_pairs_csv(job.pairs, job.csv);
    out.files.push_back(job.pairs);
    exchanges = relate_pairs(pairs, job.exchanges);
    exchanges->notes.insert(exchanges->notes.begin(), pairs.notes.begin(), pairs.notes.end());
  }
  if (!job.pps.empty()) {
    const PulseStream pulses = read_pulses_csv(job.pps, job.csv);
    out.files.push_back(job.pps);
    PpsResult found = discipline(pulses, logs, job.pulses);
    out.estimate = std::move(found.estimate);
    out.stamps = std::move(found.stamps);
    if (exchanges) {
      // The pulses are the better clock; the exchanges stand beside.
      exchanges->evidence = {};
      exchanges->pieces.clear();
      exchanges->estimates.clear();
      exchanges->method = "pairs";
      out.estimate.estimates.push_back(*exchanges);
    }
  } else if (exchanges) {
    out.estimate = *exchanges;
  } else if (!job.labels.empty()) {
    out.estimate = labels_alone(logs.front(), job.labels.front());
  } else {
    throw Error("nothing to compare", "takt clock",
                "give a folder, or --pps FILE with --nmea or --ubx FILE, or --pairs FILE");
  }
  for (const LabelStream& log : logs) add_counts(log, out.estimate);
  return out;
}

}  // namespace takt
