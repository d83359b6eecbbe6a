// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>

#include "takt/recording/gopro.h"

/// Any bytes as a telemetry track of three payloads: the first byte says where they are cut.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data + 1), size - 1);
  const std::size_t cut = bytes.size() * data[0] / 256;
  const auto payload = [](std::int64_t k, std::string text) {
    return takt::MediaIndex::Payload{takt::from_ns(k * 1'001'000'000), takt::Duration(1'001'000'000), std::move(text)};
  };
  const takt::Telemetry telemetry({payload(0, bytes.substr(0, cut)), payload(1, bytes.substr(cut)), payload(2, bytes)});
  (void)takt::read_telemetry(telemetry);
  (void)telemetry.table("SHUT", 1);
  return 0;
}
