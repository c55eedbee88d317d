#include "bench/support/onednn_conv2d.h"

#ifdef DEGAS_HAVE_ONEDNN

#include <algorithm>
#include <cstring>
#include <dnnl.hpp>

namespace degas::bench {
namespace {

using dnnl::memory;

memory filled(const memory::desc& description, const dnnl::engine& engine) {
  memory result(description, engine);
  // Any finite numbers do; zeros could be special to the hardware.
  auto* values = static_cast<float*>(result.get_data_handle());
  for (size_t i = 0; i < description.get_size() / sizeof(float); ++i) values[i] = static_cast<float>(i % 17) - 8;
  return result;
}

}  // namespace

struct OneDnnConv2d::State {
  dnnl::engine engine{dnnl::engine::kind::cpu, 0};
  dnnl::stream stream{engine};
  dnnl::primitive primitive;
  std::unordered_map<int, memory> arguments;
};

OneDnnConv2d::OneDnnConv2d(const Conv2dGeometry& g, Direction direction) : state_(std::make_unique<State>()) {
  const auto f32 = memory::data_type::f32;
  const memory::desc source({g.batch, g.channels, g.height, g.width}, f32, memory::format_tag::nhwc);
  const memory::desc target({g.batch, g.output_channels, g.output_height, g.output_width}, f32,
                            memory::format_tag::nhwc);
  const memory::desc weight({g.groups, g.output_depth(), g.depth(), g.kernel_size, g.kernel_size}, f32,
                            memory::format_tag::any);
  const memory::dims strides = {g.stride, g.stride}, before = {g.padding, g.padding};
  // oneDNN wants the padding that makes its size formula exact; where that is negative, none does.
  const auto behind = [&](int input, int output) {
    return std::max(0, (output - 1) * g.stride + g.kernel_size - input - g.padding);
  };
  const memory::dims after = {behind(g.height, g.output_height), behind(g.width, g.output_width)};
  const auto algorithm = dnnl::algorithm::convolution_direct;
  const auto& engine = state_->engine;
  const dnnl::convolution_forward::primitive_desc forward(
      {dnnl::prop_kind::forward_training, algorithm, source, weight, target, strides, before, after}, engine);
  auto& arguments = state_->arguments;
  if (direction == Direction::FusedForward) {
    dnnl::post_ops activation;
    activation.append_eltwise(1.0F, dnnl::algorithm::eltwise_relu, 0.2F, 0.0F);
    dnnl::primitive_attr attributes;
    attributes.set_post_ops(activation);
    const memory::desc bias({g.output_channels}, f32, memory::format_tag::x);
    const dnnl::convolution_forward::primitive_desc fused(
        {dnnl::prop_kind::forward_training, algorithm, source, weight, bias, target, strides, before, after},
        attributes, engine);
    state_->primitive = dnnl::convolution_forward(fused);
    arguments = {{DNNL_ARG_SRC, filled(fused.src_desc(), engine)},
                 {DNNL_ARG_WEIGHTS, filled(fused.weights_desc(), engine)},
                 {DNNL_ARG_BIAS, filled(fused.bias_desc(), engine)},
                 {DNNL_ARG_DST, filled(fused.dst_desc(), engine)}};
  } else if (direction == Direction::Forward) {
    state_->primitive = dnnl::convolution_forward(forward);
    arguments = {{DNNL_ARG_SRC, filled(forward.src_desc(), engine)},
                 {DNNL_ARG_WEIGHTS, filled(forward.weights_desc(), engine)},
                 {DNNL_ARG_DST, filled(forward.dst_desc(), engine)}};
  } else if (direction == Direction::BackwardInput) {
    const dnnl::convolution_backward_data::primitive_desc backward(
        {algorithm, source, weight, target, strides, before, after}, engine, forward);
    state_->primitive = dnnl::convolution_backward_data(backward);
    arguments = {{DNNL_ARG_DIFF_SRC, filled(backward.diff_src_desc(), engine)},
                 {DNNL_ARG_WEIGHTS, filled(backward.weights_desc(), engine)},
                 {DNNL_ARG_DIFF_DST, filled(backward.diff_dst_desc(), engine)}};
  } else {
    const dnnl::convolution_backward_weights::primitive_desc backward(
        {algorithm, source, weight, target, strides, before, after}, engine, forward);
    state_->primitive = dnnl::convolution_backward_weights(backward);
    arguments = {{DNNL_ARG_SRC, filled(backward.src_desc(), engine)},
                 {DNNL_ARG_DIFF_WEIGHTS, filled(backward.diff_weights_desc(), engine)},
                 {DNNL_ARG_DIFF_DST, filled(backward.diff_dst_desc(), engine)}};
  }
}

OneDnnConv2d::~OneDnnConv2d() = default;

void OneDnnConv2d::run() {
  state_->primitive.execute(state_->stream, state_->arguments);
}

void OneDnnConv2d::wait() {
  state_->stream.wait();
}

}  // namespace degas::bench

#endif
