// Meshes, splats and pictures: .obj, .ply, .exr, .png, .jpg, and networks that OpenCV reads.

#include "host/io/exr.h"
#include "host/io/image.h"
#include "host/io/obj.h"
#include "host/io/onnx_model.h"
#include "host/io/ply.h"
#include "tests/fuzz/fuzz.h"
#include "tests/model/data/small_capture.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
namespace fs = std::filesystem;

TEST_CASE("damaged .obj files") {
  const std::string text =
      "# a house\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\ng wall left\nf 1/1 2/2 3/3\n"
      "f 1 3 4\ng roof\nf -4//1 -3/2/1 -2/-1 4\nusemtl brick\n";
  fuzz({"mesh.obj", {whole(bytes_of(text))}, {}, [](const fs::path& path) { read_obj(path); }, 5000});
}

TEST_CASE("damaged .ply files") {
  const TemporaryFolder folder;
  std::vector<Parts> seeds;
  for (const size_t coefficients : {0, 3}) {
    const auto numbers = [](size_t count) { return std::vector<float>(count, 0.25f); };
    write_ply(folder / "seed.ply",
              {numbers(6), numbers(6), numbers(2 * 3 * coefficients), numbers(2), numbers(6), numbers(8)});
    seeds.push_back(whole_file(folder / "seed.ply"));
  }
  fuzz({"splats.ply", seeds, {}, [](const fs::path& path) { read_ply(path); }, 5000});
}

TEST_CASE("damaged .exr files") {
  const TemporaryFolder folder;
  ExrImage image{7, 5, {}};
  for (const char* name : {"position.x", "position.y", "opacity"}) {
    for (int i = 0; i < 35; ++i) image.channels[name].push_back(0.1f * static_cast<float>(i));
  }
  write_exr(folder / "seed.exr", image);
  fuzz({"maps.exr", {whole_file(folder / "seed.exr")}, {}, [](const fs::path& path) { read_exr(path); }, 3000});
}

TEST_CASE("damaged pictures") {
  for (const char* extension : {".png", ".jpg"}) {
    const auto read = [](const fs::path& path) {
      read_image(path, 3);
      read_image(path, 1);
    };
    const Parts seed = whole(encode_image(small_image(1, 0), extension));
    fuzz({std::string("picture") + extension, {seed}, {}, read, 1000});
  }
}

TEST_CASE("damaged networks") {
  const Parts seed = whole_file(fs::path(DEGAS_TEST_VECTORS) / "io/channel_means.onnx");
  OnnxInput input;
  input.side = 16;
  fuzz({"network.onnx",
        {seed},
        {},
        [&](const fs::path& path) { OnnxModel(path, input)(Image8::black(16, 16, 3)); },
        300});
}
