// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "takt/workflows/align.h"

int main(int argc, char** argv) {
  takt::AlignJob job;
  job.inputs.assign(argv + 1, argv + argc);
  const takt::Estimate found = takt::align(job).estimate;
  std::cout << takt::sentence(found) << '\n';
  return found.verdict == takt::Verdict::trusted ? 0 : 3;
}
