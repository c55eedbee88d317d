#pragma once

#include <array>
#include <tuple>
#include <vector>

#include "host/autograd/tensor.h"

namespace degas {

/// Arrays of a launch, as in kernels/common/batch.cl.
constexpr size_t batch_size = 16;

/// Work-items that share a block of such a launch: their local size.
inline int group_size(const Device& device) {
  return device.is_wide() ? 1 : 256;
}

/// Launches a kernel whose first arguments are the tensors that arrays(member) gives as a tuple, for each of at most
/// batch_size members; null pointers stand for those that are missing.
template <typename Member, typename Arrays, typename... Arguments>
void launch_batch(const Kernel& kernel, const Range& global, const Range& local, const std::vector<Member>& members,
                  const Arrays& arrays, const Arguments&... arguments) {
  std::array<decltype(arrays(members.front())), batch_size> tensors;
  for (size_t k = 0; k < members.size(); ++k) tensors[k] = arrays(members[k]);
  std::apply([&](const auto&... tensor) { kernel.launch(global, local, tensor..., arguments...); },
             std::apply([](const auto&... each) { return std::tuple_cat(each...); }, tensors));
}

}  // namespace degas
