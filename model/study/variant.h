#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/config.h"

namespace degas {

/// One of the configurations that a study compares.
struct Variant {
  std::string name;
  Config config;                          ///< checked; without seed and budget, which are the study's
  std::filesystem::path config_file;      ///< where it comes from ..
  std::vector<std::string> overrides;     ///< .. and what was set on top, as `--set` takes it
  bool is_baseline = false;               ///< another method's choice, to compare with
  std::vector<std::string> paper_labels;  ///< rows of published.h that stand beside it
};

/// A file's config with overrides on top. Error naming the file or the override.
Variant make_variant(const std::string& name, const std::filesystem::path& config_file,
                     const std::vector<std::string>& overrides);
/// The same with one more override or several; `name` is the new variant's.
Variant varied(const Variant& base, const std::string& name, const std::vector<std::string>& overrides);

/// What every variant of a study is given: minutes of training, else optimiser steps.
struct StudyBudget {
  std::optional<double> minutes;
  int64_t iterations = 0;
  /// The config's train.iterations for this budget. Under a budget in minutes no step count ends a run: small variants
  /// would stop early.
  int64_t step_limit() const { return minutes ? 1'000'000'000 : iterations; }
  std::string text() const;
};

/// A name as a folder's: what is neither letter, digit, dot nor underscore becomes a hyphen.
std::string folder_name(const std::string& name);

/// Error when two variants would share a folder, or there is none.
void require_distinct(const std::vector<Variant>& variants);

}  // namespace degas
