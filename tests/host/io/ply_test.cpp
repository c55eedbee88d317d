#include "host/io/ply.h"

#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;

namespace {

std::vector<float> floats(size_t count, unsigned seed) {
  const std::vector<double> values = random_values(static_cast<int64_t>(count), seed);
  return {values.begin(), values.end()};
}

PlySplats some_splats(size_t count, size_t coefficients = 0) {
  return {floats(3 * count, 1), floats(3 * count, 2), floats(3 * coefficients * count, 6),
          floats(count, 3),     floats(3 * count, 4), floats(4 * count, 5)};
}

}  // namespace

TEST_CASE("splats come back bit for bit, in the layout viewers read") {
  const TemporaryFolder folder;
  const size_t count = GENERATE(0, 1, 57);
  const PlySplats splats = some_splats(count);
  write_ply(folder / "a.ply", splats);
  const PlySplats back = read_ply(folder / "a.ply");
  CHECK(back.positions == splats.positions);
  CHECK(back.color_dc == splats.color_dc);
  CHECK(back.opacity_logits == splats.opacity_logits);
  CHECK(back.log_scales == splats.log_scales);
  CHECK(back.rotations == splats.rotations);

  const auto bytes = read_file_bytes(folder / "a.ply");
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const size_t end = text.find("end_header\n") + 11;
  CHECK(text.substr(0, end) ==
        fmt::format(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
            "property float x\nproperty float y\nproperty float z\n"
            "property float nx\nproperty float ny\nproperty float nz\n"
            "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float opacity\n"
            "property float scale_0\nproperty float scale_1\nproperty float scale_2\n"
            "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\nend_header\n",
            count));
  CHECK(bytes.size() == end + 17 * 4 * count);
}

TEST_CASE("harmonics are kept colour by colour, as viewers read them") {
  const TemporaryFolder folder;
  const size_t coefficients = GENERATE(3, 8, 15);
  const PlySplats splats = some_splats(5, coefficients);
  write_ply(folder / "a.ply", splats);
  CHECK(read_ply(folder / "a.ply").harmonics == splats.harmonics);
  CHECK(read_ply(folder / "a.ply").rotations == splats.rotations);

  const auto bytes = read_file_bytes(folder / "a.ply");
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const size_t end = text.find("end_header\n") + 11, row = 17 + 3 * coefficients;
  CHECK(text.substr(0, end).find(fmt::format("f_dc_2\nproperty float f_rest_0\n")) != std::string::npos);
  CHECK(text.substr(0, end).find(fmt::format("f_rest_{}\nproperty float opacity\n", 3 * coefficients - 1)) !=
        std::string::npos);
  // Splat 2, green, coefficient 1: after 9 other numbers and all of red.
  float value = 0;
  std::memcpy(&value, bytes.data() + end + (2 * row + 9 + coefficients + 1) * sizeof(float), sizeof(float));
  CHECK(value == splats.harmonics[(2 * coefficients + 1) * 3 + 1]);

  std::string damaged = text;
  damaged.replace(damaged.find("f_rest_0"), 8, "f_lost_0");
  write_file_atomically(folder / "b.ply", std::as_bytes(std::span(damaged)));
  CHECK_THROWS_WITH(read_ply(folder / "b.ply"), Contains("b.ply") && Contains("harmonics of no degree"));
}

TEST_CASE("other properties are passed over; missing ones are named") {
  const TemporaryFolder folder;
  write_ply(folder / "a.ply", some_splats(2));
  auto bytes = read_file_bytes(folder / "a.ply");
  std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto rewrite = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    write_file_atomically(folder / "b.ply", std::as_bytes(std::span<const char>(changed)));
  };
  rewrite("float nx", "float confidence");
  CHECK(read_ply(folder / "b.ply").positions == some_splats(2).positions);
  rewrite("float scale_1", "float other");
  CHECK_THROWS_WITH(read_ply(folder / "b.ply"), Contains("b.ply: has no property 'scale_1'"));
  rewrite("float opacity", "uchar opacity");
  CHECK_THROWS_WITH(read_ply(folder / "b.ply"), Contains("'opacity' is uchar, not float"));
  rewrite("vertex 2", "vertex 9999999999999999");
  CHECK_THROWS_WITH(read_ply(folder / "b.ply"), Contains("the file is damaged"));
  rewrite("binary_little_endian", "ascii");
  CHECK_THROWS_WITH(read_ply(folder / "b.ply"), Contains("not binary little endian"));
}

TEST_CASE("cut or flipped PLY files give an Error or splats, never a crash") {
  const TemporaryFolder folder;
  write_ply(folder / "a.ply", some_splats(3));
  const auto good = read_file_bytes(folder / "a.ply");
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    auto bad = good;
    if (round % 3 == 0)
      bad.resize(random() % bad.size());
    else
      bad[random() % 300] ^= std::byte(1 << random() % 8);
    write_file_atomically(folder / "bad.ply", bad);
    try {
      read_ply(folder / "bad.ply");
      CHECK(round % 3 != 0);
    } catch (const Error& error) {
      CHECK_THAT(error.what(), Contains("bad.ply"));
    }
  }
}
