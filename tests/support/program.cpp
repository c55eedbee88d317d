#include "tests/support/program.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstdlib>
#include <stdexcept>

#include "tests/support/training_scene.h"

extern char** environ;

namespace degas::test {

RunningProgram::RunningProgram(const std::vector<std::string>& arguments, const Environment& environment) {
  const char* program = std::getenv("DEGAS_PROGRAM");
  if (!program) throw std::runtime_error("DEGAS_PROGRAM is not set: run this test by ctest");
  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> settings;
  for (const auto& [name, value] : environment) settings.push_back(name + "=" + value);
  for (char** entry = environ; *entry; ++entry) settings.emplace_back(*entry);  // of two, the first one counts
  const auto pointers = [](std::vector<std::string>& strings) {
    std::vector<char*> result;
    for (std::string& text : strings) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
  };
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 1, (folder_ / "output").c_str(), O_WRONLY | O_CREAT, 0644);
  posix_spawn_file_actions_addopen(&files, 2, (folder_ / "errors").c_str(), O_WRONLY | O_CREAT, 0644);
  const int failure =
      posix_spawn(&process_, program, &files, nullptr, pointers(words).data(), pointers(settings).data());
  posix_spawn_file_actions_destroy(&files);
  if (failure != 0) throw std::runtime_error(std::string(program) + " cannot be started");
}

RunningProgram::~RunningProgram() {
  if (!running()) return;
  send(SIGKILL);
  waitpid(process_, &status_, 0);
}

void RunningProgram::send(int signal) const {
  kill(process_, signal);
}

bool RunningProgram::running() {
  if (!ended_) ended_ = waitpid(process_, &status_, WNOHANG) == process_;
  return !ended_;
}

ProgramResult RunningProgram::wait() {
  if (!ended_) ended_ = waitpid(process_, &status_, 0) == process_;
  ProgramResult result;
  if (WIFEXITED(status_)) result.exit_code = WEXITSTATUS(status_);
  if (WIFSIGNALED(status_)) result.ended_by = WTERMSIG(status_);
  result.output = file_text(folder_ / "output");
  result.errors = file_text(folder_ / "errors");
  return result;
}

ProgramResult run_program(const std::vector<std::string>& arguments, const Environment& environment) {
  return RunningProgram(arguments, environment).wait();
}

}  // namespace degas::test
