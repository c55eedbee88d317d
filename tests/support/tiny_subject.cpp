#include "tests/support/tiny_subject.h"

#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"
#include "tests/support/tiny_body.h"

namespace degas::test {
namespace {

BodyModel load_tiny_body() {
  const TemporaryFolder folder;
  write_tiny_body(folder.path() / "body.npz");
  return BodyModel::load(folder.path() / "body.npz");
}

}  // namespace

TinySubject::TinySubject(int resolution)
    : body(load_tiny_body()), maps(make_base_maps(body, betas, UvAtlas(body, resolution), 8, 1e-4)) {}

AssemblyMaps TinySubject::heads(Device& device, double size) const {
  const int64_t side = maps.resolution;
  return {random_tensor(device, {side, side, 3}, 1, -size, size),
          random_tensor(device, {side, side, 7}, 2, -size, size),
          random_tensor(device, {side, side, 4}, 3, -size, size),
          {}};
}

Splats TinySubject::posed(Tape& tape, const AssemblyMaps& heads, const DevicePose& pose) const {
  Device& device = tape.device();
  return pose_gaussians(tape, assemble(tape, heads, make_gaussian_base(device, maps)),
                        make_skinning_weights(device, maps), make_skeleton(device, body, betas), pose);
}

}  // namespace degas::test
