// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "takt/simulation/handheld.h"
#include "takt/simulation/parameters.h"
#include "takt/simulation/sensor_parameters.h"

namespace takt {

/// HandheldOptions as a scenario file and the command line write them: flat, each name with its unit.
struct HandheldParameters {
  std::string motion = "handheld";
  double duration_s = HandheldOptions{}.duration_s;
  std::optional<double> turn_rms_rad_s, speed_rms_m_s;
  std::optional<double> go_s, stop_s;
  double offset_s = HandheldOptions{}.offset_s;
  double drift_ppm = 0;
  double step_s = 0, step_at_s = 30;
  bool stereo = false;
  double stereo_offset_s = 0.0015;
  bool tracks = false;

  std::string resolution = "640x480";
  bool radtan = false, fisheye = false;
  std::optional<double> field_of_view_deg;
  double rolling_shutter_s = 0;
  FrameParameters frames;

  double pixel_noise_px = SimulatedTracking{}.pixel_noise_px;
  double outliers = 0;
  int landmarks = SimulatedTracking{}.landmarks;
  double track_length = SimulatedTracking{}.mean_length;
  double misses = SimulatedTracking{}.miss_fraction;

  ImuParameters imu;
};

template <class Visitor>
void describe(HandheldParameters& p, Visitor& v) {
  v("motion", p.motion,
    "handheld, rig, car, stops, fast, weak, still, single_axis, single_tone, translation_only, constant_rate, "
    "constant_velocity");
  v("duration_s", p.duration_s, "length of the recording");
  v("turn_rms_rad_s", p.turn_rms_rad_s, "rms angular rate; the motion's own when left out");
  v("speed_rms_m_s", p.speed_rms_m_s, "rms speed; the motion's own when left out");
  v("go_s", p.go_s, "how long it moves before it stops; the motion's own when left out");
  v("stop_s", p.stop_s, "how long it then stands; 0: it never stops");
  v("offset_s", p.offset_s, "clocks: reference - sensor in the middle of the recording");
  v("drift_ppm", p.drift_ppm, "clocks: how much faster the reference runs");
  v("step_s", p.step_s, "by which the offset jumps once");
  v("step_at_s", p.step_at_s, "when it jumps, after the start");
  v("stereo", p.stereo, "a second camera, cam1, 0.11 m to the right");
  v("stereo_offset_s", p.stereo_offset_s, "cam1's offset less cam0's");
  v("tracks", p.tracks, "write feature tracks instead of images");
  v("resolution", p.resolution, "width x height");
  v("radtan", p.radtan, "a lens with EuRoC's radial-tangential distortion");
  v("fisheye", p.fisheye, "an equidistant fisheye lens");
  v("field_of_view_deg", p.field_of_view_deg, "horizontal; 70, or 120 for the fisheye, when left out");
  v("rolling_shutter_s", p.rolling_shutter_s, "readout from the first row to the last; 0: global shutter");
  describe(p.frames, v);
  v("pixel_noise_px", p.pixel_noise_px, "tracks: sigma of u and of v");
  v("outliers", p.outliers, "tracks: fraction seen 5 to 50 px away");
  v("landmarks", p.landmarks, "tracks: points on the walls of the room");
  v("track_length", p.track_length, "tracks: frames until a feature is lost, in the mean");
  v("misses", p.misses, "tracks: fraction of the observations not made");
  describe(p.imu, v);
}

/// Throws std::invalid_argument naming the parameter that no simulation can have.
[[nodiscard]] HandheldOptions to_options(const HandheldParameters& p);

}  // namespace takt
