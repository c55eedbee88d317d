#include "model/cli/metric_options.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <memory>

#include "host/error.h"
#include "model/cli/network_input.h"
#include "model/config_fields.h"
#include "model/faces/face_encoder.h"
#include "model/loss/lpips_weights.h"

namespace degas {
namespace {

LpipsNetwork lpips_network(const std::string& name) {
  const std::vector<std::string> names = choice_names<LpipsNetwork>();
  return static_cast<LpipsNetwork>(std::find(names.begin(), names.end(), name) - names.begin());
}

}  // namespace

MetricNetworks MetricChoice::networks(Device& device, const LossConfig& loss) const {
  MetricNetworks networks = lpips.empty() ? default_metric_networks(loss) : MetricNetworks();
  for (const std::string& name : lpips) {
    // The path of a config may be that of one network's file; another's is looked for beside it.
    std::filesystem::path configured = loss.lpips_weights;
    if (std::filesystem::is_regular_file(configured)) configured = configured.parent_path();
    const LpipsNetwork network = lpips_network(name);
    networks.lpips.emplace_back(network, load_lpips_layers(lpips_weights_path(configured.string(), network), network));
  }
  if (!inception.empty()) {
    const OnnxInput usual{299, {127.5, 127.5, 127.5}, {1 / 127.5, 1 / 127.5, 1 / 127.5}};
    const NetworkInput input = parse_network_input(inception_input, "--inception-input", {usual, ""});
    const auto model = std::make_shared<OnnxModel>(inception, input.picture, input.output);
    networks.inception = [model](std::span<const float> square, int side) { return (*model)(square, side); };
    networks.description["inception"] = file_description(inception);
  }
  if (!expression.empty()) {
    const bool is_onnx = expression.extension() == ".onnx";
    const NetworkInput input = parse_network_input(expression_input, "--expression-input", {});
    const FaceEncoder encoder = is_onnx ? make_onnx_encoder(expression, input.picture, input.output)
                                        : make_dpe_encoder(device, expression, parse_encoder_keys(keys));
    networks.expression = encoder.code;
    networks.expression_side = encoder.side;
    networks.description["expression"] = encoder.description;
  }
  return networks;
}

std::vector<std::string> MetricChoice::words() const {
  std::vector<std::string> words;
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  add("--lpips", fmt::format("{}", fmt::join(lpips, ",")));
  add("--inception", inception.string());
  add("--inception-input", inception_input);
  add("--expression", expression.string());
  add("--expression-input", expression_input);
  add("--keys", keys);
  return words;
}

void add_metric_options(CLI::App& command, MetricChoice& choice) {
  command
      .add_option("--lpips", choice.lpips,
                  "LPIPS by these of alex, squeeze and vgg, each from lpips_NAME_v0.1.npz (default: alex,\n"
                  "where its weights are)")
      ->delimiter(',')
      ->check(CLI::IsMember(choice_names<LpipsNetwork>()));
  CLI::Option* inception = command.add_option("--inception", choice.inception,
                                              "FID by this ONNX network, (1,3,N,N) RGB pictures to features");
  command
      .add_option("--inception-input", choice.inception_input,
                  "Its side N, pixels (value - mean) * scale of 0..255, and output that counts (default:\n"
                  "side=299,mean=127.5,scale=0.00784314, the largest output)")
      ->needs(inception);
  CLI::Option* expression = command.add_option(
      "--expression", choice.expression,
      "AED by this network of face pictures: ONNX, or DPE's checkpoint (.pt, .npz) with its encoder");
  command
      .add_option("--expression-input", choice.expression_input,
                  "The same of an ONNX one (default: side=256,mean=0,scale=0.00392157)")
      ->needs(expression);
  command.add_option("--keys", choice.keys, "Where DPE's encoder lies in its checkpoint; see encode-faces")
      ->needs(expression);
}

}  // namespace degas
