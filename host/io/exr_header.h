#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace degas {

/// Looks an OpenEXR file's header through before the library does, which allocates whatever an attribute, the data
/// window or a tile claims. Error beginning with `label` for attributes that do not fit the file, for more pixels than
/// its bytes can hold, and for what is not read: tiles, deep pixels, several parts, lossy DWA, previews and lists.
void check_exr_header(std::span<const std::byte> file, const std::string& label);

}  // namespace degas
