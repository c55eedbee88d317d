#include "host/io/video.h"

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

Image8 shifted_gradient(int width, int height, int shift = 0) {
  Image8 image = Image8::black(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<uint8_t>(7 * x + 3 * y + 60 * c + shift);
    }
  }
  return image;
}

}  // namespace

TEST_CASE("lossless videos keep every bit and seek to the frame") {
  const TemporaryFolder folder;
  VideoWriter writer(folder / "a.mp4", 51, 30, 25, VideoQuality::Lossless);
  for (int i = 0; i < 40; ++i) writer.write(shifted_gradient(51, 30, 5 * i));
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
    const bool equal = cropped(frame, 0, 0, 51, 30).pixels == shifted_gradient(51, 30, 5 * i).pixels;
    CAPTURE(i);
    CHECK(equal);
  }
  CHECK_THROWS_WITH(reader.seek(40), Contains("a.mp4: no frame 40; the video has 40"));
}

TEST_CASE("viewing videos take odd sizes; an unfinished one leaves nothing") {
  const TemporaryFolder folder;
  {
    VideoWriter writer(folder / "a.mp4", 33, 31, 30, VideoQuality::Viewing);
    for (int i = 0; i < 3; ++i) writer.write(shifted_gradient(33, 31));
    writer.finish();
    VideoWriter unfinished(folder / "b.mp4", 33, 31, 30, VideoQuality::Viewing);
    unfinished.write(shifted_gradient(33, 31));
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
