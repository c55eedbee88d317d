#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "model/config.h"
#include "model/data/capture.h"

namespace degas::bench {

/// A configuration, and the size of the pictures it is measured with from end to end.
struct WholeCase {
  const char* config;
  int width, height;
  int training_steps;  ///< in one measurement

  std::string name() const { return std::string(config) + " " + std::to_string(width) + "x" + std::to_string(height); }
};
constexpr WholeCase whole_cases[] = {{"quick", 480, 640, 10}, {"full", 1024, 750, 2}};

/// Someone to train on or to draw: the synthetic subject in pictures of a given size, or capture A where that has it.
class Subject {
 public:
  /// Writes the capture to a folder of its own, which goes with the subject. Capture A (DEGAS_TEST_DATA) has 480x640.
  Subject(int width, int height);
  ~Subject();
  Subject(const Subject&) = delete;
  Subject& operator=(const Subject&) = delete;

  const char* name() const { return name_; }
  const std::filesystem::path& body() const { return body_; }
  /// Opens the training sequence.
  std::unique_ptr<Capture> capture() const;
  /// For what is to be written beside it.
  const std::filesystem::path& folder() const { return folder_; }

 private:
  const char* name_;
  std::filesystem::path folder_, capture_, body_;
};

/// configs/NAME.json for benchmarks; without the perceptual loss where LPIPS' weights are not there.
Config benchmark_config(const std::string& name);

}  // namespace degas::bench
