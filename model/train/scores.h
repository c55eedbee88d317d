#pragma once

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "model/config.h"
#include "model/loss/frechet.h"
#include "model/loss/metrics.h"
#include "model/train/evaluation_folder.h"

namespace degas {

/// The networks that pictures are compared by; what is left empty is not measured.
struct MetricNetworks {
  std::vector<std::pair<LpipsNetwork, std::vector<LpipsLayer>>> lpips;
  /// Features of a square picture (RGB, 0..255) for FID.
  std::function<std::vector<float>(std::span<const float> square, int side)> inception;
  /// Expression coefficients of a face picture of expression_side for AED.
  std::function<std::vector<float>(const Image8& face)> expression;
  int expression_side = 0;
  nlohmann::json description = nlohmann::json::object();  ///< of their files, for metrics.json
  std::string no_lpips = {};  ///< why there is none where one was hoped for; told once all is measured
};

/// Figures of rendered pictures against photographs, by the protocol of method.md: PSNR, SSIM, LPIPS and FID of the
/// whole picture, the person's, the face's and the mouth's box (model/loss/metrics.h says what each network sees), AED
/// of the face's box. Means are over the pictures that show the region.
class Scores {
 public:
  Scores(Device& device, const MetricNetworks& networks);

  /// Throws Error naming the picture when a network's numbers of it are not finite.
  void add(const EvaluatedPicture& picture, const Image8& truth, const Image8& render);

  int without_face() const { return without_face_; }
  const std::vector<EvaluatedPicture>& pictures() const { return pictures_; }
  /// psnr, ssim, lpips (AlexNet's; lpips_squeeze, lpips_vgg), fid, each also with person_, face_ and mouth_ before it,
  /// and aed. What could not be measured is null; fid and aed are there where their networks are. `pictures`,
  /// `frames`, and `worst`: the names of the pictures of least PSNR in the person's and in the face's box.
  nlohmann::json metrics() const;
  /// A line a picture, with the names of the columns first.
  std::string table() const;
  /// The worst pictures of metrics(), truth, render and error side by side: the person's box on the left, the face's on
  /// the right. `load` gives truth and render.
  Image8 worst_sheet(const std::function<std::pair<Image8, Image8>(const EvaluatedPicture&)>& load) const;

 private:
  static constexpr size_t regions = 4;
  struct Row {
    std::array<std::optional<ImageQuality>, regions> quality;
    std::optional<double> expression_distance;
  };
  std::vector<std::string> region_columns() const;
  void add_features(size_t region, const Tensor& truth, const Tensor& render, const std::string& name);
  double expression_distance(const Image8& truth, const Image8& render, const MeasuredRegion& face,
                             const std::string& name) const;
  /// Places in pictures_, the lowest PSNR first.
  std::vector<size_t> worst(size_t region) const;

  const MetricNetworks& networks_;
  QualityMeter meter_;
  std::vector<EvaluatedPicture> pictures_;
  std::vector<Row> rows_;
  std::array<FeatureRows, regions> truth_features_, render_features_;
  int without_face_ = 0;
};

}  // namespace degas
