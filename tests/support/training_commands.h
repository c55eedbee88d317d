#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/catch.h"
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

inline size_t line_count(const std::filesystem::path& path) {
  const std::string text = file_text(path);
  return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// Waits until history.jsonl has that many lines; false when the program ends before.
inline bool await_lines(RunningProgram& program, const std::filesystem::path& run, size_t lines) {
  while (line_count(run / "history.jsonl") < lines) {
    if (!program.running()) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// One line a step, none twice and none missing.
inline void check_history(const std::filesystem::path& run, int64_t steps) {
  std::istringstream history(file_text(run / "history.jsonl"));
  int64_t step = 0;
  for (std::string line; std::getline(history, line);) CHECK(nlohmann::json::parse(line).at("step") == ++step);
  CHECK(step == steps);
}

/// Refused as users should be: exit code 2 and one line, which holds all the parts.
inline void check_refused(const ProgramResult& result, const std::vector<std::string>& parts) {
  CAPTURE(result.errors, result.output, result.ended_by);
  CHECK(result.exit_code == 2);
  CHECK(result.errors.rfind("degas: ", 0) == 0);
  CHECK(std::count(result.errors.begin(), result.errors.end(), '\n') == 1);
  CHECK(result.errors.find("internal") == std::string::npos);
  for (const std::string& part : parts) CHECK_THAT(result.errors, Catch::Contains(part));
}

/// The bytes of every file in a folder, by name.
inline std::map<std::string, std::string> files_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files[entry.path().filename()] = file_text(entry.path());
  return files;
}

}  // namespace degas::test
