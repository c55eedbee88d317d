#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/program.h"
#include "tests/support/training_scene.h"

namespace degas::test {

/// `degas train` on the training scene as a command line; each part may be changed.
struct TrainCommand {
  std::filesystem::path run, data = training_scene() / "P1C1", body = training_scene() / "body.npz", config;
  std::vector<std::string> more;
  Environment environment;

  TrainCommand(const TemporaryFolder& folder, const Config& config_values)
      : run(folder / "run"), config(folder / "config.json") {
    std::ofstream(config) << config_text(config_values);
  }
  std::vector<std::string> arguments() const {
    std::vector<std::string> words = {"train",
                                      "--data",
                                      data.string(),
                                      "--body",
                                      body.string(),
                                      "--config",
                                      config.string(),
                                      "--out",
                                      run.string(),
                                      "--cache",
                                      (training_scene() / "cache").string()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  ProgramResult operator()() const { return run_program(arguments(), environment); }
};

}  // namespace degas::test
