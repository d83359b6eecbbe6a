// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/listen.h"

#include <fmt/core.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>

#include "takt/error.h"
#include "takt/estimators/clock/live_clock.h"
#include "takt/recording/clock_columns.h"
#include "takt/recording/gateware.h"
#include "takt/recording/gnss_log.h"
#include "takt/recording/live_bytes.h"
#include "takt/workflows/event_file.h"

namespace takt {

namespace {

constexpr std::size_t longest_line = 1024;
constexpr std::size_t enough_to_know = 4096;  // bytes without any sense

std::string bound(const std::optional<std::int64_t>& b) {
  return b ? std::to_string(*b) : "null";
}

class Listener {
 public:
  explicit Listener(const ListenJob& job) : job_(job) {
    if (job.format != "auto") status_.format = job.format;
    if (status_.format == "text") start_text();
    if (!job.mcap.empty()) mcap_.emplace(job.mcap);
  }
  void finish() {
    if (mcap_) mcap_->finish();
  }

  void feed(std::string_view bytes) {
    if (status_.format.empty()) {
      head_ += bytes;
      find_format();
      if (status_.format.empty()) return;
      const std::string all = std::exchange(head_, {});
      take(all);
      return;
    }
    take(bytes);
  }
  void end_of_source() {
    if (status_.format.empty() && !head_.empty()) find_format(), take(std::exchange(head_, {}));
    if (!line_.empty()) text_line(std::exchange(line_, {}));
  }
  void unplugged() {
    ++status_.unplugged;
    status_.plugged = false;
    line_.clear();
    emit(R"({"event":"unplugged"})");
  }
  void plugged() {
    status_.plugged = true;
    emit(R"({"event":"plugged"})");
  }
  [[nodiscard]] ListenStatus status() const {
    ListenStatus s = status_;
    if (clock_) {
      s.pulses = clock_->pulses(), s.rejected = clock_->rejected();
      s.state = clock_->state(), s.why = clock_->why();
      s.rate_ppm = clock_->rate_ppm(), s.sigma_s = clock_->sigma_s();
    }
    return s;
  }

 private:
  void emit(const std::string& json) const {
    if (job_.on_line) job_.on_line(json);
  }

  void start_text() {
    if (!job_.tick_hz) throw Error("the counter's rate is not known", job_.source, "give --tick-hz");
    clock_.emplace(DeviceCounter{"device", *job_.tick_hz, job_.counter_bits}, LabelOptions{}, job_.pulse_error_s);
  }

  void find_format() {
    GatewareDecoder probe;
    probe.feed(head_);
    if (probe.next()) {
      status_.format = "gateware";
      return;
    }
    if (head_.find("pps,") != std::string::npos || head_.find("event,") != std::string::npos) {
      status_.format = "text";
      start_text();
      return;
    }
    if (head_.size() > enough_to_know)
      throw Error("neither frames of the gateware nor lines of text come", job_.source,
                  "check --baud, or see docs/formats/clock.md");
  }

  void take(std::string_view bytes) {
    if (status_.format == "gateware") {
      decoder_.feed(bytes);
      while (const auto event = decoder_.next()) gateware_event(*event);
      return;
    }
    for (const char c : bytes) {
      if (c == '\n')
        text_line(std::exchange(line_, {}));
      else if (line_.size() < longest_line)
        line_ += c;
    }
  }

  /// pps,TICKS · event,NAME,TICKS · TICKS $SENTENCE
  void text_line(std::string line) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    if (line.empty() || line.front() == '#') return;
    if (line.find('$') != std::string::npos) {
      labels_of(line + "\r\n", std::nullopt);
      return;
    }
    const auto last = line.rfind(',');
    const auto ticks =
        last == std::string::npos ? std::nullopt : counter_value(std::string_view(line).substr(last + 1));
    if (ticks && line.starts_with("pps,")) return pulse(*ticks);
    if (ticks && line.starts_with("event,") && last > 6) return event(line.substr(6, last - 6), *ticks, "");
    ++status_.lost;
  }

  void labels_of(std::string_view bytes, std::optional<std::int64_t> arrival) {
    LabelStream out;
    gnss_.feed(bytes, arrival, out);
    for (const TimeLabel& l : out.labels) {
      ++status_.labels;
      if (clock_) clock_->observe_label(l);
    }
  }

  void pulse(std::int64_t ticks) {
    if (!clock_) return;
    const bool belongs = clock_->observe_pulse(ticks);
    event("pps", ticks, belongs ? R"(,"used":true)" : R"(,"used":false)");
  }

