#include "model/body/face_region.h"

namespace degas {
namespace {

constexpr int resolution = 256;             ///< of the atlas that is looked at
constexpr int half = FaceRegion::grid / 2;  ///< the region's side, and the last place of its corner
constexpr int cell = resolution / FaceRegion::grid;

}  // namespace

std::vector<bool> head_triangles(const BodyModel& body) {
  std::vector<bool> of_head(static_cast<size_t>(body.vertex_count()), false), triangles;
  for (const int vertex : body.head_vertices()) of_head[static_cast<size_t>(vertex)] = true;
  for (const auto& [a, b, c] : body.faces()) triangles.push_back(of_head[a] && of_head[b] && of_head[c]);
  return triangles;
}

FaceRegion find_face_region(const BodyModel& body) {
  const UvAtlas atlas(body, resolution);
  const std::vector<bool> head = head_triangles(body);
  std::array<std::array<int, FaceRegion::grid>, FaceRegion::grid> counts{};
  int all = 0;
  for (const int index : atlas.covered()) {
    if (!head[static_cast<size_t>(atlas.texels()[static_cast<size_t>(index)].triangle)]) continue;
    ++counts[index / resolution / cell][index % resolution / cell];
    ++all;
  }
  if (all == 0) return {};
  const auto share_at = [&](int row, int column) {
    int sum = 0;
    for (int r = row; r < row + half; ++r) {
      for (int c = column; c < column + half; ++c) sum += counts[r][c];
    }
    return static_cast<double>(sum) / all;
  };
  FaceRegion best{0, 0, share_at(0, 0)};
  if (best.head_share >= head_share_of_smplx) return best;
  for (int row = 0; row <= half; ++row) {
    for (int column = 0; column <= half; ++column) {
      const double share = share_at(row, column);
      if (share > best.head_share) best = {row, column, share};
    }
  }
  return best;
}

}  // namespace degas
