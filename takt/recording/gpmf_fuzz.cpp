// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/gopro.h"
#include "tests/fuzz.h"
#include "tests/gpmf_writing.h"

namespace {

std::string stream(const std::string& key, const std::string& before, const std::string& data) {
  using namespace takt::gpmf_writing;
  return nest("STRM", u64("STMP", 80577) + u32("TSMP", 60) + u32("TICK", 900) + text("STNM", key) + before + data);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  using namespace takt::gpmf_writing;
  const std::string vectors = s16("SCAL", 1, {10}) + text("ORIN", "zxY");
  const std::string gyro = stream("GYRO", vectors, s16("GYRO", 3, std::vector<std::int16_t>(30, 7)));
  const std::string accel = stream("ACCL", vectors, s16("ACCL", 3, std::vector<std::int16_t>(12, 9)));
  const std::string cori = stream("CORI", s16("SCAL", 1, {32767}), s16("CORI", 4, std::vector<std::int16_t>(8, 16000)));
  const std::string shut = stream("SHUT", "", f32("SHUT", 1, {0.01F, 0.02F}));
  const std::string faces = stream("FACE", text("TYPE", "Lf[2]B"), item("FACE", '?', 13, 1, std::string(13, '\1')));
  return takt::fuzz::plant_seeds(
      *argc, *argv,
      {"\x80" + nest("DEVC", text("DVNM", "made") + gyro + accel + cori + shut), "\x40" + nest("DEVC", faces),
       "\x10" + nest("DEVC", gyro) + nest("DEVC", cori + shut)});
}

/// Any bytes as a telemetry track of three payloads: the first byte says where the first two are cut.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view input) {
    if (input.empty()) return;
    const std::string bytes(input.substr(1));
    const std::size_t cut = bytes.size() * static_cast<unsigned char>(input[0]) / 256;
    const auto payload = [](std::int64_t k, std::string text) {
      return takt::MediaIndex::Payload{takt::from_ns(k * 1'001'000'000), takt::Duration(1'001'000'000),
                                       std::move(text)};
    };
    const takt::Telemetry telemetry(
        {payload(0, bytes.substr(0, cut)), payload(1, bytes.substr(cut)), payload(2, bytes)});
    (void)takt::read_telemetry(telemetry);
    (void)telemetry.table("SHUT", 1);
  });
}
