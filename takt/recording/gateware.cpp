// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gateware.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "takt/error.h"
#include "takt/recording/files.h"

namespace takt {

namespace {

/// Does this kind number its frames? Answers carry the command's token there instead, and the host's marks nothing.
bool is_numbered(wire::Kind kind) {
  return kind != wire::Kind::reply && kind != wire::Kind::exchange && kind != wire::Kind::host;
}

/// Which row of numbers a frame belongs to: the words of the heartbeat share one.
int row_of(const wire::Frame& f) {
  return is_numbered(f.kind) && f.kind != wire::Kind::heartbeat ? f.channel : 0;
}

/// A device that has just started says so first: the first word of its heartbeat, numbered 0.
bool is_first_heartbeat(const wire::Frame& f) {
  return f.kind == wire::Kind::heartbeat && f.sequence == 0 && f.channel == static_cast<int>(wire::Word::clock_hz);
}

}  // namespace

void GatewareDecoder::feed(std::span<const std::uint8_t> bytes) {
  passed_ += place_;
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(place_));
  place_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::optional<GatewareEvent> GatewareDecoder::next() {
  while (buffer_.size() - place_ >= wire::frame_size) {
    const auto bytes = std::span(buffer_).subspan(place_).first<wire::frame_size>();
    const wire::Decoded decoded = wire::decode_frame(bytes);
    switch (decoded.fault) {
      case wire::Fault::none: {
        GatewareEvent event = understand(decoded.frame);
        event.byte = passed_ + place_;
        place_ += wire::frame_size;
        return event;
      }
      case wire::Fault::version:
        ++totals_.bad_version;
        place_ += wire::frame_size;
        break;
      case wire::Fault::crc:
        // A true frame may begin anywhere behind: look at every byte.
        ++totals_.bad_crc;
        ++totals_.garbage_bytes;
        ++place_;
        break;
      case wire::Fault::sync:
        ++(buffer_[place_] == 0 ? totals_.idle_bytes : totals_.garbage_bytes);
        ++place_;
        break;
    }
  }
  return std::nullopt;
}

GatewareEvent GatewareDecoder::understand(const wire::Frame& frame) {
  ++totals_.frames;
  GatewareEvent event;
  event.frame = frame;
  if (frame.kind == wire::Kind::host) {
    event.ticks = static_cast<std::int64_t>(frame.stamp);
    event.boot = boot_;
  } else {
    learn(frame);
    event.ticks = extend(frame, event.boot);
  }
  const int row = row_of(frame);
  ChannelState& state = channels_[{static_cast<int>(frame.kind), row}];
  state.seen.kind = frame.kind;
  state.seen.channel = row;
  if (frame.kind == wire::Kind::heartbeat && (frame.flags & wire::flag_any_loss) != 0) ++totals_.losses_told;
  ++state.seen.frames;
  if (frame.overrun()) ++state.seen.overruns;
  if (!is_numbered(frame.kind)) return event;
  if (state.last) {
    const auto ahead = static_cast<std::uint16_t>(frame.sequence - *state.last - 1);
    if (ahead < 0x8000) {
      event.lost = ahead;
      state.seen.lost += ahead;
    } else {
      ++state.seen.repeated;
    }
  }
  state.last = frame.sequence;
  return event;
}

void GatewareDecoder::learn(const wire::Frame& frame) {
  if (frame.kind != wire::Kind::heartbeat) return;
  if (is_first_heartbeat(frame) && latest_) {
    // A wrapped sequence number also comes to 0, but then the counter has gone on.
    const int bits = device_.features ? device_.features->counter_bits : 64;
    const bool young = frame.stamp < 4096;
    if (young && (bits < 64 || static_cast<std::int64_t>(frame.stamp) < *latest_)) start_anew();
  }
  switch (static_cast<wire::Word>(frame.channel)) {
    case wire::Word::clock_hz:
      device_.clock_hz = frame.payload;
      break;
    case wire::Word::features:
      device_.features = wire::features_of(frame.payload);
      break;
    case wire::Word::status:
      device_.status = frame.payload;
      break;
    case wire::Word::identity:
      break;
  }
}

std::int64_t GatewareDecoder::extend(const wire::Frame& frame, int& boot) {
  const int bits = device_.features ? std::clamp(device_.features->counter_bits, 16, 64) : 64;
  auto ticks = static_cast<std::int64_t>(frame.stamp);
  if (latest_) {
    // The nearest instant to the latest one that has these low bits: across wraps, and a little backwards.
    const int shift = 64 - bits;
    const std::uint64_t difference = (frame.stamp - static_cast<std::uint64_t>(*latest_)) << shift;
    const std::int64_t step = static_cast<std::int64_t>(difference) >> shift;
    const std::int64_t second = device_.clock_hz && *device_.clock_hz > 0 ? *device_.clock_hz : 100'000'000;
    if (bits >= 64 && step < -second) {
      start_anew();
    } else {
      // Unsigned: stamps of a broken device may be anything.
      ticks = static_cast<std::int64_t>(static_cast<std::uint64_t>(*latest_) + static_cast<std::uint64_t>(step));
    }
  }
  if (!latest_ || ticks > *latest_) latest_ = ticks;
  boot = boot_;
  return ticks;
}

void GatewareDecoder::start_anew() {
  ++boot_;
  ++totals_.resets;
  latest_.reset();
  for (auto& [key, state] : channels_) state.last.reset();
}

GatewareHealth GatewareDecoder::health() const {
  GatewareHealth out = totals_;
  for (const auto& [key, state] : channels_) out.channels.push_back(state.seen);
  return out;
}

std::int64_t middle_of_tick_ns(std::int64_t ticks, double tick_hz) {
  // Twice the tick, so that its middle is a whole number; long double keeps the nanosecond over the counter's life.
  const long double ns = (2 * static_cast<long double>(ticks) + 1) * 0.5e9L / static_cast<long double>(tick_hz);
  constexpr long double most = 9.2e18L;
  return static_cast<std::int64_t>(std::llroundl(std::clamp(ns, -most, most)));
}

namespace {

/// Sorts events into streams; a stream comes to be with its first event.
class Collector {
 public:
  explicit Collector(GatewareCapture& out) : out_(out) {}

