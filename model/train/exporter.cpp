#include "model/train/exporter.h"

#include <algorithm>
#include <cmath>

#include "host/io/exr.h"
#include "host/io/ply.h"
#include "model/gaussians/world_harmonics.h"

namespace degas {
namespace {

constexpr float harmonic = 0.28209479177387814f;  // of degree 0: 3DGS stores colour as (colour - 0.5) / harmonic

PlySplats ply_splats(Tape& tape, const Splats& splats) {
  PlySplats ply{splats.positions.to_host<float>(),
                splats.colors.to_host<float>(),
                splats.harmonics.defined() ? world_harmonics(tape, splats) : std::vector<float>(),
                splats.opacities.to_host<float>(),
                splats.log_scales.to_host<float>(),
                splats.rotations.to_host<float>()};
  for (float& color : ply.color_dc) color = (color - 0.5f) / harmonic;
  for (float& opacity : ply.opacity_logits) {
    const float inside = std::clamp(opacity, 1e-6f, 1 - 1e-6f);  // the logit of 0 and 1 is infinite
    opacity = std::log(inside / (1 - inside));
  }
  return ply;
}

void add_channels(ExrImage& image, const std::vector<int32_t>& texels, const std::vector<float>& rows,
                  const std::vector<std::string>& names) {
  for (size_t c = 0; c < names.size(); ++c) {
    std::vector<float>& channel = image.channels[names[c]];
    channel.assign(static_cast<size_t>(image.width) * image.height, 0.0f);
    for (size_t i = 0; i < texels.size(); ++i) channel[texels[i]] = rows[i * names.size() + c];
  }
}

ExrImage gaussian_maps(const CanonicalGaussians& gaussians, const Avatar& avatar) {
  const int side = avatar.atlas().resolution();
  ExrImage image{side, side, {}};
  const std::vector<int32_t> texels = avatar.base().texels.to_host<int32_t>();
  add_channels(image, texels, gaussians.positions.to_host<float>(), {"position.x", "position.y", "position.z"});
  add_channels(image, texels, gaussians.rotations.to_host<float>(),
               {"rotation.w", "rotation.x", "rotation.y", "rotation.z"});
  add_channels(image, texels, gaussians.log_scales.to_host<float>(), {"log_scale.x", "log_scale.y", "log_scale.z"});
  add_channels(image, texels, gaussians.opacities.to_host<float>(), {"opacity"});
  add_channels(image, texels, gaussians.colors.to_host<float>(), {"color.r", "color.g", "color.b"});
  if (gaussians.harmonics.defined()) {
    std::vector<std::string> names;
    for (int64_t j = 0; j < gaussians.harmonics.dim(1); ++j) {
      for (const char* color : {"r", "g", "b"}) names.push_back(fmt::format("harmonics.{:02}.{}", j, color));
    }
    add_channels(image, texels, gaussians.harmonics.to_host<float>(), names);
  }
  add_channels(image, texels, std::vector<float>(texels.size(), 1.0f), {"covered"});
  return image;
}

}  // namespace

void export_frame(Device& device, TrainedAvatar& avatar, const Capture& capture, int frame,
                  const std::filesystem::path& ply) {
  Tape tape(device, false);
  FaceCodes codes = avatar.face_codes(capture);
  const Avatar::Signal signal = avatar.avatar().upload(avatar.avatar().signal(capture, frame, codes.mean(frame)));
  const CanonicalGaussians gaussians = avatar.avatar().decode(tape, signal).gaussians;
  if (ply.has_parent_path()) std::filesystem::create_directories(ply.parent_path());
  write_ply(ply, ply_splats(tape, avatar.pose(tape, gaussians, signal, capture, frame)));
  std::filesystem::path maps = ply;
  write_exr(maps.replace_extension(".exr"), gaussian_maps(gaussians, avatar.avatar()));
}

}  // namespace degas
