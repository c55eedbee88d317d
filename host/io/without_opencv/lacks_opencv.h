#pragma once

#include <string>

#include "host/error.h"

namespace degas {

/// What the units of this folder answer in place of those of host/io/opencv. `what` begins with the file, where there
/// is one: "videos/cam00.mp4: videos cannot be read".
[[noreturn]] inline void lacks_opencv(const std::string& what) {
  throw Error::format(
      "{}: degas is built without OpenCV; use a pack (`degas pack`, where it has OpenCV), or build it with "
      "-DDEGAS_WITH_OPENCV=ON",
      what);
}

}  // namespace degas
