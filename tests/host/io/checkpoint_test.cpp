#include "host/io/checkpoint.h"

#include <sys/resource.h>

#include <csignal>
#include <fstream>

#include "host/error.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_devices.h"

using namespace degas;
using degas::test::file_text;
using degas::test::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

Checkpoint example() {
  return {{{"step", 7}, {"config", {{"width", 0.5}}}}, {{"a", {1, 2, 3}}, {"empty", {}}, {"b", {-0.5f}}}};
}

void write_bytes(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace

TEST_CASE("a checkpoint comes back as it was written, and equal contents give equal bytes") {
  const fs::path folder = fs::temp_directory_path() / "degas_checkpoint_test";
  fs::create_directories(folder);
  write_checkpoint(folder / "one.bin", example());
  write_checkpoint(folder / "two.bin", example());
  const Checkpoint read = read_checkpoint(folder / "one.bin");
  CHECK(read.header == example().header);
  CHECK(read.arrays == example().arrays);
  CHECK(file_text(folder / "one.bin") == file_text(folder / "two.bin"));
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    CHECK(entry.path().filename().string().find(".tmp") == std::string::npos);
  }
  CHECK(read.array("b", 1).front() == -0.5f);
  CHECK_THROWS_WITH(read.array("c", 1), Catch::Contains("one.bin") && Catch::Contains("'c'"));
  CHECK_THROWS_WITH(read.array("b", 2), Catch::Contains("needs 2"));
}

TEST_CASE("a damaged checkpoint is refused, whatever byte is wrong or missing") {
  const fs::path folder = fs::temp_directory_path() / "degas_checkpoint_test";
  fs::create_directories(folder);
  const fs::path path = folder / "damaged.bin";
  write_checkpoint(path, example());
  const std::string good = file_text(path);
  for (size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] ^= 0x41;
    write_bytes(path, bad);
    CHECK_THROWS_AS(read_checkpoint(path), Error);
    write_bytes(path, good.substr(0, i));
    CHECK_THROWS_AS(read_checkpoint(path), Error);
  }
  write_bytes(path, good + "x");
  CHECK_THROWS_AS(read_checkpoint(path), Error);
  CHECK_THROWS_WITH(read_checkpoint(folder / "absent.bin"), Catch::Contains("absent.bin"));
}

TEST_CASE("a checkpoint that cannot be written leaves the old one") {
  const TemporaryFolder folder;
  write_checkpoint(folder / "x.bin", example());
  const std::string old = file_text(folder / "x.bin");
  Checkpoint larger = example();
  larger.arrays.emplace_back("more", std::vector<float>(100'000));
  {
    // No file may grow that far: as on a disk that is full.
    const auto before = std::signal(SIGXFSZ, SIG_IGN);
    rlimit limit;
    getrlimit(RLIMIT_FSIZE, &limit);
    const rlimit low{100'000, limit.rlim_max};
    setrlimit(RLIMIT_FSIZE, &low);
    CHECK_THROWS_WITH(write_checkpoint(folder / "x.bin", larger), Catch::Contains("x.bin: cannot be written"));
    setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, before);
  }
  const bool untouched = file_text(folder / "x.bin") == old;
  CHECK(untouched);
  CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);  // nothing half written is left
  CHECK_THROWS_WITH(write_checkpoint(folder / "no" / "folder" / "x.bin", example()), Catch::Contains("x.bin"));
}
