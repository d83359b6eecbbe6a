// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/gateware_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <queue>

namespace takt {

std::int64_t cycle_of_edge(double ticks) {
  return static_cast<std::int64_t>(std::floor(ticks)) - 2;
}

std::int64_t append_uart(std::vector<PinChange>& changes, GatewarePin pin, std::span<const std::uint8_t> bytes,
                         std::int64_t cycle, int clocks_per_bit) {
  for (const std::uint8_t b : bytes) {
    changes.push_back({cycle, pin, 0, false});
    bool level = false;
    for (int bit = 0; bit < 9; ++bit) {
      const bool next = bit == 8 || (b >> bit & 1) != 0;
      if (next != level) changes.push_back({cycle + (bit + 1) * std::int64_t{clocks_per_bit}, pin, 0, next});
      level = next;
    }
    cycle += 10 * std::int64_t{clocks_per_bit};
  }
  return cycle;
}

namespace {

using Cycle = std::int64_t;

/// What happens in one clock, in the order in which the clock's registers see it: first what has just taken effect,
/// then events, samples of the UARTs, the scanner's visits, and the rest.
enum class What : std::uint8_t {
  evaluate,
  busy,
  write,
  edge,
  strobe,
  sample,
  idle,
  visit,
  received,
  pop,
  complete,
  frame
};

struct Item {
  Cycle cycle;
  What what;
  int index = 0;        ///< line, slot, trigger, UART
  std::int64_t a = 0;   ///< stamp, generation …
  std::uint32_t b = 0;  ///< payload
  std::uint8_t c = 0;   ///< flags, level
  std::uint64_t order = 0;
};
struct Later {
  bool operator()(const Item& x, const Item& y) const {
    if (x.cycle != y.cycle) return x.cycle > y.cycle;
    if (x.what != y.what) return x.what > y.what;
    return x.order > y.order;
  }
};

/// A pin behind its two flip-flops.
struct Line {
  bool pin = false, invert = false, level = false;
  Cycle evaluated = -1;
};

struct Slot {
  bool occupied = false, overrun = false, lost = false;
  Cycle stamp = 0;
  std::uint8_t kind = 0, channel = 0, flags = 0;
  std::uint32_t payload = 0;
  std::uint16_t next_number = 0;
};

struct Receiver {
  bool busy = false;
  Cycle start = 0;
  int clocks_per_bit = 16;
  int sampled = 0;
  unsigned shift = 0;
};

struct TriggerState {
  std::uint32_t last = 0, rise = 0, fall = 0;
  bool run = false;
  int generation = 0;
  Cycle stopped = 0;  ///< the first cycle without run, of the generation before
};

struct Waiting {
  wire::Frame frame;
  Cycle written;
  bool is_exchange;
  Cycle answered;
};

enum : int { answer_slot, beat_slot, pulse_slot, start_slot, text_slot, first_imu };
constexpr Cycle first_edge = 3;  ///< the level that a pin has at the start is no edge
constexpr Cycle exchange_limit = 0x80'0000;
constexpr Cycle late_age = 65535;

}  // namespace

struct GatewareModel::State {
  explicit State(const GatewareBuild& b)
      : build(b),
        slots(static_cast<std::size_t>(first_imu + b.imus + b.cameras + b.triggers)),
        lines(static_cast<std::size_t>(3 + b.imus + b.cameras)),
        triggers(static_cast<std::size_t>(b.triggers)) {
    for (const int idle_high : {gnss_line, host_line}) {
      line(idle_high).pin = true;
      line(idle_high).level = true;
    }
    memory[wire::reg::id] = wire::identity;
    memory[wire::reg::clock_hz] = b.clock_hz;
    memory[wire::reg::features] = features();
    memory[wire::reg::enable] = 0xFF'FFFF;
    gnss_bit = b.clock_hz / static_cast<std::uint32_t>(b.gnss_baud);
    memory[wire::reg::gnss_bit] = gnss_bit;
    host.clocks_per_bit = b.clocks_per_bit;
    push({1, What::strobe, beat_slot});
    push({Cycle{31} * gnss_bit, What::idle, 0, idle_generation});
  }

