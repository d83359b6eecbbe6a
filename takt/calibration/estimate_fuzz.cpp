// SPDX-License-Identifier: Apache-2.0
// Any bytes as a result, in JSON or YAML; what was read is written, in both, and read again as the same.
#include "tests/fuzz.h"

#include <cstdlib>

#include "takt/calibration/estimate.h"

namespace {

const std::string json =
    R"({"schema": "takt/1", "method": "ml", "sensor": "cam0", "reference": "imu0", "verdict": "weak", "reasons": ["a"],
"offset_s": 0.003177, "sigma_s": 6.1e-6, "epoch_ns": 1700000114480613928, "drift_ppm": 0.5, "drift_sigma_ppm": null,
"frame_instant": "exposure_middle", "frame_row": "middle", "line_delay_s": 1e-5,
"T_reference_sensor": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]],
"estimates": [{"method": "extrema", "offset_s": 0.0028, "verdict": "trusted"}], "evidence": {"x": [1, 2]},
"provenance": {"version": "1", "command": "takt", "inputs": [{"path": "a", "sha256": "b"}], "seed": 1}})";
const std::string yaml =
    "schema: takt/1\nverdict: trusted\nsensor: cam0\nreference: imu0\noffset_ns: 12345678\nepoch_ns: 0\n"
    "pieces:\n  - {from_ns: 0, offset_s: 0.01, epoch_ns: 5, drift_ppm: 1}\n";

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(*argc, *argv, {json, yaml});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view bytes) {
    const std::string text(bytes);
    const takt::Estimate read =
        text.starts_with('{') ? takt::estimate_from_json(text, "r.json") : takt::estimate_from_yaml(text, "r.yaml");
    const std::string written = takt::to_json(read);
    if (takt::to_json(takt::estimate_from_json(written, "w.json")) != written) std::abort();
    if (takt::to_json(takt::estimate_from_yaml(takt::to_yaml(read), "w.yaml")) != written) std::abort();
  });
}
