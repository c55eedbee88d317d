#include "model/study/measures.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <tuple>

#include "host/error.h"
#include "model/config_fields.h"

namespace degas {
namespace {

const std::vector<std::string>& kinds() {
  static const std::vector<std::string> all = {"psnr", "ssim", "lpips", "fid", "aed"};
  return all;
}

/// face_lpips_vgg: region face, kind lpips, network vgg. No kind where the key is no measure.
struct MeasureName {
  std::string region, kind, network;

  explicit MeasureName(const std::string& key) {
    std::vector<std::string> words;
    std::string word;
    for (std::istringstream stream(key); std::getline(stream, word, '_');) words.push_back(word);
    const std::vector<std::string> networks = choice_names<LpipsNetwork>();
    if (words.size() > 1 && std::find(networks.begin(), networks.end(), words.back()) != networks.end()) {
      network = words.back();
      words.pop_back();
    }
    if (words.empty() || std::find(kinds().begin(), kinds().end(), words.back()) == kinds().end()) return;
    kind = words.back();
    words.pop_back();
    region = fmt::format("{}", fmt::join(words, " "));
  }
};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::string cell;
  for (std::istringstream stream(line + ','); std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

}  // namespace

bool is_measure(const std::string& key) {
  return !MeasureName(key).kind.empty();
}

bool lower_is_better(const std::string& measure) {
  const std::string kind = MeasureName(measure).kind;
  return kind == "lpips" || kind == "fid" || kind == "aed";
}

std::vector<std::string> shown_measures(const nlohmann::json& metrics) {
  std::vector<std::pair<std::tuple<std::string, size_t, std::string>, std::string>> found;
  for (const auto& [key, value] : metrics.items()) {
    const MeasureName name(key);
    if (!value.is_number() || name.kind.empty() || name.region == "person") continue;
    if (!name.region.empty() && name.kind == "ssim") continue;
    const auto place = std::find(kinds().begin(), kinds().end(), name.kind) - kinds().begin();
    found.push_back({{name.region, static_cast<size_t>(place), name.network}, key});
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> measures;
  for (const auto& [place, key] : found) measures.push_back(key);
  return measures;
}

std::string measure_label(const std::string& measure) {
  MeasureName name(measure);
  std::transform(name.kind.begin(), name.kind.end(), name.kind.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return (name.region.empty() ? "" : name.region + " ") + name.kind + (name.network.empty() ? "" : " " + name.network);
}

std::string measure_text(const std::string& measure, double value, bool with_sign) {
  const std::string kind = MeasureName(measure).kind;
  const int digits = kind == "psnr" ? 2 : kind == "fid" ? 1 : 4;
  return with_sign ? fmt::format("{:+.{}f}", value, digits) : fmt::format("{:.{}f}", value, digits);
}

FrameTable FrameTable::read(const std::filesystem::path& path) {
  std::ifstream stream(path);
  std::string line;
  if (!stream || !std::getline(stream, line)) throw Error::format("{}: cannot be read", path.string());
  const std::vector<std::string> names = cells_of(line);
  const auto column = [&](const char* name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) throw Error::format("{}: has no column '{}'", path.string(), name);
    return static_cast<size_t>(found - names.begin());
  };
  const size_t camera = column("camera"), frame = column("frame");
  FrameTable table;
  for (int number = 2; std::getline(stream, line); ++number) {
    const std::vector<std::string> cells = cells_of(line);
    try {
      if (cells.size() != names.size()) throw std::invalid_argument("another number of cells");
      auto& row = table.rows[{cells[camera], std::stoi(cells[frame])}];
      for (size_t i = 0; i < cells.size(); ++i) {
        if (is_measure(names[i]) && !cells[i].empty()) row[names[i]] = std::stod(cells[i]);
      }
    } catch (const std::logic_error&) {
      throw Error::format("{}: line {} is no row of numbers under its heading; evaluate again", path.string(), number);
    }
  }
  return table;
}

std::map<std::string, double> FrameTable::means(const std::vector<int>* frames) const {
  std::map<std::string, std::pair<double, int>> sums;
  for (const auto& [key, row] : rows) {
    if (frames && std::find(frames->begin(), frames->end(), key.second) == frames->end()) continue;
    for (const auto& [measure, value] : row) {
      sums[measure].first += value;
      ++sums[measure].second;
    }
  }
  std::map<std::string, double> means;
  for (const auto& [measure, sum] : sums) means[measure] = sum.first / sum.second;
  return means;
}

nlohmann::json Spread::json() const {
  nlohmann::json json = {
      {"mean", mean}, {"median", median}, {"lowest", lowest}, {"highest", highest}, {"count", count}};
  if (deviation) json["deviation"] = *deviation;
  return json;
}

Spread spread_of(const std::vector<double>& values) {
  Spread spread;
  spread.count = values.size();
  if (values.empty()) return spread;
  for (const double value : values) spread.mean += value / static_cast<double>(values.size());
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  spread.lowest = sorted.front();
  spread.highest = sorted.back();
  spread.median = (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]) / 2;
  if (values.size() < 2) return spread;
  double squares = 0;
  for (const double value : values) squares += (value - spread.mean) * (value - spread.mean);
  spread.deviation = std::sqrt(squares / static_cast<double>(values.size() - 1));
  return spread;
}

nlohmann::json PairedDifference::json() const {
  nlohmann::json json = {
      {"mean", mean}, {"share_better", share_better}, {"pictures", pictures}, {"over_seeds", seeds.json()}};
  if (standard_error) json["standard_error"] = *standard_error;
  return json;
}

std::optional<PairedDifference> paired_difference(const std::vector<FrameTable>& a, const std::vector<FrameTable>& b,
                                                  const std::string& measure) {
  std::map<FrameTable::Key, std::vector<double>> by_picture;
  std::vector<double> by_seed;
  for (size_t seed = 0; seed < std::min(a.size(), b.size()); ++seed) {
    std::vector<double> differences;
    for (const auto& [key, row] : a[seed].rows) {
      const auto other = b[seed].rows.find(key);
      if (other == b[seed].rows.end() || !row.count(measure) || !other->second.count(measure)) continue;
      differences.push_back(row.at(measure) - other->second.at(measure));
      by_picture[key].push_back(differences.back());
    }
    if (!differences.empty()) by_seed.push_back(spread_of(differences).mean);
  }
  if (by_picture.empty()) return {};
  std::vector<double> pictures;
  PairedDifference result;
  for (const auto& [key, values] : by_picture) {
    pictures.push_back(spread_of(values).mean);
    const bool better = lower_is_better(measure) ? pictures.back() < 0 : pictures.back() > 0;
    result.share_better += better / static_cast<double>(by_picture.size());
  }
  result.pictures = pictures.size();
  result.seeds = spread_of(by_seed);
  result.mean = result.seeds.mean;
  const size_t batches = pictures.size() < 20 ? pictures.size() : 10;
  std::vector<double> means;
  for (size_t i = 0; i < batches; ++i) {
    const auto at = [&](size_t k) { return pictures.begin() + static_cast<long>(k * pictures.size() / batches); };
    means.push_back(spread_of({at(i), at(i + 1)}).mean);
  }
  if (const auto deviation = spread_of(means).deviation)
    result.standard_error = *deviation / std::sqrt(static_cast<double>(batches));
  return result;
}

}  // namespace degas
