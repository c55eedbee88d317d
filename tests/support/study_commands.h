#pragma once

#include "tests/support/training_commands.h"

namespace degas::test {

/// A command that trains variants on the training scene; each part may be changed.
struct StudyCommand {
  std::string command;
  std::filesystem::path output, config;
  std::vector<std::string> more;

  /// No more than `iterations` steps and a checkpoint every other one.
  StudyCommand(const TemporaryFolder& folder, const std::string& command, int iterations)
      : command(command), output(folder / "study"), config(folder / "config.json") {
    Config values = tiny_config();
    values.train.iterations = iterations;
    values.train.checkpoint_every = 2;
    std::ofstream(config) << config_text(values);
  }
  std::vector<std::string> arguments() const {
    const std::filesystem::path& scene = training_scene();
    std::vector<std::string> words = {command,   "--data",       scene / "P1C1", "--body",  scene / "body.npz",
                                      "--novel", scene / "P1C2", "--config",     config,    "--out",
                                      output,    "--hold-out",   "cam02",        "--cache", scene / "cache"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  ProgramResult operator()() const { return run_program(arguments()); }
};

}  // namespace degas::test
