#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/support/catch.h"
#include "tests/support/training_scene.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

TEST_CASE("captures with a cut or flipped file give an Error that names it, or pictures, never a crash") {
  const std::string name = GENERATE("cameras.json", "capture.json", "smplx.npz", "dpe.zip");
  const TemporaryFolder folder;
  const fs::path capture = folder / "capture";
  fs::copy(training_scene() / "P1C1", capture, fs::copy_options::recursive);
  const std::vector<std::byte> good = read_file_bytes(capture / name);
  std::mt19937 random(11);
  int refused = 0;
  for (int round = 0; round < 100; ++round) {
    CAPTURE(name, round);
    std::vector<std::byte> bad = good;
    if (round % 4 == 0)
      bad.resize(random() % bad.size());
    else
      for (int flips = 0; flips < 1 + round % 3; ++flips) bad[random() % bad.size()] ^= std::byte(1 << random() % 8);
    write_file_atomically(capture / name, bad);
    try {
      CaptureOptions options;
      options.cache = folder / "cache";
      const auto opened = open_capture(capture, options);
      opened->pose(0);
      for (int camera = 0; camera < static_cast<int>(opened->camera_names().size()); ++camera)
        opened->face_code(0, camera);
    } catch (const Error& error) {
      ++refused;
      // Of sizes or names that no longer fit together, either side may be named.
      CHECK_THAT(error.what(), Contains("capture/"));
    }
  }
  CHECK(refused > 25);
}
