#include "host/io/image.h"

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/video.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

Image8 gradient(int width, int height, int channels, int shift = 0) {
  Image8 image = Image8::black(width, height, channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) image.at(x, y)[c] = static_cast<uint8_t>(7 * x + 3 * y + 60 * c + shift);
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

TEST_CASE("lossless videos keep every bit and seek to the frame") {
  const TemporaryFolder folder;
  VideoWriter writer(folder / "a.mp4", 51, 30, 25, VideoQuality::Lossless);
  for (int i = 0; i < 40; ++i) writer.write(gradient(51, 30, 3, 5 * i));
  CHECK(!std::filesystem::exists(folder / "a.mp4"));
  writer.finish();
  VideoReader reader(folder / "a.mp4");
  CHECK(reader.frame_count() == 40);
  CHECK(reader.width() == 52);
  CHECK(reader.frames_per_second() == Approx(25));
  Image8 frame;
  for (const int i : {0, 1, 5, 39, 2, 30, 30}) {
    reader.seek(i);
    REQUIRE(reader.read(frame));
    const bool equal = cropped(frame, 0, 0, 51, 30).pixels == gradient(51, 30, 3, 5 * i).pixels;
    CAPTURE(i);
    CHECK(equal);
  }
  CHECK_THROWS_WITH(reader.seek(40), Contains("a.mp4: no frame 40; the video has 40"));
}

TEST_CASE("viewing videos take odd sizes; an unfinished one leaves nothing") {
  const TemporaryFolder folder;
  {
    VideoWriter writer(folder / "a.mp4", 33, 31, 30, VideoQuality::Viewing);
    for (int i = 0; i < 3; ++i) writer.write(gradient(33, 31, 3));
    writer.finish();
    VideoWriter unfinished(folder / "b.mp4", 33, 31, 30, VideoQuality::Viewing);
    unfinished.write(gradient(33, 31, 3));
  }
  int files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++files;
  CHECK(files == 1);
  VideoReader reader(folder / "a.mp4");
  CHECK(reader.frame_count() == 3);
  CHECK(reader.width() == 34);
  write_file_atomically(folder / "cut.mp4", std::vector<std::byte>(100));
  CHECK_THROWS_WITH(VideoReader(folder / "cut.mp4"), Contains("cut.mp4: cannot be opened as a video"));
  CHECK_THROWS_WITH(VideoReader(folder / "none.mp4"), Contains("none.mp4: no such file"));
}
