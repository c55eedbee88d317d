#include "model/study/published.h"

namespace degas {

const std::vector<PublishedRow>& published_rows() {
  static const std::string card = "one RTX 3090", actor = "ActorsHQ Actor01", dreams = "DREAMS-Avatar";
  static const std::vector<PublishedRow> rows = {
      {"encoders", "all", {{"psnr", 30.67}}, 0, dreams, card},
      {"encoders", "no pose embedding", {{"psnr", 30.01}}, 0, dreams, card},
      {"encoders", "no PVM", {{"psnr", 30.42}}, 0, dreams, card},
      {"encoders", "no PVE", {{"psnr", 29.43}}, 0, dreams, card},
      {"views", "3", {{"psnr", 29.66}}, 0, dreams, card},
      {"views", "6", {{"psnr", 30.98}}, 0, dreams, card},
      {"views", "12", {{"psnr", 30.95}}, 0, dreams, card},
      {"views", "31 (all)", {{"psnr", 32.63}}, 0, dreams, card},
      {"face", "DPE", {{"psnr", 26.21}, {"aed", 0.0853}, {"cross_aed", 0.2413}}, 0, dreams, card},
      {"face", "DECA", {{"psnr", 26.19}, {"aed", 0.1105}, {"cross_aed", 0.2638}}, 0, dreams, card},
      {"face", "DAD-3DHeads", {{"psnr", 26.23}, {"aed", 0.0998}, {"cross_aed", 0.3697}}, 0, dreams, card},
      {"methods",
       "GaussianAvatar",
       {{"psnr", 26.95}, {"ssim", 0.9389}, {"lpips", 0.0407}, {"fid", 38.5}},
       0,
       actor,
       card},
      {"methods", "3DGS-Avatar", {{"psnr", 28.78}, {"ssim", 0.9511}, {"lpips", 0.0418}, {"fid", 49.4}}, 0, actor, card},
      {"methods",
       "AnimatableGaussians",
       {{"psnr", 30.36}, {"ssim", 0.9682}, {"lpips", 0.0339}, {"fid", 33.5}},
       10,
       actor,
       card},
      {"methods",
       "DEGAS (paper)",
       {{"psnr", 31.13}, {"ssim", 0.9708}, {"lpips", 0.0318}, {"fid", 24.5}},
       30,
       actor,
       card},
      {"methods",
       "GaussianAvatar",
       {{"psnr", 20.93}, {"ssim", 0.9582}, {"lpips", 0.1056}, {"fid", 81.1}},
       0,
       dreams,
       card},
      {"methods", "PoseVocab", {{"psnr", 28.40}, {"ssim", 0.9740}, {"lpips", 0.0503}, {"fid", 147}}, 0, dreams, card},
      {"methods",
       "AnimatableGaussians",
       {{"psnr", 32.15}, {"ssim", 0.9814}, {"lpips", 0.0167}, {"fid", 13.1}, {"aed", 0.2657}},
       10,
       dreams,
       card},
      {"methods",
       "DEGAS (paper)",
       {{"psnr", 33.96}, {"ssim", 0.9853}, {"lpips", 0.0152}, {"fid", 13.9}, {"aed", 0.0598}},
       30,
       dreams,
       card},
  };
  return rows;
}

const PublishedRow* find_published(const std::string& table, const std::string& label) {
  for (const PublishedRow& row : published_rows()) {
    if (row.table == table && row.label == label) return &row;
  }
  return nullptr;
}

}  // namespace degas
