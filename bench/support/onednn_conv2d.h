#pragma once

#include "host/ops/conv2d_launch.h"

namespace degas::bench {

enum class Direction { Forward, FusedForward, BackwardInput, BackwardWeight };

/// oneDNN's convolution of the same sizes on the CPU: NHWC activations, weights in the layout it likes best. A fused
/// forward pass has a bias per channel and a leaky ReLU, the others neither; oneDNN knows no bias per pixel.
class OneDnnConv2d {
 public:
  OneDnnConv2d(const Conv2dGeometry& geometry, Direction direction);
  ~OneDnnConv2d();
  void run();
  void wait();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace degas::bench
