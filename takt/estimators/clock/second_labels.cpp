// SPDX-License-Identifier: Apache-2.0
#include "takt/estimators/clock/second_labels.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>

#include "takt/time/time_scales.h"

namespace takt {

namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::int64_t rollover_s = 1024LL * 604800;
constexpr double shortest_wrap_s = 16;  // of a counter whose wraps labels can be told apart by
constexpr double one_voice = 0.95;      // share of labels that must agree
constexpr double most_in_guard = 0.03;  // share of labels near a pulse: more, and all of them may be late by a second
constexpr std::size_t least_votes = 3;
constexpr const char* own_file = "the pulses' own file";
constexpr std::int64_t table_ends_utc_s =
    1798761600;  // 2027-01-01: until then the table of leap seconds is known to hold

std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

/// A label as a GPS second and the fraction behind it. UTC is taken back by the leap seconds that the receiver itself
/// applied, where these show, else by the table: a receiver that has not resolved them yet does no harm then.
struct GpsLabel {
  std::int64_t second = 0;
  double fraction = 0;
  bool by_table = false;
  std::int64_t utc_s = 0;
};
GpsLabel on_gps(const TimeLabel& l, const std::vector<LeapStep>& leaps) {
  GpsLabel out;
  std::int64_t gps = l.time_ns;
  if (l.scale == LabelScale::utc) {
    const std::int64_t whole = l.time_ns + (l.leap_second ? second_ns : 0);
    out.by_table = !l.gps_minus_utc_s;
    if (l.gps_minus_utc_s) {
      gps = whole + (*l.gps_minus_utc_s - gps_epoch_utc_s) * second_ns;
    } else {
      // During a leap second Unix time repeats the 59th second, and the table's new value holds already.
      gps = to_ns(to_gps(from_ns<Utc>(l.time_ns - (l.leap_second ? second_ns : 0)))) +
            (l.leap_second ? 2 * second_ns : 0);
      for (const LeapStep& leap : leaps) {
        const std::int64_t with = l.time_ns + (leap.gps_minus_utc_s - gps_epoch_utc_s) * second_ns;
        if (with >= leap.gps_s * second_ns) gps = with;
      }
    }
  }
  // Receivers say 11.999999750 and mean 12.
  constexpr std::int64_t slack = 500'000;
  out.second = floor_div(gps + slack, second_ns);
  out.fraction = static_cast<double>(gps - out.second * second_ns) * 1e-9;
  out.utc_s = floor_div(l.time_ns + slack, second_ns);
  return out;
}

struct Vote {
  std::int64_t gps_minus_count;
  std::int64_t count;  // the pulse's number
  std::int64_t utc_s;
  bool by_table;
  std::string source;
  bool names_next = false;
  double late = 0.5;  // share of a second after its pulse
};

/// Midnight UTC at the end of a month: only there UTC may leap.
bool month_begins(std::int64_t utc_s) {
  if (utc_s % 86400 != 0) return false;
  const std::chrono::year_month_day day{std::chrono::sys_days(std::chrono::days(utc_s / 86400))};
  return static_cast<unsigned>(day.day()) == 1;
}

/// Receivers whose week number has 10 bits jump back by 1024 weeks: votes that differ by just that are one vote. The
/// table's leap seconds are then those of the right date.
bool undo_rollover(std::vector<Vote>& votes) {
  if (votes.empty()) return false;
  constexpr std::int64_t most_leaps = 60;
  std::int64_t newest = votes.front().gps_minus_count;
  for (const Vote& v : votes) newest = std::max(newest, v.gps_minus_count);
  bool any = false;
  for (Vote& v : votes) {
    const std::int64_t apart = newest - v.gps_minus_count, times = (apart + most_leaps) / rollover_s;
    if (times < 1 || std::abs(apart - times * rollover_s) > (v.by_table ? most_leaps : 1)) continue;
    v.utc_s += times * rollover_s;
    v.gps_minus_count += times * rollover_s;
    if (v.by_table) v.gps_minus_count = to_ns(to_gps(from_ns<Utc>(v.utc_s * second_ns))) / second_ns - v.count;
    any = true;
  }
  return any;
}

/// A leap that the table does not know: at the end of a month all labels step by one second together.
std::optional<LeapStep> find_leap(std::vector<Vote>& votes) {
  for (std::size_t i = 1; i < votes.size(); ++i) {
    const std::int64_t step = votes[i].gps_minus_count - votes[i - 1].gps_minus_count;
    if (std::abs(step) != 1 || !votes[i].by_table) continue;
    const std::int64_t midnight = floor_div(votes[i].utc_s + 5, 86400) * 86400;
    if (!month_begins(midnight) || std::abs(votes[i].utc_s - midnight) > 5) continue;
    // All of one mind before, all of one mind behind.
    const std::int64_t before = votes[i - 1].gps_minus_count, behind = votes[i].gps_minus_count;
    const bool clean = std::all_of(votes.begin(), votes.begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const Vote& v) { return v.gps_minus_count == before; }) &&
                       std::all_of(votes.begin() + static_cast<std::ptrdiff_t>(i), votes.end(),
                                   [&](const Vote& v) { return v.gps_minus_count == behind; });
    if (!clean || i < least_votes || votes.size() - i < least_votes) continue;
    const int table = tai_minus_utc_s(from_ns<Utc>((midnight - 10) * second_ns)) - tai_minus_gps_s;
    LeapStep leap;
    leap.gps_minus_utc_s = table - static_cast<int>(step);
    // The new value holds from the leap second's own beginning on, or where a second was left out.
    const std::int64_t gps_midnight = midnight - gps_epoch_utc_s + table;  // where midnight would have been
    leap.gps_s = step < 0 ? gps_midnight : gps_midnight - 1;
    for (std::size_t k = i; k < votes.size(); ++k) votes[k].gps_minus_count -= step;
    return leap;
  }
  return std::nullopt;
}

