#include "host/io/lens.h"

#include <algorithm>

namespace degas {

bool Lens::distorts() const {
  return std::any_of(distortion.begin(), distortion.end(), [](double value) { return value != 0; });
}

bool is_distortion_size(size_t count) {
  return count == 0 || count == 4 || count == 5 || count == 8 || count == 12 || count == 14;
}

}  // namespace degas
