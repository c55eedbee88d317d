#include "model/net/static_maps.h"

namespace degas {

StaticMaps::StaticMaps(Device& device, const NetConfig& config, uint64_t seed) : MapNetwork(device, config, seed) {
  for (const Head& head : heads_of(config_)) {
    maps_.push_back(store_.create_zeros(std::string("map.") + head.name,
                                        {1, config_.resolution, config_.resolution, head.channels}));
  }
}

HeadMaps StaticMaps::decode(Tape& tape, const Inputs&, std::optional<uint64_t>) const {
  return head_maps(tape, config_, maps_);
}

}  // namespace degas
