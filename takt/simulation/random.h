// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace takt {

/// A well-mixed 64-bit hash of its argument (splitmix64's finaliser).
constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// Random numbers that are the same on every machine (std distributions are not): one named stream a purpose, so
/// that asking more of one (say, more landmarks) leaves all the others as they were.
class Random {
 public:
  Random(std::uint64_t seed, std::string_view purpose) : state_(mix64(seed)) {
    for (const char c : purpose) state_ = mix64(state_ ^ static_cast<std::uint8_t>(c));
  }

  std::uint64_t bits() { return mix64(state_ += 0x9e3779b97f4a7c15ull); }
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal (Box–Muller).
  double normal() {
    const double radius = std::sqrt(-2 * std::log1p(-uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }
  bool chance(double probability) { return uniform() < probability; }

 private:
  std::uint64_t state_;
};

}  // namespace takt
