// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gopro.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>

#include "takt/error.h"
#include "takt/recording/libav.h"
#include "takt/recording/mp4_box.h"
#include "takt/recording/video_reader.h"

namespace takt {

namespace {

/// "zxY" -> the rows X Y Z out of the columns; nothing unless each axis occurs once.
std::optional<Mat3> signed_permutation(const std::string& letters) {
  if (letters.size() != 3) return std::nullopt;
  Mat3 m = Mat3::Zero();
  for (int column = 0; column < 3; ++column) {
    const char c = letters[static_cast<std::size_t>(column)];
    const int axis = std::tolower(static_cast<unsigned char>(c)) - 'x';
    if (axis < 0 || axis > 2 || !m.row(axis).isZero()) return std::nullopt;
    m(axis, column) = std::isupper(static_cast<unsigned char>(c)) != 0 ? 1 : -1;
  }
  return m;
}

/// "Gyroscope (z,x,y)" -> "ZXY"; empty where the name says nothing.
std::string letters_in_name(const std::string& name) {
  const auto open = name.find('(');
  if (open == std::string::npos) return {};
  std::string letters;
  for (std::size_t i = open + 1; i < name.size() && name[i] != ')'; ++i)
    if (name[i] != ',') letters += static_cast<char>(std::toupper(static_cast<unsigned char>(name[i])));
  return signed_permutation(letters) ? letters : std::string();
}

std::vector<Vec3> body_vectors(const TelemetryTable& table) {
  const Mat3 turn = stored_axes(table.head).body_from_stored;
  std::vector<Vec3> out;
  out.reserve(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i) out.push_back(turn * Vec3(table.row(i)));
  return out;
}

/// Values at the instants `wanted`, straight between samples, held beyond the ends.
std::vector<Vec3> interpolated(const std::vector<Stamp>& stamps, const std::vector<Vec3>& values,
                               const std::vector<Stamp>& wanted) {
  std::vector<Vec3> out;
  out.reserve(wanted.size());
  for (const Stamp t : wanted) {
    const auto after = std::upper_bound(stamps.begin(), stamps.end(), t);
    if (after == stamps.begin()) {
      out.push_back(values.front());
    } else if (after == stamps.end()) {
      out.push_back(values.back());
    } else {
      const auto i = static_cast<std::size_t>(after - stamps.begin());
      const double along = to_seconds(t - stamps[i - 1]) / to_seconds(stamps[i] - stamps[i - 1]);
      out.push_back((1 - along) * values[i - 1] + along * values[i]);
    }
  }
  return out;
}

std::optional<ImuStream> imu_of(const Telemetry& telemetry, std::vector<std::string>& notes) {
  const auto gyro = telemetry.table("GYRO", 3);
  if (!gyro) return std::nullopt;
  ImuStream imu;
  imu.name = "GYRO";
  imu.clock = "media time";
  imu.stamps = gyro->stamps;
  imu.gyro_rad_s = body_vectors(*gyro);
  notes.push_back(gyro->note);
  notes.push_back("GYRO: " + stored_axes(gyro->head).words);
  if (const std::string& unit = gyro->head.unit; !unit.empty() && unit != "rad/s")
    notes.push_back(fmt::format("GYRO: its unit is given as {}, rad/s is assumed", unit));

  const auto accel = telemetry.table("ACCL", 3);
  if (!accel) {
    notes.push_back("no accelerometer (ACCL)");
  } else if (accel->stamps == gyro->stamps) {
    imu.accel_m_s2 = body_vectors(*accel);
  } else if (!std::is_sorted(accel->stamps.begin(), accel->stamps.end())) {
    notes.push_back("ACCL is left out: its stamps run backward");
  } else {
    imu.accel_m_s2 = interpolated(accel->stamps, body_vectors(*accel), imu.stamps);
    notes.push_back(accel->note + "; interpolated to the instants of GYRO");
  }
  return imu;
}

/// Stored as w, x, z, y (gpmf-parser issue 180; with this order CORI's rate equals GYRO's on all three axes).
std::optional<AttitudeStream> attitude_of(const Telemetry& telemetry, const char* key,
                                          std::vector<std::string>& notes) {
  const auto table = telemetry.table(key, 4);
  if (!table) return std::nullopt;
  AttitudeStream attitude;
  attitude.name = key;
  attitude.clock = "media time";
  for (std::size_t i = 0; i < table->rows(); ++i) {
    const double* q = table->row(i);
    const Quat turn(q[0], q[1], q[3], q[2]);
    if (!(turn.norm() > 0.5)) continue;  // an unfilled sample
    attitude.stamps.push_back(table->stamps[i]);
    attitude.world_from_body.push_back(turn.normalized());
  }
  notes.push_back(table->note);
  return attitude;
}

/// The exposure of each frame: that of the nearest sample, less than a frame away; 0, unknown, where there is none.
std::vector<double> exposures_of(const TelemetryTable& shut, const std::vector<Stamp>& frames,
                                 std::vector<std::string>& notes) {
  if (frames.size() < 2) return {};
  const Duration frame = (frames.back() - frames.front()) / static_cast<std::int64_t>(frames.size() - 1);
  std::vector<double> out;
  std::size_t missing = 0, at = 0;
  for (const Stamp t : frames) {
    const auto distance = [&](std::size_t i) { return std::abs((shut.stamps[i] - t).count()); };
    while (at + 1 < shut.rows() && distance(at + 1) <= distance(at)) ++at;
    const double exposure_s = *shut.row(at);
    const bool known = distance(at) < frame.count() * 6 / 10 && exposure_s > 0 && exposure_s < 60;
    out.push_back(known ? exposure_s : 0);
    missing += !known;
  }
  notes.push_back(shut.note);
  if (missing > 0)
    notes.push_back(fmt::format("SHUT: the exposure of {} of {} frames is not given", missing, out.size()));
  return out;
}

void note_stabilisation(const AttitudeStream& image_against_body, std::vector<std::string>& notes) {
  double largest = 0;
  for (const Quat& q : image_against_body.world_from_body) largest = std::max(largest, Eigen::AngleAxisd(q).angle());
  const double degrees = largest * 180 / std::numbers::pi;
  if (degrees > 0.5)
    notes.push_back(fmt::format(
        "the picture is stabilised in the camera: IORI turns it by up to {:.1f} degrees against the body that GYRO is "
        "fixed to",
        degrees));
}

/// What the camera wrote once for the whole file (moov/udta/GPMF), as far as it matters for time.
struct Settings {
  std::optional<double> readout_s;           ///< SROT, in ms there
  std::optional<double> diagonal_fov_deg;    ///< ZFOV
  std::optional<std::string> stabilisation;  ///< EISA, where EISE says that it was on
};

Settings settings_of(const std::string& path) {
  constexpr std::array<std::string_view, 3> place{"moov", "udta", "GPMF"};
  const std::vector<std::byte> bytes = mp4_box(path, place);
  const gpmf::Payload payload = gpmf::parse(bytes);
  Settings settings;
  std::string stabilised;
  for (const gpmf::Item& device : payload.items)
    for (const gpmf::Item& item : device.children) {
      const auto number = [&item]() -> std::optional<double> {
        const auto n = gpmf::numbers(item);
        return n && n->values.size() == 1 ? std::optional(n->values[0]) : std::nullopt;
      };
      if (item.key == "SROT") settings.readout_s = number();
      if (item.key == "ZFOV") settings.diagonal_fov_deg = number();
      if (item.key == "EISE") stabilised = gpmf::text(item);
      if (item.key == "EISA") settings.stabilisation = gpmf::text(item);
    }
  if (settings.readout_s) *settings.readout_s *= 1e-3;
  if (settings.readout_s && !(*settings.readout_s > 0 && *settings.readout_s < 1)) settings.readout_s.reset();
  if (stabilised != "Y") settings.stabilisation.reset();
  return settings;
}

/// The stamp of CORI is the frame's start by GoPro's word, and so is then the frame's own presentation time.
void time_frames(CameraStream& camera, const Settings& settings, std::vector<std::string>& notes) {
  camera.timing.instant = ExposureInstant::start;
  camera.timing.row = RowReference::first;
  camera.timing.shutter = Shutter::rolling;
  notes.push_back("a frame's stamp is taken as the start of the exposure of its first row");
  if (settings.readout_s) {
    camera.timing.readout_s = *settings.readout_s;
    notes.push_back(
        fmt::format("rolling shutter: the camera gives a readout of {:.2f} ms (SROT)", *settings.readout_s * 1e3));
  }
  if (settings.diagonal_fov_deg)
    notes.push_back(
        fmt::format("the camera gives a diagonal field of view of {:.1f} degrees (ZFOV)", *settings.diagonal_fov_deg));
  if (settings.stabilisation)
    notes.push_back(fmt::format("the camera's stabilisation was on ({})", *settings.stabilisation));
}

}  // namespace

StoredAxes stored_axes(const gpmf::Stream& stream) {
  if (const auto m = signed_permutation(stream.stored_axes))
    return {*m, fmt::format("axes stored as {} (ORIN; lower case is negative)", stream.stored_axes)};
  if (stream.matrix.size() == 9) {
    const std::string letters = stream.output_axes.empty() ? "ZXY" : stream.output_axes;
    const Mat3 turn = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(stream.matrix.data());
    if (const auto m = signed_permutation(letters); m && turn.allFinite() && std::abs(turn.determinant()) > 0.5)
      return {*m * turn, fmt::format("axes turned by MTRX to {}", letters)};
  }
  if (const std::string letters = letters_in_name(stream.name); !letters.empty())
    return {*signed_permutation(letters), fmt::format("axes stored as {} (said by the stream's name)", letters)};
  return {*signed_permutation("ZXY"), "axes taken as stored in the order Z X Y: the camera does not say"};
}

Recording read_telemetry(const Telemetry& telemetry) {
  Recording recording;
  recording.notes = telemetry.notes();
  if (auto imu = imu_of(telemetry, recording.notes)) recording.imus.push_back(std::move(*imu));
  for (const char* key : {"CORI", "IORI"})
    if (auto attitude = attitude_of(telemetry, key, recording.notes)) {
      if (attitude->name == "IORI") note_stabilisation(*attitude, recording.notes);
      recording.attitudes.push_back(std::move(*attitude));
    }
  return recording;
}

bool is_gopro(const std::string& path) {
  if (!is_video(path)) return false;
  try {
    return av::gpmf_stream(*av::open_header(path)) >= 0;
  } catch (const Error&) {
    return false;
  }
}

Recording read_gopro(const std::string& path, const OpenOptions& options) {
  const auto index = std::make_shared<const MediaIndex>(index_media(path));
  const Telemetry telemetry(index->telemetry);
  Recording recording = read_telemetry(telemetry);
  if (recording.imus.empty() && recording.attitudes.empty())
    throw Error("its telemetry track holds neither GYRO nor CORI", path, "pass a gyro log beside the video");
  recording.files = {path};

  std::vector<double> exposures_s;
  if (const auto shut = telemetry.table("SHUT", 1)) exposures_s = exposures_of(*shut, index->stamps, recording.notes);
  CameraStream camera = video_camera(path, index, exposures_s, options);
  time_frames(camera, settings_of(path), recording.notes);
  recording.cameras.push_back(std::move(camera));
  recording.notes.insert(recording.notes.begin(), index->notes.begin(), index->notes.end());
  return recording;
}

}  // namespace takt
