#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "model/inspect/inspection.h"

namespace degas {

/// What inspect.json holds: what was found of the capture and each camera, mask_iou_mean, mask_iou_min and
/// reprojection_rms_px (null where unknown), suspected (names), trials, notes and warnings (words).
nlohmann::json inspection_json(const Inspection& inspection);

/// The same with its pictures as one HTML page that needs no other file.
std::string inspection_page(const Inspection& inspection, const std::string& title);

/// The lines that the command prints.
std::string inspection_text(const Inspection& inspection);

}  // namespace degas
