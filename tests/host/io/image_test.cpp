#include "host/io/image.h"

#include <algorithm>
#include <cmath>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

Image8 gradient(int width, int height, int channels) {
  Image8 image = Image8::black(width, height, channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) image.at(x, y)[c] = static_cast<uint8_t>(7 * x + 3 * y + 60 * c);
    }
  }
  return image;
}

}  // namespace

TEST_CASE("pictures come back; channels are RGB") {
  const TemporaryFolder folder;
  const int channels = GENERATE(1, 3);
  const Image8 image = gradient(13, 7, channels);
  write_image(folder / "a.png", image);
  const Image8 back = read_image(folder / "a.png", channels);
  CHECK(back.width == 13);
  CHECK(back.height == 7);
  CHECK(back.pixels == image.pixels);
  CHECK(decode_image(encode_image(image, ".png"), channels, "memory").pixels == image.pixels);
}

TEST_CASE("JPEG pictures are read and written", "[jpeg]") {
  const TemporaryFolder folder;
  Image8 red = Image8::black(16, 16, 3);
  for (size_t i = 0; i < red.pixels.size(); i += 3) red.pixels[i] = 200;
  write_image(folder / "red.jpg", red);
  const Image8 jpeg = read_image(folder / "red.jpg");
  CHECK(jpeg.at(8, 8)[0] > 190);
  CHECK(jpeg.at(8, 8)[2] < 10);
}

TEST_CASE("pictures that cannot be read or written are named") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_image(folder / "missing.png"), Contains("missing.png: no such file"));
  write_image(folder / "cut.png", gradient(40, 40, 3));
  std::vector<std::byte> bytes = read_file_bytes(folder / "cut.png");
  bytes.resize(20);
  write_file_atomically(folder / "cut.png", bytes);
  CHECK_THROWS_WITH(read_image(folder / "cut.png"), Contains("cut.png: is no picture"));
  CHECK_THROWS_WITH(write_image(folder / "a.xyz", gradient(2, 2, 3)), Contains("'.xyz'"));
}

TEST_CASE("resizing averages areas, cropping pads with black") {
  Image8 image = Image8::black(4, 2, 1);
  image.pixels = {0, 100, 10, 30, 100, 200, 10, 30};
  CHECK(resized(image, 2, 1).pixels == std::vector<uint8_t>{100, 20});
  CHECK(cropped(image, 1, 1, 2, 1).pixels == std::vector<uint8_t>{200, 10});
  CHECK(cropped(image, -1, -1, 3, 2).pixels == std::vector<uint8_t>{0, 0, 0, 0, 0, 100});
  CHECK(cropped(image, 9, 9, 1, 1).pixels == std::vector<uint8_t>{0});
}

TEST_CASE("resizing is the mean over what a pixel covers, or linear between centres where a side grows") {
  struct Sizes {
    int width, height, new_width, new_height;
  };
  const Sizes sizes = GENERATE(Sizes{13, 7, 5, 3}, Sizes{40, 30, 17, 30}, Sizes{12, 8, 6, 2}, Sizes{5, 4, 13, 9},
                               Sizes{13, 7, 9, 15}, Sizes{1, 1, 3, 2});
  const int channels = GENERATE(1, 3);
  CAPTURE(sizes.width, sizes.height, sizes.new_width, sizes.new_height, channels);
  const Image8 image = gradient(sizes.width, sizes.height, channels);
  const double step_x = 1.0 * sizes.width / sizes.new_width, step_y = 1.0 * sizes.height / sizes.new_height;
  const bool shrinks = step_x >= 1 && step_y >= 1;
  const auto overlap = [](int pixel, double begin, double end) {
    return std::max(0.0, std::min(pixel + 1.0, end) - std::max<double>(pixel, begin));
  };
  const auto tent = [](int pixel, double center, int size) {  // with the border's pixels continued outwards
    const double at = std::clamp(center, 0.5, size - 0.5);
    return std::max(0.0, 1 - std::abs(pixel + 0.5 - at));
  };
  const Image8 out = resized(image, sizes.new_width, sizes.new_height);
  double largest = 0;
  for (int y = 0; y < sizes.new_height; ++y) {
    for (int x = 0; x < sizes.new_width; ++x) {
      for (int c = 0; c < channels; ++c) {
        double sum = 0;
        for (int v = 0; v < sizes.height; ++v) {
          for (int u = 0; u < sizes.width; ++u) {
            sum += image.at(u, v)[c] *
                   (shrinks ? overlap(u, x * step_x, (x + 1) * step_x) / step_x *
                                  overlap(v, y * step_y, (y + 1) * step_y) / step_y
                            : tent(u, (x + 0.5) * step_x, sizes.width) * tent(v, (y + 0.5) * step_y, sizes.height));
          }
        }
        largest = std::max(largest, std::abs(out.at(x, y)[c] - sum));
      }
    }
  }
  CHECK(largest < 1.01);  // fixed-point arithmetic may take the other neighbour
}

TEST_CASE("grey and coloured pictures are read as either; damage is an Error") {
  const Image8 grey = gradient(9, 5, 1), color = gradient(9, 5, 3);
  const Image8 grey_as_color = decode_image(encode_image(grey, ".png"), 3, "grey");
  for (size_t i = 0; i < grey_as_color.pixels.size(); ++i) REQUIRE(grey_as_color.pixels[i] == grey.pixels[i / 3]);
  const Image8 color_as_grey = decode_image(encode_image(color, ".png"), 1, "color");
  REQUIRE(color_as_grey.pixels.size() == 45);
  for (size_t i = 0; i < 45; ++i) {
    const double luma = 0.299 * color.pixels[3 * i] + 0.587 * color.pixels[3 * i + 1] + 0.114 * color.pixels[3 * i + 2];
    REQUIRE(std::abs(color_as_grey.pixels[i] - luma) < 1.01);
  }
  std::vector<std::byte> bytes = encode_image(color, ".png");
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::byte> damaged = bytes;
    damaged[i] ^= std::byte{0x55};
    try {
      decode_image(damaged, 3, "damaged");  // what does not matter may be damaged
    } catch (const Error& error) {
      REQUIRE_THAT(error.what(), Contains("damaged: "));
    }
  }
}
