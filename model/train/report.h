#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace degas {

struct ReportInputs {
  std::filesystem::path run;                       ///< run folder: history.jsonl, config.json
  std::vector<std::filesystem::path> evaluations;  ///< `degas eval` folders: metrics.json, sheets/*.png
  std::string title = "degas: training report";
  int pictures = 4;  ///< side-by-side sheets shown of each evaluation
};

/// Writes one HTML file that needs no other: curves of loss and PSNR as SVG, the metrics of each evaluation in a table,
/// and its sheets (truth, render, error) and worst pictures embedded. Throws Error naming a missing or broken file.
void write_report(const std::filesystem::path& output, const ReportInputs& inputs);

}  // namespace degas
