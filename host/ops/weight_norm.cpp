#include "host/ops/weight_norm.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace degas {
namespace {

/// v's elements as groups x rows x columns, for the kernels.
struct Layout {
  int groups, rows, columns;
  int outputs() const { return groups * columns; }
};

/// Elements up to which one work-group does a whole pass: a GPU has more of them to keep busy.
int64_t small_size(const Device& device) {
  return device.is_wide() ? 1 << 16 : 1 << 13;
}

int group_size(const Device& device) {
  return device.is_wide() ? 1 : 256;
}

Kernel weight_norm_kernel(Device& device, const char* name) {
  return device.kernel("weight_norm", name, {{"GROUP", group_size(device)}});
}

template <typename... Arguments>
void launch_small(const char* name, const Layout& layout, const Tensor& v, const Arguments&... arguments) {
  Device& device = v.device();
  const size_t group = group_size(device);
  weight_norm_kernel(device, name)
      .launch({group}, {group}, v, arguments..., LocalMemory{group * device.real_bytes()}, layout.groups, layout.rows,
              layout.columns);
}

size_t vectors_in(const Device& device, int columns) {
  return static_cast<size_t>((columns + device.vector_width() - 1) / device.vector_width());
}

/// Partial sums of a * b, in an order fixed by the size; `finish` adds them up.
void dot(const Tensor& a, const Tensor& b, const char* finish, const Tensor& result) {
  Device& device = a.device();
  const int64_t vectors = std::max<int64_t>(1, a.size() / device.vector_width());
  int64_t partials, stretch;
  if (device.is_wide()) {
    stretch = std::max<int64_t>(256, (vectors + 63) / 64);
    partials = (vectors + stretch - 1) / stretch;
  } else {
    stretch = 1;
    partials = std::min<int64_t>(512, (vectors + 15) / 16);
  }
  const Tensor partial(device, {partials});
  weight_norm_kernel(device, "partial_dot")
      .launch({static_cast<size_t>(partials)}, {device.is_wide() ? size_t{1} : size_t{64}}, a, b, partial,
              static_cast<int>(partials), stretch, a.size());
  weight_norm_kernel(device, finish).launch({1}, {1}, partial, static_cast<int>(partials), result);
}

template <typename... Arguments>
void launch_rows(const char* name, const Layout& layout, const Tensor& target, const Arguments&... arguments) {
  Device& device = target.device();
  const size_t rows = static_cast<size_t>(layout.groups) * layout.rows;
  const Range local = device.is_wide() ? Range{1, 64} : Range{32, 4};
  weight_norm_kernel(device, name)
      .launch({vectors_in(device, layout.columns), rows}, local, arguments..., layout.groups, layout.rows,
              layout.columns);
}

/// s[o] = sum of dw * v over the elements of output o, and with it dgain.
Tensor sum_outputs(const Tensor& v, const Tensor& dw, const Tensor& norm, const Tensor& dgain, const Layout& layout) {
  Device& device = v.device();
  const int chunk_rows = std::max(32, (layout.rows + 31) / 32);
  const int chunks = (layout.rows + chunk_rows - 1) / chunk_rows;
  const Tensor partial(device, {chunks, layout.outputs()}), sums(device, {layout.outputs()});
  const Range local = device.is_wide() ? Range{1, 1, 1} : Range{32, 1, 1};
  weight_norm_kernel(device, "output_sums")
      .launch({vectors_in(device, layout.columns), static_cast<size_t>(chunks), static_cast<size_t>(layout.groups)},
              local, v, dw, partial, layout.groups, layout.rows, layout.columns, chunk_rows);
  weight_norm_kernel(device, "finish_output_sums")
      .launch({static_cast<size_t>(layout.outputs())}, {64}, partial, norm, sums, dgain, chunks, layout.outputs());
  return sums;
}

}  // namespace

Tensor weight_norm(Tape& tape, const Tensor& v, const Tensor& gain, int groups) {
  const Layout layout{groups, static_cast<int>(v.size() / (groups * v.dim(-1))), static_cast<int>(v.dim(-1))};
  if (gain.size() != layout.outputs() || int64_t{groups} * layout.rows * layout.columns != v.size()) {
    throw std::logic_error(fmt::format("[weight_norm] gain {} and {} groups do not fit v {}", to_string(gain.shape()),
                                       groups, to_string(v.shape())));
  }
  Device& device = tape.device();
  const Tensor norm(device, {2}), output(device, v.shape());
  const bool is_small = v.size() <= small_size(device);
  if (is_small) {
    launch_small("weight_norm_small", layout, v, gain, norm, output);
  } else {
    dot(v, v, "finish_norm", norm);
    launch_rows("weight_norm", layout, output, v, gain, norm, output);
  }
  tape.record("weight_norm", {v, gain}, {output}, [=](Tape& tape) {
    Device& device = tape.device();
    const Tensor dw = output.gradient(), dv(device, v.shape()), dgain(device, gain.shape());
    if (is_small) {
      launch_small("weight_norm_small_backward", layout, v, gain, norm, dw, dv, dgain);
    } else {
      const Tensor sums = sum_outputs(v, dw, norm, dgain, layout), along(device, {1});
      dot(gain, sums, "finish_dot", along);
      launch_rows("weight_norm_backward", layout, dv, v, gain, norm, dw, along, dv);
    }
    tape.accumulate(gain, dgain);
    tape.accumulate(v, dv);
  });
  return output;
}

}  // namespace degas
