#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include "host/io/checkpoint.h"
#include "tests/support/training_commands.h"

using namespace degas;
using namespace degas::test;
namespace fs = std::filesystem;

namespace {

/// A file system in memory, as small as asked for; where the kernel lets this process mount one.
class SmallDisk {
 public:
  explicit SmallDisk(uintmax_t bytes)
      : mounted_(mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, size(bytes)) == 0) {}
  ~SmallDisk() {
    if (mounted_) umount2(folder_.path().c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  bool is_mounted() const { return mounted_; }
  bool grow(uintmax_t bytes) { return mount("tmpfs", folder_.path().c_str(), "tmpfs", MS_REMOUNT, size(bytes)) == 0; }
  fs::path operator/(const std::string& name) const { return folder_ / name; }

 private:
  const char* size(uintmax_t bytes) {
    option_ = "size=" + std::to_string(bytes);
    return option_.c_str();
  }
  TemporaryFolder folder_;
  std::string option_;
  bool mounted_;
};

/// No file that this process's children write may grow beyond so many bytes: a quota of the cheapest kind.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(uintmax_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_;
};

Config eight_steps_saved_every_other() {
  Config config = tiny_config();
  config.train.iterations = 8;
  config.train.checkpoint_every = 2;
  config.train.refine_poses = true;
  return config;
}

int64_t saved_step(const fs::path& run) {
  return read_checkpoint(run / "checkpoint.bin").header.at("step");
}

/// The whole run's checkpoint once there is room, and nothing half-written beside it.
void check_resumes_to(const std::string& expected, TrainCommand train) {
  train.more.push_back("--resume");
  const ProgramResult result = train();
  CAPTURE(result.errors);
  CHECK(result.exit_code == 0);
  const bool same = file_text(train.run / "checkpoint.bin") == expected;
  CHECK(same);
  for (const auto& [name, text] : files_of(train.run)) CHECK_THAT(name, !Catch::Contains(".tmp"));
  check_history(train.run, 8);
}

}  // namespace

TEST_CASE("a disk that fills up ends training in one line; the checkpoint before stands, and the run goes on from it") {
  const TemporaryFolder folder;
  const std::string kernels = GENERATE("wide", "gpu");
  TrainCommand whole(folder, eight_steps_saved_every_other());
  whole.more = {"--kernels", kernels};
  REQUIRE(whole().exit_code == 0);
  const std::string expected = file_text(whole.run / "checkpoint.bin");
  uintmax_t others = 0;
  for (const auto& [name, text] : files_of(whole.run)) others += name.rfind("checkpoint", 0) == 0 ? 0 : text.size();
  constexpr uintmax_t page = 4096;
  // Room for one checkpoint and a half; files take whole pages.
  SmallDisk disk(expected.size() * 3 / 2 + others + 20 * page);
  if (!disk.is_mounted()) {
    WARN("skipped: this process may not mount a small file system");
    return;
  }
  TrainCommand train = whole;
  train.run = disk / "run";
  check_refused(train(), {"checkpoint", "No space left on device"});
  CHECK(saved_step(train.run) == 2);
  const std::string kept = file_text(train.run / "checkpoint.bin");

  SECTION("with more room it goes on") {
    REQUIRE(disk.grow(expected.size() * 8));
    check_resumes_to(expected, train);
  }
  SECTION("without any room, not even for a line of its history, what there is stays as it is") {
    std::ofstream(disk / "filler") << std::string(expected.size(), 'x');
    TrainCommand again = train;
    again.more.push_back("--resume");
    check_refused(again(), {"No space left on device"});
    CHECK(saved_step(train.run) == 2);
    const bool same = file_text(train.run / "checkpoint.bin") == kept;
    CHECK(same);
    fs::remove(disk / "filler");
    REQUIRE(disk.grow(expected.size() * 8));
    check_resumes_to(expected, train);
  }
}

TEST_CASE("a quota that lets no checkpoint through ends training in one line, and loses none that there was") {
  const TemporaryFolder whole_folder, folder;
  const std::string kernels = GENERATE("wide", "gpu");
  Config config = eight_steps_saved_every_other();
  TrainCommand whole(whole_folder, config);
  whole.more = {"--kernels", kernels};
  REQUIRE(whole().exit_code == 0);
  const std::string expected = file_text(whole.run / "checkpoint.bin");
  config.train.iterations = 4;
  TrainCommand half(folder, config);
  half.more = whole.more;
  REQUIRE(half().exit_code == 0);
  config.train.iterations = 8;
  TrainCommand train(folder, config);
  train.more = whole.more;
  TrainCommand again = train;
  again.more.push_back("--resume");
  {
    const FileSizeLimit limit(expected.size() / 2);
    check_refused(again(), {"checkpoint", "File too large"});
  }
  CHECK(saved_step(train.run) == 4);
  check_resumes_to(expected, train);
}
