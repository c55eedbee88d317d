#include "host/io/exr.h"

#include <cstring>
#include <limits>
#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

ExrImage some_maps() {
  ExrImage image{33, 17, {}};
  for (const char* name : {"position.x", "position.y", "opacity", "rotation.w"}) {
    const std::vector<double> values =
        random_values(33 * 17, static_cast<unsigned>(name[0] + name[9 % std::strlen(name)]), -1e3, 1e3);
    image.channels[name].assign(values.begin(), values.end());
  }
  image.channels["opacity"][5] = std::numeric_limits<float>::denorm_min();
  return image;
}

}  // namespace

TEST_CASE("maps come back bit for bit under their names") {
  const TemporaryFolder folder;
  const ExrImage image = some_maps();
  write_exr(folder / "maps.exr", image);
  const ExrImage back = read_exr(folder / "maps.exr");
  CHECK(back.width == 33);
  CHECK(back.height == 17);
  CHECK(back.channels == image.channels);
  write_exr(folder / "again.exr", image);
  const bool same_bytes = read_file_bytes(folder / "maps.exr") == read_file_bytes(folder / "again.exr");
  CHECK(same_bytes);
}

TEST_CASE("OpenEXR files that cannot be read or written are named") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_exr(folder / "missing.exr"), Contains("missing.exr: no such file"));
  write_file_atomically(folder / "none.exr", std::vector<std::byte>(50));
  CHECK_THROWS_WITH(read_exr(folder / "none.exr"), Contains("none.exr: cannot be read as OpenEXR"));
  ExrImage uneven = some_maps();
  uneven.channels["opacity"].pop_back();
  CHECK_THROWS_AS(write_exr(folder / "a.exr", uneven), std::logic_error);
  std::filesystem::create_directory(folder / "taken.exr");
  write_file_atomically(folder / "taken.exr" / "file", {});
  CHECK_THROWS_WITH(write_exr(folder / "taken.exr", some_maps()), Contains("taken.exr: cannot be written"));
}

TEST_CASE("cut or flipped OpenEXR files give an Error or pictures, never a crash") {
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", some_maps());
  const auto good = read_file_bytes(folder / "a.exr");
  std::mt19937 random(9);
  int errors = 0;
  for (int round = 0; round < 150; ++round) {
    auto bad = good;
    if (round % 3 == 0)
      bad.resize(random() % bad.size());
    else
      bad[random() % (round % 2 ? 400 : bad.size())] ^= std::byte(1 << random() % 8);
    write_file_atomically(folder / "bad.exr", bad);
    try {
      read_exr(folder / "bad.exr");
    } catch (const Error& error) {
      CHECK_THAT(error.what(), Contains("bad.exr"));
      ++errors;
    }
  }
  CHECK(errors > 50);
}