  void add(const GatewareEvent& e) {
    const auto sequence = std::uint32_t{e.frame.sequence};
    const int channel = e.frame.channel;
    switch (e.frame.kind) {
      case wire::Kind::pulse:
        edge("pps", e.ticks, sequence);
        break;
      case wire::Kind::gnss_start:
        edge("gnss", e.ticks, sequence);
        out_.bursts.push_back({out_.gnss_text.size(), e.ticks});
        break;
      case wire::Kind::gnss_text:
        for (unsigned i = 0; i <= (e.frame.flags & wire::detail_mask); ++i)
          out_.gnss_text.push_back(static_cast<char>(e.frame.payload >> (8 * i)));
        break;
      case wire::Kind::data_ready:
        edge("imu" + std::to_string(channel), e.ticks, sequence);
        break;
      case wire::Kind::trigger:
        edge("trigger" + std::to_string(channel), e.ticks, sequence);
        break;
      case wire::Kind::exposure:
        exposure(e);
        break;
      case wire::Kind::exchange:
        exchange(e);
        break;
      case wire::Kind::host:
        host(e);
        break;
      default:
        break;
    }
  }

  [[nodiscard]] std::size_t half_exposures() const { return half_exposures_; }

 private:
  void edge(const std::string& name, std::int64_t ticks, std::uint32_t sequence) {
    Pulse pulse;
    pulse.ticks = ticks;
    pulse.edge = Edge::rising;
    pulse.sequence = sequence;
    stream(out_.pulses, name).pulses.push_back(pulse);
  }