  static constexpr int pulse_line = 0, gnss_line = 1, host_line = 2, imu_line = 3;

  GatewareBuild build;
  std::vector<Slot> slots;
  std::vector<Line> lines;
  std::vector<TriggerState> triggers;
  std::priority_queue<Item, std::vector<Item>, Later> items;
  std::uint64_t pushed = 0;
  const std::function<void(const SentByte&)>* sent = nullptr;

  // Registers.
  std::array<std::uint32_t, 64> memory{};
  std::uint32_t enable = 0xFF'FFFF, gnss_bit = 5000;

  // Commands.
  Receiver host, gnss;
  int index = 0;
  std::array<std::uint8_t, wire::command_size> command{};  ///< as far as it was taken
  std::uint16_t crc = 0xFFFF;
  std::vector<std::uint8_t> summed;
  bool busy = false, answer_is_exchange = false;
  Cycle request = 0, answered = 0;
  std::uint8_t broken = 0, refused = 0, host_errors = 0;
  std::vector<std::pair<Cycle, int>> status_changes;

  // GNSS text.
  std::array<std::uint8_t, 4> text{};
  int text_count = 0;
  bool text_waits = false, line_idle = false;
  std::int64_t idle_generation = 0;

  // Exposures.
  std::array<std::uint16_t, 16> exposed{};

  // Heartbeat.
  std::uint32_t beats = 0;
  Cycle last_beat = 0, latest_drop = -1;

  // FIFO and framer.
  std::deque<Waiting> fifo;
  std::deque<std::pair<Cycle, int>> level_changes, water_changes;
  int level = 0, water_level = 0, water = 0;
  Cycle uart_free = 3;  ///< the first cycle in which the framer could give its first byte
  bool framing = false;

  Line& line(int i) { return lines[static_cast<std::size_t>(i)]; }
  Slot& slot(int i) { return slots[static_cast<std::size_t>(i)]; }
  [[nodiscard]] int camera_line() const { return imu_line + build.imus; }
  [[nodiscard]] int camera_slot() const { return first_imu + build.imus; }
  [[nodiscard]] int trigger_slot() const { return camera_slot() + build.cameras; }
  [[nodiscard]] Cycle byte_clocks() const { return 10 * Cycle{build.clocks_per_bit} + 1; }

  [[nodiscard]] std::uint32_t features() const {
    return static_cast<std::uint32_t>(build.fifo_log2) << 28 | 1u << 20 |
           static_cast<std::uint32_t>(build.triggers) << 16 | static_cast<std::uint32_t>(build.cameras) << 12 |
           static_cast<std::uint32_t>(build.imus) << 8 | 64u;
  }

  void push(Item item) {
    item.order = pushed++;
    items.push(item);
  }

  void step() {
    const Item item = items.top();
    items.pop();
    switch (item.what) {
      case What::evaluate:
        return evaluate(item);
      case What::busy:
        busy = item.c != 0;
        return;
      case What::write:
        return write(item.cycle);
      case What::edge:
        return edge(item);
      case What::strobe:
        return strobe(item);
      case What::sample:
        return sample(item);
      case What::idle:
        return idle(item);
      case What::visit:
        return visit(item);
      case What::received:
        return received(item.cycle, static_cast<std::uint8_t>(item.b));
      case What::pop:
        return pop(item.cycle);
      case What::complete:
        return complete(item.cycle);
      case What::frame:
        return frame(item.cycle);
    }
  }

