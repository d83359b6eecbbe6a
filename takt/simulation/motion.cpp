// SPDX-License-Identifier: Apache-2.0
#include "takt/simulation/motion.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace takt {

namespace {

/// Clear of the walls by this, so that no face fills the view with a single texel.
constexpr double wall_margin_m = 0.3;

const std::array<Motion, 12> table{{
    {.name = "handheld",
     .says = "a camera in a hand: 0.5 to 1.5 rad/s, up to 4 Hz",
     .turn_calm_rad_s = 0.5,
     .turn_lively_rad_s = 1.5,
     .speed_calm_m_s = 0.1,
     .speed_lively_m_s = 0.3},
    {.name = "rig",
     .says = "a slow robot in a hall: turns about the vertical, moves in the plane",
     .freedom = Freedom::upright,
     .turn_calm_rad_s = 0.2,
     .turn_lively_rad_s = 0.5,
     .turn_low_hz = 0.05,
     .turn_high_hz = 1,
     .speed_calm_m_s = 0.2,
     .speed_lively_m_s = 0.4,
     .speed_low_hz = 0.06,
     .speed_high_hz = 0.5,
     .room_half_extent_m = {8, 7, 2}},
    {.name = "car",
     .says = "a car in a square: turns slowly about the vertical, up to 8 m/s",
     .freedom = Freedom::upright,
     .turn_calm_rad_s = 0.1,
     .turn_lively_rad_s = 0.25,
     .turn_low_hz = 0.05,
     .turn_high_hz = 0.7,
     .speed_calm_m_s = 4,
     .speed_lively_m_s = 8,
     .speed_low_hz = 0.08,
     .speed_high_hz = 0.5,
     .room_half_extent_m = {90, 90, 8}},
    {.name = "stops",
     .says = "carried about, and put down every now and then",
     .turn_calm_rad_s = 0.4,
     .turn_lively_rad_s = 0.8,
     .turn_high_hz = 2,
     .speed_calm_m_s = 0.2,
     .speed_lively_m_s = 0.4,
     .go_s = 9,
     .stop_s = 6},
    {.name = "constant_velocity", .says = "glides without turning: no answer is possible", .constant_speed_m_s = 0.02},
    {.name = "fast",
     .says = "shaken hard: 3 to 5 rad/s, up to 5 Hz",
     .turn_calm_rad_s = 3,
     .turn_lively_rad_s = 5,
     .turn_low_hz = 0.5,
     .turn_high_hz = 5,
     .speed_calm_m_s = 0.3,
     .speed_lively_m_s = 0.6,
     .speed_low_hz = 0.4,
     .speed_high_hz = 2},
    {.name = "weak",
     .says = "held almost still: 0.07 to 0.2 rad/s",
     .turn_calm_rad_s = 0.07,
     .turn_lively_rad_s = 0.2,
     .turn_low_hz = 0.2,
     .turn_high_hz = 2,
     .speed_calm_m_s = 0.03,
     .speed_lively_m_s = 0.1},
    {.name = "still", .says = "on a table: no answer is possible"},
    {.name = "single_axis",
     .says = "turns about one axis only: the rotation about it stays unknown",
     .freedom = Freedom::one,
     .turn_calm_rad_s = 0.5,
     .turn_lively_rad_s = 1.5},
    {.name = "single_tone",
     .says = "one pure sinusoid: offsets are ambiguous by its period",
     .freedom = Freedom::one,
     .turn_calm_rad_s = 0.5,
     .turn_lively_rad_s = 1.5,
     .turn_low_hz = 0.7,
     .turn_high_hz = 1.5,
     .tones = 1},
    {.name = "translation_only", .says = "moves without turning", .speed_calm_m_s = 0.1, .speed_lively_m_s = 0.3},
    {.name = "constant_rate", .says = "a turntable: the rate never changes", .constant_rate_rad_s = 0.5},
}};

class WaveMotion : public Trajectory {
 public:
  WaveMotion(const Motion& m, std::uint64_t seed) {
    Random random(seed, "motion");
    const double heading = random.uniform(-std::numbers::pi, std::numbers::pi);
    mean_ = Eigen::AngleAxisd(heading, Vec3::UnitZ());
    centre_ = 0.05 * m.room_half_extent_m.cwiseProduct(
                         Vec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
    const Vec3 axis = Vec3(random.normal(), random.normal(), random.normal()).normalized();
    const double turn = random.uniform(m.turn_calm_rad_s, m.turn_lively_rad_s);
    double speed = random.uniform(m.speed_calm_m_s, m.speed_lively_m_s);
    rate_ = m.constant_rate_rad_s * axis;
    const bool upright = m.freedom == Freedom::upright;
    const Mat3 turn_shape = m.freedom == Freedom::one ? Mat3(axis * axis.transpose())
                            : upright                 ? Mat3(Vec3(0.05, 0.05, 1).asDiagonal())
                                                      : Mat3::Identity();
    const Mat3 move_shape = (upright ? Vec3(1, 1, 0.02) : Vec3(1, 1, 0.7)).asDiagonal();
    const Vec3 course(random.normal(), random.normal(), 0);
    glide_ = m.constant_speed_m_s * course.normalized();
    turning_ = Wave({turn, m.turn_low_hz, m.turn_high_hz, m.tones}, turn_shape, Random(seed, "turning"));
    const auto moving_at = [&](double v) {
      return Wave({v, m.speed_low_hz, m.speed_high_hz, m.tones}, move_shape, Random(seed, "moving"));
    };
    moving_ = moving_at(speed);
    // Some draws of lively tones add up to more than the room has: those go as fast as fits.
    const Vec3 space = m.room_half_extent_m.array() - wall_margin_m - centre_.cwiseAbs().array();
    const double fits = 0.999 * (space.array() / moving_.bound().array().max(1e-9)).minCoeff();
    if (fits < 1 && speed * fits >= m.speed_calm_m_s) moving_ = moving_at(speed *= fits);
    const Vec3 reach = centre_.cwiseAbs() + moving_.bound();
    if ((reach.array() > m.room_half_extent_m.array() - wall_margin_m).any())
      throw std::invalid_argument(fmt::format(
          "motion {}: {:.2f} m/s from {} Hz on could reach {:.1f}, {:.1f}, {:.1f} m from the middle of a room of "
          "{}, {}, {} m: lower the speed or raise its lowest frequency",
          m.name, speed, m.speed_low_hz, reach.x(), reach.y(), reach.z(), m.room_half_extent_m.x(),
          m.room_half_extent_m.y(), m.room_half_extent_m.z()));
  }

  Eigen::Isometry3d world_from_body(double t) const override {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = (mean_ * exp_so3(rate_ * t + turning_.at(t)[0])).toRotationMatrix();
    pose.translation() = centre_ + glide_ * t + moving_.at(t)[0];
    return pose;
  }
  Vec3 omega_body(double t) const override {
    const auto phi = turning_.at(t);
    return right_jacobian(rate_ * t + phi[0]) * (rate_ + phi[1]);
  }
  Vec3 velocity_world(double t) const override { return glide_ + moving_.at(t)[1]; }
  Vec3 acceleration_world(double t) const override { return moving_.at(t)[2]; }

 private:
  Quat mean_;
  Vec3 centre_, rate_, glide_;
  Wave turning_, moving_;
};

/// Another motion, run through at a varying pace: for `go_s` seconds at its own, then `stop_s` at none.
/// The pace has a continuous slope, so that accelerations are finite.
class StopAndGo : public Trajectory {
 public:
  StopAndGo(std::shared_ptr<const Trajectory> going, double go_s, double stop_s)
      : going_(std::move(going)), go_s_(go_s), cycle_s_(go_s + stop_s) {}

