// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/message_streams.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <set>

#include "takt/error.h"
#include "takt/recording/raw_picture.h"
#include "takt/recording/sensor_messages.h"

namespace takt {

namespace {

const char* const ros_clock = "ros";
using Bytes = MessageFile::Bytes;

/// One camera topic while the file is read.
struct CameraTopic {
  Channel channel;
  std::vector<Stamp> stamps, arrivals;
  std::vector<MessagePlace> places;
  std::set<std::string, std::less<>> unknown_encodings;
  std::uint32_t rows = 0;
};

/// Pictures of one topic. The chunk in use is kept, so that frames in a row decompress it once.
class MessageFrames : public FrameReader, public KeepsStored {
 public:
  MessageFrames(std::shared_ptr<const MessageFile> file, std::shared_ptr<const CameraTopic> topic)
      : file_(std::move(file)), topic_(std::move(topic)) {}

  std::optional<Frame> next() override {
    while (index_ < topic_->places.size()) {
      const std::size_t index = index_++;
      last_ = bytes_of(topic_->places[index]);
      const auto& [owner, data] = last_;
      GrayImage image = owner ? read_image(topic_->channel, data, owner) : GrayImage{};
      if (!image.empty()) return Frame{index, topic_->stamps[index], 0, std::move(image)};
      ++broken_;
    }
    return std::nullopt;
  }
  void skip_to(std::size_t index) override { index_ = std::max(index_, index); }
  [[nodiscard]] std::optional<StoredPicture> stored() const override {
    return read_stored_picture(topic_->channel, last_.second);
  }

 private:
  /// What holds the message's bytes, and the bytes.
  using Held = std::pair<std::shared_ptr<const Bytes>, std::span<const std::byte>>;
  Held bytes_of(const MessagePlace& place) {
    if (!place.chunk) {
      const auto data = file_->message(place);
      return {data, data ? std::span<const std::byte>(*data) : std::span<const std::byte>{}};
    }
    if (!chunk_ || chunk_at_ != *place.chunk) {
      chunk_.reset();
      last_ = {};
      chunk_ = file_->chunk(*place.chunk);
      chunk_at_ = *place.chunk;
    }
    if (!chunk_ || place.offset + place.size > chunk_->size()) return {};
    return {chunk_, std::span<const std::byte>(*chunk_).subspan(place.offset, place.size)};
  }

  std::shared_ptr<const MessageFile> file_;
  std::shared_ptr<const CameraTopic> topic_;
  std::size_t index_ = 0;
  std::shared_ptr<const Bytes> chunk_;
  std::uint64_t chunk_at_ = 0;
  Held last_;
};

std::string printable(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
  return text;
}

void say_zero_stamps(const std::string& name, const std::vector<Stamp>& stamps, std::vector<std::string>& notes) {
  const auto zeros = std::count(stamps.begin(), stamps.end(), Stamp{});
  if (zeros > 0)
    notes.push_back(fmt::format("{}: {} of {} messages have header.stamp 0: its driver does not stamp", name, zeros,
                                stamps.size()));
}

/// Collects the streams while the messages go by.
class Collector {
 public:
  std::uint64_t wants(const Channel& channel) {
    types_.insert(channel.type);
    switch (sensor_message(channel)) {
      case SensorMessage::none:
        return 0;
      case SensorMessage::image:
      case SensorMessage::compressed_image:
        return channel.encoding == MessageEncoding::json ? whole_message : image_head_bytes;
      case SensorMessage::imu:
      case SensorMessage::camera_info:
        break;
    }
    return whole_message;
  }

  void see(const Message& m) {
    bool good = true;
    switch (sensor_message(m.channel)) {
      case SensorMessage::none:
        break;
      case SensorMessage::imu:
        good = see_imu(m);
        break;
      case SensorMessage::image:
      case SensorMessage::compressed_image:
        good = see_picture(m);
        break;
      case SensorMessage::camera_info:
        see_camera_info(m);
        break;
    }
    if (!good) ++broken_;
  }

  Recording finish(const std::shared_ptr<const MessageFile>& file) {
    Recording r;
    for (const std::string& topic : order_) {
      if (const auto imu = imus_.find(topic); imu != imus_.end()) r.imus.push_back(finish_imu(imu->second, r.notes));
      if (const auto cam = cameras_.find(topic); cam != cameras_.end())
        r.cameras.push_back(finish_camera(topic, std::move(cam->second), file, r.notes));
    }
    if (broken_ > 0) r.notes.push_back(fmt::format("{} messages are broken and were passed over", broken_));
    return r;
  }

  [[nodiscard]] std::string types() const {
    std::string all;
    for (const std::string& type : types_) all += (all.empty() ? "" : ", ") + printable(type.substr(0, 64));
    return all;
  }

