// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/recording/format.h"
#include "takt/streams/clock_events.h"
#include "takt/streams/gateware_wire.h"

/// The host's end of the gateware's wire (docs/formats/wire.md): frames out of bytes, losses counted, the counter
/// extended.
namespace takt {

/// One frame that passed its CRC.
struct GatewareEvent {
  wire::Frame frame;
  std::int64_t ticks = 0;  ///< the stamp, extended beyond the counter's width; comparable within one `boot`
  int boot = 0;            ///< how often the device has started anew before this
  std::size_t lost = 0;    ///< events of this channel that are missing before this one, by sequence number
  std::uint64_t byte = 0;  ///< where the frame begins in all bytes that were fed
};

/// What was lost on the way, and where.
struct GatewareHealth {
  struct Channel {
    wire::Kind kind;
    int channel = 0;
    std::size_t frames = 0;
    std::size_t lost = 0;      ///< missing sequence numbers
    std::size_t overruns = 0;  ///< frames that say that events before them were lost in the device
    std::size_t repeated = 0;  ///< sequence numbers that were there already
  };
  std::vector<Channel> channels;  ///< ordered by kind and channel
  std::size_t frames = 0;
  std::size_t bad_crc = 0;        ///< sync found, but the sum is wrong
  std::size_t bad_version = 0;    ///< frames of another version of the wire
  std::size_t garbage_bytes = 0;  ///< passed over while looking for a frame
  std::size_t idle_bytes = 0;     ///< zeros between frames: an SPI host that had nothing to read
  std::size_t resets = 0;         ///< times that the device has started anew
  std::size_t losses_told = 0;    ///< heartbeats that say that some channel lost something
};

/// What the device says of itself, as far as its heartbeats have told.
struct GatewareDevice {
  std::optional<std::uint32_t> clock_hz;
  std::optional<wire::Features> features;
  std::optional<std::uint32_t> status;
};

/// Frames from bytes as they come, in pieces of any size. Never throws for what the bytes hold: what is not a frame is
/// counted. Memory is bounded by what was fed since the last call of `next`.
class GatewareDecoder {
 public:
  void feed(std::span<const std::uint8_t> bytes);
  void feed(std::span<const std::byte> bytes) {
    feed({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  }
  void feed(std::string_view bytes) { feed({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}); }
  /// The next event, or nothing until more bytes come.
  [[nodiscard]] std::optional<GatewareEvent> next();
  [[nodiscard]] GatewareHealth health() const;
  [[nodiscard]] const GatewareDevice& device() const { return device_; }

 private:
  [[nodiscard]] GatewareEvent understand(const wire::Frame& frame);
  [[nodiscard]] std::int64_t extend(const wire::Frame& frame, int& boot);
  void start_anew();
  void learn(const wire::Frame& frame);

  std::vector<std::uint8_t> buffer_;
  std::size_t place_ = 0;     ///< in the buffer
  std::uint64_t passed_ = 0;  ///< bytes before the buffer
  GatewareDevice device_;
  GatewareHealth totals_;
  struct ChannelState {
    GatewareHealth::Channel seen;
    std::optional<std::uint16_t> last;
  };
  std::map<std::pair<int, int>, ChannelState> channels_;
  std::optional<std::int64_t> latest_;  ///< ticks
  int boot_ = 0;
};

/// Everything that a recording of the gateware holds, as nouns. Ticks of several boots are never mixed: only the
/// longest one is kept, and that is said.
struct GatewareCapture {
  DeviceCounter counter;
  std::vector<PulseStream> pulses;    ///< "pps", "gnss" (starts of bursts), "imu0", "trigger0" …
  std::vector<StrobeStream> strobes;  ///< "cam0" …: start and end of the same frame, joined by number
  /// What the receiver said, and where: bytes from `first` on belong to a burst whose start bit came at `ticks`.
  struct Burst {
    std::size_t first = 0;
    std::int64_t ticks = 0;
  };
  std::string gnss_text;
  std::vector<Burst> bursts;
  PairStream
      exchanges;  ///< two-way, on the host's clock where the recording has its marks; device_ns from the nominal rate
  GatewareHealth health;
  GatewareDevice device;
  std::vector<std::string> notes;
};

/// Joins events into nouns. Throws takt::Error where no frame is found or the clock's rate is not told.
[[nodiscard]] GatewareCapture read_gateware_capture(std::string_view bytes, const std::string& where);
[[nodiscard]] GatewareCapture read_gateware_capture(const std::string& path);

/// Ticks of a counter in nanoseconds by its nominal rate, rounded to the nearest; an edge is taken in the middle of its
/// tick.
[[nodiscard]] std::int64_t middle_of_tick_ns(std::int64_t ticks, double tick_hz);

[[nodiscard]] bool looks_like_gateware(const std::string& path);
/// Cameras with the middles of their exposures as stamps; the other channels are counted in the notes.
[[nodiscard]] Recording read_gateware(const std::string& path, const OpenOptions& options);
[[nodiscard]] Recording read_gateware(std::string_view bytes, const std::string& where);

}  // namespace takt
