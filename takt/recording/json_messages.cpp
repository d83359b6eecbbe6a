// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/json_messages.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>

#include "takt/recording/camera_info.h"
#include "takt/recording/picture.h"
#include "takt/recording/raw_picture.h"

namespace takt::json_messages {

namespace {

using Json = nlohmann::json;
using Bytes = std::vector<std::byte>;
constexpr std::int64_t second_ns = 1'000'000'000;

Json parsed(std::span<const std::byte> message) {
  const auto* const text = reinterpret_cast<const char*>(message.data());
  return Json::parse(text, text + message.size(), nullptr, false);
}

/// The member of that name, or null.
const Json& at(const Json& object, const char* key) {
  static const Json none;
  if (!object.is_object()) return none;
  const auto found = object.find(key);
  return found == object.end() ? none : *found;
}

std::optional<double> number(const Json& object, const char* key) {
  const Json& value = at(object, key);
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}
std::string text(const Json& object, const char* key) {
  const Json& value = at(object, key);
  return value.is_string() ? value.get<std::string>() : std::string();
}
std::uint32_t whole(const Json& object, const char* key) {
  const auto value = number(object, key);
  return value && *value >= 0 && *value <= UINT32_MAX ? static_cast<std::uint32_t>(*value) : 0;
}

std::optional<Vec3> vector(const Json& object) {
  const auto x = number(object, "x"), y = number(object, "y"), z = number(object, "z");
  if (!x || !y || !z) return std::nullopt;
  return Vec3(*x, *y, *z);
}

std::vector<double> doubles(const Json& list) {
  std::vector<double> out;
  if (!list.is_array() || list.size() > 64) return out;
  for (const Json& x : list) out.push_back(x.is_number() ? x.get<double>() : 0);
  return out;
}

/// A member that one of ROS and Foxglove writes in capitals.
const Json& either(const Json& object, const char* a, const char* b) {
  return at(object, a).is_null() ? at(object, b) : at(object, a);
}

int base64_value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;
  return c == '/' || c == '_' ? 63 : -1;
}

/// RFC 4648, with or without padding; also a list of byte values, as some bridges write.
Bytes binary(const Json& value) {
  Bytes out;
  if (value.is_array())
    for (const Json& x : value) out.push_back(static_cast<std::byte>(x.is_number_integer() ? x.get<int>() : 0));
  if (!value.is_string()) return out;
  const auto& coded = value.get_ref<const std::string&>();
  out.reserve(coded.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : coded) {
    const int v = base64_value(c);
    if (v < 0) break;
    bits = bits << 6 | static_cast<std::uint32_t>(v);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    out.push_back(static_cast<std::byte>(bits >> count));
  }
  return out;
}

std::optional<Stamp> stamp_of(const Json& message) {
  const Json& stamp =
      at(message, "timestamp").is_null() ? at(at(message, "header"), "stamp") : at(message, "timestamp");
  const Json& s = either(stamp, "sec", "secs");
  const Json& ns = at(stamp, "nanosec").is_null() ? either(stamp, "nsec", "nsecs") : at(stamp, "nanosec");
  if (!s.is_number_integer() || !ns.is_number_integer()) return std::nullopt;
  const auto seconds = s.get<std::int64_t>(), rest = ns.get<std::int64_t>();
  constexpr std::int64_t most = std::int64_t{1} << 32;
  if (seconds <= -most || seconds >= most || rest < 0 || rest >= second_ns) return std::nullopt;
  return from_ns(seconds * second_ns + rest);
}

/// Where the values of a stamp's two numbers are in the text.
struct StampDigits {
  std::string_view s, ns;
};

/// Walks over a JSON text and finds the values of two members by their path. The text has been parsed before.
class DigitFinder {
 public:
  explicit DigitFinder(std::string_view text) : text_(text) {}

  std::optional<StampDigits> find() {
    value("");
    if (found_.s.empty() || found_.ns.empty()) return std::nullopt;
    return found_;
  }

 private:
  static constexpr int most_depth = 64;

