// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/clock_events.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "takt/calibration/words.h"
#include "takt/error.h"
#include "takt/estimators/clock/event_marks.h"
#include "takt/estimators/clock/matched_stamps.h"
#include "takt/recording/gateware.h"
#include "takt/time/time_scales.h"

namespace takt {

namespace {

std::string stem_of(const std::string& path) {
  std::string name = std::filesystem::path(path).stem().string();
  if (const auto at = name.find("_frames"); at != std::string::npos) name.resize(at);
  return name;
}

/// Exposures are compared where strobes have a width.
std::vector<FrameNote> notes_of(const FrameTable& table, bool widths) {
  std::vector<FrameNote> out;
  for (std::size_t i = 0; i < table.stamps_ns.size(); ++i)
    out.push_back({table.stamps_ns[i], widths && !table.exposures_s.empty() ? table.exposures_s[i] : 0});
  return out;
}

/// GPS time to the reference that is asked for.
std::int64_t on_reference_ns(std::int64_t gps_ns, const std::string& reference) {
  return reference == "gps" ? gps_ns : to_ns(to_utc(from_ns<Gps>(gps_ns)));
}

}  // namespace

ClockOutcome relate_frames(const std::string& path, const StrobeStream& strobes, const ClockCsvOptions& options,
                           const std::string& reference, const BoardToReference& to_reference) {
  const FrameTable table = read_frames_csv(path, {.time_unit = options.time_unit});
  for (std::size_t i = 1; i < table.stamps_ns.size(); ++i)
    if (table.stamps_ns[i] <= table.stamps_ns[i - 1])
      throw Error(fmt::format("frame {} is not later than the one before", i + 1), path,
                  "sort the table by its stamps");
  const bool widths = std::any_of(strobes.strobes.begin(), strobes.strobes.end(),
                                  [](const FrameStrobe& s) { return s.end_ticks > s.start_ticks; });
  const FramePairing pairing = pair_frames(notes_of(table, widths), strobes);
  ClockOutcome out;
  std::vector<MatchedStamps> matches;
  const double hz = strobes.counter.tick_hz;
  for (std::size_t i = 0; i < pairing.strobe_of.size(); ++i) {
    PulseStamp frame;
    frame.index = i;
    frame.device_ns = table.stamps_ns[i];
    if (const auto& j = pairing.strobe_of[i]; j && !pairing.ambiguous) {
      const FrameStrobe& s = strobes.strobes[*j];
      const std::int64_t start = middle_of_tick_ns(s.start_ticks, hz), end = middle_of_tick_ns(s.end_ticks, hz);
      const std::int64_t middle = start + (end - start) / 2;
      if (to_reference) {
        frame.stamp = to_reference(middle);
      } else {
        const auto tick = static_cast<std::int64_t>(std::ceil(0.5e9 / hz)) + 1;
        frame.stamp = {middle, 1 / hz / std::sqrt(24.0), middle - tick, middle + tick, ClockState::locked};
      }
      if (frame.stamp.state != ClockState::ambiguous) {
        frame.used = true;
        matches.push_back({frame.device_ns, frame.stamp.reference_ns});
      }
    }
    out.stamps.push_back(frame);
  }
  const std::string camera = stem_of(path);
  Estimate& e = out.estimate;
  if (pairing.ambiguous) {
    e = Estimate::refusal("strobes", "ambiguous: " + pairing.why);
    e.sensor = camera, e.reference = reference;
  } else {
    e = relate_matches(matches, camera, reference);
    e.method = "strobes";
    if (widths) e.frame_instant = "middle";
    if (pairing.disagreements > 0)
      e.notes.push_back(fmt::format("the pairing was lost and found again {} times", pairing.disagreements));
    const std::size_t unpaired = pairing.strobe_of.size() - matches.size();
    if (e.answered() && unpaired * 4 > pairing.strobe_of.size())
      e.doubt(Verdict::weak, fmt::format("{} of {} frames have no strobe of which they are certain", unpaired,
                                         pairing.strobe_of.size()));
    if (table.exposures_s.empty())
      e.notes.push_back("the frames do not say their exposures: they are paired by their intervals alone");
  }
  e.extras.push_back({"frames", static_cast<double>(table.stamps_ns.size()), {}});
  e.extras.push_back({"strobes", static_cast<double>(strobes.size()), {}});
  e.extras.push_back({"frames_without_strobe", static_cast<double>(pairing.lost_strobes), {}});
  e.extras.push_back({"strobes_without_frame", static_cast<double>(pairing.lost_frames), {}});
  out.files.push_back(path);
  return out;
}

ClockOutcome relate_marked_frames(const ClockJob& job, const std::vector<LabelStream>& logs) {
  std::vector<EventMark> marks;
  for (const LabelStream& log : logs) marks.insert(marks.end(), log.events.begin(), log.events.end());
  const MarkedEvents events = marked_events(marks, job.event_channel);
  if (events.strobes.size() == 0)
    throw Error(fmt::format("stamps no events on input {} (TIM-TM2): {} marks, {} of which the receiver does not vouch "
                            "for",
                            job.event_channel, marks.size(), events.unvouched),
                job.labels.empty() ? job.frames : job.labels.front(),
                "give the receiver's log that holds them, a capture of the gateware, or --strobes FILE");
  const std::string& reference = job.pulses.reference;
  const double sigma_s = std::max(events.accuracy_s, 1e-9);
  const auto to_reference = [&](std::int64_t gps_ns) {
    return DisciplinedStamp{on_reference_ns(gps_ns, reference), sigma_s, {}, {}, ClockState::locked};
  };
  ClockOutcome out = relate_frames(job.frames, events.strobes, job.csv, reference, to_reference);
  Estimate& e = out.estimate;
  e.extras.push_back({"events", static_cast<double>(events.strobes.size()), {}});
  e.extras.push_back({"events_lost", static_cast<double>(events.lost), {}});
  e.extras.push_back({"events_not_vouched_for", static_cast<double>(events.unvouched), {}});
  e.extras.push_back({"event_accuracy_s", events.accuracy_s, {}});
  // The receiver's own error may be the same in all of them.
  if (e.sigma_s) e.sigma_s = std::hypot(*e.sigma_s, events.accuracy_s);
  for (OffsetPiece& piece : e.pieces) piece.sigma_s = std::hypot(piece.sigma_s, events.accuracy_s);
  e.notes.push_back(
      fmt::format("{}: the receiver's own stamps (TIM-TM2), which it holds to be good to {}",
                  events.have_ends ? "middles of the exposures" : "rising edges, not middles of exposures",
                  rounded_time_words(events.accuracy_s)));
  return out;
}

std::vector<PulseStamp> event_stamps(const ClockJob& job, const LabelStream& log) {
  std::vector<PulseStamp> out;
  for (const EventMark& mark : log.events)
    for (const auto& edge : {mark.rising_ns, mark.falling_ns}) {
      if (!edge) continue;
      PulseStamp s;
      s.index = out.size();
      s.device_ns = mark.scale == LabelScale::utc ? to_ns(to_gps(from_ns<Utc>(*edge))) : *edge;
      s.used = mark.valid;
      s.stamp.reference_ns = on_reference_ns(s.device_ns, job.pulses.reference);
      s.stamp.sigma_s = mark.accuracy_s;
      s.stamp.state = mark.valid ? ClockState::locked : ClockState::ambiguous;
      out.push_back(s);
    }
  return out;
}

ClockOutcome relate_triggered(const ClockJob& job) {
  if (job.shared_trigger.size() != 2)
    throw Error("needs two tables", "--shared-trigger", "give device,arrival of both sensors: A.csv B.csv");
  ClockOutcome out;
  out.files = job.shared_trigger;
  const std::string a_name = stem_of(job.shared_trigger[0]), b_name = stem_of(job.shared_trigger[1]);
  std::vector<std::vector<TriggeredSample>> samples;
  std::vector<std::string> notes;
  for (const std::string& path : job.shared_trigger) {
    const PairStream s = read_pairs_csv(path, job.csv);
    if (s.two_way) throw Error("holds exchanges both ways", path, "give device,arrival of each sample");
    std::vector<TriggeredSample>& now = samples.emplace_back();
    for (const ClockPair& p : s.pairs) now.push_back({p.device_ns, p.arrival_ns});
    for (std::size_t i = 1; i < now.size(); ++i)
      if (now[i].sensor_ns <= now[i - 1].sensor_ns)
        throw Error(fmt::format("sample {} is not later than the one before", i + 1), path, "sort the table");
    notes.insert(notes.end(), s.notes.begin(), s.notes.end());
  }
  const TriggerSyncResult found = match_triggers(samples[0], samples[1]);
  Estimate& e = out.estimate;
  if (found.ambiguous) {
    e = Estimate::refusal("trigger", "ambiguous: " + found.why);
    e.sensor = a_name, e.reference = b_name;
  } else {
    std::vector<MatchedStamps> matches;
    std::vector<PairStream> hosts(2);
    for (const TriggerMatch& m : found.matches) {
      const std::int64_t a = samples[0][m.a].sensor_ns, b = samples[1][m.b].sensor_ns;
      matches.push_back({a, b});
      hosts[0].pairs.push_back({0, a, m.received_ns});
      hosts[1].pairs.push_back({0, b, m.received_ns});
    }
    e = relate_matches(matches, a_name, b_name);
    e.method = "trigger";
    for (std::size_t k = 0; k < 2; ++k) {
      hosts[k].device = k == 0 ? a_name : b_name;
      Estimate host = relate_pairs(hosts[k], job.exchanges);
      host.evidence = {};
      host.pieces.clear();
      host.estimates.clear();
      e.estimates.push_back(std::move(host));
    }
  }
  e.notes.insert(e.notes.begin(), notes.begin(), notes.end());
  e.extras.push_back({"triggers_lost_" + a_name, static_cast<double>(found.lost_a), {}});
  e.extras.push_back({"triggers_lost_" + b_name, static_cast<double>(found.lost_b), {}});
  return out;
}

}  // namespace takt