int table_at(std::int64_t gps_s) {
  return static_cast<int>(gps_s + gps_epoch_utc_s -
                          floor_div(to_ns(to_utc(from_ns<Gps>(gps_s * second_ns))), second_ns));
}

/// Leap seconds that the receiver applied and vouched for, where they differ from the table's: a change at the end of a
/// month, or a value after the table's end.
std::vector<LeapStep> leaps_of_receiver(const LabelStream& labels) {
  std::vector<LeapStep> leaps;
  std::optional<int> last;
  for (const TimeLabel& l : labels.labels) {
    if (!l.gps_minus_utc_s || !l.leap_resolved.value_or(false) || !l.valid) continue;
    const int now = *l.gps_minus_utc_s;
    const GpsLabel at = on_gps(l, {});
    const std::int64_t utc_s = at.second + gps_epoch_utc_s - now, midnight = floor_div(utc_s + 60, 86400) * 86400;
    if (!last && utc_s >= table_ends_utc_s && now != table_at(at.second)) leaps.push_back({at.second - 86400, now});
    if (last && std::abs(now - *last) == 1 && month_begins(midnight) && std::abs(utc_s - midnight) <= 60 &&
        now != table_at(at.second))
      leaps.push_back({midnight - gps_epoch_utc_s + std::min(now, *last), now});
    last = now;
  }
  return leaps;
}

std::string said_by(const std::vector<Vote>& votes, std::int64_t c) {
  std::map<std::string, std::size_t> by;
  for (const Vote& v : votes)
    if (v.gps_minus_count == c) ++by[v.source];
  std::string out;
  for (const auto& [source, n] : by) out += fmt::format("{}{} {}", out.empty() ? "" : ", ", n, source);
  return out;
}

/// Labels that are late by whole seconds every time look like labels in time, but for the ends: the first pulses have
/// no label, and just as many labels at the end have no pulse. A label that names the pulse to come rules that out.
std::optional<std::int64_t> late_by(const std::vector<Vote>& votes, std::int64_t agreed, std::int64_t last_second) {
  std::optional<std::int64_t> first, last;
  for (const Vote& v : votes) {
    if (v.gps_minus_count != agreed) continue;
    if (v.names_next || v.source == own_file) return std::nullopt;
    first = std::min(first.value_or(v.count), v.count);
    last = std::max(last.value_or(v.count), v.count);
  }
  if (first && *first >= 1 && *first <= 3 && *last - last_second == *first) return first;
  return std::nullopt;
}

/// A source whose arrivals scatter so near to a pulse that some must fall on its other side, though none of these few
/// has been seen to.
std::optional<std::string> scatters_over_a_pulse(const std::vector<Vote>& votes, std::int64_t agreed,
                                                 const LabelOptions& options) {
  std::map<std::string, std::vector<double>> late;
  for (const Vote& v : votes)
    if (v.gps_minus_count == agreed && v.source != own_file) late[v.source].push_back(v.late);
  for (const auto& [source, all] : late) {
    const auto n = static_cast<double>(all.size());
    if (all.size() < 2) continue;
    const double mean = std::accumulate(all.begin(), all.end(), 0.0) / n;
    double squares = 0;
    for (const double x : all) squares += (x - mean) * (x - mean);
    // Two σ and more while few have come: by then some 2 % of the labels lie beyond.
    const double reach = (2 + 8 / n) * std::sqrt(squares / (n - 1));
    if (mean - reach < options.earliest_s || mean + reach > options.latest_s)
      return fmt::format("{} labels come {:.2f} ± {:.2f} s behind their pulse: some may belong to a neighbour", source,
                         mean, std::sqrt(squares / (n - 1)));
  }
  return std::nullopt;
}