  // Pins.
  int line_of(const PinChange& c) const {
    switch (c.pin) {
      case GatewarePin::pps:
        return pulse_line;
      case GatewarePin::gnss:
        return gnss_line;
      case GatewarePin::host:
        return host_line;
      case GatewarePin::imu:
        return imu_line + c.index;
      case GatewarePin::exposure:
        return camera_line() + c.index;
    }
    return 0;
  }
  void change(const PinChange& c) {
    const int i = line_of(c);
    line(i).pin = c.level;
    judge(i, c.cycle + 1);
  }
  void judge(int i, Cycle cycle) {
    if (line(i).evaluated == cycle) return;
    line(i).evaluated = cycle;
    push({cycle, What::evaluate, i});
  }
  void evaluate(const Item& item) {
    Line& l = line(item.index);
    push({item.cycle + 1, What::edge, item.index, 0, 0, static_cast<std::uint8_t>(l.pin != l.invert)});
  }
  void edge(const Item& item) {
    Line& l = line(item.index);
    const bool level_now = item.c != 0;
    if (level_now == l.level) return;
    l.level = level_now;
    if (item.cycle < first_edge) return;
    const Cycle e = item.cycle;
    if (item.index == pulse_line) {
      if (level_now && (enable & wire::pulse_bit()) != 0) push({e, What::strobe, pulse_slot, e});
    } else if (item.index == host_line) {
      if (!level_now) begin(host, 0, e);
    } else if (item.index == gnss_line) {
      if (!level_now && !gnss.busy) {
        if (line_idle && (enable & wire::gnss_bit()) != 0) push({e, What::strobe, start_slot, e});
        line_idle = false;
        ++idle_generation;
        gnss.clocks_per_bit = static_cast<int>(gnss_bit);
        begin(gnss, 1, e);
      }
    } else if (item.index < camera_line()) {
      const int k = item.index - imu_line;
      if (level_now && (enable & wire::imu_bit(k)) != 0) push({e, What::strobe, first_imu + k, e});
    } else {
      const int k = item.index - camera_line();
      if ((enable & wire::camera_bit(k)) == 0) return;
      auto& frames = exposed[static_cast<std::size_t>(k)];
      if (level_now) ++frames;
      push({e + 1, What::strobe, camera_slot() + k, e, frames,
            static_cast<std::uint8_t>(level_now ? wire::flag_level : 0)});
    }
  }

  // UARTs.
  void begin(Receiver& r, int which, Cycle start) {
    if (r.busy) return;
    r.busy = true;
    r.start = start;
    r.sampled = 0;
    r.shift = 0;
    if (which == 0 && index == 0 && !busy) request = start;
    push({start + r.clocks_per_bit / 2, What::sample, which});
  }
  void sample(const Item& item) {
    Receiver& r = item.index == 0 ? host : gnss;
    const bool level_now = line(item.index == 0 ? host_line : gnss_line).level;
    const int n = r.sampled++;
    if (n == 0 && level_now) {
      r.busy = false;
    } else if (n <= 8) {
      if (n > 0) r.shift |= static_cast<unsigned>(level_now) << (n - 1);
      push({item.cycle + r.clocks_per_bit, What::sample, item.index});
      return;
    } else {
      r.busy = false;
      if (level_now && item.index == 0) push({item.cycle + 1, What::received, 0, 0, r.shift});
      if (level_now && item.index == 1) text_byte(item.cycle + 1, static_cast<std::uint8_t>(r.shift));
      if (!level_now && item.index == 0) ++host_errors;
    }
    if (item.index == 1) push({item.cycle + 31 * Cycle{r.clocks_per_bit} + 1, What::idle, 0, ++idle_generation});
  }
  void text_byte(Cycle cycle, std::uint8_t byte) {
    text[static_cast<std::size_t>(text_count)] = byte;
    if (text_count == 3) text_event(cycle + 1, 3);
    text_waits = text_count != 3;
    text_count = (text_count + 1) % 4;
  }
  void text_event(Cycle cycle, int less_1) {
    if ((enable & wire::gnss_bit()) == 0) return;
    const std::uint32_t payload = text[0] | text[1] << 8 | text[2] << 16 | static_cast<std::uint32_t>(text[3]) << 24;
    push({cycle, What::strobe, text_slot, cycle, payload, static_cast<std::uint8_t>(less_1)});
  }
  void idle(const Item& item) {
    if (item.a != idle_generation) return;
    line_idle = true;
    if (text_waits) text_event(item.cycle + 1, text_count - 1);
    text_waits = false;
    text_count = 0;
  }

