#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace degas {

/// Float images of one size by channel name, rows from the top.
struct ExrImage {
  int width = 0, height = 0;
  std::map<std::string, std::vector<float>> channels;  ///< each width * height values
};

/// Multi-channel OpenEXR, 32-bit float, ZIP compressed (without loss), written under a temporary name, then renamed.
/// Names such as "position.x" group channels in viewers. Error naming the file.
void write_exr(const std::filesystem::path& path, const ExrImage& image);
/// Reads every channel of a flat, single-part file in lines (no tiles) as float. Error naming the file and the reason.
ExrImage read_exr(const std::filesystem::path& path);

}  // namespace degas
