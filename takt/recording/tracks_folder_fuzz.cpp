// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/tracks_folder.h"
#include "tests/fuzz.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return takt::fuzz::plant_seeds(
      *argc, *argv,
      {"t_ns,feature_id,u_px,v_px\n100,1,632.6,22.7\n100,2,1,1\n200,2,1,1\n300,1,2,2\n|cam0:\n  resolution: [752, "
       "480]\n"
       "  intrinsics: [458.6, 457.3, 367.2, 248.4]\n  distortion_model: radtan\n  distortion_coeffs: [-0.3, 0, 0, 0]\n"
       "  pixel_noise_sigma: 1\n  rolling_shutter_line_delay_s: 0\n"});
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return takt::fuzz::reads_or_says_why(data, size, [](std::string_view text) {
    const std::size_t bar = std::min(text.find('|'), text.size());
    std::vector<std::string> notes;
    (void)takt::read_tracks(text.substr(0, bar), text.substr(std::min(bar + 1, text.size())), "cam0", "run", notes);
  });
}
