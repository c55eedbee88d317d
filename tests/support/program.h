#pragma once

#include <sys/types.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace degas::test {

/// How a program ended, and what it said.
struct ProgramResult {
  int exit_code = -1;  ///< -1 when a signal ended it
  int ended_by = 0;    ///< that signal
  std::string output, errors;
};

using Environment = std::vector<std::pair<std::string, std::string>>;

/// The degas program (environment variable DEGAS_PROGRAM, which CTest sets) with these arguments.
class RunningProgram {
 public:
  explicit RunningProgram(const std::vector<std::string>& arguments, const Environment& environment = {});
  /// Kills it where it still runs.
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  void send(int signal) const;
  bool running();
  ProgramResult wait();

 private:
  TemporaryFolder folder_;  // of what it prints
  pid_t process_ = -1;
  bool ended_ = false;
  int status_ = 0;
};

ProgramResult run_program(const std::vector<std::string>& arguments, const Environment& environment = {});

}  // namespace degas::test
