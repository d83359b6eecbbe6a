// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>
#include <span>
#include <string>

#include "takt/motion/trajectory.h"
#include "takt/simulation/wave.h"

/// How the simulated body moves: one table row a kind of motion.
namespace takt {

/// Along which directions it rotates and moves.
enum class Freedom {
  all,     ///< every direction alike
  one,     ///< one fixed, seeded axis
  upright  ///< as on wheels: turns about the vertical, moves in the plane, shakes a little otherwise
};

/// A row of the table. Rates without a single value lie between `calm` and `lively`; the seed chooses.
struct Motion {
  std::string name;
  std::string says;  ///< one line for the help
  Freedom freedom = Freedom::all;
  double turn_calm_rad_s = 0, turn_lively_rad_s = 0;  ///< rms angular rate
  double turn_low_hz = 0.3, turn_high_hz = 4;
  int tones = 24;
  double speed_calm_m_s = 0, speed_lively_m_s = 0;  ///< rms speed
  double speed_low_hz = 0.2, speed_high_hz = 1.5;
  double constant_speed_m_s = 0;           ///< added along one fixed, seeded direction; the room does not hold it
  double constant_rate_rad_s = 0;          ///< added about one fixed, seeded axis
  double go_s = 0, stop_s = 0;             ///< it moves for so long, then stands for so long, and so on; 0: never stops
  Vec3 room_half_extent_m{3.0, 2.5, 1.5};  ///< the box around, from its centre, in which it moves
};

/// handheld, rig, car, stops, fast, weak, still, single_axis, single_tone, translation_only, constant_rate,
/// constant_velocity.
[[nodiscard]] std::span<const Motion> motions();
/// Throws std::invalid_argument naming the ones there are.
[[nodiscard]] const Motion& find_motion(const std::string& name);

/// The motion as a function of time, from −∞ to ∞, around the room's centre (the world's origin). Its attitude is
/// R(t) = R₀·exp(φ(t)), so ω = Jr(φ)·φ̇ exactly. The body's x axis looks ahead, z up, in the mean.
/// Throws std::invalid_argument when it could leave the room.
[[nodiscard]] std::shared_ptr<const Trajectory> make_trajectory(const Motion& motion, std::uint64_t seed);

}  // namespace takt
