#pragma once

#include <cstdint>

namespace degas {

/// A learning rate as a function of the step: a linear warm-up, then a constant or half a cosine.
struct Schedule {
  enum class Kind { Constant, Cosine };
  Kind kind = Kind::Constant;
  double peak = 1e-4;         ///< the rate after warm-up
  double final_fraction = 0;  ///< of peak, reached at total_steps (Cosine)
  int64_t warmup_steps = 0;   ///< step s < warmup_steps has (s + 1) / warmup_steps of peak
  int64_t total_steps = 0;    ///< where the cosine ends; later steps keep its last value

  double at(int64_t step) const;
};

}  // namespace degas
