#include "model/body/uv_packing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "host/error.h"
#include "model/body/plane.h"

namespace degas {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int cells = 256;      ///< on a side of the grid in which charts are laid out
constexpr double gap = 0.5;     ///< cells that each chart keeps free around itself
constexpr int size_steps = 12;  ///< halvings in the search for the largest size that fits
constexpr int turns = 4;

/// Bits of a grid, row by row.
struct Bitmap {
  Bitmap(int width_, int height_)
      : width(width_), height(height_), words((width_ + 63) / 64), bits(static_cast<size_t>(words) * height_, 0) {}
  void set(int x, int y) { bits[static_cast<size_t>(y) * words + x / 64] |= uint64_t{1} << (x % 64); }

  int width, height, words;
  std::vector<uint64_t> bits;
};

/// Calls visit(word of the grid, bits of the shape there) for every word of `shape` laid at (x, y), until it is false.
template <typename Grid, typename Visit>
bool for_each_word(Grid& grid, const Bitmap& shape, int x, int y, const Visit& visit) {
  const int shift = x % 64;
  for (int row = 0; row < shape.height; ++row) {
    auto* target = grid.bits.data() + static_cast<size_t>(y + row) * grid.words + x / 64;
    const uint64_t* source = shape.bits.data() + static_cast<size_t>(row) * shape.words;
    uint64_t carried = 0;
    for (int w = 0; w < shape.words; ++w) {
      if (!visit(target[w], source[w] << shift | carried)) return false;
      carried = shift == 0 ? 0 : source[w] >> (64 - shift);
    }
    if (carried != 0 && !visit(target[shape.words], carried)) return false;
  }
  return true;
}

/// The first place, row by row, where the shape meets nothing that is taken and stays above `bottom`.
std::optional<std::array<int, 2>> find_place(const Bitmap& taken, const Bitmap& shape, int bottom) {
  for (int y = 0; y + shape.height < bottom; ++y) {
    for (int x = 0; x + shape.width <= taken.width; ++x) {
      if (for_each_word(taken, shape, x, y, [](uint64_t word, uint64_t bits) { return (word & bits) == 0; })) {
        return std::array{x, y};
      }
    }
  }
  return std::nullopt;
}

/// Triangles of a part that share texture vertices.
struct Chart {
  std::vector<int> triangles;
  std::vector<int> corners;  ///< texture vertices, ascending
  bool is_head = false;
  double area = 0;    ///< of the surface, square metres
  double metres = 0;  ///< per unit of texture
  double angle = 0;   ///< that makes its box smallest
};

/// Where a chart goes: cells = turn * texture point + offset, y down.
struct Place {
  Eigen::Matrix2d turn;  ///< and size
  Vector2d offset;
};

class AtlasPacker {
 public:
  AtlasPacker(const TexturedMesh& mesh, const std::vector<AtlasPart>& parts) : mesh_(mesh) {
    packed_.texture_triangles = mesh.texture_triangles;
    cut(parts);
    find_charts(parts);
    for (Chart& chart : charts_) measure(chart);
    // Large ones first; equal ones in the mesh's order.
    std::stable_sort(charts_.begin(), charts_.end(), [](const Chart& a, const Chart& b) { return a.area > b.area; });
  }

  PackedAtlas pack() {
    packed_.texture_coordinates.assign(points_.size(), Vector2d::Zero());
    Bitmap head_grid(cells / 2, cells / 2), grid(cells, cells);
    for (int y = 0; y < cells / 2; ++y) {
      for (int x = 0; x < cells / 2; ++x) grid.set(x, y);
    }
    lay_out(true, head_grid);
    lay_out(false, grid);
    return std::move(packed_);
  }

 private:
  /// Gives every part texture vertices of its own.
  void cut(const std::vector<AtlasPart>& parts) {
    std::map<std::pair<int, int>, int> copies;  // texture vertex and part
    for (size_t t = 0; t < parts.size(); ++t) {
      for (int& corner : packed_.texture_triangles[t]) {
        const auto [found, is_new] = copies.emplace(std::pair(corner, parts[t].id), static_cast<int>(points_.size()));
        const Vector2d& uv = mesh_.texture_coordinates[corner];
        if (is_new) points_.emplace_back(uv.x(), -uv.y());
        corner = found->second;
      }
    }
  }

