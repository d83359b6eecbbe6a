// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/pendulum.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/open_in_part.h"
#include "takt/recording/yaml_fields.h"
#include "takt/workflows/dial_rig.h"
#include "takt/workflows/pick_named.h"

namespace fs = std::filesystem;

namespace takt {
namespace {

void append(std::vector<std::string>& to, const std::vector<std::string>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Streams of the job's files, and what was read.
struct Streams {
  std::vector<AngleStream> angles;
  std::vector<CameraStream> cameras;
  std::vector<ImuStream> imus;
  std::vector<UnreadableStream> unreadable;  ///< IMUs
};

void read_into(Streams& s, const std::string& path, const PendulumJob& job, PendulumOutcome& out) {
  auto [r, unreadable] = open_recording_in_part(path, job.open);
  append(out.notes, r.notes);
  append(out.files, r.files);
  std::move(r.angles.begin(), r.angles.end(), std::back_inserter(s.angles));
  std::move(r.cameras.begin(), r.cameras.end(), std::back_inserter(s.cameras));
  std::move(r.imus.begin(), r.imus.end(), std::back_inserter(s.imus));
  std::move(unreadable.begin(), unreadable.end(), std::back_inserter(s.unreadable));
}

Streams read_streams(const PendulumJob& job, PendulumOutcome& out) {
  Streams s;
  if (job.input.empty()) {
    read_into(s, job.angle_file, job, out);
    read_into(s, job.imu_file, job, out);
  } else {
    read_into(s, job.input, job, out);
    const std::string beside = (fs::path(job.input) / "angle.csv").string();
    if (s.angles.empty() && fs::exists(beside)) read_into(s, beside, job, out);
  }
  const std::string where = job.input.empty() ? job.angle_file : job.input;
  if (s.angles.empty() && s.cameras.empty())
    throw Error("there is neither a camera nor an angle in it", where,
                "give the dial's angles with --angle FILE (t_ns,angle_rad)");
  if (s.imus.empty())
    throw Error("there is no gyro in it", job.input.empty() ? job.imu_file : job.input, "give one with --imu FILE");
  return s;
}

/// What the stamps of the dial's frames mean.
void apply_rig_file(FrameTiming& timing, const YamlFields& rig) {
  if (rig.has("exposure_s")) timing.exposure_s = duration_s(rig, "exposure_s");
  if (const auto rows = rig.number("rows")) timing.rows = static_cast<int>(*rows);
  if (rig.has("readout_s")) timing.readout_s = duration_s(rig, "readout_s");
  timing.instant = exposure_instant(rig).value_or(timing.instant);
}

/// The IMUs that were asked for. One that cannot be read has its refusal beside the others' answers.
void pick_imus(Streams& s, const PendulumJob& job) {
  std::erase_if(s.unreadable, [&](const UnreadableStream& u) {
    return !job.reference.empty() && !name_matches(job.reference, u.name);
  });
  const bool asked_unreadable = !job.reference.empty() && !s.unreadable.empty() &&
                                std::none_of(s.imus.begin(), s.imus.end(), [&](const ImuStream& imu) {
                                  return name_matches(job.reference, imu.name);
                                });
  if (asked_unreadable) throw s.unreadable.front().why;
  s.imus = pick_named(s.imus, job.reference, "IMU", job.input);
}

/// The estimator that was asked for takes the place of the default; all stay listed.
Estimate chosen(Estimate e, const std::string& estimator) {
  if (estimator == "all" || estimator == "spline" || e.estimates.empty()) return e;
  const auto found = std::find_if(e.estimates.begin(), e.estimates.end(),
                                  [&](const Estimate& other) { return other.method == estimator; });
  Estimate one = *found;
  one.estimates = std::move(e.estimates);
  one.evidence = std::move(e.evidence);
  return one;
}

std::optional<YamlFields> read_rig_file(const PendulumJob& job, PendulumOutcome& out) {
  std::string file = job.rig_file;
  if (file.empty() && !job.input.empty()) file = (fs::path(job.input) / "rig.yaml").string();
  if (job.rig_file.empty() && !fs::exists(file)) return std::nullopt;
  out.files.push_back(file);
  return YamlFields(read_file(file), file);
}

/// A rig that cannot see its dial is the rig file's fault.
DialAngles read_view(const CameraStream& camera, const DialRig& rig, const DialView& view, const DialOptions& options,
                     const std::string& where) {
  try {
    return dial_angles(camera, rig.dial, view, options);
  } catch (const std::invalid_argument& e) {
    throw Error(e.what(), where, "correct the rig file");
  }
}

/// Whether the dial was seen to move.
bool moves(const DialAngles& read) {
  const std::vector<double>& a = read.angles.angle_rad;
  if (a.empty()) return false;
  const auto [low, high] = std::minmax_element(a.begin(), a.end());
  return *high - *low > 5 * read.pixel_rad;
}

/// A roll is easily told the wrong way round: where no dial moves in the pictures the other way is tried.
DialAngles read_dial(const CameraStream& camera, const DialRig& rig, const DialOptions& options,
                     const std::string& where) {
  DialAngles read = read_view(camera, rig, rig.view, options, where);
  if (rig.view.roll_rad == 0 || moves(read)) return read;
  DialView other = rig.view;
  other.roll_rad = -other.roll_rad;
  DialAngles turned = read_view(camera, rig, other, options, where);
  if (!moves(turned)) return read;
  turned.notes.emplace_back("the dial is there only with the other sign of roll_deg, which is used");
  return turned;
}

/// The dial's angles: as they were logged, or read from pictures.
AngleStream dial_of(Streams& streams, const std::optional<YamlFields>& rig, const PendulumJob& job,
                    PendulumOutcome& out) {
  if (!streams.angles.empty()) {
    streams.angles = pick_named(streams.angles, job.sensor, "angle", job.input);
    AngleStream dial = std::move(streams.angles.front());
    if (rig) apply_rig_file(dial.timing, *rig);
    return dial;
  }
  streams.cameras = pick_named(streams.cameras, job.sensor, "camera", job.input);
  CameraStream& camera = streams.cameras.front();
  if (!rig)
    throw Error("there is no rig.yaml that says what its pictures show", job.input,
                "write dial, dial_radius_m and camera_distance_m into one (docs/methods/pendulum.md)");
  apply_rig_file(camera.timing, *rig);
  const DialRig seen = dial_rig(*rig, camera, job.dial_method);
  DialOptions options = seen.options;
  options.threads = job.threads;
  options.rows = job.pendulum.estimate_line_delay;
  options.progress = job.progress;
  DialAngles read = read_dial(camera, seen, options, out.files.back());
  for (const std::string& note : read.notes) out.notes.push_back(camera.name + ": " + note);
  if (read.angles.size() == 0)
    throw Error("none of its pictures shows the dial", job.input,
                "check dial_radius_m, camera_distance_m and roll_deg");
  return std::move(read.angles);
}

/// The rows of a frame's two readings are known to a share of what is between them (a mounting that was told to a
/// degree, a print that ends within a strip: seen in films of known line delay), and the offset is that of a row far
/// from both.
void widen_by_rows(Estimate& e, const AngleStream& dial) {
  constexpr double share = 5e-4;
  if (!e.answered() || !e.line_delay_s || !e.line_delay_sigma_s || dial.rows.empty()) return;
  double row = 0;
  for (const double r : dial.rows) row += r / static_cast<double>(dial.rows.size());
  const double more = share * std::abs(*e.line_delay_s), whole = std::hypot(*e.line_delay_sigma_s, more);
  // The swing by swing methods have taken the line delay as it was found: all of its uncertainty is in theirs.
  const auto widen = [&](Estimate& one) {
    if (!one.answered()) return;
    one.sigma_s = std::hypot(*one.sigma_s, (one.line_delay_sigma_s ? more : whole) * row);
    if (one.line_delay_sigma_s) one.line_delay_sigma_s = whole;
  };
  for (Estimate& one : e.estimates) widen(one);
  widen(e);
}

/// Where both are known they should agree: a nominal readout is often a few percent off.
void compare_line_delay(Estimate& e, const FrameTiming& told) {
  if (!e.line_delay_s || told.readout_s == 0) return;
  const double away = *e.line_delay_s - told.line_delay_s(), sigma = e.line_delay_sigma_s.value_or(0);
  if (std::abs(away) < std::max(5 * sigma, 0.2e-6)) return;
  e.doubt(Verdict::trusted, fmt::format("the line delay is {:.2f} ± {:.2f} µs, not the {:.2f} µs of the readout that "
                                        "was told; what was found is used",
                                        *e.line_delay_s * 1e6, sigma * 1e6, told.line_delay_s() * 1e6));
}

}  // namespace

PendulumOutcome calibrate_pendulum(const PendulumJob& job) {
  const std::vector<std::string> estimators{"all", "spline", "damped", "extrema"};
  if (std::find(estimators.begin(), estimators.end(), job.estimator) == estimators.end())
    throw std::invalid_argument("there is no estimator \"" + job.estimator + "\"; there are spline, damped, extrema");
  PendulumOutcome out;
  Streams streams = read_streams(job, out);
  pick_imus(streams, job);
  const std::optional<YamlFields> rig = read_rig_file(job, out);
  const AngleStream dial = dial_of(streams, rig, job, out);
  PendulumOptions options = job.pendulum;
  if (options.estimate_line_delay && dial.rows.empty())
    throw Error("its angles do not say which rows they are from, so there is no line delay in them",
                job.input.empty() ? job.angle_file : job.input, "give pictures of the dial, or leave out --line-delay");
  // Readings of a frame from several rows are there to find what lies between the rows.
  if (!dial.rows.empty()) options.estimate_line_delay = true;
  const auto rig_temperature = rig ? rig->number("temperature_c") : std::nullopt;
  for (const ImuStream& imu : streams.imus) {
    Estimate e = calibrate_pendulum(dial, imu, options);
    widen_by_rows(e, dial);
    compare_line_delay(e, dial.timing);
    if (const auto t = imu.temperature_c ? imu.temperature_c : rig_temperature)
      e.extras.push_back({"temperature_c", *t, std::nullopt});
    out.estimates.push_back(chosen(std::move(e), job.estimator));
  }
  for (const UnreadableStream& imu : streams.unreadable) {
    Estimate e = Estimate::refusal(out.estimates.front().method, imu.why.what());
    e.sensor = dial.name;
    e.reference = imu.name;
    out.estimates.push_back(std::move(e));
  }
  for (Estimate& e : out.estimates) e.notes = out.notes;
  return out;
}

}  // namespace takt
