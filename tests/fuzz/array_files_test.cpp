// Arrays: .npy, .npz and what torch.save writes.

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/npz.h"
#include "host/io/torch_archive.h"
#include "host/io/zip_archive.h"
#include "model/loss/lpips_weights.h"
#include "model/net/expression_encoder_weights.h"
#include "tests/fuzz/fuzz.h"
#include "tests/support/catch.h"
#include "tests/support/encoder_weights.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
namespace fs = std::filesystem;

namespace {

const fs::path vectors = fs::path(DEGAS_TEST_VECTORS) / "io";

/// Every conversion that a caller may ask for; what a type does not convert to is an Error.
void convert(const NpyArray& array) {
  const auto attempt = [](const auto& conversion) {
    try {
      conversion();
    } catch (const Error&) {
    }
  };
  attempt([&] { array.floats(); });
  attempt([&] { array.doubles(); });
  attempt([&] { array.integers(); });
  attempt([&] { array.text(); });
}

void read_npy(const fs::path& path) {
  convert(parse_npy(read_file_bytes(path), path.string()));
}

void read_npz(const fs::path& path) {
  const NpzFile file(path);
  for (const std::string& key : file.keys()) {
    if (key != "objects") convert(file.read(key));
  }
}

void convert_torch(const fs::path& path) {
  for (const auto& [name, tensor] : read_torch_archive(path)) convert(tensor);
}

/// Arrays of every kind of the NumPy vectors, those that are refused left out.
std::vector<Parts> npy_seeds() {
  std::vector<Parts> seeds;
  for (const auto& [name, bytes] : archive_parts(vectors / "numpy.npz")) {
    try {
      parse_npy(bytes, name);
      seeds.push_back(whole(bytes));
    } catch (const Error&) {
    }
  }
  return seeds;
}

}  // namespace

TEST_CASE("damaged .npy files") {
  fuzz({"array.npy", npy_seeds(), {}, read_npy, 4000});
}

TEST_CASE("damaged .npz files") {
  const TemporaryFolder folder;
  std::map<std::string, NpyArray> arrays = {{"a", NpyArray::from({2, 3}, std::vector<float>{1, 2, 3, 4, 5, 6})},
                                            {"b", NpyArray::from_text("text")}};
  write_npz(folder / "seed.npz", arrays);
  fuzz({"archive.npz", {whole_file(folder / "seed.npz")}, {}, read_npz, 3000});
}

TEST_CASE("damaged arrays in whole .npz files") {
  Parts parts;
  int number = 0;
  for (const Parts& seed : npy_seeds()) parts[fmt::format("{}.npy", number++)] = seed.begin()->second;
  fuzz({"arrays.npz", {parts}, write_archive, read_npz, 500});
}

TEST_CASE("damaged torch archives") {
  fuzz({"state.pt",
        {whole_file(vectors / "torch_state.pt"), whole_file(vectors / "torch_bare.pt"),
         whole_file(vectors / "torch_code.pt")},
        {},
        convert_torch,
        3000});
}

TEST_CASE("damaged pickles and storages in whole torch archives") {
  fuzz({"tensors.pt",
        {archive_parts(vectors / "torch_state.pt"), archive_parts(vectors / "torch_bare.pt"),
         archive_parts(vectors / "torch_code.pt")},
        write_archive,
        convert_torch,
        5000});
}

TEST_CASE("damaged weights of the expression encoder") {
  const TorchTensors tensors = make_encoder_weights({{4, 8}, 6, 3, 2, 5});
  const TemporaryFolder folder;
  write_file_atomically(folder / "seed.pt", make_torch_archive(tensors));
  write_npz(folder / "seed.npz", tensors);
  const auto read = [](const fs::path& path) { load_expression_encoder(path, {}); };
  fuzz({"encoder.pt", {archive_parts(folder / "seed.pt")}, write_archive, read, 500});
  fuzz({"encoder.npz", {archive_parts(folder / "seed.npz")}, write_archive, read, 300});
}

TEST_CASE("damaged weights of LPIPS") {
  std::map<std::string, NpyArray> arrays;
  const auto add = [&](const std::string& key, const Shape& shape) {
    arrays[key] = NpyArray::from(shape, std::vector<float>(static_cast<size_t>(element_count(shape)), 0.5f));
  };
  const std::vector<std::pair<int, Shape>> convolutions = {
      {0, {64, 3, 11, 11}}, {3, {192, 64, 5, 5}}, {6, {384, 192, 3, 3}}, {8, {256, 384, 3, 3}}, {10, {256, 256, 3, 3}}};
  int linear = 0;
  for (const auto& [place, shape] : convolutions) {
    add(fmt::format("features.{}.weight", place), shape);
    add(fmt::format("features.{}.bias", place), {shape[0]});
    add(fmt::format("lin{}", linear++), {shape[0]});
  }
  const TemporaryFolder folder;
  write_npz(folder / "seed.npz", arrays);
  fuzz({"lpips_alex_v0.1.npz",
        {whole_file(folder / "seed.npz")},
        {},
        [](const fs::path& path) { load_lpips_layers(path, LpipsNetwork::Alex); },
        60});
}
