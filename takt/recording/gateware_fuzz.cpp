// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gateware.h"
#include "tests/fuzz.h"

namespace {

std::string text(const takt::wire::Frame& f) {
  const auto bytes = takt::wire::encode(f);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using takt::wire::Kind;
  const std::string board =
      text({Kind::heartbeat, 0, 0, 0, 1, 48'000'000}) + text({Kind::heartbeat, 1, 0, 1, 2, 0x80144220});
  const std::string events =
      text({Kind::pulse, 0, 4, 0, 48'000'000, 0}) + text({Kind::exposure, 0, 4, 0, 50'000'000, 1}) +
      text({Kind::exposure, 0, 0, 1, 50'048'000, 1}) + text({Kind::gnss_start, 0, 0, 0, 51'000'000, 0}) +
      text({Kind::gnss_text, 0, 3, 0, 51'100'000, 0x4d524e24});
  const std::string exchange = text({Kind::host, 0, 0, 9, 17, 0}) +
                               text({Kind::exchange, 0, 0, 480, 1000, (9u << 24) | 500}) +
                               text({Kind::host, 1, 0, 9, 19, 0});
  return takt::fuzz::plant_seeds(*argc, *argv,
                                 {board + events, board + exchange + board, events + board + "garbage" + events});
}

/// Bytes as they are, and as frames whose sums are right: else nothing would pass the CRC.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view input) {
    std::string sealed(input);
    for (std::size_t at = 0; at + takt::wire::frame_size <= sealed.size(); at += takt::wire::frame_size) {
      auto* frame = reinterpret_cast<std::uint8_t*>(sealed.data()) + at;
      const auto crc = takt::wire::crc16({frame + 2, 16});
      frame[18] = static_cast<std::uint8_t>(crc >> 8);
      frame[19] = static_cast<std::uint8_t>(crc);
    }
    try {
      (void)takt::read_gateware(input, "fuzz");
    } catch (const takt::Error&) {
    }
    (void)takt::read_gateware(sealed, "fuzz");
  });
}
