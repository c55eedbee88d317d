#include "host/io/torch_archive.h"

#include <cstring>
#include <random>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/zip_archive.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
using namespace std::string_literals;
namespace fs = std::filesystem;

namespace {

const fs::path vectors = fs::path(DEGAS_TEST_VECTORS) / "io";

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span<const char>(text));
  return {bytes.begin(), bytes.end()};
}

TorchTensors read_pickle_text(const std::string& pickle) {
  const std::vector<ZipEntry> entries = {{"x/data.pkl", bytes_of(pickle)}, {"x/data/0", std::vector<std::byte>(16)}};
  return read_torch_archive(make_zip(entries, false), "evil.pt");
}

/// A tensor of one float storage of 4 elements with the given pickled offset, sizes and strides.
std::string tensor_pickle(const std::string& rest) {
  return "\x80\x02"
         "ctorch._utils\n_rebuild_tensor_v2\n((X\x07" +
         std::string(3, '\0') + "storagectorch\nFloatStorage\nX\x01" + std::string(3, '\0') + "0X\x03" +
         std::string(3, '\0') + "cpuK\x04tQ" + rest + "\x89)tR.";
}

}  // namespace

TEST_CASE("archives of torch.save are read") {
  const TorchTensors code = read_torch_archive(vectors / "torch_code.pt");
  REQUIRE(code.size() == 1);
  CHECK(code.at("exp").shape == Shape{1, 24});
  CHECK(code.at("exp").floats()[23] == 23.0f / 8);

  const TorchTensors bare = read_torch_archive(vectors / "torch_bare.pt");
  CHECK(bare.at("").shape == Shape{3, 2, 2});
  CHECK(bare.at("").floats() == std::vector<float>{1, 9, 13, 21, 2, 10, 14, 22, 3, 11, 15, 23});

  const TorchTensors state = read_torch_archive(read_file_bytes(vectors / "torch_state.pt"), "state");
  REQUIRE(state.size() == 6);
  CHECK(state.at("model.weight").floats() == std::vector<float>{0, 1, 2, 3, 4, 5});
  CHECK(state.at("model.bias").floats() == std::vector<float>{-1, -1, -1});
  CHECK(state.at("parameter").floats() == std::vector<float>{2, 3});
  CHECK(state.at("nested.half").floats() == std::vector<float>{0.5f, -2});
  CHECK(state.at("nested.long").shape.empty());
  CHECK(state.at("nested.long").integers() == std::vector<int64_t>{7});
  CHECK(state.at("nested.flag").integers() == std::vector<int64_t>{1});
}

TEST_CASE("a face code of the test capture is read") {
  const std::string path = data_path("data/capture/A/P1C1/dpe/dpe-000000-cam01.pt");
  if (path.empty()) return;
  CHECK(read_torch_archive(path).at("exp").shape == Shape{1, 512});
}

TEST_CASE("a written archive comes back") {
  const std::vector<float> floats = {1, 2, 3, 4, 5, 6};
  const std::vector<int64_t> integers = {-5};
  const std::vector<std::byte> bytes =
      make_torch_archive({{"exp", NpyArray::from({2, 3}, floats)}, {"n", NpyArray::from({}, integers)}}, "code");
  const TorchTensors back = read_torch_archive(bytes, "memory");
  CHECK(back.at("exp").shape == Shape{2, 3});
  CHECK(back.at("exp").floats() == floats);
  CHECK(back.at("n").integers() == integers);
}

