#include "host/ops/drift.h"

#include <fmt/format.h>

#include <numeric>
#include <span>
#include <stdexcept>

#include "host/ops/batch.h"

namespace degas {

RowGroups group_rows(Device& device, const std::vector<int32_t>& group_of_row, int groups) {
  std::vector<int32_t> starts(static_cast<size_t>(groups) + 1);
  for (const int32_t group : group_of_row) {
    if (group < 0 || group >= groups) throw std::logic_error(fmt::format("[group_rows] group {} of {}", group, groups));
    ++starts[static_cast<size_t>(group) + 1];
  }
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  std::vector<int32_t> members(group_of_row.size()), next = starts;
  for (size_t row = 0; row < group_of_row.size(); ++row) {
    members[static_cast<size_t>(next[static_cast<size_t>(group_of_row[row])]++)] = static_cast<int32_t>(row);
  }
  const auto count = static_cast<int64_t>(group_of_row.size());
  return {Tensor::from(device, {count}, std::span<const int32_t>(members)),
          Tensor::from(device, {groups + 1}, std::span<const int32_t>(starts)),
          Tensor::from(device, {count}, std::span<const int32_t>(group_of_row))};
}

Tensor mean_drift(Tape& tape, const Tensor& vectors, const RowGroups& groups) {
  const int64_t count = groups.members.size(), group_count = groups.starts.size() - 1;
  if (vectors.shape() != Shape{count, 3}) {
    throw std::logic_error(fmt::format("[mean_drift] needs ({},3), got {}", count, to_string(vectors.shape())));
  }
  Device& device = tape.device();
  const auto items = static_cast<size_t>(group_size(device));
  const Defines defines = {{"GROUP", group_size(device)}};
  const Tensor means(device, {group_count, 3}), output(device, {1});
  device.kernel("drift", "group_means", defines)
      .launch({static_cast<size_t>(group_count) * items}, {items}, vectors, groups.members, groups.starts, means,
              LocalMemory{items * device.real_bytes()});
  device.kernel("drift", "drift", defines)
      .launch({1}, {1}, means, groups.starts, output, static_cast<int>(group_count));
  tape.record("mean_drift", {vectors}, {output}, [=](Tape& tape) {
    tape.accumulate(vectors, [&](const Tensor& gradient) {
      Device& device = tape.device();
      device.kernel("drift", "drift_gradient", defines)
          .launch({static_cast<size_t>(count)}, device.pointwise_local(), means, groups.group_of_row, output.gradient(),
                  gradient, count);
    });
  });
  return output;
}

}  // namespace degas
