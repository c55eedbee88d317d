#include "model/train/scores.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "host/error.h"
#include "model/train/picture.h"

namespace degas {
namespace {

enum Region : size_t { whole_picture, person, face, mouth };
constexpr const char* prefixes[] = {"", "person_", "face_", "mouth_"};
constexpr size_t worst_count = 8;
constexpr int sheet_side = 256;

std::string lpips_key(LpipsNetwork network) {
  const char* keys[] = {"lpips", "lpips_squeeze", "lpips_vgg"};
  return keys[static_cast<int>(network)];
}

std::vector<std::vector<LpipsLayer>> layers_of(const MetricNetworks& networks) {
  std::vector<std::vector<LpipsLayer>> layers;
  for (const auto& [network, its_layers] : networks.lpips) layers.push_back(its_layers);
  return layers;
}

void require_finite(const std::vector<float>& numbers, const char* network, const std::string& name) {
  if (!std::all_of(numbers.begin(), numbers.end(), [](float value) { return std::isfinite(value); })) {
    throw Error::format("{}: the {} network's numbers of it are not finite; its weights, mean or scale are wrong", name,
                        network);
  }
}

std::vector<float> bytes_range(const Tensor& picture) {
  std::vector<float> values = picture.to_host<float>();
  for (float& value : values) value *= 255;
  return values;
}

nlohmann::json mean_or_null(const std::vector<double>& values) {
  if (values.empty()) return {};
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

Scores::Scores(Device& device, const MetricNetworks& networks)
    : networks_(networks), meter_(device, layers_of(networks)) {}

void Scores::add_features(size_t region, const Tensor& truth, const Tensor& render, const std::string& name) {
  const auto add = [&](const Tensor& square, FeatureRows& rows) {
    const std::vector<float> features = networks_.inception(bytes_range(square), static_cast<int>(square.dim(0)));
    require_finite(features, "FID", name);
    rows.add(features);
  };
  add(truth, truth_features_[region]);
  add(render, render_features_[region]);
}

double Scores::expression_distance(const Image8& truth, const Image8& render, const MeasuredRegion& face,
                                   const std::string& name) const {
  const MeasuredRegion region{face.inside, face.square, networks_.expression_side};
  const auto code = [&](const Image8& picture) {
    std::vector<float> numbers = networks_.expression(to_image8(meter_.square(picture, region)));
    require_finite(numbers, "expression", name);
    return numbers;
  };
  return cosine_distance(code(truth), code(render));
}

void Scores::add(const EvaluatedPicture& picture, const Image8& truth, const Image8& render) {
  const auto region_of = [&](const std::optional<Rectangle>& box) {
    return box ? box_region(truth, *box) : std::optional<MeasuredRegion>();
  };
  const std::array<std::optional<MeasuredRegion>, regions> seen = {whole_region(truth, picture.person),
                                                                   region_of(picture.person), region_of(picture.face),
                                                                   region_of(picture.mouth)};
  Row row;
  for (size_t region = 0; region < regions; ++region) {
    if (!seen[region]) continue;
    row.quality[region] = meter_.measure(render, truth, *seen[region]);
    if (networks_.inception) {
      add_features(region, meter_.square(truth, *seen[region]), meter_.square(render, *seen[region]), picture.name());
    }
  }
  if (networks_.expression && seen[face]) {
    row.expression_distance = expression_distance(truth, render, *seen[face], picture.name());
  }
  without_face_ += !seen[face];
  pictures_.push_back(picture);
  rows_.push_back(std::move(row));
}

nlohmann::json Scores::metrics() const {
  nlohmann::json metrics;
  for (size_t region = 0; region < regions; ++region) {
    const std::string prefix = prefixes[region];
    const auto mean = [&](const auto& figure) {
      std::vector<double> values;
      for (const Row& row : rows_) {
        if (row.quality[region]) values.push_back(figure(*row.quality[region]));
      }
      return mean_or_null(values);
    };
    metrics[prefix + "psnr"] = mean([](const ImageQuality& quality) { return quality.psnr; });
    metrics[prefix + "ssim"] = mean([](const ImageQuality& quality) { return quality.ssim; });
    metrics[prefix + "lpips"] = nullptr;
    for (size_t i = 0; i < networks_.lpips.size(); ++i) {
      metrics[prefix + lpips_key(networks_.lpips[i].first)] =
          mean([i](const ImageQuality& quality) { return quality.lpips[i]; });
    }
    if (!networks_.inception) continue;
    const bool enough = truth_features_[region].count() > 1;
    metrics[prefix + "fid"] =
        enough ? nlohmann::json(frechet_distance(truth_features_[region].matrix(), render_features_[region].matrix()))
               : nlohmann::json();
  }
  std::vector<double> distances;
  std::set<int> frames;
  for (size_t i = 0; i < rows_.size(); ++i) {
    if (rows_[i].expression_distance) distances.push_back(*rows_[i].expression_distance);
    frames.insert(pictures_[i].frame);
  }
  if (networks_.expression) metrics["aed"] = mean_or_null(distances);
  metrics["frames"] = frames.size();
  metrics["pictures"] = rows_.size();
  for (const auto& [key, region] : {std::pair("person", person), std::pair("face", face)}) {
    metrics["worst"][key] = nlohmann::json::array();
    for (const size_t place : worst(region)) metrics["worst"][key].push_back(pictures_[place].name());
  }
  if (!networks_.description.empty()) metrics["networks"] = networks_.description;
  return metrics;
}

std::vector<std::string> Scores::region_columns() const {
  std::vector<std::string> columns = {"psnr", "ssim"};
  if (networks_.lpips.empty()) columns.push_back("lpips");
  for (const auto& [network, layers] : networks_.lpips) columns.push_back(lpips_key(network));
  return columns;
}

std::string Scores::table() const {
  const std::vector<std::string> columns = region_columns();
  std::string text = "camera,frame,refined";
  for (const char* prefix : prefixes) {
    for (const std::string& column : columns) text += fmt::format(",{}{}", prefix, column);
  }
  text += networks_.expression ? ",aed\n" : "\n";
  for (size_t i = 0; i < rows_.size(); ++i) {
    text += fmt::format("{},{},{}", pictures_[i].camera, pictures_[i].frame, pictures_[i].refined ? 1 : 0);
    for (const std::optional<ImageQuality>& quality : rows_[i].quality) {
      std::vector<double> values;
      if (quality) {
        values = {quality->psnr, quality->ssim};
        values.insert(values.end(), quality->lpips.begin(), quality->lpips.end());
      }
      for (size_t k = 0; k < columns.size(); ++k) text += k < values.size() ? fmt::format(",{:.6f}", values[k]) : ",";
    }
    if (networks_.expression) {
      text += rows_[i].expression_distance ? fmt::format(",{:.6f}", *rows_[i].expression_distance) : ",";
    }
    text += '\n';
  }
  return text;
}

std::vector<size_t> Scores::worst(size_t region) const {
  std::vector<size_t> places;
  for (size_t i = 0; i < rows_.size(); ++i) {
    if (rows_[i].quality[region]) places.push_back(i);
  }
  std::stable_sort(places.begin(), places.end(),
                   [&](size_t a, size_t b) { return rows_[a].quality[region]->psnr < rows_[b].quality[region]->psnr; });
  places.resize(std::min(places.size(), worst_count));
  return places;
}

Image8 Scores::worst_sheet(const std::function<std::pair<Image8, Image8>(const EvaluatedPicture&)>& load) const {
  const std::vector<size_t> columns[] = {worst(person), worst(face)};
  const size_t rows = std::max({columns[0].size(), columns[1].size(), size_t{1}});
  Image8 sheet = Image8::black(6 * sheet_side, static_cast<int>(rows) * sheet_side, 3);
  for (size_t column = 0; column < 2; ++column) {
    for (size_t row = 0; row < columns[column].size(); ++row) {
      const EvaluatedPicture& picture = pictures_[columns[column][row]];
      const auto [truth, render] = load(picture);
      const Rectangle square = grown_square(column == 0 ? picture.person : *picture.face, 0);
      const auto cut = [&](const Image8& image) {
        return resized(cropped(image, square.left, square.top, square.width, square.height), sheet_side, sheet_side);
      };
      const Image8 part = comparison_sheet(cut(truth), cut(render));
      for (int y = 0; y < sheet_side; ++y) {
        std::copy_n(part.at(0, y), part.width * 3,
                    sheet.at(static_cast<int>(column) * part.width, static_cast<int>(row) * sheet_side + y));
      }
    }
  }
  return sheet;
}

}  // namespace degas