TEST_CASE("a pickle that wants more than tensors is refused by name") {
  CHECK_THROWS_WITH(read_torch_archive(vectors / "torch_refused.pt"),
                    Contains("torch_refused.pt") && Contains("'torch.device'"));
  CHECK_THROWS_WITH(read_pickle_text("\x80\x02"
                                     "cos\nsystem\nX\x01" +
                                     std::string(3, '\0') + "a\x85R."),
                    Contains("evil.pt") && Contains("'os.system'"));
  CHECK_THROWS_WITH(read_pickle_text("\x80\x02"
                                     "cbuiltins\neval\n."),
                    Contains("'builtins.eval'"));
  CHECK_THROWS_WITH(read_pickle_text("\x80\x02}."), Contains("holds no tensor"));
  CHECK_THROWS_WITH(read_pickle_text("\x80\x02"
                                     "K"),
                    Contains("ends early"));
  CHECK_THROWS_WITH(read_pickle_text("\x80\x02R."), Contains("not read at byte"));
  CHECK_THROWS_WITH(read_torch_archive(vectors / "numpy.npz"), Contains("is no torch archive"));
  CHECK_THROWS_WITH(read_torch_archive(vectors / "missing.pt"), Contains("missing.pt: no such file"));
  // As torch.save wrote before 1.6.
  const std::string bare = "\x80\x02\x8a\nl\xfc\x9c";
  const auto bytes = std::as_bytes(std::span<const char>(bare));
  CHECK_THROWS_WITH(read_torch_archive(std::vector<std::byte>(bytes.begin(), bytes.end()), "old.pt"),
                    Contains("old.pt: is a bare pickle") && Contains("torch.save its tensors again"));
}

TEST_CASE("tensors that do not fit their storage are refused before memory is taken") {
  CHECK(read_pickle_text(tensor_pickle("K\x01K\x03\x85K\x01\x85")).at("").shape == Shape{3});
  CHECK_THROWS_WITH(read_pickle_text(tensor_pickle("K\x02K\x03\x85K\x01\x85")), Contains("does not fit its storage"));
  const char *misfit = "does not fit its storage", *none = "has a size or stride that is none";
  CHECK_THROWS_WITH(read_pickle_text(tensor_pickle("K\0J\xff\xff\xff\x7f\x85K\0\x85"s)), Contains(misfit));  // expanded
  CHECK_THROWS_WITH(read_pickle_text(tensor_pickle("J\xff\xff\xff\xffK\x03\x85K\x01\x85")),
                    Contains(misfit));  // offset -1
  CHECK_THROWS_WITH(read_pickle_text(tensor_pickle("K\0K\x02\x85J\xff\xff\xff\xff\x85"s)),
                    Contains(none));  // stride -1
  // A dictionary within itself: {"a": itself}.
  CHECK_THROWS_WITH(read_pickle_text("\x80\x02}q\x01X\x01" + std::string(3, '\0') + "ah\x01s."),
                    Contains("nested too deeply"));
}

TEST_CASE("damaged archives give an Error or the right tensor, never a crash") {
  const std::vector<std::byte> file = read_file_bytes(vectors / "torch_state.pt");
  const ZipReader archive(vectors / "torch_state.pt");
  std::vector<ZipEntry> entries;
  for (const std::string& name : archive.names()) entries.push_back({name, archive.read(name)});
  std::mt19937 random(11);
  int errors = 0;
  const auto attempt = [&](std::vector<std::byte> bytes) {
    try {
      read_torch_archive(std::move(bytes), "bad.pt");
    } catch (const Error& error) {
      if (std::strstr(error.what(), "bad.pt")) ++errors;
    }
  };
  for (int round = 0; round < 300; ++round) {  // the zip archive around it
    std::vector<std::byte> bad = file;
    if (round % 3 == 0)
      bad.resize(random() % bad.size());
    else
      bad[random() % bad.size()] ^= std::byte(1 << random() % 8);
    attempt(std::move(bad));
  }
  CHECK(errors > 100);
  errors = 0;
  for (int round = 0; round < 3000; ++round) {  // the pickle itself, with a right checksum
    std::vector<ZipEntry> bad = entries;
    for (ZipEntry& entry : bad) {
      if (!entry.name.ends_with("data.pkl")) continue;
      if (round % 5 == 0)
        entry.bytes.resize(random() % entry.bytes.size());
      else
        for (int flips = 1 + round % 4; flips > 0; --flips)
          entry.bytes[random() % entry.bytes.size()] ^= std::byte(1 << random() % 8);
    }
    attempt(make_zip(bad, false));
  }
  CHECK(errors > 1000);
}