  Eigen::Isometry3d world_from_body(double t) const override { return going_->world_from_body(pace(t).place); }
  Vec3 omega_body(double t) const override {
    const Pace p = pace(t);
    return p.rate * going_->omega_body(p.place);
  }
  Vec3 velocity_world(double t) const override {
    const Pace p = pace(t);
    return p.rate * going_->velocity_world(p.place);
  }
  Vec3 acceleration_world(double t) const override {
    const Pace p = pace(t);
    return p.rate * p.rate * going_->acceleration_world(p.place) + p.slope * going_->velocity_world(p.place);
  }

 private:
  struct Pace {
    double place, rate, slope;
  };
  /// rate = sin² ramps of `ramp_s` at both ends of the going part.
  Pace pace(double t) const {
    const double ramp_s = std::min(1.0, 0.5 * go_s_);
    const double whole = go_s_ - ramp_s;  // what one cycle covers
    const double cycles = std::floor(t / cycle_s_), u = t - cycles * cycle_s_;
    const double k = std::numbers::pi / ramp_s;
    const auto risen = [&](double x) -> Pace {
      return {0.5 * (x - std::sin(k * x) / k), 0.5 * (1 - std::cos(k * x)), 0.5 * k * std::sin(k * x)};
    };
    Pace p{whole, 0, 0};
    if (u < ramp_s) {
      p = risen(u);
    } else if (u < go_s_ - ramp_s) {
      p = {0.5 * ramp_s + u - ramp_s, 1, 0};
    } else if (u < go_s_) {
      const Pace back = risen(go_s_ - u);
      p = {whole - back.place, back.rate, -back.slope};
    }
    p.place += cycles * whole;
    return p;
  }

  std::shared_ptr<const Trajectory> going_;
  double go_s_, cycle_s_;
};

}  // namespace

std::span<const Motion> motions() {
  return table;
}

const Motion& find_motion(const std::string& name) {
  std::string names;
  for (const Motion& m : table) {
    if (m.name == name) return m;
    names += (names.empty() ? "" : ", ") + m.name;
  }
  throw std::invalid_argument("no motion named '" + name + "'; there are " + names);
}

std::shared_ptr<const Trajectory> make_trajectory(const Motion& motion, std::uint64_t seed) {
  auto going = std::make_shared<WaveMotion>(motion, seed);
  if (motion.stop_s > 0) return std::make_shared<StopAndGo>(going, motion.go_s, motion.stop_s);
  return going;
}

}  // namespace takt
