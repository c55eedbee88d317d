#pragma once

#include "model/gaussians/posing.h"

namespace degas::test {

/// The body of tiny_body.h with Gaussians on it, of some shape.
struct TinySubject {
  BodyModel body;
  std::vector<double> betas = {0.5, -1};
  BaseMaps maps;

  explicit TinySubject(int resolution = 16);
  /// Random numbers of the network's heads, up to `size`.
  AssemblyMaps heads(Device& device, double size) const;
  Splats posed(Tape& tape, const AssemblyMaps& heads, const DevicePose& pose) const;
};

}  // namespace degas::test
