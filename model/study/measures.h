#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace degas {

// Figures of `degas eval`, whatever measures and regions its files hold: psnr, face_lpips, ...

/// Is this key of metrics.json a measure of quality, rather than a count, a time or a name?
bool is_measure(const std::string& key);
/// LPIPS, FID and AED are distances; of the others more is better.
bool lower_is_better(const std::string& measure);
/// The measures that tables show, in their order: of the whole picture first, then by region. The person's box and
/// SSIM of boxes are left out, which files hold.
std::vector<std::string> shown_measures(const nlohmann::json& metrics);
/// "face LPIPS"
std::string measure_label(const std::string& measure);
/// With the digits that its scale deserves: dB two, FID one, others four.
std::string measure_text(const std::string& measure, double value, bool with_sign = false);

/// per_frame.csv of an evaluation.
struct FrameTable {
  using Key = std::pair<std::string, int>;  ///< camera and frame
  std::map<Key, std::map<std::string, double>> rows;
  /// Error naming file and line.
  static FrameTable read(const std::filesystem::path& path);
  /// Mean of each measure over the frames given, or all; measures that no row has are left out.
  std::map<std::string, double> means(const std::vector<int>* frames = nullptr) const;
};

struct Spread {
  double mean = 0;
  std::optional<double> deviation;  ///< sample standard deviation; nothing of fewer than two
  double median = 0, lowest = 0, highest = 0;
  size_t count = 0;
  nlohmann::json json() const;
};
Spread spread_of(const std::vector<double>& values);

/// What one variant has over another in the same pictures.
struct PairedDifference {
  double mean = 0;
  /// Of the mean, by ten means of consecutive frames (batch means: neighbouring frames are alike, so that frames taken
  /// as independent would promise too much); by single frames where there are fewer than twenty. Nothing below two.
  std::optional<double> standard_error;
  double share_better = 0;  ///< of the pictures, by lower_is_better
  size_t pictures = 0;
  Spread seeds;  ///< of the mean over each seed
  nlohmann::json json() const;
};
/// a minus b; one table a seed, the same seeds in both; nothing where they share no picture with this measure.
std::optional<PairedDifference> paired_difference(const std::vector<FrameTable>& a, const std::vector<FrameTable>& b,
                                                  const std::string& measure);

}  // namespace degas
