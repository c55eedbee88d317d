#include "model/data/dreams_codes.h"

#include <limits>
#include <numeric>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/torch_archive.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

const std::vector<int64_t> numbers = {10, 12, 15};

void write_code(const fs::path& path, const std::vector<float>& code, const std::string& key = "exp") {
  write_file_atomically(path,
                        make_torch_archive({{key, NpyArray::from({1, static_cast<int64_t>(code.size())}, code)}}));
}

}  // namespace

TEST_CASE("codes are found by frame number and camera") {
  const TemporaryFolder folder;
  write_code(folder / "dpe/dpe-000012-cam01.pt", {1, 2, 3});
  write_code(folder / "dpe/dpe-000011-cam01.pt", {9, 9, 9});  // no such frame
  write_code(folder / "dpe/dpe-000015-cam07.pt", {9, 9, 9});  // no such camera
  write_file_atomically(folder / "dpe/notes.txt", {});
  const DreamsCodes codes(folder.path(), numbers, 2);
  CHECK(codes.size() == 3);
  CHECK(codes.code(1, 1) == std::vector<float>{1, 2, 3});
  CHECK_FALSE(codes.code(0, 1).has_value());
  CHECK_FALSE(codes.code(2, 1).has_value());
}

TEST_CASE("archives whose names tell no view are told of, and a lone tensor is a code whatever its name") {
  const TemporaryFolder folder;
  write_code(folder / "dpe/dpe-000012-07.pt", {1, 2});
  std::vector<std::string> warnings;
  const auto warn = [&](const std::string& text) { warnings.push_back(text); };
  CHECK(open_codes(folder.path(), {}, numbers, 2, warn)->size() == 0);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("dpe-FRAME-camCAMERA.pt") && Contains("'dpe-000012-07.pt'"));
  CHECK_THROWS_WITH(open_codes({}, folder / "dpe", numbers, 2, warn), Contains("no face codes") && Contains("-07.pt'"));
  write_code(folder / "dpe/dpe-000012-cam01.pt", {3, 4}, "expression");
  CHECK(open_codes(folder.path(), {}, numbers, 2, warn)->code(1, 1) == std::vector<float>{3, 4});
  CHECK(warnings.size() == 2);
}

TEST_CASE("a capture without codes has none") {
  const TemporaryFolder folder;
  const DreamsCodes codes(folder.path(), numbers, 2);
  CHECK(codes.size() == 0);
  CHECK_FALSE(codes.code(0, 0).has_value());
}

TEST_CASE("codes come as arrays too: one a view, one a frame, or a table") {
  const TemporaryFolder folder;
  const auto write_array = [&](const std::string& name, const Shape& shape, const std::vector<float>& values) {
    write_file_atomically(folder / name, make_npy(NpyArray::from(shape, values)));
    return folder / name;
  };
  const float none = std::numeric_limits<float>::quiet_NaN();
  SECTION("one a view, in a folder that is named itself") {
    write_array("views/dpe-000012-cam01.npy", {2}, {4, 5});
    const DreamsCodes codes(folder / "views", numbers, 2);
    CHECK(codes.size() == 2);
    CHECK(codes.code(1, 1) == std::vector<float>{4, 5});
  }
  SECTION("bundled") {
    write_array("a.npy", {1, 2}, {4, 5});
    const ZipEntry entry{"x/dpe-000015-cam00.npy", read_file_bytes(folder / "a.npy")};
    write_file_atomically(folder / "codes.zip", make_zip({&entry, 1}, false));
    CHECK(DreamsCodes(folder / "codes.zip", numbers, 2).code(2, 0) == std::vector<float>{4, 5});
  }
  SECTION("a table by frame and camera, missing where not finite") {
    const DreamsCodes codes(write_array("t.npy", {3, 2, 1}, {1, 2, none, 4, 5, 6}), numbers, 2);
    CHECK(codes.size() == 1);
    CHECK(codes.code(0, 1) == std::vector<float>{2});
    CHECK_FALSE(codes.code(1, 0).has_value());
    CHECK(codes.code(2, 1) == std::vector<float>{6});
    CHECK(codes.files() == std::vector<fs::path>{folder / "t.npy"});
  }
  SECTION("a table by frame serves all cameras") {
    write_array("expression_codes.npy", {3, 2}, {1, 2, 3, 4, none, 6});
    const DreamsCodes codes(folder.path(), numbers, 2);
    CHECK(codes.code(1, 0) == std::vector<float>{3, 4});
    CHECK(codes.code(1, 1) == std::vector<float>{3, 4});
    CHECK_FALSE(codes.code(2, 0).has_value());
  }
  SECTION("a table of another size") {
    CHECK_THROWS_WITH(DreamsCodes(write_array("t.npy", {2, 2, 1}, {1, 2, 3, 4}), numbers, 2),
                      Contains("t.npy: 'codes' has shape (2, 2, 1), expected (3, 2, N)"));
  }
}

TEST_CASE("codes that cannot be used are named") {
  const TemporaryFolder folder;
  write_code(folder / "dpe/dpe-000010-cam00.pt", {1, 2, 3});
  write_code(folder / "dpe/dpe-000010-cam01.pt", {1, 2});
  write_code(folder / "dpe/dpe-000012-cam00.pt", {1, std::numeric_limits<float>::quiet_NaN(), 3});
  const NpyArray code = NpyArray::from({1, 3}, std::vector<float>{1, 2, 3});
  write_file_atomically(folder / "dpe/dpe-000012-cam01.pt", make_torch_archive({{"pose", code}, {"shape", code}}));
  write_file_atomically(folder / "dpe/dpe-000015-cam00.pt", std::vector<std::byte>(30));
  const DreamsCodes codes(folder.path(), numbers, 2);
  CHECK_THROWS_WITH(codes.code(0, 1), Contains("dpe-000010-cam01.pt: the face code has 2 numbers where others have 3"));
  CHECK_THROWS_WITH(codes.code(1, 0), Contains("dpe-000012-cam00.pt: the face code is not finite"));
  CHECK_THROWS_WITH(codes.code(1, 1), Contains("dpe-000012-cam01.pt: has 2 tensors and none is called 'exp'"));
  CHECK_THROWS_WITH(codes.code(2, 0), Contains("dpe-000015-cam00.pt: no readable zip archive"));
}

TEST_CASE("capture A: files, a bundle of them and the table give the same codes") {
  const fs::path source = data_path("data/capture/A/P1C1");
  if (source.empty()) return;
  std::vector<int64_t> rows(80);
  std::iota(rows.begin(), rows.end(), 0);
  const TemporaryFolder bundled, table;
  std::vector<ZipEntry> entries;
  for (const auto& entry : fs::directory_iterator(source / "dpe")) {
    entries.push_back({"dpe/" + entry.path().filename().string(), read_file_bytes(entry.path())});
  }
  write_file_atomically(bundled / "dpe/all.zip", make_zip(entries, false));
  fs::create_symlink(source / "expression_codes.npz", table / "expression_codes.npz");
  const DreamsCodes from_files(source, rows, 13), from_bundle(bundled.path(), rows, 13),
      from_table(table.path(), rows, 13);
  CHECK(from_table.size() == 512);
  size_t found = 0;
  for (int frame = 0; frame < 80; ++frame) {
    for (int camera = 0; camera < 13; ++camera) {
      const auto code = from_files.code(frame, camera);
      found += code.has_value();
      const bool same = code == from_bundle.code(frame, camera) && code == from_table.code(frame, camera);
      if (!same) FAIL("frame " << frame << ", camera " << camera);
    }
  }
  CHECK(found == entries.size());
}