 private:
  struct ImuTopic {
    ImuStream stream;
    bool has_accel = true;
  };

  bool see_imu(const Message& m) {
    const auto message = read_imu(m.channel.encoding, m.head);
    if (!message) return false;
    const auto [found, is_new] = imus_.try_emplace(m.channel.topic);
    if (is_new) order_.push_back(m.channel.topic);
    ImuStream& imu = found->second.stream;
    imu.name = m.channel.topic;
    imu.stamps.push_back(message->stamp);
    imu.arrivals.push_back(m.recorded);
    imu.gyro_rad_s.push_back(message->gyro_rad_s);
    imu.accel_m_s2.push_back(message->accel_m_s2);
    found->second.has_accel = found->second.has_accel && message->has_accel;
    return true;
  }

  bool see_picture(const Message& m) {
    const auto head = read_image_head(m.channel, m.head);
    if (!head) return false;
    const auto [found, is_new] = cameras_.try_emplace(m.channel.topic);
    if (is_new) order_.push_back(m.channel.topic);
    CameraTopic& camera = found->second;
    if (is_new) camera.channel = m.channel;
    camera.stamps.push_back(head->stamp);
    camera.arrivals.push_back(m.recorded);
    camera.places.push_back(m.place);
    if (head->rows > 0) camera.rows = head->rows;
    if (!head->encoding.empty() && !is_known_encoding(head->encoding) && camera.unknown_encodings.size() < 4)
      camera.unknown_encodings.emplace(head->encoding.substr(0, 32));
    return true;
  }

  void see_camera_info(const Message& m) {
    const std::string place = name_space(m.channel.topic);
    if (models_.contains(place)) return;
    models_[place] = read_camera_info(m.channel.encoding, m.head);
  }

  static ImuStream finish_imu(ImuTopic& topic, std::vector<std::string>& notes) {
    topic.stream.clock = ros_clock;
    if (!topic.has_accel) topic.stream.accel_m_s2.clear();
    say_zero_stamps(topic.stream.name, topic.stream.stamps, notes);
    return std::move(topic.stream);
  }

  CameraStream finish_camera(const std::string& name, CameraTopic topic, const std::shared_ptr<const MessageFile>& file,
                             std::vector<std::string>& notes) const {
    CameraStream camera;
    camera.name = name;
    camera.clock = ros_clock;
    camera.stamps = topic.stamps;
    camera.arrivals = std::move(topic.arrivals);
    if (const auto found = models_.find(name_space(name)); found != models_.end()) {
      if (found->second)
        camera.model = found->second->model;
      else
        notes.push_back(name + ": its camera_info has no intrinsics or a model that takt does not have");
      if (found->second && found->second->off_px > 0)
        notes.push_back(
            fmt::format("{}: k3 of its camera_info was put into k1 and k2 (at most {:.2g} px off in a corner)", name,
                        found->second->off_px));
    }
    camera.timing.rows = camera.model ? camera.model->height : static_cast<int>(std::min(topic.rows, 65535U));
    for (const std::string& encoding : topic.unknown_encodings)
      notes.push_back(fmt::format("{}: pictures of encoding '{}' cannot be decoded", name, printable(encoding)));
    notes.push_back(name + ": ROS does not say which instant of the exposure is stamped; the middle is taken");
    say_zero_stamps(name, camera.stamps, notes);
    camera.open = [file, shared = std::make_shared<const CameraTopic>(std::move(topic))] {
      return std::make_unique<MessageFrames>(file, shared);
    };
    return camera;
  }

  std::vector<std::string> order_;  // of first appearance
  std::map<std::string, ImuTopic> imus_;
  std::map<std::string, CameraTopic> cameras_;
  std::map<std::string, std::optional<CameraInfoModel>> models_;  // by name space
  std::set<std::string> types_;
  std::size_t broken_ = 0;
};

}  // namespace

Recording message_streams(const std::shared_ptr<const MessageFile>& file, const std::string& path,
                          const std::string& repair) {
  Collector collector;
  const std::vector<std::string> damage =
      file->visit([&](const Channel& c) { return collector.wants(c); }, [&](const Message& m) { collector.see(m); });
  Recording recording = collector.finish(file);
  recording.files = {path};
  recording.notes.insert(recording.notes.begin(), damage.begin(), damage.end());
  if (!recording.imus.empty() || !recording.cameras.empty()) return recording;
  if (!damage.empty()) throw Error("nothing could be read: " + damage.front(), path, repair);
  const std::string types = collector.types();
  if (types.empty()) throw Error("has no messages", path, "check that recording went well");
  if (!recording.notes.empty()) throw Error("nothing could be read: " + recording.notes.front(), path, repair);
  throw Error("has neither IMU nor camera messages, only " + types, path,
              "record sensor_msgs/Imu, Image or CompressedImage");
}

}  // namespace takt
