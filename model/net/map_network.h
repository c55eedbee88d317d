#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "model/body/face_region.h"
#include "model/config.h"
#include "model/net/heads.h"
#include "model/net/parameter_store.h"

namespace degas {

/// What turns driving signals into head maps: by net.kind the method's own network (AvatarNet), or another method's
/// choice to compare it with.
class MapNetwork {
 public:
  struct Inputs {
    Tensor posed_vertex_map;  ///< (1, R, R, 3) metres, 0 where no texel is covered; for use_pvm, use_pve and kind skips
    Tensor pose;              ///< (3 J) axis-angles of the joints after the root; for use_pose_embedding and kind mlp
    Tensor face_code;         ///< (face_code_size); where that is above 0
    Tensor world_normals;     ///< (1, R, R, 3) unit at vertices, 0 where no texel is covered; for use_world_normals
  };

  virtual ~MapNetwork() = default;

  /// noise_seed: draws the latent's noise for a training step; without it z is the mean. Inputs that the network does
  /// not read may be undefined; others must have their shape (std::logic_error).
  virtual HeadMaps decode(Tape& tape, const Inputs& inputs, std::optional<uint64_t> noise_seed = {}) const = 0;

  /// With the switches of what the kind does not read off.
  const NetConfig& config() const { return config_; }
  ParameterStore& parameters() { return store_; }
  const ParameterStore& parameters() const { return store_; }

 protected:
  MapNetwork(Device& device, const NetConfig& config, uint64_t seed) : config_(config), store_(device, seed) {}

  NetConfig config_;
  ParameterStore store_;
};

/// Whether a network of this kind is driven by face codes. The others' faces move with the mesh at most.
inline bool reads_face_code(const NetConfig& config) {
  return config.kind == NetKind::Degas;
}

/// The network of net.kind; the arguments are AvatarNet's.
std::unique_ptr<MapNetwork> make_network(Device& device, const NetConfig& config, int face_code_size,
                                         const Tensor& joint_masks, uint64_t seed, const FaceRegion& face_region);

/// Throws std::logic_error when an input has not `size` numbers.
void require_input(const char* name, const Tensor& tensor, int64_t size);

}  // namespace degas
