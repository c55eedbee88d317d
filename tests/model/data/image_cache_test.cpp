#include "model/data/image_cache.h"

#include <chrono>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/video.h"
#include "model/data/person_pixels.h"
#include "tests/model/data/small_capture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

struct CachedSmallCapture {
  TemporaryFolder folder, cache;
  std::vector<std::string> warnings;
  CachedSmallCapture() { write_small_capture(folder.path()); }
  std::unique_ptr<Capture> open(double scale = 1) {
    CaptureOptions options;
    options.image_scale = scale;
    options.cache = cache.path();
    options.warn = [this](const std::string& text) { warnings.push_back(text); };
    return open_capture(folder.path(), options);
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> out;
    for (const auto& entry : fs::recursive_directory_iterator(cache.path())) {
      if (entry.is_regular_file()) out.push_back(entry.path());
    }
    return out;
  }
};

}  // namespace

TEST_CASE("packed persons come back; damaged ones are refused") {
  const Image8 image = small_image(2, 0), mask = small_mask(2);
  std::vector<std::byte> packed = pack_person(image, mask);
  Image8 image_back, mask_back;
  REQUIRE(unpack_person(packed, small_width, small_height, image_back, mask_back));
  CHECK(image_back.pixels == image.pixels);
  CHECK(mask_back.pixels == mask.pixels);
  for (size_t size = 0; size < packed.size(); ++size) {
    CHECK_FALSE(unpack_person(std::span(packed).first(size), small_width, small_height, image_back, mask_back));
  }
  for (size_t i = 0; i < packed.size(); ++i) {
    packed[i] ^= std::byte{0xff};
    unpack_person(packed, small_width, small_height, image_back, mask_back);  // must not leave its buffers (sanitizers)
    packed[i] ^= std::byte{0xff};
  }
}

TEST_CASE("cached pictures are the capture's, and videos are decoded once") {
  CachedSmallCapture small;
  {
    const auto capture = small.open();
    CHECK(small.files().empty());  // nothing is decoded before it is asked for
    CHECK(capture->load(3, 1).image.pixels == small_image(3, 1).pixels);
    CHECK(capture->load(3, 1).mask.pixels == small_mask(3).pixels);
    CHECK(small.files().size() == 1);
    CHECK_FALSE(capture->has_image(0, 2));
    CHECK(capture->face_code(1, 0).has_value());
    CHECK_THROWS_WITH(capture->load(0, 2), Contains("cam02 has no picture of frame 0"));
    CHECK_THROWS_WITH(capture->load(99, 0), Contains("no frame 99"));
  }
  const auto written = fs::last_write_time(small.files()[0]);
  CHECK(small.open()->load(3, 1).image.pixels == small_image(3, 1).pixels);
  CHECK(fs::last_write_time(small.files()[0]) == written);
  CHECK(small.warnings.empty());
}

TEST_CASE("another scale or a changed capture has files of its own") {
  CachedSmallCapture small;
  small.open()->load(0, 0);
  small.open(0.5)->load(0, 0);
  CHECK(small.files().size() == 2);
  write_small_capture(small.folder.path());
  small.open()->load(0, 0);
  CHECK(small.files().size() == 3);
}

TEST_CASE("a cache file that is not whole is written again") {
  CachedSmallCapture small;
  small.open()->load(0, 0);
  const fs::path file = small.files()[0];
  for (const size_t size : {size_t{0}, size_t{10}, size_t{60}, static_cast<size_t>(fs::file_size(file)) - 1}) {
    fs::resize_file(file, size);
    CHECK(small.open()->load(0, 0).image.pixels == small_image(0, 0).pixels);
  }
}

