#pragma once

#include <map>
#include <string>
#include <vector>

namespace degas {

/// A row of a published table: another capture and other hardware than any run of ours.
struct PublishedRow {
  std::string table, label;               ///< which study of the paper, and its name there
  std::map<std::string, double> figures;  ///< by measure: psnr, ssim, lpips, fid, aed
  double frames_per_second = 0;           ///< 0: not published
  std::string data, hardware;
};

/// Of arXiv 2408.10588: its ablations (tables "encoders", "views", "face") and its comparisons ("methods").
const std::vector<PublishedRow>& published_rows();
/// Null where there is none.
const PublishedRow* find_published(const std::string& table, const std::string& label);

}  // namespace degas
