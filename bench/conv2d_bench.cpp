// Convolutions of the network (full and quick configurations) and of LPIPS: time and rate of the forward pass, plain
// and with bias and leaky ReLU, and of both gradients, with oneDNN beside them where the build found it and the device
// is a CPU; with --tune tuned parameters, and the built-in ones beside them.
#include <fmt/format.h>

#include "bench/support/harness.h"
#include "bench/support/onednn_conv2d.h"
#include "host/device/tuner.h"
#include "host/device/user_cache.h"

using namespace degas;
using namespace degas::bench;

namespace {

struct Layer {
  const char* name;
  int size, channels, output_channels, kernel_size, stride, padding, groups;
  BiasKind bias;
  bool trained;  // LPIPS weights are not

  Conv2dGeometry geometry() const {
    const int output = (size + 2 * padding - kernel_size) / stride + 1;
    return {1, size, size, channels, output, output, output_channels, kernel_size, stride, padding, groups};
  }
};

constexpr auto untied = BiasKind::Untied, tied = BiasKind::Tied;
constexpr Layer layers[] = {
    {"full/decoder0.conv1", 128, 384, 384, 3, 1, 1, 3, untied, true},
    {"full/decoder0.conv2", 128, 384, 192, 3, 1, 1, 3, untied, true},
    {"full/decoder0.skip", 128, 384, 192, 1, 1, 0, 3, tied, true},
    {"full/decoder1.conv1", 256, 192, 192, 3, 1, 1, 3, untied, true},
    {"full/decoder1.conv2", 256, 192, 96, 3, 1, 1, 3, untied, true},
    {"full/decoder1.skip", 256, 192, 96, 1, 1, 0, 3, tied, true},
    {"full/decoder2.conv1", 512, 96, 96, 3, 1, 1, 3, untied, true},
    {"full/decoder2.conv2", 512, 96, 48, 3, 1, 1, 3, untied, true},
    {"full/decoder2.skip", 512, 96, 48, 1, 1, 0, 3, tied, true},
    {"full/head.position", 512, 16, 3, 3, 1, 1, 1, untied, true},
    {"full/head.color_opacity", 512, 16, 4, 3, 1, 1, 1, untied, true},
    {"full/head.rotation_scale", 512, 16, 7, 3, 1, 1, 1, untied, true},
    {"full/joint.conv1", 64, 80, 80, 3, 1, 1, 1, untied, true},
    {"full/joint.conv2", 64, 80, 128, 3, 1, 1, 1, untied, true},
    {"full/pose.skip", 64, 162, 16, 1, 1, 0, 1, tied, true},
    {"full/encoder0.conv1", 512, 3, 3, 3, 1, 1, 1, untied, true},
    {"full/encoder0.conv2", 512, 3, 8, 3, 2, 1, 1, untied, true},
    {"full/encoder0.skip", 512, 3, 8, 1, 2, 0, 1, tied, true},
    {"full/encoder1.conv1", 256, 8, 8, 3, 1, 1, 1, untied, true},
    {"full/encoder1.conv2", 256, 8, 16, 3, 2, 1, 1, untied, true},
    {"full/encoder2.conv1", 128, 16, 16, 3, 1, 1, 1, untied, true},
    {"full/encoder2.conv2", 128, 16, 32, 3, 2, 1, 1, untied, true},
    {"full/encoder4.conv2", 32, 32, 64, 3, 2, 1, 1, untied, true},
    {"full/encoder6.conv2", 8, 128, 128, 3, 2, 1, 1, untied, true},
    {"full/encoder6.skip", 8, 128, 128, 1, 2, 0, 1, tied, true},
    {"full/pve_decoder0.conv1", 8, 128, 128, 3, 1, 1, 1, untied, true},
    {"full/pve_decoder3.conv2", 64, 64, 32, 3, 1, 1, 1, untied, true},
    {"full/face0.conv1", 8, 32, 32, 3, 1, 1, 1, untied, true},
    {"quick/decoder0.conv1", 64, 192, 192, 3, 1, 1, 3, untied, true},
    {"quick/decoder0.conv2", 64, 192, 96, 3, 1, 1, 3, untied, true},
    {"quick/decoder1.conv1", 128, 96, 96, 3, 1, 1, 3, untied, true},
    {"quick/decoder1.conv2", 128, 96, 48, 3, 1, 1, 3, untied, true},
    {"quick/decoder2.conv1", 256, 48, 48, 3, 1, 1, 3, untied, true},
    {"quick/decoder2.conv2", 256, 48, 24, 3, 1, 1, 3, untied, true},
    {"quick/decoder2.skip", 256, 48, 24, 1, 1, 0, 3, tied, true},
    {"quick/head.rotation_scale", 256, 8, 7, 3, 1, 1, 1, untied, true},
    {"quick/encoder0.conv1", 256, 3, 3, 3, 1, 1, 1, untied, true},
    {"quick/encoder0.conv2", 256, 3, 8, 3, 2, 1, 1, untied, true},
    {"quick/encoder1.conv1", 128, 8, 8, 3, 1, 1, 1, untied, true},
    {"quick/joint.conv2", 32, 40, 64, 3, 1, 1, 1, untied, true},
    {"reference/conv3x3.32", 128, 32, 32, 3, 1, 1, 1, tied, true},
    {"lpips/alex.conv1", 256, 3, 64, 11, 4, 2, 1, tied, false},
    {"lpips/alex.conv2", 31, 64, 192, 5, 1, 2, 1, tied, false},
    {"lpips/alex.conv3", 15, 192, 384, 3, 1, 1, 1, tied, false},
    {"lpips/alex.conv4", 15, 384, 256, 3, 1, 1, 1, tied, false},
    {"lpips/squeeze.fire2.squeeze", 63, 128, 16, 1, 1, 0, 1, tied, false},
    {"lpips/squeeze.fire2.expand3", 63, 16, 64, 3, 1, 1, 1, tied, false},
};

const char* name_of(Direction direction) {
  switch (direction) {
    case Direction::Forward:
      return "forward";
    case Direction::FusedForward:
      return "forward+bias+lrelu";
    case Direction::BackwardInput:
      return "backward_input";
    case Direction::BackwardWeight:
      return "backward_weight";
  }
  return "";
}

Tensor numbers(Device& device, Shape shape) {
  std::vector<float> values(element_count(shape));
  for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 17) - 8;
  return Tensor::from(device, std::move(shape), std::span<const float>(values));
}

