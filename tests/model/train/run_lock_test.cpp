#include "model/train/run_lock.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/error.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;

TEST_CASE("a run is trained by one process at a time") {
  const TemporaryFolder folder;
  const auto run = folder.path() / "run";
  {
    const RunLock first(run);
    CHECK_THROWS_WITH(RunLock(run), Catch::Contains("another process trains this run") && Catch::Contains("--out"));
  }
  CHECK_NOTHROW(RunLock(run));
}

TEST_CASE("the lock of a killed process is free") {
  const TemporaryFolder folder;
  int ready[2];
  REQUIRE(pipe(ready) == 0);
  const pid_t child = fork();
  if (child == 0) {
    const RunLock lock(folder.path());
    if (write(ready[1], "x", 1) == 1) pause();
    _exit(1);
  }
  char byte;
  REQUIRE(read(ready[0], &byte, 1) == 1);
  CHECK_THROWS_WITH(RunLock(folder.path()), Catch::Contains("another process"));
  kill(child, SIGKILL);
  REQUIRE(waitpid(child, nullptr, 0) == child);
  CHECK_NOTHROW(RunLock(folder.path()));
  close(ready[0]);
  close(ready[1]);
}

TEST_CASE("a folder that cannot be made is an error that names it") {
  CHECK_THROWS_WITH(RunLock("/dev/null/run"), Catch::Contains("/dev/null/run"));
}