  void blanks() {
    while (place_ < text_.size() && std::string_view(" \t\r\n").find(text_[place_]) != std::string_view::npos) ++place_;
  }
  bool take(char c) {
    blanks();
    if (place_ >= text_.size() || text_[place_] != c) return false;
    ++place_;
    return true;
  }
  std::string_view string() {
    const std::size_t begin = place_;
    while (place_ < text_.size() && text_[place_] != '"') place_ += text_[place_] == '\\' ? 2 : 1;
    place_ = std::min(place_, text_.size());
    const std::string_view out = text_.substr(begin, place_ - begin);
    place_ = std::min(place_ + 1, text_.size());
    return out;
  }
  void value(const std::string& path) {
    if (++depth_ > most_depth) place_ = text_.size();
    if (take('{')) {
      while (place_ < text_.size() && !take('}')) {
        if (!take('"')) break;
        const std::string key(string());
        if (!take(':')) break;
        value(path + "/" + key);
        take(',');
      }
    } else if (take('[')) {
      while (place_ < text_.size() && !take(']')) {
        value(path + "/[]");
        take(',');
      }
    } else if (take('"')) {
      string();
    } else {
      const std::size_t begin = place_;
      while (place_ < text_.size() && std::string_view(",]} \t\r\n").find(text_[place_]) == std::string_view::npos)
        ++place_;
      scalar(path, text_.substr(begin, place_ - begin));
    }
    --depth_;
  }
  void scalar(const std::string& path, std::string_view digits) {
    for (const char* stamp : {"/header/stamp/", "/timestamp/"}) {
      if (!path.starts_with(stamp)) continue;
      const std::string key = path.substr(std::string_view(stamp).size());
      if (key == "sec" || key == "secs") found_.s = digits;
      if (key == "nanosec" || key == "nsec" || key == "nsecs") found_.ns = digits;
    }
  }

  std::string_view text_;
  std::size_t place_ = 0;
  int depth_ = 0;
  StampDigits found_;
};

}  // namespace

std::optional<ImuMessage> read_imu(std::span<const std::byte> message) {
  const Json json = parsed(message);
  const auto stamp = stamp_of(json);
  const auto gyro = vector(at(json, "angular_velocity"));
  if (!stamp || !gyro) return std::nullopt;
  const auto accel = vector(at(json, "linear_acceleration"));
  const std::vector<double> covariance = doubles(at(json, "linear_acceleration_covariance"));
  const bool measured = accel && (covariance.empty() || covariance.front() != -1);
  return ImuMessage{*stamp, *gyro, accel.value_or(Vec3::Zero()), measured};
}

std::optional<ImageHead> read_image_head(std::span<const std::byte> message) {
  const Json json = parsed(message);
  const auto stamp = stamp_of(json);
  if (!stamp) return std::nullopt;
  return ImageHead{*stamp, whole(json, "height"), text(json, "encoding")};
}

GrayImage read_image(std::span<const std::byte> message, bool compressed) {
  const Json json = parsed(message);
  const auto data = std::make_shared<const Bytes>(binary(at(json, "data")));
  if (compressed) return decode_picture(*data);
  const std::string encoding = text(json, "encoding");
  return to_gray({whole(json, "width"), whole(json, "height"), whole(json, "step"), encoding, *data,
                  whole(json, "is_bigendian") != 0},
                 data);
}

std::optional<CameraInfoModel> read_camera_info(std::span<const std::byte> message) {
  const Json json = parsed(message);
  CameraInfo info;
  info.width = whole(json, "width");
  info.height = whole(json, "height");
  info.distortion = text(json, "distortion_model");
  info.d = doubles(either(json, "D", "d"));
  const std::vector<double> k = doubles(either(json, "K", "k"));
  if (k.size() != info.k.size()) return std::nullopt;
  std::copy(k.begin(), k.end(), info.k.begin());
  return model_of(info);
}

std::optional<Stamp> stamp(std::span<const std::byte> message) {
  return stamp_of(parsed(message));
}

std::optional<Bytes> with_stamp(std::span<const std::byte> message, Stamp stamp) {
  if (!stamp_of(parsed(message))) return std::nullopt;
  const std::string_view text(reinterpret_cast<const char*>(message.data()), message.size());
  const auto digits = DigitFinder(text).find();
  if (!digits) return std::nullopt;
  std::int64_t s = to_ns(stamp) / second_ns, ns = to_ns(stamp) % second_ns;
  if (ns < 0) ns += second_ns, --s;
  struct Exchange {
    std::string_view old;
    std::string now;
  };
  std::array<Exchange, 2> parts{{{digits->s, std::to_string(s)}, {digits->ns, std::to_string(ns)}}};
  if (parts[0].old.data() > parts[1].old.data()) std::swap(parts[0], parts[1]);
  std::string out;
  const char* from = text.data();
  for (const Exchange& part : parts) {
    out.append(from, part.old.data());
    out += part.now;
    from = part.old.data() + part.old.size();
  }
  out.append(from, text.data() + text.size());
  const auto bytes = std::as_bytes(std::span(out));
  return Bytes(bytes.begin(), bytes.end());
}

}  // namespace takt::json_messages
