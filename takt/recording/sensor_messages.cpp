// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/sensor_messages.h"

#include <algorithm>
#include <array>

#include "takt/recording/camera_info.h"
#include "takt/recording/json_messages.h"
#include "takt/recording/message_reader.h"
#include "takt/recording/picture.h"
#include "takt/recording/raw_picture.h"

namespace takt {

namespace {

Vec3 read_vector(MessageReader& in) {
  const double x = in.f64(), y = in.f64(), z = in.f64();
  return {x, y, z};
}

RawPicture read_raw_picture(MessageReader& in) {
  RawPicture p;
  p.height = in.u32();
  p.width = in.u32();
  p.encoding = in.text();
  p.big_endian = in.u8() != 0;
  p.stride = in.u32();
  return p;
}

}  // namespace

SensorMessage sensor_message(const Channel& channel) {
  if (channel.encoding == MessageEncoding::other) return SensorMessage::none;
  const std::string& type = channel.type;
  if (type == "sensor_msgs/Imu") return SensorMessage::imu;
  if (type == "sensor_msgs/Image") return SensorMessage::image;
  if (type == "sensor_msgs/CompressedImage") return SensorMessage::compressed_image;
  if (type == "sensor_msgs/CameraInfo") return SensorMessage::camera_info;
  if (channel.encoding != MessageEncoding::json) return SensorMessage::none;
  if (type == "foxglove.RawImage") return SensorMessage::image;
  if (type == "foxglove.CompressedImage") return SensorMessage::compressed_image;
  if (type == "foxglove.CameraCalibration") return SensorMessage::camera_info;
  return SensorMessage::none;
}

std::string name_space(std::string topic) {
  if (topic.ends_with("/compressed")) topic.resize(topic.rfind('/'));
  return topic.substr(0, topic.rfind('/'));
}

std::optional<ImuMessage> read_imu(MessageEncoding encoding, std::span<const std::byte> message) {
  if (encoding == MessageEncoding::json) return json_messages::read_imu(message);
  MessageReader in(encoding, message);
  const auto stamp = in.header();
  if (!stamp) return std::nullopt;
  ImuMessage m{};
  m.stamp = *stamp;
  in.skip_f64(4 + 9);  // orientation and its covariance
  m.gyro_rad_s = read_vector(in);
  in.skip_f64(9);
  m.accel_m_s2 = read_vector(in);
  m.has_accel = in.f64() != -1;  // the message's own sign for "not measured"
  in.skip_f64(8);
  if (!in.good()) return std::nullopt;
  return m;
}

std::optional<ImageHead> read_image_head(const Channel& channel, std::span<const std::byte> head) {
  if (channel.encoding == MessageEncoding::json) return json_messages::read_image_head(head);
  MessageReader in(channel.encoding, head);
  const auto stamp = in.header();
  if (!stamp) return std::nullopt;
  ImageHead out{*stamp, 0, {}};
  if (sensor_message(channel) == SensorMessage::compressed_image) return out;
  const RawPicture picture = read_raw_picture(in);
  if (!in.good()) return std::nullopt;
  out.rows = picture.height;
  out.encoding = picture.encoding;
  return out;
}

std::optional<StoredPicture> read_stored_picture(const Channel& channel, std::span<const std::byte> message) {
  if (channel.encoding == MessageEncoding::json) return std::nullopt;
  MessageReader in(channel.encoding, message);
  if (!in.header()) return std::nullopt;
  StoredPicture out;
  if (sensor_message(channel) == SensorMessage::compressed_image) {
    const std::string_view format = in.text();
    out = EncodedPicture{format, in.bytes()};
  } else {
    RawPicture picture = read_raw_picture(in);
    picture.pixels = in.bytes();
    out = picture;
  }
  return in.good() ? std::optional(out) : std::nullopt;
}

GrayImage read_image(const Channel& channel, std::span<const std::byte> message, std::shared_ptr<const void> owner) {
  if (channel.encoding == MessageEncoding::json)
    return json_messages::read_image(message, sensor_message(channel) == SensorMessage::compressed_image);
  const auto stored = read_stored_picture(channel, message);
  if (!stored) return {};
  if (const auto* const encoded = std::get_if<EncodedPicture>(&*stored)) return decode_picture(encoded->bytes);
  return to_gray(std::get<RawPicture>(*stored), std::move(owner));
}

std::optional<CameraInfoModel> read_camera_info(MessageEncoding encoding, std::span<const std::byte> message) {
  if (encoding == MessageEncoding::json) return json_messages::read_camera_info(message);
  MessageReader in(encoding, message);
  in.header();
  CameraInfo info;
  info.height = in.u32();
  info.width = in.u32();
  info.distortion = in.text();
  const std::uint32_t count = in.u32();
  if (count > 64) return std::nullopt;
  info.d.resize(count);
  for (double& x : info.d) x = in.f64();
  for (double& x : info.k) x = in.f64();
  if (!in.good()) return std::nullopt;
  return model_of(info);
}

}  // namespace takt