  // Slots and scanner.
  void strobe(const Item& item) {
    const int i = item.index;
    Slot& s = slot(i);
    std::uint8_t kind = 0, channel = 0, flags = item.c;
    std::uint32_t payload = item.b;
    Cycle stamp = item.a;
    if (i == beat_slot) {
      stamp = item.cycle;
      channel = static_cast<std::uint8_t>(beats++ % 4);
      if (latest_drop >= last_beat) flags = wire::flag_any_loss;
      last_beat = item.cycle;
      const Cycle period = Cycle{1} << build.heartbeat_log2;
      push({(item.cycle / period + 1) * period + 1, What::strobe, beat_slot});
    } else if (i == answer_slot) {
      kind = static_cast<std::uint8_t>(answer_is_exchange ? wire::Kind::exchange : wire::Kind::reply);
      channel = item.c;
      flags = 0;
    } else if (i == pulse_slot) {
      kind = static_cast<std::uint8_t>(wire::Kind::pulse);
      flags = wire::flag_level;
    } else if (i == start_slot) {
      kind = static_cast<std::uint8_t>(wire::Kind::gnss_start);
    } else if (i == text_slot) {
      kind = static_cast<std::uint8_t>(wire::Kind::gnss_text);
    } else if (i < camera_slot()) {
      kind = static_cast<std::uint8_t>(wire::Kind::data_ready);
      channel = static_cast<std::uint8_t>(i - first_imu);
      flags = wire::flag_level;
    } else if (i < trigger_slot()) {
      kind = static_cast<std::uint8_t>(wire::Kind::exposure);
      channel = static_cast<std::uint8_t>(i - camera_slot());
    } else {
      kind = static_cast<std::uint8_t>(wire::Kind::trigger);
      channel = static_cast<std::uint8_t>(i - trigger_slot());
      flags = wire::flag_level;
      const TriggerState& t = triggers[channel];
      const auto generation = static_cast<int>(item.b);
      const Cycle match = item.cycle - 4;
      const bool current = t.run && t.generation == generation;
      // The pin is set in the second clock after the count matched, if the trigger still runs in the first.
      if (!current && t.stopped <= match + 1) return;
      // A pin that never falls rises once.
      const bool falls = t.fall != t.rise && t.fall < t.last + 2;
      if (current && falls) push({item.cycle + t.last + 2, What::strobe, i, 0, item.b});
      if ((enable & wire::trigger_bit(channel)) == 0) return;
      stamp = item.cycle;
      payload = 0;
    }
    if (s.occupied) {
      s.lost = true;
      return;
    }
    s.occupied = true;
    s.overrun = s.lost;
    s.lost = false;
    s.stamp = stamp;
    s.kind = kind;
    s.channel = channel;
    s.flags = flags;
    s.payload = payload;
    const auto round = static_cast<Cycle>(slots.size());
    const Cycle from = item.cycle + 1;
    const Cycle turn = from + ((i - from) % round + round) % round;
    push({turn + 2, What::visit, i});
  }

  void settle_level(Cycle limit) {
    for (; !level_changes.empty() && level_changes.front().first <= limit; level_changes.pop_front())
      level += level_changes.front().second;
  }
  /// The high-water mark as the register holds it, one clock behind the level.
  void settle_water(Cycle limit) {
    while (!water_changes.empty() && water_changes.front().first <= limit) {
      const Cycle c = water_changes.front().first;
      for (; !water_changes.empty() && water_changes.front().first == c; water_changes.pop_front())
        water_level += water_changes.front().second;
      water = std::max(water, water_level >> (build.fifo_log2 - 7));
    }
  }
  void change_level(Cycle cycle, int by) {
    level_changes.emplace_back(cycle, by);
    water_changes.emplace_back(cycle, by);
  }

