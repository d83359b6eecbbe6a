// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/message_writer.h"

#include <fmt/core.h>

#include <array>
#include <limits>
#include <stdexcept>

#include "takt/error.h"
#include "takt/recording/byte_edit.h"

namespace takt {

namespace {

constexpr const char* frame_id = "takt";

/// The mirror of MessageReader.
class Writer {
 public:
  explicit Writer(MessageEncoding encoding) : cdr_(encoding == MessageEncoding::cdr) {
    if (cdr_) append(out_, std::uint32_t{0x0100});  // little-endian
  }

  template <class T>
  void put(T value) {
    if (cdr_)
      while ((out_.size() - 4) % sizeof value != 0) out_.push_back(std::byte{0});
    append(out_, value);
  }
  void doubles(std::span<const double> values) {
    for (const double x : values) put(x);
  }
  void text(std::string_view s) {
    put(static_cast<std::uint32_t>(s.size() + (cdr_ ? 1 : 0)));
    append(out_, std::as_bytes(std::span(s)));
    if (cdr_) out_.push_back(std::byte{0});
  }
  void header(Stamp stamp) {
    constexpr std::int64_t second_ns = 1'000'000'000;
    std::int64_t s = to_ns(stamp) / second_ns, ns = to_ns(stamp) % second_ns;
    if (ns < 0) ns += second_ns, --s;
    const bool fits =
        cdr_ ? s >= std::numeric_limits<std::int32_t>::min() && s <= std::numeric_limits<std::int32_t>::max()
             : s >= 0 && s <= std::numeric_limits<std::uint32_t>::max();
    if (!fits)
      throw Error(fmt::format("its stamp, {} ns, does not fit", to_ns(stamp)), "a message",
                  "convert to an ASL folder, which takes every stamp");
    if (!cdr_) put(std::uint32_t{0});  // seq
    put(static_cast<std::uint32_t>(s));
    put(static_cast<std::uint32_t>(ns));
    text(frame_id);
  }
  MessageBytes& bytes() { return out_; }

 private:
  bool cdr_;
  MessageBytes out_;
};

constexpr std::string_view ros1_header = "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
constexpr std::string_view ros2_header =
    "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    "================================================================================\n"
    "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
constexpr std::string_view between =
    "================================================================================\n";

/// Arrays and lists are spelt alike in both; ROS 2 has small names where ROS 1 has capitals in CameraInfo.
struct Type {
  std::string_view name, md5, fields, parts;
};
constexpr std::array<Type, 4> types{{
    {"sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2",
     "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\ngeometry_msgs/Vector3 "
     "angular_velocity\nfloat64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\nfloat64[9] "
     "linear_acceleration_covariance\n",
     "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
     "================================================================================\n"
     "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"},
    {"sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743",
     "uint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n", ""},
    {"sensor_msgs/CompressedImage", "8f7a12909da2c9d3332d540a0977563f", "string format\nuint8[] data\n", ""},
    {"sensor_msgs/CameraInfo", "c9a58c1b0b154e0e6da7578cb991d214",
     "uint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] K\nfloat64[9] R\nfloat64[12] "
     "P\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
     "MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool "
     "do_rectify\n"},
}};

const Type& type_named(std::string_view name) {
  for (const Type& t : types)
    if (t.name == name) return t;
  throw std::logic_error("no message type " + std::string(name));
}

}  // namespace

MessageBytes imu_message(MessageEncoding encoding, Stamp stamp, const Vec3& w, const Vec3* a) {
  constexpr std::array<double, 9> unknown{}, not_measured{-1};
  const Vec3 accel = a ? *a : Vec3::Zero();
  Writer out(encoding);
  out.header(stamp);
  out.doubles(std::array{0.0, 0.0, 0.0, 1.0});
  out.doubles(not_measured);
  out.doubles(std::array{w.x(), w.y(), w.z()});
  out.doubles(unknown);
  out.doubles(std::array{accel.x(), accel.y(), accel.z()});
  out.doubles(a ? unknown : not_measured);
  return std::move(out.bytes());
}

namespace {

/// An Image's fields before its pixels, and how many bytes these have.
void image_head(Writer& out, const RawPicture& p, std::uint32_t bytes) {
  out.put(p.height);
  out.put(p.width);
  out.text(p.encoding);
  out.put(std::uint8_t{p.big_endian});
  out.put(p.stride);
  out.put(bytes);
}

}  // namespace

MessageBytes image_message(MessageEncoding encoding, Stamp stamp, const GrayImage& image) {
  const auto width = static_cast<std::uint32_t>(image.width), height = static_cast<std::uint32_t>(image.height);
  Writer out(encoding);
  out.header(stamp);
  image_head(out, {.width = width, .height = height, .stride = width, .encoding = "mono8", .pixels = {}},
             width * height);
  for (int y = 0; y < image.height; ++y) append(out.bytes(), std::as_bytes(std::span(image.row(y), width)));
  return std::move(out.bytes());
}

MessageBytes image_message(MessageEncoding encoding, Stamp stamp, const StoredPicture& picture) {
  Writer out(encoding);
  out.header(stamp);
  if (const auto* const encoded = std::get_if<EncodedPicture>(&picture)) {
    out.text(encoded->format);
    out.put(static_cast<std::uint32_t>(encoded->bytes.size()));
    append(out.bytes(), encoded->bytes);
  } else {
    const RawPicture& raw = std::get<RawPicture>(picture);
    image_head(out, raw, static_cast<std::uint32_t>(raw.pixels.size()));
    append(out.bytes(), raw.pixels);
  }
  return std::move(out.bytes());
}

bool has_camera_info(const CameraModel& model) {
  return model.projection == Projection::pinhole && model.distortion != Distortion::fov;
}

MessageBytes camera_info_message(MessageEncoding encoding, Stamp stamp, const CameraModel& m) {
  const bool fisheye = m.distortion == Distortion::equidistant;
  Writer out(encoding);
  out.header(stamp);
  out.put(static_cast<std::uint32_t>(m.height));
  out.put(static_cast<std::uint32_t>(m.width));
  out.text(fisheye ? "equidistant" : "plumb_bob");
  out.put(fisheye ? std::uint32_t{4} : std::uint32_t{5});
  out.doubles(m.distortion == Distortion::none ? std::array<double, 4>{} : m.coeffs);
  if (!fisheye) out.put(0.0);  // k3
  out.doubles(std::array{m.fx, 0.0, m.cx, 0.0, m.fy, m.cy, 0.0, 0.0, 1.0});
  out.doubles(std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  out.doubles(std::array{m.fx, 0.0, m.cx, 0.0, 0.0, m.fy, m.cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  for (int i = 0; i < 6; ++i) out.put(std::uint32_t{0});  // binning, and a region of interest that is all
  out.put(std::uint8_t{0});
  return std::move(out.bytes());
}

std::string message_definition(MessageEncoding encoding, std::string_view type) {
  const Type& t = type_named(type);
  const bool ros1 = encoding == MessageEncoding::ros1;
  std::string fields(t.fields);
  if (!ros1)
    for (const char* name : {" D\n", " K\n", " R\n", " P\n"})
      if (const std::size_t at = fields.find(name); at != std::string::npos)
        fields[at + 1] = static_cast<char>(fields[at + 1] + ('a' - 'A'));
  std::string out = "std_msgs/Header header\n" + fields;
  out += between;
  out += ros1 ? ros1_header : ros2_header;
  if (t.parts.empty()) return out;
  out += between;
  out += t.parts;
  return out;
}

std::string_view ros1_md5(std::string_view type) {
  return type_named(type).md5;
}

}  // namespace takt