  void find_charts(const std::vector<AtlasPart>& parts) {
    std::vector<int> leader(points_.size());
    std::iota(leader.begin(), leader.end(), 0);
    const auto find = [&](int vertex) {
      while (leader[vertex] != vertex) vertex = leader[vertex] = leader[leader[vertex]];
      return vertex;
    };
    for (const std::array<int, 3>& triangle : packed_.texture_triangles) {
      for (int k = 1; k < 3; ++k) leader[find(triangle[k])] = find(triangle[0]);
    }
    std::map<int, int> chart_of_leader;
    for (size_t t = 0; t < parts.size(); ++t) {
      const auto [found, is_new] =
          chart_of_leader.emplace(find(packed_.texture_triangles[t][0]), static_cast<int>(charts_.size()));
      if (is_new) charts_.emplace_back();
      Chart& chart = charts_[found->second];
      chart.triangles.push_back(static_cast<int>(t));
      chart.is_head = parts[t].is_head;
      chart.area += surface_area(static_cast<int>(t));
    }
  }

  double surface_area(int triangle) const {
    const auto& [a, b, c] = mesh_.triangles[triangle];
    const Vector3d ab = mesh_.vertices[b] - mesh_.vertices[a], ac = mesh_.vertices[c] - mesh_.vertices[a];
    return 0.5 * ab.cross(ac).norm();
  }

  /// A triangle's corners in texture units, y down as the atlas' rows go.
  std::array<Vector2d, 3> corners(int triangle) const {
    std::array<Vector2d, 3> result;
    for (int k = 0; k < 3; ++k) result[k] = points_[packed_.texture_triangles[triangle][k]];
    return result;
  }

  void measure(Chart& chart) const {
    double texture_area = 0;
    for (const int triangle : chart.triangles) {
      const auto [a, b, c] = corners(triangle);
      texture_area += 0.5 * std::abs(cross(b - a, c - a));
      for (const int corner : packed_.texture_triangles[triangle]) chart.corners.push_back(corner);
    }
    std::sort(chart.corners.begin(), chart.corners.end());
    chart.corners.erase(std::unique(chart.corners.begin(), chart.corners.end()), chart.corners.end());
    chart.metres = texture_area > 0 ? std::sqrt(chart.area / texture_area) : 0;
    double smallest = -1;
    for (int degrees = 0; degrees < 90; degrees += 5) {
      const double angle = degrees * std::numbers::pi / 180;
      const auto [low, high] = box(chart, Eigen::Rotation2Dd(angle).toRotationMatrix());
      const double area = (high - low).prod();
      if (smallest < 0 || area < smallest * (1 - 1e-9)) smallest = area, chart.angle = angle;
    }
  }

  std::array<Vector2d, 2> box(const Chart& chart, const Eigen::Matrix2d& turn) const {
    Vector2d low = turn * points_[chart.corners.front()], high = low;
    for (const int corner : chart.corners) {
      const Vector2d at = turn * points_[corner];
      low = low.cwiseMin(at), high = high.cwiseMax(at);
    }
    return {low, high};
  }

  /// The cells that a chart takes with its gap, and the place that maps it into them. size: cells per metre.
  std::pair<Bitmap, Place> draw(const Chart& chart, double size, int turn) const {
    constexpr double reach = gap + std::numbers::sqrt2 / 2;  // a cell's centre to its corner
    const double scale = size * chart.metres, angle = chart.angle + turn * std::numbers::pi / 2;
    Place place{scale * Eigen::Rotation2Dd(angle).toRotationMatrix(), {}};
    const auto [low, high] = box(chart, place.turn);
    place.offset = Vector2d::Constant(reach) - low;
    const Vector2d extent = high - low;
    Bitmap shape(static_cast<int>(std::ceil(extent.x() + 2 * reach)),
                 static_cast<int>(std::ceil(extent.y() + 2 * reach)));
    for (const int triangle : chart.triangles) {
      std::array<Vector2d, 3> points = corners(triangle);
      for (Vector2d& corner : points) corner = place.turn * corner + place.offset;
      cover(points, reach, shape);
    }
    return {std::move(shape), place};
  }

