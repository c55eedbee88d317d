#include "model/net/map_network.h"

#include <fmt/format.h>

#include <stdexcept>

#include "model/net/avatar_net.h"
#include "model/net/skip_net.h"
#include "model/net/static_maps.h"
#include "model/net/texel_mlp.h"

namespace degas {

std::unique_ptr<MapNetwork> make_network(Device& device, const NetConfig& config, int face_code_size,
                                         const Tensor& joint_masks, uint64_t seed, const FaceRegion& face_region) {
  if (config.kind == NetKind::Degas) {
    return std::make_unique<AvatarNet>(device, config, face_code_size, joint_masks, seed, face_region);
  }
  NetConfig own = config;
  own.use_pose_embedding = own.use_pvm = own.use_pve = own.use_world_normals = false;
  if (config.kind == NetKind::Static) return std::make_unique<StaticMaps>(device, own, seed);
  if (config.kind == NetKind::Skips) return std::make_unique<SkipNet>(device, own, seed);
  return std::make_unique<TexelMlp>(device, own, static_cast<int>(3 * joint_masks.dim(2)), seed);
}

void require_input(const char* name, const Tensor& tensor, int64_t size) {
  if (!tensor.defined() || tensor.size() != size) {
    throw std::logic_error(fmt::format("[network] {} must have {} numbers, got {}", name, size,
                                       tensor.defined() ? to_string(tensor.shape()) : "none"));
  }
}

}  // namespace degas