void decide(std::vector<Vote> votes, std::int64_t last_second, const LabelOptions& options, SegmentLabels& s,
            LabelledTrain& out) {
  std::stable_sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) { return a.count < b.count; });
  if (undo_rollover(votes))
    out.words.push_back("the receiver's week number rolled over: its dates are brought forward by 1024 weeks");
  if (const auto leap = find_leap(votes)) {
    out.leaps.push_back(*leap);
    out.words.push_back(fmt::format("a leap second that the built-in table does not know: GPS − UTC becomes {} s",
                                    leap->gps_minus_utc_s));
  }
  std::map<std::int64_t, std::size_t> tally;
  for (const Vote& v : votes) ++tally[v.gps_minus_count];
  s.votes = votes.size();
  if (tally.empty()) {
    s.why_not = s.in_guard > 0
                    ? fmt::format("all {} labels arrive so near to a pulse that they may belong to either neighbour",
                                  s.in_guard)
                : s.unvouched > 0 ? "the receiver does not vouch for any of its labels (no fix yet?)"
                                  : "no label came with these pulses";
    return;
  }
  const auto best =
      std::max_element(tally.begin(), tally.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  s.gps_minus_count_s = best->first;
  s.agreeing = best->second;
  const double share = static_cast<double>(s.agreeing) / static_cast<double>(s.votes + s.in_guard);
  if (s.agreeing < least_votes) {
    s.why_not = fmt::format("only {} label{} name a second; {} are needed", s.agreeing, s.agreeing == 1 ? "" : "s",
                            least_votes);
    return;
  }
  const bool near_pulses = static_cast<double>(s.in_guard) > most_in_guard * static_cast<double>(s.votes + s.in_guard);
  if (share < one_voice || near_pulses) {
    std::string others;
    for (const auto& [c, n] : tally)
      if (c != best->first && others.size() < 120)
        others += fmt::format("{}{:+} s: {}", others.empty() ? "" : "; ", c - best->first, said_by(votes, c));
    s.why_not = fmt::format("labels disagree on the whole second: {} of {} say one ({}), {}{} come too near to a pulse",
                            s.agreeing, s.votes + s.in_guard, said_by(votes, best->first),
                            others.empty() ? "" : "others differ (" + others + "), ", s.in_guard);
    return;
  }
  // A receiver that corrects itself does so once, and is right afterwards: the last word must be the majority's.
  constexpr std::size_t last_words = 5;
  if (votes.size() > last_words && std::all_of(votes.end() - last_words, votes.end(),
                                               [&](const Vote& v) { return v.gps_minus_count != best->first; })) {
    s.why_not = fmt::format("the labels step by {:+} s at the end, and nothing says which are right",
                            votes.back().gps_minus_count - best->first);
    return;
  }
  if (const auto late = late_by(votes, best->first, last_second)) {
    s.why_not =
        fmt::format("the first {0} no label and the last label{1} no pulse, as if every label were late by {2} s",
                    *late == 1 ? "pulse has" : "pulses have", *late == 1 ? " has" : "s have", *late);
    return;
  }
  constexpr std::size_t many = 200;  // so many show by themselves how many fall near a pulse
  if (s.votes < many)
    if (auto near = scatters_over_a_pulse(votes, best->first, options)) {
      s.why_not = *std::move(near);
      return;
    }
  if (!options.old_dates && s.gps_minus_count_s + gps_epoch_utc_s < table_ends_utc_s - rollover_s) {
    s.why_not =
        "the labels name a date before May 2007: the receiver's week number has rolled over (1024 weeks), or the log "
        "is "
        "that old (takt clock --old-dates)";
    return;
  }
  s.known = true;
}

bool stale(const TimeLabel& l, std::map<std::string, std::int64_t>& last) {
  const std::int64_t now = l.time_ns + (l.leap_second ? second_ns / 2 : 0);
  const auto [found, fresh] = last.try_emplace(l.source, now);
  if (fresh) return false;
  const bool same = found->second == now;
  found->second = now;
  return same;
}

