#include "host/io/npz.h"

#include <cmath>
#include <cstring>
#include <numeric>
#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "tests/support/npy_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using namespace std::string_literals;
namespace fs = std::filesystem;

TEST_CASE("an npz file comes back as it was written") {
  const TemporaryFolder folder;
  const std::vector<float> floats = {1.5f, -2, 3, 4, 5, 6e30f};
  const std::vector<int64_t> integers = {-1, int64_t{1} << 40};
  const std::vector<uint8_t> bytes = {0, 255};
  write_npz(folder / "a.npz", {{"f", NpyArray::from({2, 3}, floats)},
                               {"i", NpyArray::from({2}, integers)},
                               {"u", NpyArray::from({2, 1}, bytes)},
                               {"t", NpyArray::from_text("{\"größe\": true, \"x\": \"\xf0\x9f\x99\x82\"}")},
                               {"none", NpyArray::from({0, 3}, std::span<const float>())}});
  const NpzFile file(folder / "a.npz");
  CHECK(file.keys() == std::vector<std::string>{"f", "i", "none", "t", "u"});
  CHECK(file.read("f").floats() == floats);
  CHECK(file.read("f").shape == Shape{2, 3});
  CHECK(file.read("i").integers() == integers);
  CHECK(file.read("u").integers() == std::vector<int64_t>{0, 255});
  CHECK(file.read("t").text() == "{\"größe\": true, \"x\": \"\xf0\x9f\x99\x82\"}");
  CHECK(file.read("none").floats().empty());
  CHECK(file.read("f", {-1, 3}).shape == Shape{2, 3});
  CHECK_THROWS_WITH(file.read("f", {-1, 4}), Contains("a.npz: 'f' has shape (2, 3), expected (-1, 4)"));
  CHECK_THROWS_WITH(file.read("g"), Contains("a.npz: no array 'g'; it has f, i, none, t, u"));
  CHECK_THROWS_WITH(file.read("t").floats(), Contains("a.npz: 't': holds text"));
  CHECK_THROWS_WITH(file.read("f").integers(), Contains("integers are expected"));
  CHECK_THROWS_WITH(file.read("f").text(), Contains("one text is expected"));
  CHECK_THROWS_WITH(NpzFile(folder / "missing.npz"), Contains("missing.npz: no such file"));
}

TEST_CASE("npy headers: byte orders, Fortran order, versions") {
  const std::string big(std::string("\x3f\x80\0\0", 4) + std::string("\x40\0\0\0", 4));
  CHECK(parse_npy(npy_file("{'descr': '>f4', 'fortran_order': False, 'shape': (2,), }", big), "x").floats() ==
        std::vector<float>{1, 2});
  const NpyArray half = parse_npy(
      npy_file("{'shape':(3,),'descr':'<f2','fortran_order':False}\n", std::string("\0\x3c\0\xc0\x01\0", 6), 2), "x");
  CHECK(half.floats() == std::vector<float>{1, -2, std::ldexp(1.0f, -24)});
  const NpyArray fortran = parse_npy(npy_file("{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3, 2), }",
                                              "\x00\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0a\x0b"s, 3),
                                     "x");
  CHECK(fortran.integers() == std::vector<int64_t>{0, 6, 2, 8, 4, 10, 1, 7, 3, 9, 5, 11});
  CHECK(parse_npy(npy_file("{'descr': '|b1', 'fortran_order': False, 'shape': (), }", "\x01"), "x").integers() ==
        std::vector<int64_t>{1});
}

TEST_CASE("npy headers that are not what NumPy writes are refused with the reason") {
  const auto parse = [](const std::string& dictionary, const std::string& payload) {
    return parse_npy(npy_file(dictionary, payload), "file.npz: 'key'");
  };
  CHECK_THROWS_WITH(parse("{'descr': '|O', 'fortran_order': False, 'shape': (2,), }", "xx"),
                    Contains("file.npz: 'key': is an array of Python objects"));
  CHECK_THROWS_WITH(parse("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (2,), }", "xx"),
                    Contains("structured"));
  CHECK_THROWS_WITH(parse("{'descr': '<c8', 'fortran_order': False, 'shape': (1,), }", "12345678"), Contains("'<c8'"));
  CHECK_THROWS_WITH(parse("{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }", "1234567"),
                    Contains("needs 8 bytes but 7 follow"));
  // 2^62 elements of 4 bytes would wrap around to 0.
  CHECK_THROWS_WITH(parse("{'descr': '<f4', 'fortran_order': False, 'shape': (4611686018427387904,), }", ""),
                    Contains("damaged"));
  CHECK_THROWS_AS(parse("{'descr': '<f4', 'fortran_order': False, 'shape': (-1,), }", ""), Error);
  CHECK_THROWS_AS(parse("{'descr': '<f4', 'shape': (1,), }", "1234"), Error);
  CHECK_THROWS_AS(parse("{'descr': '<f4', 'fortran_order': False, 'shape': (1,), } + os", "1234"), Error);
  CHECK_THROWS_WITH(parse_npy(npy_file("{}", "", 9), "x"), Contains("version 9"));
}

TEST_CASE("archives of NumPy are read: Fortran order, objects beside arrays, deflated") {
  const NpzFile file(fs::path(DEGAS_TEST_VECTORS) / "io" / "numpy.npz");
  std::vector<double> counted(24);
  std::iota(counted.begin(), counted.end(), 0);
  CHECK(file.read("c_order", {2, 3, 4}).doubles() == counted);
  CHECK(file.read("fortran", {2, 3, 4}).doubles() == counted);
  CHECK(file.read("big_endian").doubles() == std::vector<double>{1, -2, 300});
  CHECK(file.read("text").text() == "naïve");
  CHECK(file.read("flag").integers() == std::vector<int64_t>{1});
  CHECK(file.contains("objects"));
  CHECK_THROWS_WITH(file.read("objects"), Contains("numpy.npz: 'objects': is an array of Python objects"));
}

TEST_CASE("damaged npz files give an Error or intact arrays, never a crash") {
  const TemporaryFolder folder;
  const std::vector<float> values(300, 1.25f);
  write_npz(folder / "good.npz",
            {{"values", NpyArray::from({3, 100}, values)}, {"text", NpyArray::from_text("hello")}});
  const std::vector<std::byte> good = read_file_bytes(folder / "good.npz");
  std::mt19937 random(7);
  int errors = 0, intact = 0;
  for (int round = 0; round < 400; ++round) {
    std::vector<std::byte> bad = good;
    if (round % 4 == 0) {
      bad.resize(random() % good.size());
    } else {
      for (int flips = 1 + round % 3; flips > 0; --flips) bad[random() % bad.size()] ^= std::byte(1 << random() % 8);
    }
    write_file_atomically(folder / "bad.npz", bad);
    try {
      const NpzFile file(folder / "bad.npz");
      const std::vector<float> read = file.read("values").floats();
      file.read("text").text();
      CHECK(read == values);  // what the checksum lets through is whole
      ++intact;
    } catch (const Error& error) {
      CHECK_THAT(error.what(), Contains("bad.npz"));
      ++errors;
    }
  }
  CHECK(errors > 200);
  CHECK(errors + intact == 400);
}
