// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/pendulum.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/yaml_fields.h"

namespace fs = std::filesystem;

namespace takt {
namespace {

void append(std::vector<std::string>& to, const std::vector<std::string>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Streams of the job's files, and what was read.
struct Streams {
  std::vector<AngleStream> angles;
  std::vector<ImuStream> imus;
};

void read_into(Streams& s, const std::string& path, const PendulumJob& job, PendulumOutcome& out) {
  Recording r = open_recording(path, job.open);
  append(out.notes, r.notes);
  append(out.files, r.files);
  std::move(r.angles.begin(), r.angles.end(), std::back_inserter(s.angles));
  std::move(r.imus.begin(), r.imus.end(), std::back_inserter(s.imus));
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
  if (s.angles.empty())
    throw Error("there is no angle in it", where, "give the dial's angles with --angle FILE (t_ns,angle_rad)");
  if (s.imus.empty())
    throw Error("there is no gyro in it", job.input.empty() ? job.imu_file : job.input, "give one with --imu FILE");
  return s;
}

template <class Stream>
void keep_named(std::vector<Stream>& streams, const std::string& name, const std::string& where) {
  if (name.empty()) return;
  std::string known;
  for (const Stream& s : streams) known += (known.empty() ? "" : ", ") + s.name;
  std::erase_if(streams, [&](const Stream& s) { return s.name != name; });
  if (streams.empty()) throw Error("there is no stream " + name, where, "it has: " + known);
}

/// What the stamps of the dial's frames mean.
void apply_rig_file(AngleStream& dial, const std::string& path) {
  const YamlFields rig(read_file(path), path);
  if (const auto exposure = rig.number("exposure_s")) dial.timing.exposure_s = *exposure;
  if (const auto rows = rig.number("rows")) dial.timing.rows = static_cast<int>(*rows);
  if (const auto readout = rig.number("readout_s")) dial.timing.readout_s = *readout;
  const std::string stamp = rig.text("stamp").value_or("middle");
  if (stamp == "start")
    dial.timing.instant = ExposureInstant::start;
  else if (stamp == "end")
    dial.timing.instant = ExposureInstant::end;
  else if (stamp != "middle")
    rig.fail("stamp", "is \"" + stamp + "\", none of start, middle, end");
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

}  // namespace

PendulumOutcome calibrate_pendulum(const PendulumJob& job) {
  const std::vector<std::string> estimators{"all", "spline", "damped", "extrema"};
  if (std::find(estimators.begin(), estimators.end(), job.estimator) == estimators.end())
    throw std::invalid_argument("there is no estimator \"" + job.estimator + "\"; there are spline, damped, extrema");
  PendulumOutcome out;
  Streams streams = read_streams(job, out);
  keep_named(streams.angles, job.sensor, job.input);
  keep_named(streams.imus, job.reference, job.input);
  AngleStream& dial = streams.angles.front();
  std::string rig_file = job.rig_file;
  if (rig_file.empty() && !job.input.empty()) rig_file = (fs::path(job.input) / "rig.yaml").string();
  if (!job.rig_file.empty() || fs::exists(rig_file)) {
    apply_rig_file(dial, rig_file);
    out.files.push_back(rig_file);
  }
  for (const ImuStream& imu : streams.imus)
    out.estimates.push_back(chosen(calibrate_pendulum(dial, imu, job.pendulum), job.estimator));
  return out;
}

}  // namespace takt