  /// Sets the cells whose centres lie within `reach` of the triangle's sides and of its box.
  static void cover(const std::array<Vector2d, 3>& points, double reach, Bitmap& shape) {
    const Vector2d low = points[0].cwiseMin(points[1]).cwiseMin(points[2]);
    const Vector2d high = points[0].cwiseMax(points[1]).cwiseMax(points[2]);
    const double winding = cross(points[1] - points[0], points[2] - points[0]) < 0 ? -1 : 1;
    std::array<Vector2d, 3> sides;
    std::array<double, 3> limits;
    for (int k = 0; k < 3; ++k) {
      sides[k] = winding * (points[(k + 1) % 3] - points[k]);
      limits[k] = -reach * sides[k].norm();
    }
    const auto first = [&](double from) { return std::max(0, static_cast<int>(std::ceil(from - reach - 0.5))); };
    const auto last = [&](double to, int size) {
      return std::min(size - 1, static_cast<int>(std::floor(to + reach - 0.5)));
    };
    for (int y = first(low.y()); y <= last(high.y(), shape.height); ++y) {
      for (int x = first(low.x()); x <= last(high.x(), shape.width); ++x) {
        const Vector2d centre(x + 0.5, y + 0.5);
        bool inside = true;
        for (int k = 0; k < 3 && inside; ++k) inside = cross(sides[k], centre - points[k]) >= limits[k];
        if (inside) shape.set(x, y);
      }
    }
  }

  /// Lays the charts out at a size; nothing where they do not fit.
  std::optional<std::vector<Place>> try_size(const std::vector<const Chart*>& charts, Bitmap grid, double size) const {
    std::vector<Place> places;
    for (const Chart* chart : charts) {
      std::optional<std::pair<Bitmap, Place>> best;
      std::array<int, 2> best_at{};
      int best_bottom = grid.height + 1;
      for (int turn = 0; turn < turns; ++turn) {
        std::pair<Bitmap, Place> drawn = draw(*chart, size, turn);
        const auto at = find_place(grid, drawn.first, best_bottom);
        if (!at) continue;
        best_at = *at, best_bottom = (*at)[1] + drawn.first.height;
        best = std::move(drawn);
      }
      if (!best) return std::nullopt;
      for_each_word(grid, best->first, best_at[0], best_at[1], [](uint64_t& word, uint64_t bits) {
        word |= bits;
        return true;
      });
      best->second.offset += Vector2d(best_at[0], best_at[1]);
      places.push_back(best->second);
    }
    return places;
  }

  void lay_out(bool head, const Bitmap& grid) {
    std::vector<const Chart*> charts;
    double area = 0;
    for (const Chart& chart : charts_) {
      if (chart.is_head != head) continue;
      charts.push_back(&chart);
      if (chart.metres > 0) area += chart.area;
    }
    if (charts.empty()) return;
    const auto refuse = [&](const std::string& why) {
      return Error::format("the texture of the {} {}; take MakeHuman's own base.obj", head ? "head" : "body", why);
    };
    if (!(area > 0)) throw refuse("covers no area");
    double free = 0;
    for (const uint64_t word : grid.bits) free += 64 - __builtin_popcountll(word);
    double low = 0, high = std::sqrt(free / area);
    std::vector<Place> best;
    for (int step = 0; step < size_steps || best.empty(); ++step) {
      const double size = 0.5 * (low + high);
      if (auto places = try_size(charts, grid, size)) {
        best = std::move(*places);
        low = size;
      } else {
        high = size;
      }
      if (step > 60) throw refuse(fmt::format("is cut into {} pieces, more than the atlas holds", charts.size()));
    }
    for (size_t i = 0; i < charts.size(); ++i) {
      for (const int corner : charts[i]->corners) {
        const Vector2d at = (best[i].turn * points_[corner] + best[i].offset) / cells;
        packed_.texture_coordinates[corner] = {at.x(), 1 - at.y()};
      }
    }
  }

  TexturedMesh mesh_;
  std::vector<Vector2d> points_;  // of the texture, y down as the atlas' rows go
  std::vector<Chart> charts_;
  PackedAtlas packed_;
};

}  // namespace

PackedAtlas pack_atlas(const TexturedMesh& mesh, const std::vector<AtlasPart>& parts) {
  return AtlasPacker(mesh, parts).pack();
}

}  // namespace degas