  void event(const std::string& name, std::int64_t ticks, const std::string& more) {
    ++status_.events;
    std::string clean;
    for (const char c : name)
      if (std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '/') clean += c;
    const auto s = clock_ ? clock_->stamp(ticks) : std::nullopt;
    const bool known = s && s->state != ClockState::ambiguous;
    const auto device_ns = static_cast<std::int64_t>(
        std::llroundl(static_cast<long double>(ticks) * (1e9L / static_cast<long double>(tick_hz()))));
    const std::string json = fmt::format(
        R"({{"event":"{}","ticks":{},"t_ns":{},"reference_ns":{},"sigma_s":{},"lower_ns":{},"upper_ns":{},"state":"{}"{}}})",
        clean, ticks, device_ns, known ? std::to_string(s->reference_ns) : "null",
        s ? fmt::format("{:.4g}", s->sigma_s) : "null", bound(s ? s->lower_ns : std::nullopt),
        bound(s ? s->upper_ns : std::nullopt), to_string(s ? s->state : ClockState::ambiguous), more);
    emit(json);
    if (!mcap_) return;
    // What is not on UTC stands apart, on the device's clock.
    const std::int64_t at_ns = std::max<std::int64_t>(0, known ? s->reference_ns : device_ns);
    mcap_->write((known ? "/takt/" : "/takt/device_time/") + clean, static_cast<std::uint64_t>(at_ns), json);
  }

  [[nodiscard]] double tick_hz() const {
    if (job_.tick_hz) return *job_.tick_hz;
    return decoder_.device().clock_hz ? static_cast<double>(*decoder_.device().clock_hz) : 1e9;
  }

  void gateware_event(const GatewareEvent& e) {
    status_.lost += e.lost;
    if (!clock_ && (job_.tick_hz || decoder_.device().clock_hz))
      clock_.emplace(DeviceCounter{"board", tick_hz(), 64}, LabelOptions{}, job_.pulse_error_s);
    const std::string channel = std::to_string(e.frame.channel);
    switch (e.frame.kind) {
      case wire::Kind::pulse:
        return pulse(e.ticks);
      case wire::Kind::gnss_start:
        burst_ = e.ticks;
        return;
      case wire::Kind::gnss_text: {
        std::string bytes;
        for (unsigned i = 0; i <= (e.frame.flags & wire::detail_mask); ++i)
          bytes += static_cast<char>(e.frame.payload >> (8 * i) & 0xffU);
        return labels_of(bytes, burst_);
      }
      case wire::Kind::data_ready:
        return event("imu" + channel, e.ticks, fmt::format(R"(,"sequence":{})", e.frame.sequence));
      case wire::Kind::trigger:
        return event("trigger" + channel, e.ticks, fmt::format(R"(,"sequence":{})", e.frame.sequence));
      case wire::Kind::exposure: {
        // Both edges of the same frame: the stamp is their middle.
        if (e.frame.level()) {
          begun_[e.frame.channel] = {e.frame.payload, e.ticks};
          return;
        }
        const auto found = begun_.find(e.frame.channel);
        if (found == begun_.end() || found->second.first != e.frame.payload) return;
        const std::int64_t from = found->second.second;
        event("cam" + channel, from + (e.ticks - from) / 2,
              fmt::format(R"(,"frame":{},"exposure_s":{:.9f})", e.frame.payload,
                          static_cast<double>(e.ticks - from) / tick_hz()));
        begun_.erase(found);
        return;
      }
      default:
        return;
    }
  }

  const ListenJob& job_;
  ListenStatus status_;
  std::string head_, line_;
  std::optional<LiveClock> clock_;
  GatewareDecoder decoder_;
  GnssDecoder gnss_;
  std::optional<std::int64_t> burst_;
  std::optional<EventFile> mcap_;
  std::map<int, std::pair<std::uint32_t, std::int64_t>> begun_;
};

}  // namespace

ListenStatus listen(const ListenJob& job) {
  LiveBytes source(job.source, job.baud);
  Listener listener(job);
  using Clock = std::chrono::steady_clock;
  Clock::time_point shown{};
  bool gone = false;
  while (!job.stop || !job.stop()) {
    std::string bytes;
    switch (source.read(bytes, 100)) {
      case LiveBytes::Status::data:
        listener.feed(bytes);
        break;
      case LiveBytes::Status::unplugged:
        if (!std::exchange(gone, true)) listener.unplugged();
        break;
      case LiveBytes::Status::plugged:
        gone = false;
        listener.plugged();
        break;
      case LiveBytes::Status::quiet:
        break;
      case LiveBytes::Status::ended:
        listener.end_of_source();
        listener.finish();
        return listener.status();
    }
    if (job.on_status && Clock::now() - shown > std::chrono::milliseconds(250)) {
      shown = Clock::now();
      job.on_status(listener.status());
    }
  }
  listener.finish();
  return listener.status();
}

}  // namespace takt
