// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace takt {

/// SHA-256 [FIPS 180-4], fed piece by piece: names an input file beyond doubt.
class Sha256 {
 public:
  void update(std::string_view bytes);
  /// 64 hexadecimal digits. The object is spent afterwards.
  [[nodiscard]] std::string digest();

 private:
  void compress(const std::uint8_t* block);

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> block_{};
  std::uint64_t length_ = 0;  ///< bytes so far
};

}  // namespace takt