  void visit(const Item& item) {
    const Cycle w = item.cycle;
    const int i = item.index;
    Slot& s = slot(i);
    s.occupied = false;
    settle_level(w - 2);
    settle_water(w - 3);
    const std::uint16_t number = s.next_number++;
    const bool full = level >= (1 << build.fifo_log2) - 1;
    if (i == answer_slot && (full || !answer_is_exchange)) push({w + 1, What::busy});
    if (full) {
      s.lost = true;
      latest_drop = w;
      return;
    }
    wire::Frame f;
    f.kind = static_cast<wire::Kind>(s.kind);
    f.channel = s.channel;
    f.flags = static_cast<std::uint8_t>(s.flags | (s.overrun ? wire::flag_overrun : 0));
    f.sequence = number;
    f.stamp = static_cast<std::uint64_t>(s.stamp);
    f.payload = i == beat_slot ? word(s.channel, w - 1) : s.payload;
    if (i == answer_slot)
      f.sequence = static_cast<std::uint16_t>(answer_is_exchange ? answered - request : command[4] << 8 | command[3]);
    fifo.push_back({f, w, i == answer_slot && answer_is_exchange, answered});
    change_level(w, 1);
    if (!framing) start_frame(0);
  }

  [[nodiscard]] std::uint32_t word(int which, Cycle) const {
    switch (static_cast<wire::Word>(which)) {
      case wire::Word::clock_hz:
        return build.clock_hz;
      case wire::Word::features:
        return features();
      case wire::Word::status:
        return static_cast<std::uint32_t>(host_errors) << 24 | static_cast<std::uint32_t>(water & 0xFF) << 16 |
               static_cast<std::uint32_t>(refused) << 8 | broken;
      case wire::Word::identity:
        break;
    }
    return wire::identity;
  }

