#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "host/io/npz.h"

namespace degas::test {

/// SMPL-X's arrays for a made-up body of 9 vertices (a bumpy 3 x 3 grid, 8 triangles whose texture fills 0.1 .. 0.9),
/// 55 joints in SMPL-X's tree, 10 shape and 3 expression columns (one column of each all zero), random pose blend
/// shapes, regressor and weights (about five joints a vertex). float32 except weights and template; the root's parent
/// is 2^32-1.
std::map<std::string, NpyArray> tiny_body_arrays();
/// The same, written to a file.
void write_tiny_body(const std::filesystem::path& path);

}  // namespace degas::test