  /// Start and end are joined by their frame's number, and by nothing else.
  void exposure(const GatewareEvent& e) {
    const int channel = e.frame.channel;
    std::optional<GatewareEvent>& start = starts_[channel];
    if (e.frame.level()) {
      if (start) ++half_exposures_;
      start = e;
      return;
    }
    if (start && start->frame.payload == e.frame.payload && e.ticks > start->ticks) {
      stream(out_.strobes, "cam" + std::to_string(channel))
          .strobes.push_back({start->ticks, e.ticks, e.frame.payload & 0xFFFF});
    } else {
      ++half_exposures_;
    }
    start.reset();
  }

  void host(const GatewareEvent& e) {
    if (e.frame.channel == static_cast<int>(wire::HostMark::request_sent)) sent_[e.frame.sequence & 0xFF] = e.ticks;
    if (e.frame.channel == static_cast<int>(wire::HostMark::answer_received) && answered_ &&
        answered_->token == (e.frame.sequence & 0xFF)) {
      if (const auto sent = sent_.find(answered_->token); sent != sent_.end())
        out_.exchanges.pairs.push_back({sent->second, answered_->ticks, e.ticks});
      answered_.reset();
    }
  }

  void exchange(const GatewareEvent& e) {
    const wire::Exchange x = wire::exchange_of(e.frame);
    // The middle of the device's share: both bounds of the exchange hold for it.
    const std::int64_t request = e.ticks - e.frame.sequence;
    const std::int64_t delay = x.answer ? static_cast<std::int64_t>(*x.answer - x.request) : 0;
    answered_ = Answered{x.token, request + delay / 2};
  }

  template <class Stream>
  static Stream& stream(std::vector<Stream>& all, const std::string& name) {
    for (Stream& s : all)
      if (s.name == name) return s;
    all.emplace_back();
    all.back().name = name;
    return all.back();
  }

  struct Answered {
    std::uint8_t token = 0;
    std::int64_t ticks = 0;
  };
  GatewareCapture& out_;
  std::map<int, std::optional<GatewareEvent>> starts_;
  std::map<int, std::int64_t> sent_;
  std::optional<Answered> answered_;
  std::size_t half_exposures_ = 0;
};

const char* name_of(wire::Kind kind) {
  switch (kind) {
    case wire::Kind::heartbeat:
      return "heartbeat";
    case wire::Kind::pulse:
      return "pps";
    case wire::Kind::gnss_start:
      return "gnss start";
    case wire::Kind::gnss_text:
      return "gnss text";
    case wire::Kind::data_ready:
      return "imu";
    case wire::Kind::exposure:
      return "cam";
    case wire::Kind::trigger:
      return "trigger";
    default:
      return "answer";
  }
}

void note_losses(GatewareCapture& out) {
  for (const auto& c : out.health.channels)
    if (c.lost > 0 || c.overruns > 0 || c.repeated > 0)
      out.notes.push_back(fmt::format("{} {}: {} events missing, {} overruns told by the device, {} frames repeated",
                                      name_of(c.kind), c.channel, c.lost, c.overruns, c.repeated));
  if (out.health.bad_crc > 0 || out.health.garbage_bytes > 0)
    out.notes.push_back(fmt::format("{} frames with a wrong CRC, {} bytes outside of frames", out.health.bad_crc,
                                    out.health.garbage_bytes));
  if (out.health.bad_version > 0)
    out.notes.push_back(
        fmt::format("{} frames of another version of the wire were passed over", out.health.bad_version));
}

/// Events of the longest run between two starts of the device.
std::vector<GatewareEvent> longest_boot(std::vector<GatewareEvent> events, int boots, std::vector<std::string>& notes) {
  if (boots == 0) return events;
  std::vector<std::size_t> counts(static_cast<std::size_t>(boots) + 1);
  for (const auto& e : events) ++counts[static_cast<std::size_t>(e.boot)];
  const auto best = static_cast<int>(std::max_element(counts.begin(), counts.end()) - counts.begin());
  const std::size_t all = events.size();
  std::erase_if(events, [&](const GatewareEvent& e) { return e.boot != best; });
  notes.push_back(fmt::format("the device started anew {} times; only the longest run is kept: {} of {} frames", boots,
                              events.size(), all));
  return events;
}

}  // namespace

GatewareCapture read_gateware_capture(std::string_view bytes, const std::string& where) {
  GatewareDecoder decoder;
  std::vector<GatewareEvent> events;
  constexpr std::size_t piece = 1 << 20;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    decoder.feed(bytes.substr(at, piece));
    while (auto event = decoder.next()) events.push_back(*event);
  }
  GatewareCapture out;
  out.health = decoder.health();
  out.device = decoder.device();
  if (out.health.frames == 0)
    throw Error("no frame of the gateware in these bytes", where,
                out.health.bad_version > 0
                    ? "its frames are of another version of the wire: update takt or the gateware"
                    : "record the serial line raw, at the board's baud rate");
  if (!out.device.clock_hz || *out.device.clock_hz == 0)
    throw Error("the device never told its clock's rate", where,
                "record at least four heartbeats, two seconds, or join pieces of one recording");
  events = longest_boot(std::move(events), static_cast<int>(out.health.resets), out.notes);
  Collector collector(out);
  for (const auto& e : events) collector.add(e);

