// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/write_messages.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "takt/recording/message_writer.h"
#include "takt/recording/sensor_messages.h"
#include "takt/recording/stored_picture.h"

namespace takt {

namespace {

/// A stream that gives its messages one after the other.
class Source {
 public:
  virtual ~Source() = default;
  /// When the next message was recorded; nothing at the end.
  [[nodiscard]] virtual std::optional<Stamp> next_time() = 0;
  virtual void write_next(MessageSink& sink) = 0;
};

Stamp recorded(const std::vector<Stamp>& arrivals, const std::vector<Stamp>& stamps, std::size_t i) {
  return std::max(Stamp{}, arrivals.empty() ? stamps[i] : arrivals[i]);
}

class ImuSource : public Source {
 public:
  ImuSource(const ImuStream& imu, std::uint32_t channel) : imu_(imu), channel_(channel) {}
  std::optional<Stamp> next_time() override {
    if (i_ == imu_.size()) return std::nullopt;
    return recorded(imu_.arrivals, imu_.stamps, i_);
  }
  void write_next(MessageSink& sink) override {
    const Vec3* const accel = imu_.accel_m_s2.empty() ? nullptr : &imu_.accel_m_s2[i_];
    sink.write(channel_, *next_time(), imu_message(sink.encoding(), imu_.stamps[i_], imu_.gyro_rad_s[i_], accel));
    ++i_;
  }

 private:
  const ImuStream& imu_;
  std::uint32_t channel_;
  std::size_t i_ = 0;
};

/// Pictures go out as they are stored, colours and all, where the reader knows how that is; else in grey.
class CameraSource : public Source {
 public:
  explicit CameraSource(const CameraStream& camera) : camera_(camera), frames_(camera.open()) {
    frame_ = frames_->next();
    const auto stored = frame_ ? stored_picture(*frames_) : std::nullopt;
    encoded_ = stored && std::holds_alternative<EncodedPicture>(*stored);
  }
  /// As the first picture is, all have to be: a topic has one type.
  [[nodiscard]] bool encoded() const { return encoded_; }
  [[nodiscard]] bool any_grey() const { return any_grey_; }
  void to(std::uint32_t channel, bool info, WrittenStream& count) {
    channel_ = channel;
    info_ = info;
    written_ = &count;
  }

  std::optional<Stamp> next_time() override {
    if (!frame_) return std::nullopt;
    return recorded(camera_.arrivals, camera_.stamps, frame_->index);
  }
  void write_next(MessageSink& sink) override {
    const Stamp time = *next_time();
    const auto stored = stored_picture(*frames_);
    const bool fits = stored && std::holds_alternative<EncodedPicture>(*stored) == encoded_;
    if (fits || !encoded_) {
      sink.write(channel_, time,
                 fits ? image_message(sink.encoding(), frame_->stamp, *stored)
                      : image_message(sink.encoding(), frame_->stamp, frame_->image));
      if (info_) sink.write(channel_ + 1, time, camera_info_message(sink.encoding(), frame_->stamp, *camera_.model));
      ++written_->count;
      any_grey_ = any_grey_ || !fits;
    }
    frame_ = frames_->next();
  }

 private:
  const CameraStream& camera_;
  std::unique_ptr<FrameReader> frames_;
  std::optional<Frame> frame_;
  bool encoded_ = false, any_grey_ = false;
  std::uint32_t channel_ = 0;
  bool info_ = false;
  WrittenStream* written_ = nullptr;
};

std::string camera_topic(const std::string& name, bool encoded) {
  return (name.starts_with('/') ? name_space(name) : "/" + name) + (encoded ? "/image_raw/compressed" : "/image_raw");
}
std::string imu_topic(const std::string& name) {
  return name.starts_with('/') ? name : "/" + name;
}

}  // namespace

Written write_messages(const Recording& recording, MessageSink& sink) {
  Written out;
  out.streams.reserve(recording.imus.size() + recording.cameras.size());
  std::vector<std::unique_ptr<Source>> sources;
  std::vector<const CameraSource*> cameras;
  std::uint32_t channel = 1;
  for (const ImuStream& imu : recording.imus) {
    out.streams.push_back({imu.name, imu_topic(imu.name), imu.size()});
    sink.add_channel(out.streams.back().written, "sensor_msgs/Imu");
    sources.push_back(std::make_unique<ImuSource>(imu, channel++));
  }
  for (const CameraStream& camera : recording.cameras) {
    if (!camera.open) {
      out.notes.push_back(camera.name + " has no pictures and is left out");
      continue;
    }
    const bool info = camera.model && has_camera_info(*camera.model);
    if (camera.model && !info) out.notes.push_back(camera.name + ": a camera_info has no place for its lens");
    auto source = std::make_unique<CameraSource>(camera);
    out.streams.push_back({camera.name, camera_topic(camera.name, source->encoded()), 0});
    sink.add_channel(out.streams.back().written,
                     source->encoded() ? "sensor_msgs/CompressedImage" : "sensor_msgs/Image");
    if (info) sink.add_channel(name_space(out.streams.back().written) + "/camera_info", "sensor_msgs/CameraInfo");
    source->to(channel, info, out.streams.back());
    cameras.push_back(source.get());
    sources.push_back(std::move(source));
    channel += info ? 2 : 1;
  }
  while (true) {
    Source* first = nullptr;
    for (const auto& source : sources)
      if (source->next_time() && (!first || *source->next_time() < *first->next_time())) first = source.get();
    if (!first) break;
    first->write_next(sink);
  }
  sink.finish();
  for (std::size_t i = 0, s = recording.imus.size(); i < recording.cameras.size(); ++i) {
    if (!recording.cameras[i].open) continue;
    const std::size_t lost = recording.cameras[i].size() - out.streams[s++].count;
    if (lost > 0)
      out.notes.push_back(fmt::format("{}: {} pictures could not be decoded", recording.cameras[i].name, lost));
  }
  if (std::any_of(cameras.begin(), cameras.end(), [](const CameraSource* c) { return c->any_grey(); }))
    out.notes.emplace_back("pictures that are no JPEG, PNG or message are written in grey");
  out.notes.emplace_back("mountings, noise, exposures and what a stamp means have no place in these messages");
  return out;
}

}  // namespace takt
