// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/ros1_bag.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <set>

#include "takt/error.h"
#include "takt/recording/byte_cursor.h"
#include "takt/recording/picture.h"
#include "takt/recording/raw_picture.h"
#include "takt/recording/ros1_container.h"

namespace takt {

namespace {

const char* const ros_clock = "ros";
const char* const imu_type = "sensor_msgs/Imu";
const char* const image_type = "sensor_msgs/Image";
const char* const compressed_type = "sensor_msgs/CompressedImage";
const char* const camera_info_type = "sensor_msgs/CameraInfo";

/// std_msgs/Header; its stamp.
Stamp read_header(ByteCursor& in) {
  in.u32();  // seq
  const std::int64_t s = in.u32(), ns = in.u32();
  in.text(in.u32());  // frame_id
  return from_ns(s * 1'000'000'000 + ns);
}

Vec3 read_vector(ByteCursor& in) {
  const double x = in.f64(), y = in.f64(), z = in.f64();
  return {x, y, z};
}

struct ImuMessage {
  Stamp stamp;
  Vec3 gyro_rad_s, accel_m_s2;
  bool has_accel;
};

std::optional<ImuMessage> read_imu(std::span<const std::byte> data) {
  constexpr std::uint64_t covariance = 9 * sizeof(double);
  ByteCursor in(data);
  ImuMessage m{};
  m.stamp = read_header(in);
  in.bytes(4 * sizeof(double) + covariance);  // orientation
  m.gyro_rad_s = read_vector(in);
  in.bytes(covariance);
  m.accel_m_s2 = read_vector(in);
  m.has_accel = in.f64() != -1;  // the message's own sign for "not measured"
  in.bytes(covariance - sizeof(double));
  if (!in.good()) return std::nullopt;
  return m;
}

RawPicture read_raw_picture(ByteCursor& in) {
  RawPicture p;
  p.height = in.u32();
  p.width = in.u32();
  p.encoding = in.text(in.u32());
  const bool big_endian = in.u8() != 0;
  static_cast<void>(big_endian);  // of no meaning for 8-bit pixels
  p.stride = in.u32();
  p.pixels = in.bytes(in.u32());
  return p;
}

std::optional<CameraModel> read_camera_info(std::span<const std::byte> data) {
  ByteCursor in(data);
  read_header(in);
  CameraModel model;
  const std::uint32_t height = in.u32(), width = in.u32();
  const std::string_view distortion = in.text(in.u32());
  std::vector<double> d(std::min<std::uint32_t>(in.u32(), 16));
  for (double& x : d) x = in.f64();
  std::array<double, 9> k{};
  for (double& x : k) x = in.f64();
  if (!in.good() || height == 0 || width == 0 || height > 65535 || width > 65535) return std::nullopt;
  model.width = static_cast<int>(width);
  model.height = static_cast<int>(height);
  model.fx = k[0], model.cx = k[2], model.fy = k[4], model.cy = k[5];
  if (!(model.fx > 0) || !(model.fy > 0)) return std::nullopt;  // an uncalibrated camera says 0
  const bool four = d.size() >= 4 && std::all_of(d.begin() + 4, d.end(), [](double x) { return x == 0; });
  const bool none = std::all_of(d.begin(), d.end(), [](double x) { return x == 0; });
  if (none) return model;
  if (!four || (distortion != "plumb_bob" && distortion != "equidistant" && distortion != "fisheye"))
    return std::nullopt;
  model.distortion = distortion == "plumb_bob" ? Distortion::radtan : Distortion::equidistant;
  std::copy_n(d.begin(), 4, model.coeffs.begin());
  return model;
}

/// One camera topic while the bag is read.
struct CameraTopic {
  bool compressed = false;
  std::vector<Stamp> stamps;
  std::vector<Ros1Place> places;
  std::set<std::string, std::less<>> unknown_encodings;
  std::uint32_t rows = 0;
};

/// Pictures of one topic. The chunk in use is kept, so that frames in a row decompress it once.
class BagFrames : public FrameReader {
 public:
  BagFrames(std::shared_ptr<const Ros1Container> bag, std::shared_ptr<const CameraTopic> topic)
      : bag_(std::move(bag)), topic_(std::move(topic)) {}

  std::optional<Frame> next() override {
    while (index_ < topic_->places.size()) {
      const std::size_t index = index_++;
      GrayImage image = decode(topic_->places[index]);
      if (!image.empty()) return Frame{index, topic_->stamps[index], 0, std::move(image)};
      ++broken_;
    }
    return std::nullopt;
  }
  void skip_to(std::size_t index) override { index_ = std::max(index_, index); }

 private:
  using Bytes = std::vector<std::byte>;

  /// What holds the message's bytes, and the bytes.
  std::pair<std::shared_ptr<const Bytes>, std::span<const std::byte>> bytes_of(const Ros1Place& place) {
    if (!place.chunk) {
      auto data = std::make_shared<Bytes>(place.size);
      if (!bag_->bytes().read(place.offset, *data)) return {};
      return {data, *data};
    }
    if (!chunk_ || chunk_at_ != *place.chunk) {
      chunk_.reset();
      chunk_ = bag_->chunk(*place.chunk);
      chunk_at_ = *place.chunk;
    }
    if (!chunk_ || place.offset + place.size > chunk_->size()) return {};
    return {chunk_, std::span<const std::byte>(*chunk_).subspan(place.offset, place.size)};
  }

  GrayImage decode(const Ros1Place& place) {
    const auto [owner, data] = bytes_of(place);
    ByteCursor in(data);
    read_header(in);
    if (!topic_->compressed) {
      const RawPicture picture = read_raw_picture(in);
      return in.good() ? to_gray(picture, owner) : GrayImage{};
    }
    in.text(in.u32());  // format: the bytes say it themselves
    const auto encoded = in.bytes(in.u32());
    return in.good() ? decode_picture(encoded) : GrayImage{};
  }

  std::shared_ptr<const Ros1Container> bag_;
  std::shared_ptr<const CameraTopic> topic_;
  std::size_t index_ = 0;
  std::shared_ptr<const Bytes> chunk_;
  std::uint64_t chunk_at_ = 0;
};

/// "/cam0/image_raw/compressed" and "/cam0/camera_info" share "/cam0".
std::string name_space(std::string topic) {
  if (topic.ends_with("/compressed")) topic.resize(topic.rfind('/'));
  return topic.substr(0, topic.rfind('/'));
}

/// Collects the streams while the messages go by.
class Collector {
 public:
  void see(const Ros1Message& m) {
    ++messages_;
    const std::string& type = m.connection.type;
    bool good = true;
    if (type == imu_type) good = see_imu(m);
    if (type == image_type || type == compressed_type) good = see_picture(m, type == compressed_type);
    if (type == camera_info_type) see_camera_info(m);
    if (!good) ++broken_;
    ++types_[type];
  }

  Recording finish(const std::shared_ptr<const Ros1Container>& bag) {
    Recording r;
    for (const std::string& topic : order_) {
      if (const auto imu = imus_.find(topic); imu != imus_.end()) r.imus.push_back(finish_imu(imu->second, r.notes));
      if (const auto cam = cameras_.find(topic); cam != cameras_.end())
        r.cameras.push_back(finish_camera(topic, std::move(cam->second), bag, r.notes));
    }
    if (broken_ > 0) r.notes.push_back(fmt::format("{} messages are broken and were passed over", broken_));
    return r;
  }

  [[nodiscard]] std::size_t messages() const { return messages_; }
  [[nodiscard]] std::string types() const {
    std::string all;
    for (const auto& [type, count] : types_) all += (all.empty() ? "" : ", ") + printable(type.substr(0, 64));
    return all;
  }

 private:
  struct ImuTopic {
    ImuStream stream;
    bool has_accel = true;
  };

  bool see_imu(const Ros1Message& m) {
    const auto message = read_imu(m.data);
    if (!message) return false;
    const auto [found, is_new] = imus_.try_emplace(m.connection.topic);
    if (is_new) order_.push_back(m.connection.topic);
    ImuStream& imu = found->second.stream;
    imu.name = m.connection.topic;
    imu.stamps.push_back(message->stamp);
    imu.gyro_rad_s.push_back(message->gyro_rad_s);
    imu.accel_m_s2.push_back(message->accel_m_s2);
    found->second.has_accel = found->second.has_accel && message->has_accel;
    return true;
  }

  bool see_picture(const Ros1Message& m, bool compressed) {
    ByteCursor in(m.data);
    const Stamp stamp = read_header(in);
    if (!in.good()) return false;
    const auto [found, is_new] = cameras_.try_emplace(m.connection.topic);
    if (is_new) order_.push_back(m.connection.topic);
    CameraTopic& camera = found->second;
    camera.compressed = compressed;
    camera.stamps.push_back(stamp);
    camera.places.push_back(m.place);
    if (compressed) return true;
    const RawPicture picture = read_raw_picture(in);
    if (!in.good()) return false;  // its stamp counts; its picture will be passed over
    camera.rows = picture.height;
    if (!is_known_encoding(picture.encoding) && camera.unknown_encodings.size() < 4)
      camera.unknown_encodings.emplace(picture.encoding.substr(0, 32));
    return true;
  }

  void see_camera_info(const Ros1Message& m) {
    const std::string place = name_space(m.connection.topic);
    if (models_.contains(place)) return;
    models_[place] = read_camera_info(m.data);
  }

  static ImuStream finish_imu(ImuTopic& topic, std::vector<std::string>& notes) {
    topic.stream.clock = ros_clock;
    if (!topic.has_accel) topic.stream.accel_m_s2.clear();
    say_zero_stamps(topic.stream.name, topic.stream.stamps, notes);
    return std::move(topic.stream);
  }

  CameraStream finish_camera(const std::string& name, CameraTopic topic,
                             const std::shared_ptr<const Ros1Container>& bag, std::vector<std::string>& notes) const {
    CameraStream camera;
    camera.name = name;
    camera.clock = ros_clock;
    camera.stamps = topic.stamps;
    if (const auto found = models_.find(name_space(name)); found != models_.end()) {
      camera.model = found->second;
      if (!camera.model)
        notes.push_back(name + ": its camera_info has no intrinsics or a model that takt does not have");
    }
    camera.timing.rows = camera.model ? camera.model->height : static_cast<int>(std::min(topic.rows, 65535U));
    for (const std::string& encoding : topic.unknown_encodings)
      notes.push_back(fmt::format("{}: pictures of encoding '{}' cannot be decoded", name, printable(encoding)));
    notes.push_back(name + ": ROS does not say which instant of the exposure is stamped; the middle is taken");
    say_zero_stamps(name, camera.stamps, notes);
    camera.open = [bag, shared = std::make_shared<const CameraTopic>(std::move(topic))] {
      return std::make_unique<BagFrames>(bag, shared);
    };
    return camera;
  }

  static void say_zero_stamps(const std::string& name, const std::vector<Stamp>& stamps,
                              std::vector<std::string>& notes) {
    const auto zeros = std::count(stamps.begin(), stamps.end(), Stamp{});
    if (zeros > 0)
      notes.push_back(fmt::format("{}: {} of {} messages have header.stamp 0: its driver does not stamp", name, zeros,
                                  stamps.size()));
  }

  static std::string printable(std::string text) {
    for (char& c : text)
      if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
    return text;
  }

  std::vector<std::string> order_;  // of first appearance
  std::map<std::string, ImuTopic> imus_;
  std::map<std::string, CameraTopic> cameras_;
  std::map<std::string, std::optional<CameraModel>> models_;  // by name space
  std::map<std::string, std::size_t> types_;
  std::size_t messages_ = 0;
  std::size_t broken_ = 0;
};

}  // namespace

bool looks_like_ros1_bag(const std::string& path) {
  const std::string head = file_head(path, 16);
  return is_ros1_bag(head) || (path.ends_with(".bag") && !head.empty());
}

Recording read_ros1_bag(const std::string& path, const OpenOptions&) {
  return read_ros1_bag(open_bytes(path), path);
}

Recording read_ros1_bag(std::shared_ptr<const ByteSource> bytes, const std::string& path) {
  const auto bag = std::make_shared<const Ros1Container>(std::move(bytes), path);
  Collector collector;
  const std::vector<std::string> damage = bag->visit([&](const Ros1Message& m) { collector.see(m); });
  Recording recording = collector.finish(bag);
  recording.files = {path};
  recording.notes.insert(recording.notes.begin(), damage.begin(), damage.end());
  if (!recording.imus.empty() || !recording.cameras.empty()) return recording;
  if (!damage.empty())
    throw Error("nothing could be read: " + damage.front(), path, "copy the bag again, or try `rosbag reindex`");
  if (collector.messages() == 0) throw Error("the bag has no messages", path, "check that recording went well");
  throw Error("the bag has neither IMU nor camera messages, only " + collector.types(), path,
              "record sensor_msgs/Imu, Image or CompressedImage");
}

}  // namespace takt