  // Framer.
  void start_frame(Cycle popped) {
    framing = true;
    push({std::max({uart_free, fifo.front().written + 2, popped + 2}), What::frame});
  }
  void frame(Cycle first) {
    Waiting& w = fifo.front();
    if (w.is_exchange) {
      const auto delay = static_cast<std::uint32_t>(std::min(first + 3 - w.answered, exchange_limit));
      w.frame.payload = (w.frame.payload & 0xFF00'0000) | delay;
    }
    const wire::FrameBytes bytes = wire::encode(w.frame);
    for (std::size_t k = 0; k < bytes.size(); ++k)
      (*sent)({bytes[k], first + static_cast<Cycle>(k) * byte_clocks() + 3});
    const auto count = static_cast<Cycle>(bytes.size());
    uart_free = first + count * byte_clocks();
    push({first + (count - 1) * byte_clocks() + 1, What::pop});
  }
  void pop(Cycle cycle) {
    if (fifo.front().is_exchange) push({cycle + 1, What::busy});
    fifo.pop_front();
    change_level(cycle, -1);
    framing = false;
    if (!fifo.empty()) start_frame(cycle);
  }

  // Commands.
  void received(Cycle cycle, std::uint8_t byte) {
    if (index == 0) {
      if (byte == wire::command_sync[0]) index = 1;
      return;
    }
    if (index == 1) {
      index = byte == wire::command_sync[1] ? 2 : 0;
      summed.clear();
      return;
    }
    summed.push_back(byte);
    if (!busy && index < 9) command[static_cast<std::size_t>(index)] = byte;
    if (index == 10) push({cycle + 1, What::complete});
    index = index == 10 ? 0 : index + 1;
  }
  void complete(Cycle cycle) {
    if (wire::crc16(summed) != 0) {
      ++broken;
    } else if (busy) {
      ++refused;
    } else {
      push({cycle + 2, What::busy, 0, 0, 0, 1});
      push({cycle + 3, What::write});
    }
  }

  /// The command takes effect, and is answered four clocks later.
  void write(Cycle cycle) {
    const std::uint8_t operation = command[2] & 15, address = command[3];
    const bool known = command[2] >> 4 == wire::wire_version && operation >= 1 && operation <= 3;
    const int k = (address - wire::reg::trigger) / 4;
    const bool is_trigger = address >= wire::reg::trigger && k < build.triggers && address % 4 != 3;
    const bool writable = is_trigger || address == wire::reg::enable || address == wire::reg::invert ||
                          address == wire::reg::gnss_bit || address == wire::reg::run;
    const bool readable = writable || address <= wire::reg::features;
    std::uint32_t value = 0;
    for (unsigned i = 0; i < 4; ++i) value |= static_cast<std::uint32_t>(command[5 + i]) << (8 * i);
    if (known && operation == 2 && writable) apply(address, k, is_trigger, value, cycle);

    answered = cycle + 4;
    auto status = wire::Status::ok;
    const bool late = answered - request >= late_age;
    if (!known)
      status = wire::Status::unknown;
    else if (operation == 3)
      status = late ? wire::Status::late : wire::Status::ok;
    else if (!readable)
      status = wire::Status::no_register;
    else if (operation == 2 && !writable)
      status = wire::Status::read_only;
    answer_is_exchange = known && operation == 3 && !late;
    std::uint32_t payload = address == wire::reg::run ? run_mask() : memory[address & 63];
    if (address == wire::reg::run) payload |= memory[address] & ~((1u << build.triggers) - 1);
    if (answer_is_exchange) payload = static_cast<std::uint32_t>(command[4]) << 24;
    push({answered, What::strobe, answer_slot, answered, payload, static_cast<std::uint8_t>(status)});
  }
  [[nodiscard]] std::uint32_t run_mask() const {
    std::uint32_t mask = 0;
    for (std::size_t i = 0; i < triggers.size(); ++i) mask |= static_cast<std::uint32_t>(triggers[i].run) << i;
    return mask;
  }

  void apply(std::uint8_t address, int k, bool is_trigger, std::uint32_t value, Cycle cycle) {
    memory[address & 63] = value;
    if (address == wire::reg::enable) enable = value & 0xFF'FFFF;
    if (address == wire::reg::gnss_bit) gnss_bit = value & 0xFFFF;
    if (address == wire::reg::invert) {
      const auto invert = [&](int i, std::uint32_t bit) {
        line(i).invert = (value & bit) != 0;
        judge(i, cycle);
      };
      invert(pulse_line, wire::pulse_bit());
      invert(gnss_line, wire::gnss_bit());
      for (int i = 0; i < build.imus; ++i) invert(imu_line + i, wire::imu_bit(i));
      for (int i = 0; i < build.cameras; ++i) invert(camera_line() + i, wire::camera_bit(i));
    }
    if (is_trigger) {
      TriggerState& t = triggers[static_cast<std::size_t>(k)];
      const std::uint32_t mask = (1u << build.trigger_bits) - 1;
      (address % 4 == 0 ? t.last : address % 4 == 1 ? t.rise : t.fall) = value & mask;
      set_run(k, false, cycle);
    }
    if (address == wire::reg::run)
      for (int i = 0; i < build.triggers; ++i) set_run(i, (value >> i & 1) != 0, cycle);
  }
  void set_run(int k, bool run, Cycle cycle) {
    TriggerState& t = triggers[static_cast<std::size_t>(k)];
    if (t.run == run) return;
    t.run = run;
    if (!run) {
      t.stopped = cycle;
      ++t.generation;
    } else if (t.rise < t.last + 2) {
      push({cycle + t.rise + 4, What::strobe, trigger_slot() + k, 0, static_cast<std::uint32_t>(t.generation)});
    }
  }
};

GatewareModel::GatewareModel(const GatewareBuild& build) : state_(std::make_unique<State>(build)) {}
GatewareModel::~GatewareModel() = default;
GatewareModel::GatewareModel(GatewareModel&&) noexcept = default;
GatewareModel& GatewareModel::operator=(GatewareModel&&) noexcept = default;

void GatewareModel::run(std::span<const PinChange> changes, std::int64_t end,
                        const std::function<void(const SentByte&)>& sent) {
  State& s = *state_;
  s.sent = &sent;
  for (const PinChange& change : changes) {
    // A level of this cycle is seen by what happens from the next one on.
    while (!s.items.empty() && s.items.top().cycle <= change.cycle) s.step();
    s.change(change);
  }
  while (!s.items.empty() && s.items.top().cycle < end) s.step();
  s.sent = nullptr;
}

}  // namespace takt