TEST_CASE("a cache file with any byte changed is written again, with a warning where a picture was the damage") {
  CachedSmallCapture small;
  small.open()->load(0, 0);
  const fs::path file = small.files()[0];
  const std::string good = file_text(file);
  int told = 0;
  for (size_t place = 0; place < good.size(); place += place < 200 ? 3 : 101) {
    CAPTURE(place);
    std::string bad = good;
    bad[place] ^= 0x10;
    std::ofstream(file, std::ios::binary) << bad;
    small.warnings.clear();
    const auto capture = small.open();
    for (int frame = 0; frame < small_frames; ++frame) {
      CHECK(capture->load(frame, 0).image.pixels == small_image(frame, 0).pixels);
      CHECK(capture->load(frame, 0).mask.pixels == small_mask(frame).pixels);
    }
    CHECK(file_text(file) == good);
    CHECK(small.warnings.size() <= 1);
    if (small.warnings.empty()) continue;
    ++told;
    CHECK_THAT(small.warnings[0], Contains("cam00.pixels: the cached pictures are damaged; decoding them again"));
  }
  CHECK(told > 0);
}

TEST_CASE("frames with an empty mask are skipped with one warning a camera") {
  CachedSmallCapture small;
  VideoWriter writer(small.folder / "videos/cam00.mp4", 2 * small_width, small_height, 30, VideoQuality::Lossless);
  for (int frame = 0; frame < small_frames; ++frame) {
    Image8 both = Image8::black(2 * small_width, small_height, 3);
    for (int x = small_width; x < 2 * small_width && frame != 2 && frame != 4; ++x)
      std::fill_n(both.at(x, 5), 3, uint8_t{255});
    writer.write(both);
  }
  writer.finish();
  for (int round = 0; round < 2; ++round) {  // decoded, then from the cache
    small.warnings.clear();
    const auto capture = small.open();
    CHECK(capture->has_image(1, 0));
    CHECK_FALSE(capture->has_image(2, 0));
    CHECK_FALSE(capture->has_image(4, 0));
    REQUIRE(small.warnings.size() == 1);
    CHECK_THAT(small.warnings[0], Contains("cam00.mp4: frame 2 of cam00 has an empty mask (skipped: 2 of 6 frames"));
    CHECK_THROWS_WITH(capture->load(4, 0), Contains("frame 4 of cam00 has an empty mask"));
  }
}

TEST_CASE("open_capture says what it cannot open") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(open_capture(folder / "missing"), Contains("missing: no such folder"));
  CHECK_THROWS_WITH(open_capture(folder.path()), Contains("holds no known capture"));
  CaptureOptions options;
  options.format = "other";
  CHECK_THROWS_WITH(open_capture(folder.path(), options), Contains("format 'other' is not known"));
  options.format = "";
  options.image_scale = 0;
  CHECK_THROWS_WITH(open_capture(folder.path(), options), Contains("image_scale is 0"));
}

TEST_CASE("capture A: a cached picture loads within 2 ms") {
  const std::string path = data_path("data/capture/A/P1C1");
  if (path.empty()) return;
  const TemporaryFolder cache;
  CaptureOptions options;
  options.cache = cache.path();
  const auto capture = open_capture(path, options);
  using Clock = std::chrono::steady_clock;
  const auto milliseconds = [](Clock::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
  };
  auto start = Clock::now();
  REQUIRE(capture->has_image(0, 2));
  const double decoding = milliseconds(Clock::now() - start);
  std::vector<double> times;
  for (int i = 0; i < 200; ++i) {
    start = Clock::now();
    const Sample sample = capture->load(i * 37 % 80, 2);
    times.push_back(milliseconds(Clock::now() - start));
  }
  std::nth_element(times.begin(), times.begin() + 100, times.end());
  uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(cache.path()))
    bytes += entry.is_regular_file() ? entry.file_size() : 0;
  std::printf("80 frames of 480x640 decoded into the cache in %.0f ms, %.1f MB; a load takes %.2f ms (median)\n",
              decoding, static_cast<double>(bytes) / 1e6, times[100]);
#ifndef __SANITIZE_THREAD__  // whose bookkeeping is most of such an access
  CHECK(times[100] < 2);
#endif
}