Timing measure_ours(Bench& bench, const Layer& layer, Direction direction) {
  const Conv2dGeometry g = layer.geometry();
  Device& device = bench.device;
  const Tensor input = numbers(device, {1, g.height, g.width, g.channels});
  const Tensor weight = numbers(device, {g.groups, g.kernel_size, g.kernel_size, g.depth(), g.output_depth()});
  const Tensor output = numbers(device, g.output_shape());
  const Tensor bias = layer.bias == tied ? numbers(device, {g.output_channels})
                                         : numbers(device, {g.output_height, g.output_width, g.output_channels});
  return bench.time([&] {
    switch (direction) {
      case Direction::Forward:
        return conv2d_forward(g, input, weight, Tensor(), BiasKind::None, 1, output);
      case Direction::FusedForward:
        return conv2d_forward(g, input, weight, bias, layer.bias, 0.2, output);
      case Direction::BackwardInput:
        return conv2d_backward_input(g, output, weight, input);
      case Direction::BackwardWeight:
        return conv2d_backward_weight(g, input, output, weight);
    }
  });
}

}  // namespace

int main(int count, char** values) {
  Bench bench(count, values, "conv2d");
  for (const Layer& layer : layers) {
    for (const Direction direction :
         {Direction::Forward, Direction::FusedForward, Direction::BackwardInput, Direction::BackwardWeight}) {
      if (direction == Direction::BackwardWeight && !layer.trained) continue;
      Row row;
      row.name = fmt::format("{} {}", layer.name, name_of(direction));
      row.kind = name_of(direction);
      if (!bench.arguments.wants(row.name)) continue;
      const Conv2dGeometry g = layer.geometry();
      row.gflop = 2e-9 * static_cast<double>(g.output_pixels()) * g.taps() * g.depth() * g.output_channels;
      row.time = measure_ours(bench, layer, direction);
      if (bench.arguments.tune != TuneMode::Off) {
        row.peer = "the same with built-in parameters";
        row.peer_time = row.time;
        bench.device.set_tuner(
            std::make_unique<Tuner>(bench.device, bench.arguments.tune, cache_folder() / "tuning.json"));
        row.time = measure_ours(bench, layer, direction);
        bench.device.set_tuner(nullptr);
        bench.report.add(row);
        continue;
      }
#ifdef DEGAS_HAVE_ONEDNN
      // oneDNN 2.6 overruns its buffers in the weight gradient of a 1x1 stride-2 layer of three channels.
      const bool overruns =
          direction == Direction::BackwardWeight && g.kernel_size == 1 && g.stride > 1 && g.channels < 16;
      if (bench.device.description().is_cpu && !overruns) {
        OneDnnConv2d peer(g, direction);
        row.peer = "oneDNN";
        row.peer_time = measure([&] { peer.run(); }, [&] { peer.wait(); }, {.clock = bench.arguments.clock});
      }
#endif
      bench.report.add(row);
    }
  }
  bench.finish();
}