  out.counter = {"board", static_cast<double>(*out.device.clock_hz), 64};
  for (auto& p : out.pulses) p.counter = out.counter;
  for (auto& s : out.strobes) s.counter = out.counter;
  out.exchanges.name = "exchanges";
  out.exchanges.device = out.counter.clock;
  out.exchanges.two_way = true;
  for (auto& p : out.exchanges.pairs) p.device_ns = middle_of_tick_ns(p.device_ns, out.counter.tick_hz);
  if (collector.half_exposures() > 0)
    out.notes.push_back(
        fmt::format("{} exposures of which only one edge came are left out", collector.half_exposures()));
  note_losses(out);
  return out;
}

GatewareCapture read_gateware_capture(const std::string& path) {
  return read_gateware_capture(read_file(path), path);
}

bool looks_like_gateware(const std::string& path) {
  std::error_code failed;
  if (!std::filesystem::is_regular_file(path, failed)) return false;
  std::ifstream in(path, std::ios::binary);
  std::string head(8192, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  GatewareDecoder decoder;
  decoder.feed(head);
  // A sync and sixteen bits of CRC: one frame by chance in 2^32 places; two are none.
  return decoder.next() && decoder.next();
}

Recording read_gateware(std::string_view bytes, const std::string& where) {
  const GatewareCapture capture = read_gateware_capture(bytes, where);
  Recording out;
  out.notes = capture.notes;
  for (const StrobeStream& strobes : capture.strobes) {
    CameraStream camera;
    camera.name = strobes.name;
    camera.clock = capture.counter.clock;
    for (const FrameStrobe& f : strobes.strobes) {
      const std::int64_t start = middle_of_tick_ns(f.start_ticks, capture.counter.tick_hz);
      const std::int64_t end = middle_of_tick_ns(f.end_ticks, capture.counter.tick_hz);
      camera.stamps.push_back(from_ns<DeviceClock>(std::midpoint(start, end)));
      const auto open_ns = static_cast<std::uint64_t>(end) - static_cast<std::uint64_t>(start);  // garbage may wrap
      camera.exposures_s.push_back(static_cast<double>(static_cast<std::int64_t>(open_ns)) * 1e-9);
    }
    out.cameras.push_back(std::move(camera));
  }
  for (const PulseStream& p : capture.pulses)
    out.notes.push_back(fmt::format("{}: {} edges on the clock \"{}\" of {} MHz", p.name, p.size(),
                                    capture.counter.clock, capture.counter.tick_hz * 1e-6));
  if (!capture.gnss_text.empty())
    out.notes.push_back(fmt::format("the receiver's own {} bytes in {} bursts; takt clock reads them",
                                    capture.gnss_text.size(), capture.bursts.size()));
  if (capture.exchanges.size() > 0)
    out.notes.push_back(fmt::format("{} time exchanges with the host", capture.exchanges.size()));
  return out;
}

Recording read_gateware(const std::string& path, const OpenOptions&) {
  Recording out = read_gateware(read_file(path), path);
  out.files.push_back(path);
  return out;
}

}  // namespace takt
