// SPDX-License-Identifier: Apache-2.0
#include "takt/streams/kalibr_names.h"

namespace takt {

const char* kalibr_name(Projection projection) {
  switch (projection) {
    case Projection::pinhole:
      return "pinhole";
    case Projection::omni:
      return "omni";
    case Projection::double_sphere:
      return "ds";
    case Projection::eucm:
      return "eucm";
  }
  return "";
}

const char* kalibr_name(Distortion distortion) {
  switch (distortion) {
    case Distortion::none:
      return "none";
    case Distortion::radtan:
      return "radtan";
    case Distortion::equidistant:
      return "equidistant";
    case Distortion::fov:
      return "fov";
  }
  return "";
}

}  // namespace takt
