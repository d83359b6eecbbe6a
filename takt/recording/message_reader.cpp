// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/message_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <string>

namespace takt {

namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

struct Split {
  std::int64_t s;
  std::uint32_t ns;
};
Split split(Stamp stamp) {
  const std::int64_t all = to_ns(stamp);
  std::int64_t s = all / second_ns, ns = all % second_ns;
  if (ns < 0) ns += second_ns, --s;
  return {s, static_cast<std::uint32_t>(ns)};
}

}  // namespace

MessageReader::MessageReader(MessageEncoding encoding, std::span<const std::byte> bytes) : bytes_(bytes) {
  if (encoding == MessageEncoding::ros1) return;
  cdr_ = true;
  const auto head = this->bytes(4);
  origin_ = 4;
  if (head.empty()) return;
  // The representation identifier: 0 CDR_BE, 1 CDR_LE, 6 CDR2_BE, 7 CDR2_LE; the others are laid out differently.
  const auto kind = static_cast<unsigned>(head[1]);
  good_ =
      encoding == MessageEncoding::cdr && head[0] == std::byte{0} && (kind == 0 || kind == 1 || kind == 6 || kind == 7);
  big_endian_ = kind % 2 == 0;
  if (kind > 1) most_align_ = 4;
}

void MessageReader::align(std::size_t to) {
  if (!cdr_) return;
  to = std::min(to, most_align_);
  const std::size_t beyond = (place_ - origin_) % to;
  if (beyond != 0) bytes(to - beyond);
}

std::span<const std::byte> MessageReader::bytes(std::uint64_t count) {
  if (count > bytes_.size() - place_) {
    good_ = false;
    place_ = bytes_.size();
    return {};
  }
  const auto out = bytes_.subspan(place_, static_cast<std::size_t>(count));
  place_ += out.size();
  return out;
}

std::uint64_t MessageReader::number(std::size_t size) {
  align(size);
  const auto b = bytes(size);
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < b.size(); ++i)
    value |= std::to_integer<std::uint64_t>(b[big_endian_ ? size - 1 - i : i]) << (8 * i);
  return value;
}

std::uint8_t MessageReader::u8() {
  return static_cast<std::uint8_t>(number(1));
}
std::uint32_t MessageReader::u32() {
  return static_cast<std::uint32_t>(number(4));
}
double MessageReader::f64() {
  return std::bit_cast<double>(number(8));
}
std::string_view MessageReader::text() {
  const auto b = bytes(u32());
  std::string_view all(reinterpret_cast<const char*>(b.data()), b.size());
  if (cdr_ && all.ends_with('\0')) all.remove_suffix(1);
  return all;
}
std::span<const std::byte> MessageReader::bytes() {
  return bytes(u32());
}
void MessageReader::skip_f64(std::uint64_t count) {
  if (count == 0) return;
  align(8);
  bytes(8 * count);
}

std::optional<Stamp> MessageReader::header() {
  if (!cdr_) u32();  // seq
  const std::uint32_t s = u32(), ns = u32();
  text();  // frame_id
  if (!good_) return std::nullopt;
  const std::int64_t seconds = cdr_ ? static_cast<std::int32_t>(s) : static_cast<std::int64_t>(s);
  return from_ns(seconds * second_ns + ns);
}

std::optional<std::size_t> MessageReader::stamp_place() {
  if (!cdr_) u32();
  const std::size_t at = place_;
  u32();
  u32();
  text();
  return good_ ? std::optional(at) : std::nullopt;
}

bool overwrite_stamp(MessageEncoding encoding, std::span<std::byte> message, Stamp stamp) {
  MessageReader reader(encoding, message);
  const auto at = reader.stamp_place();
  const auto [s, ns] = split(stamp);
  const bool fits = reader.is_cdr()
                        ? s >= std::numeric_limits<std::int32_t>::min() && s <= std::numeric_limits<std::int32_t>::max()
                        : s >= 0 && s <= std::numeric_limits<std::uint32_t>::max();
  if (!at || !fits) return false;
  const auto put = [&](std::size_t place, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i)
      message[place + (reader.big_endian() ? 3 - i : i)] = static_cast<std::byte>(value >> (8 * i));
  };
  put(*at, static_cast<std::uint32_t>(s));
  put(*at + 4, ns);
  return true;
}

std::optional<Stamp> header_stamp(MessageEncoding encoding, std::span<const std::byte> message) {
  return MessageReader(encoding, message).header();
}

bool begins_with_header(const Channel& channel) {
  static constexpr std::array known{
      "sensor_msgs/Imu",           "sensor_msgs/Image",         "sensor_msgs/CompressedImage", "sensor_msgs/CameraInfo",
      "sensor_msgs/MagneticField", "sensor_msgs/PointCloud2",   "sensor_msgs/LaserScan",       "sensor_msgs/NavSatFix",
      "nav_msgs/Odometry",         "geometry_msgs/PoseStamped", "geometry_msgs/TwistStamped"};
  if (std::find(known.begin(), known.end(), channel.type) != known.end()) return true;
  // The first line of the definition that is neither empty, comment nor constant.
  std::string_view rest = channel.definition;
  while (!rest.empty()) {
    std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    line = line.substr(0, line.find('#'));
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || line.find('=') != std::string_view::npos) continue;
    line.remove_prefix(begin);
    const std::string_view type = line.substr(0, line.find_first_of(" \t"));
    return type == "Header" || type == "std_msgs/Header" || type == "std_msgs/msg/Header";
  }
  return false;
}

std::string plain_type(std::string type) {
  if (const std::size_t at = type.find("/msg/"); at != std::string::npos) type.erase(at, 4);
  return type;
}

}  // namespace takt
