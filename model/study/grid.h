#pragma once

#include "model/study/variant.h"

namespace degas {

/// The configurations of a sweep; the first is the base itself. Those that equal an earlier one are left out.
///
/// A grid file is JSON with one or both of
///   "sweep":  {"net.resolution": [128, 512], "net.width": [0.25, 1]}      every value by itself, the rest as the base
///   "points": [{"name": "fast", "set": {"net.resolution": 128, "net.width": 0.25}}]    several together; the name may
///             be left out
/// Error naming the file and the key, value or name that is wrong.
std::vector<Variant> grid_variants(const Variant& base, const std::filesystem::path& file);

/// The sweep made without a file: resolution, width, bias resolution, encoders, image scale, views a step, raster
/// options, and some of them together.
std::vector<Variant> default_grid(const Variant& base);

/// Every *.json of a folder, in the order of their names, with the overrides that all variants have.
std::vector<Variant> baseline_variants(const std::filesystem::path& folder, const std::vector<std::string>& overrides);

}  // namespace degas