/// Labels without arrival, where the user says that both logs began together.
void vote_by_order(const PulseTrain& train, const LabelStream& labels, std::vector<std::vector<Vote>>& votes,
                   LabelledTrain& out) {
  if (train.segments.empty()) return;
  std::optional<std::int64_t> first;
  for (const TimeLabel& l : labels.labels) {
    const GpsLabel g = on_gps(l, out.leaps);
    if (!l.valid || std::abs(g.fraction) > 1e-3) continue;
    const std::int64_t second = g.second - (l.names_next ? 1 : 0);
    if (!first) first = second;
    const std::int64_t count = second - *first;
    if (count < 0 || count > train.segments.front().pulses.back().second) continue;
    votes.front().push_back({*first, count, g.utc_s, g.by_table, l.source});
  }
  out.words.push_back("labels have no arrival times: the first label is taken to name the first pulse (--same-start)");
}

/// Arrivals on the pulses' counter without wraps. A log's own wraps follow from its order, but not during which wrap of
/// the pulses it began: both logs must begin and end within a quarter of a wrap of each other, else it may be another.
struct Arrivals {
  std::vector<std::optional<ExtendedCount>> of;  // one a label
  bool unsure = false;
};
Arrivals arrivals_of(const LabelStream& labels, const PulseTrain& train) {
  Arrivals out;
  CountExtender extender(labels.arrival_hz ? 64 : train.bits, train.tick_hz);
  std::size_t runs = 0;
  for (const TimeLabel& l : labels.labels) {
    out.of.emplace_back();
    if (!l.arrival_ticks) continue;
    // Arrivals in seconds are ns on the pulses' clock.
    const bool seconds = labels.arrival_hz && *labels.arrival_hz != train.tick_hz;
    const std::int64_t ticks =
        !seconds ? *l.arrival_ticks
                 : static_cast<std::int64_t>(
                       std::llroundl(static_cast<long double>(*l.arrival_ticks) * train.tick_hz / *labels.arrival_hz));
    out.of.back() = extender.extend(ticks);
    runs = out.of.back()->restarts + 1;
  }
  if (labels.arrival_hz || train.bits >= 63) return out;
  const auto turn = static_cast<double>(std::int64_t{1} << train.bits);
  const bool too_short = turn < shortest_wrap_s * train.tick_hz;
  for (std::size_t run = 0; run < runs; ++run) {
    std::optional<std::int64_t> first, last, first_pulse, last_pulse;
    for (const auto& at : out.of)
      if (at && at->restarts == run) first = first.value_or(at->ticks), last = at->ticks;
    for (const TrainSegment& s : train.segments)
      if (s.restarts == run) {
        first_pulse = first_pulse.value_or(s.pulses.front().ticks);
        last_pulse = s.pulses.back().ticks;
      }
    if (!first || !first_pulse) continue;
    const double begin = static_cast<double>(*first_pulse - *first) / turn,
                 end = static_cast<double>(*last_pulse - *last) / turn, whole = std::round(begin);
    const bool sure = !too_short && std::abs(begin - whole) < 0.25 && std::abs(end - whole) < 0.25;
    out.unsure = out.unsure || !sure;
    for (auto& at : out.of)
      if (at && at->restarts == run) {
        if (sure)
          at->ticks += static_cast<std::int64_t>(whole) << train.bits;
        else
          at.reset();
      }
  }
  return out;
}

}  // namespace

int LabelledTrain::gps_minus_utc_s(std::int64_t gps_s) const {
  int value = table_at(gps_s);
  for (const LeapStep& leap : leaps)
    if (gps_s >= leap.gps_s) value = leap.gps_minus_utc_s;
  return value;
}

std::int64_t LabelledTrain::utc_ns(std::int64_t gps_ns) const {
  return gps_ns + (gps_epoch_utc_s - gps_minus_utc_s(floor_div(gps_ns, second_ns))) * second_ns;
}

