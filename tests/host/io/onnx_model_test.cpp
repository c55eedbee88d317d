#include "host/io/onnx_model.h"

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

const std::string channel_means = std::string(DEGAS_TEST_VECTORS) + "/io/channel_means.onnx";

Image8 even_picture(int side, uint8_t red, uint8_t green, uint8_t blue) {
  Image8 picture = Image8::black(side, side, 3);
  for (size_t i = 0; i < picture.pixels.size(); i += 3) {
    picture.pixels[i] = red;
    picture.pixels[i + 1] = green;
    picture.pixels[i + 2] = blue;
  }
  return picture;
}

}  // namespace

TEST_CASE("a network is given RGB with mean and scale by channel, and its largest output is taken") {
  OnnxModel model(channel_means, {16, {10, 20, 30}, {0.5, 0.25, 2}});
  const std::vector<float> numbers = model(even_picture(16, 110, 60, 31));
  const float red = 50, green = 10, blue = 2;
  REQUIRE(numbers.size() == 4);
  CHECK(numbers[0] == Approx(red));
  CHECK(numbers[1] == Approx(green));
  CHECK(numbers[2] == Approx(blue));
  CHECK(numbers[3] == Approx(red + 2 * green + 4 * blue));
  OnnxModel by_name(channel_means, {16, {0, 0, 0}, {1, 1, 1}}, "sum");
  CHECK(by_name(even_picture(16, 1, 2, 3)) == std::vector<float>{6});
}

TEST_CASE("a square of another side is interpolated between pixel centres") {
  OnnxModel model(channel_means, {16, {0, 0, 0}, {1, 1, 1}});
  // Red rises by 2 a pixel of 8: between the centres the same slope, beyond the outer ones nothing.
  std::vector<float> square(8 * 8 * 3);
  for (size_t i = 0; i < 64; ++i) square[3 * i] = 2 * static_cast<float>(i % 8) + 100;
  CHECK(model(square, 8)[0] == Approx(107));
  square.assign(8 * 8 * 3, 0);
  square[0] = 64;  // a corner: along each axis one pixel sees it whole, the next two by 3/4 and 1/4
  CHECK(model(square, 8)[0] == Approx(64 * 2.0 * 2.0 / 256));
  CHECK_THROWS_AS(model(square, 9), std::logic_error);
}

TEST_CASE("what is no network, or takes another input, is named") {
  const TemporaryFolder folder;
  write_file_atomically(folder / "text.onnx", std::vector<std::byte>(100, std::byte{'x'}));
  CHECK_THROWS_WITH(OnnxModel(folder / "none.onnx", {}), Contains("none.onnx: no such file"));
  CHECK_THROWS_WITH(OnnxModel(folder / "text.onnx", {}), Contains("text.onnx: is no ONNX network that OpenCV"));
  CHECK_THROWS_WITH(OnnxModel(channel_means, {16}, "codes"),
                    Contains("no output 'codes'; outputs here: ") && Contains("code"));
}

TEST_CASE("tensors that do not hold the numbers they are to hold are refused before OpenCV copies them") {
  const TemporaryFolder folder;
  const std::vector<std::byte> good = read_file_bytes(channel_means);
  const auto load = [&](size_t at, const std::vector<int>& from, const std::vector<int>& to) {
    std::vector<std::byte> bytes = good;
    for (size_t i = 0; i < from.size(); ++i) {
      REQUIRE(static_cast<int>(bytes[at + i]) == from[i]);
      bytes[at + i] = static_cast<std::byte>(to[i]);
    }
    write_file_atomically(folder / "damaged.onnx", bytes);
    OnnxModel(folder / "damaged.onnx", {16});
  };
  // The weight `onnx::MatMul_7` of 3 x 4 floats: dimensions, type, name, 48 bytes.
  const size_t weight = 0x155;
  const std::vector<int> dims = {8, 3, 8, 4}, type = {16, 1}, raw = {0x4a, 48};
  CHECK_THROWS_WITH(load(weight, dims, {8, 3, 8, 5}), Contains("damaged.onnx: ") &&
                                                          Contains("'onnx::MatMul_7' does not hold the 15 numbers") &&
                                                          Contains("[3, 5]"));
  CHECK_THROWS_WITH(load(weight, dims, {8, 3, 8, 3}), Contains("does not hold the 9 numbers"));
  CHECK_THROWS_WITH(load(weight, dims, {9, 3, 8, 4}), Contains("is no ONNX network that is whole"));
  const int int64 = 7, float64 = 11;
  CHECK_THROWS_WITH(load(weight + 4, type, {16, int64}), Contains("does not hold the 12 numbers"));
  CHECK_THROWS_WITH(load(weight + 4, type, {16, float64}), Contains("does not hold the 12 numbers"));
  const int as_floats = 0x22, as_int64s = 0x3a;
  CHECK_NOTHROW(load(weight + 22, raw, {as_floats, 48}));
  CHECK_THROWS_WITH(load(weight + 22, raw, {as_int64s, 48}), Contains("does not hold the 12 numbers"));
  CHECK_THROWS_WITH(load(weight - 1, {72}, {120}), Contains("is no ONNX network that is whole"));
  // As a field of dimensions, the 48 bytes are as many.
  const int as_dimensions = 0x0a;
  CHECK_THROWS_WITH(load(weight + 22, raw, {as_dimensions, 48}), Contains("a tensor of more than 32 dimensions"));
}

TEST_CASE("the face landmarks of a picture: 478 points in the picture") {
  const std::string path = data_path("weights/face_landmarks_detector.onnx");
  if (path.empty()) return;
  OnnxModel model(path, {});
  const std::vector<float> numbers = model(even_picture(256, 200, 150, 120));
  CHECK(numbers.size() == 3 * 478);
  CHECK(std::all_of(numbers.begin(), numbers.end(), [](float value) { return value > -256 && value < 512; }));
}
