#include "model/net/expression_encoder.h"

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/npz.h"
#include "host/io/torch_archive.h"
#include "host/ops/pointwise.h"
#include "host/ops/reduction.h"
#include "model/net/expression_encoder_weights.h"
#include "tests/support/encoder_weights.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

// As in tests/vectors/make_expression_encoder.py.
constexpr size_t stride = 13;
const EncoderSizes narrow = {{8, 16, 24, 32}, 20, 5, 3, 12};
const EncoderSizes published = {{64, 128, 256, 512, 512, 512, 512}, 512, 20, 5, 512};

ExpressionEncoder load(Device& device, const TorchTensors& tensors) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "weights.pt", make_torch_archive(tensors));
  return ExpressionEncoder(device, load_expression_encoder(folder / "weights.pt"));
}

Tensor drawn(Device& device, const std::string& name, const Shape& shape) {
  const std::vector<float> values = encoder_numbers(name, shape, 1);
  return Tensor::from(device, shape, std::span<const float>(values));
}

/// Largest difference relative to the stored ones' largest.
double difference(const std::vector<double>& values, const std::vector<double>& stored) {
  REQUIRE(values.size() == stored.size());
  double largest = 0, scale = 0;
  for (size_t i = 0; i < stored.size(); ++i) {
    const double error = std::abs(values[i] - stored[i]);
    if (!(error <= largest)) largest = error;
    scale = std::max(scale, std::abs(stored[i]));
  }
  return largest / scale;
}

const NpzFile& vectors() {
  static const NpzFile file(std::string(DEGAS_TEST_VECTORS) + "/expression_encoder.npz");
  return file;
}

}  // namespace

TEST_CASE("the encoder equals PyTorch's module of the same equations") {
  const KernelSet set = GENERATE(from_range(kernel_sets()));
  const Real real = GENERATE(Real::Double, Real::Float);
  Device& device = test::device(set, real);
  const ExpressionEncoder encoder = load(device, make_encoder_weights(narrow));
  CHECK(encoder.image_side() == 32);
  CHECK(encoder.code_size() == 12);
  const double bar = real == Real::Double ? 1e-9 : 1e-4;

  Tensor images = drawn(device, "images", {2, 32, 32, 3});
  images.set_requires_gradient();
  Tape tape(device);
  const Tensor code = encoder(tape, images);
  CHECK(difference(code.to_host<double>(), vectors().read("small_code").doubles()) < bar);
  tape.backward(sum(tape, multiply(tape, code, drawn(device, "code", code.shape()))));
  const std::vector<double> gradient = images.gradient().to_host<double>();
  std::vector<double> sampled;
  for (size_t i = 0; i < gradient.size(); i += stride) sampled.push_back(gradient[i]);
  CHECK(difference(sampled, vectors().read("small_image_gradient").doubles()) < bar);
}

TEST_CASE("the encoder of DPE's own sizes equals PyTorch's") {
  const KernelSet set = GENERATE(from_range(kernel_sets()));
  Device& device = test::device(set);
  const TorchTensors tensors = make_encoder_weights(published);
  int64_t count = 0;
  for (const auto& [name, tensor] : tensors) count += element_count(tensor.shape);
  CHECK(count == vectors().read("full_parameter_count").integers()[0]);
  const ExpressionEncoder encoder = load(device, tensors);
  CHECK(encoder.image_side() == 256);
  Tape tape(device, false);
  const std::vector<double> code = encoder(tape, drawn(device, "full_image", {1, 256, 256, 3})).to_host<double>();
  CHECK(code.size() == 512);
  CHECK(difference(code, vectors().read("full_code").doubles()) < 1e-4);
}

TEST_CASE("weights come from torch archives at any depth, and what does not fit is named") {
  const TemporaryFolder folder;
  TorchTensors tensors = make_encoder_weights(narrow);
  const auto save = [&](const std::string& file, const std::string& prefix) {
    TorchTensors renamed;
    for (const auto& [name, tensor] : tensors) renamed[prefix + name] = tensor;
    write_file_atomically(folder / file, make_torch_archive(renamed));
    return folder / file;
  };
  write_npz(folder / "weights.npz", tensors);
  CHECK(load_expression_encoder(folder / "weights.npz").blocks.size() == 3);
  CHECK(load_expression_encoder(save("whole.pt", "gen.")).blocks.size() == 3);
  CHECK_THROWS_WITH(parse_encoder_keys("head=x"), Contains("--keys head=x: 'head=x' is no PART=PATH"));

  SECTION("other names") {
    for (const std::string layer : {"0.weight", "0.bias", "1.weight", "1.bias", "2.weight", "2.bias"}) {
      auto moved = tensors.extract("mlp_exp." + layer);
      moved.key() = "exp_fc." + layer;
      tensors.insert(std::move(moved));
    }
    CHECK_THROWS_WITH(load_expression_encoder(save("keys.pt", "")), Contains("keys.pt: no tensor 'mlp_exp.0.weight'") &&
                                                                        Contains("--keys code=PATH") &&
                                                                        Contains("exp_fc"));
    CHECK(load_expression_encoder(folder / "keys.pt", parse_encoder_keys("code=exp_fc")).code.size() == 3);
  }
  SECTION("two of a kind") {
    tensors["pose.dir.weight"] = tensors["dir.weight"];
    CHECK_THROWS_WITH(load_expression_encoder(save("two.pt", "")),
                      Contains("basis may be any of dir.weight, pose.dir.weight"));
  }
  SECTION("a missing layer") {
    tensors.erase("enc.net_app.convs.2.skip.1.weight");
    CHECK_THROWS_WITH(load_expression_encoder(save("missing.pt", "")),
                      Contains("missing.pt: no tensor 'enc.net_app.convs.2.skip.1.weight'"));
  }
  SECTION("a shape that does not follow") {
    tensors["mlp.1.weight"] = NpyArray::from({20, 19}, std::vector<float>(380));
    CHECK_THROWS_WITH(load_expression_encoder(save("shape.pt", "")),
                      Contains("'mlp.1.weight' has shape (20, 19), expected (any, 20)"));
  }
  SECTION("a bias of another length") {
    tensors["enc.net_app.convs.0.1.bias"] = NpyArray::from({7}, std::vector<float>(7));
    CHECK_THROWS_WITH(load_expression_encoder(save("bias.pt", "")),
                      Contains("'enc.net_app.convs.0.1.bias' has 7 numbers, expected 8"));
  }
  SECTION("numbers that are none") {
    tensors["mlp.0.bias"] = NpyArray::from({20}, std::vector<float>(20, NAN));
    CHECK_THROWS_WITH(load_expression_encoder(save("nan.pt", "")),
                      Contains("'mlp.0.bias' holds numbers that are not finite"));
  }
}