LabelledTrain label_train(const PulseTrain& train, const PulseStream& pulses, const std::vector<LabelStream>& logs,
                          const LabelOptions& options) {
  LabelledTrain out;
  out.segments.resize(train.segments.size());
  for (const LabelStream& labels : logs)
    if (out.leaps.empty()) out.leaps = leaps_of_receiver(labels);
  std::vector<std::vector<Vote>> votes(train.segments.size());

  for (std::size_t k = 0; k < train.segments.size(); ++k)
    for (const TrainPulse& p : train.segments[k].pulses)
      if (const auto& label = pulses.pulses[p.index].label_utc_s) {
        TimeLabel l;
        l.time_ns = *label * second_ns;
        votes[k].push_back({on_gps(l, out.leaps).second - p.second, p.second, *label, true, own_file});
      }

  std::size_t unplaced = 0, without_arrival = 0, label_count = 0;
  bool unsure_wrap = false;
  std::vector<std::int64_t> unresolved_until(train.segments.size(), -1);
  for (const LabelStream& labels : logs) {
    label_count += labels.labels.size();
    const Arrivals arrivals = arrivals_of(labels, train);
    unsure_wrap = unsure_wrap || arrivals.unsure;
    std::map<std::string, std::int64_t> last;
    for (std::size_t i = 0; i < labels.labels.size(); ++i) {
      const TimeLabel& l = labels.labels[i];
      if (!arrivals.of[i]) {
        without_arrival += !l.arrival_ticks;
        continue;
      }
      const ExtendedCount at = *arrivals.of[i];
      // The segment of the same run of the counter that the label falls into, or the last one before it.
      std::optional<std::size_t> segment;
      for (std::size_t k = 0; k < train.segments.size(); ++k) {
        const TrainSegment& s = train.segments[k];
        if (s.restarts != at.restarts) continue;
        if (!segment || s.pulses.front().ticks <= at.ticks) segment = k;
      }
      if (!segment) {
        ++unplaced;
        continue;
      }
      const TrainSegment& s = train.segments[*segment];
      SegmentLabels& found = out.segments[*segment];
      const bool is_stale = stale(l, last);
      if (l.leap_resolved && !*l.leap_resolved && l.valid)
        unresolved_until[*segment] =
            std::max(unresolved_until[*segment], static_cast<std::int64_t>(s.second_at(at.ticks)) + 1);
      if (!l.valid) {
        ++found.unvouched;
        continue;
      }
      if (is_stale) {
        ++found.stale;
        continue;
      }
      const GpsLabel g = on_gps(l, out.leaps);
      double u = s.second_at(at.ticks);
      if (u < 0 || u > static_cast<double>(s.pulses.back().second) + 60) {
        ++unplaced;
        continue;
      }
      if (!l.names_next) u -= g.fraction;
      const double n = std::floor(u), late = u - n;
      if (late < options.earliest_s || late > options.latest_s) {
        ++found.in_guard;
        continue;
      }
      const auto count = static_cast<std::int64_t>(n) + (l.names_next ? 1 : 0);
      votes[*segment].push_back({g.second - count, count, g.utc_s, g.by_table, l.source, l.names_next, late});
    }
  }
  const std::size_t before = std::accumulate(votes.begin(), votes.end(), std::size_t{0},
                                             [](std::size_t n, const auto& v) { return n + v.size(); });
  std::size_t behind = 0;
  for (std::size_t k = 0; k < votes.size(); ++k) {
    std::erase_if(votes[k],
                  [&](const Vote& v) { return v.by_table && v.source != own_file && v.count <= unresolved_until[k]; });
    behind += votes[k].size();
  }
  if (behind < before)
    out.words.push_back(fmt::format(
        "{} labels in UTC came before the receiver knew its leap seconds and were not counted", before - behind));
  const bool blind = without_arrival > 0 && without_arrival == label_count;
  if (blind && options.same_start)
    for (const LabelStream& labels : logs) vote_by_order(train, labels, votes, out);
  for (std::size_t k = 0; k < votes.size(); ++k) {
    decide(std::move(votes[k]), train.segments[k].pulses.back().second, options, out.segments[k], out);
    if (!out.segments[k].known && blind && !options.same_start && out.segments[k].votes == 0)
      out.segments[k].why_not =
          "the labels have no arrival times, so nothing says which pulse they name; log arrivals, or give --same-start "
          "if both logs began within the same second";
  }
  if (unsure_wrap)
    for (SegmentLabels& found : out.segments)
      if (!found.known && found.votes == 0)
        found.why_not = fmt::format(
            "the counter wraps every {:.3g} s, and the labels do not begin and end with the pulses: nothing says "
            "during which wrap they came (log both from beginning to end, or widen the counter)",
            std::ldexp(1, train.bits) / train.tick_hz);
  std::size_t stale_labels = 0, guard = 0;
  for (const SegmentLabels& s : out.segments) stale_labels += s.stale, guard += s.in_guard;
  if (stale_labels > 0)
    out.words.push_back(fmt::format("{} labels repeat the one before: the receiver stalled", stale_labels));
  if (guard > 0)
    out.words.push_back(
        fmt::format("{} labels arrived within the guard band around a pulse and were not counted", guard));
  if (unplaced > 0) out.words.push_back(fmt::format("{} labels came where no pulses were", unplaced));
  return out;
}

}  // namespace takt
