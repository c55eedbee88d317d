#include "model/study/studies.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "host/error.h"
#include "model/data/corrupted_capture.h"
#include "model/net/map_network.h"
#include "model/train/training_views.h"

namespace degas {
namespace {

Variant with_paper(Variant variant, const std::vector<std::string>& labels) {
  variant.paper_labels = labels;
  return variant;
}

std::vector<Variant> encoder_study(const Variant& base) {
  const NetConfig& net = base.config.net;
  std::vector<Variant> all = {with_paper(varied(base, "all", {}), {"all"})};
  const auto add_off = [&](bool is_on, const std::string& name, const std::string& key,
                           const std::vector<std::string>& labels) {
    if (is_on) all.push_back(with_paper(varied(base, name, {key + "=false"}), labels));
  };
  add_off(net.use_pose_embedding, "no pose embedding", "net.use_pose_embedding", {"no pose embedding"});
  add_off(net.use_pvm, "no PVM", "net.use_pvm", {"no PVM"});
  add_off(net.use_pve, "no PVE", "net.use_pve", {"no PVE"});
  add_off(net.use_world_normals, "no world normals", "net.use_world_normals", {});
  return all;
}

std::vector<Variant> view_study(const Variant& base, const Capture& capture) {
  const std::vector<int> cameras = allowed_cameras(capture, base.config.data);
  const int most = static_cast<int>(cameras.size());
  std::vector<Variant> all = {with_paper(varied(base, fmt::format("{} (all)", most), {}), {"31 (all)"})};
  for (const int count : {12, 6, 3}) {
    if (count >= most) continue;
    std::vector<std::string> names;
    for (const int camera : spread_cameras(cameras, capture, count))
      names.push_back(capture.camera_names()[static_cast<size_t>(camera)]);
    all.push_back(
        with_paper(varied(base, std::to_string(count), {fmt::format("data.cameras={}", fmt::join(names, ","))}),
                   {std::to_string(count)}));
  }
  return all;
}

std::vector<Variant> face_study(const Variant& base) {
  struct Signal {
    FaceSignal signal;
    const char* name;
    std::vector<std::string> labels;
  };
  const std::vector<Signal> signals = {{FaceSignal::Code, "code", {"DPE"}},
                                       {FaceSignal::Expression, "expression", {"DECA", "DAD-3DHeads"}},
                                       {FaceSignal::Mesh, "mesh", {}},
                                       {FaceSignal::None, "none", {}}};
  std::vector<Variant> all;
  for (const Signal& signal : signals) {
    const bool is_base = signal.signal == base.config.face.signal;
    Variant variant = varied(base, signal.name, {fmt::format("face.signal={}", signal.name)});
    all.insert(is_base ? all.begin() : all.end(), with_paper(std::move(variant), signal.labels));
  }
  return all;
}

std::vector<Variant> loss_study(const Variant& base) {
  const LossConfig& loss = base.config.loss;
  std::vector<Variant> all = {varied(base, "all terms", {})};
  const auto add_off = [&](double weight, const std::string& name, const std::string& key) {
    if (weight > 0) all.push_back(varied(base, name, {"loss." + key + "=0"}));
  };
  add_off(loss.ssim_weight, "no SSIM", "ssim_weight");
  add_off(loss.lpips_weight, "no LPIPS", "lpips_weight");
  add_off(loss.offset_weight, "no offset term", "offset_weight");
  add_off(loss.drift_weight, "no drift term", "drift_weight");
  add_off(loss.scale_weight, "no scale term", "scale_weight");
  add_off(loss.collapse_weight, "no collapse term", "collapse_weight");
  if (loss.lpips_weight == 0) all.push_back(varied(base, "with LPIPS", {"loss.lpips_weight=0.1"}));
  return all;
}

std::vector<Variant> size_study(const Variant& base) {
  const NetConfig& net = base.config.net;
  const auto name = [](int resolution, double width) {
    return fmt::format("{} texels, width {:g}", resolution, width);
  };
  std::vector<Variant> all = {varied(base, name(net.resolution, net.width), {})};
  for (const double factor : {0.5, 2.0}) {
    const int resolution = static_cast<int>(net.resolution * factor);
    if (resolution >= 128 && resolution <= 4096)
      all.push_back(varied(base, name(resolution, net.width), {fmt::format("net.resolution={}", resolution)}));
    all.push_back(
        varied(base, name(net.resolution, net.width * factor), {fmt::format("net.width={:g}", net.width * factor)}));
  }
  return all;
}

std::vector<Variant> stability_study(const Variant& base) {
  std::vector<Variant> all = {
      varied(base, corrupts(base.config.data.corruption) ? "as configured" : "as recorded", {})};
  const auto add = [&](const std::string& name, const std::vector<std::string>& overrides) {
    all.push_back(varied(base, name, overrides));
  };
  if (base.config.train.warm_up_steps > 0) {
    add("no ramp of the learning rate", {"train.warm_up_steps=0"});
  } else {
    add("learning rate ramped up over 100 steps", {"train.warm_up_steps=100"});
  }
  add("registration off by up to 3 degrees and 1 cm",
      {"data.corruption.registration_degrees=3", "data.corruption.registration_metres=0.01"});
  add("20 % of masks wrong", {"data.corruption.wrong_masks=0.2"});
  if (base.config.face.signal == FaceSignal::Code && reads_face_code(base.config.net))
    add("30 % of frames without face codes", {"data.corruption.missing_codes=0.3"});
  return all;
}

}  // namespace

std::vector<std::string> study_names() {
  return {"encoders", "views", "face", "losses", "size", "stability"};
}

std::vector<int> spread_cameras(const std::vector<int>& cameras, const Capture& capture, int count) {
  if (count >= static_cast<int>(cameras.size())) return cameras;
  const size_t total = cameras.size(), wanted = static_cast<size_t>(count);
  const Eigen::Vector3d person = capture.pose(0).translation;
  std::vector<Eigen::Vector3d> directions;
  for (const int camera : cameras) directions.push_back((capture.camera(camera).center() - person).normalized());
  const auto repulsion = [&](size_t a, size_t b) {
    return 1 / std::max((directions[a] - directions[b]).squaredNorm(), 1e-12);
  };
  std::vector<size_t> chosen;
  for (size_t i = 0; i < wanted; ++i) chosen.push_back(i * total / wanted);
  // Each exchange lowers the energy, of which there are finitely many: this ends.
  for (bool exchanged = true; exchanged;) {
    exchanged = false;
    for (size_t& place : chosen) {
      const auto energy_at = [&](size_t candidate) {
        double energy = 0;
        for (const size_t& other : chosen) energy += &other == &place ? 0 : repulsion(candidate, other);
        return energy;
      };
      for (size_t candidate = 0; candidate < total; ++candidate) {
        if (std::find(chosen.begin(), chosen.end(), candidate) != chosen.end()) continue;
        if (energy_at(candidate) >= energy_at(place) * (1 - 1e-9)) continue;
        place = candidate;
        exchanged = true;
      }
    }
  }
  std::sort(chosen.begin(), chosen.end());
  std::vector<int> result;
  for (const size_t i : chosen) result.push_back(cameras[i]);
  return result;
}

std::vector<Variant> study_variants(const std::string& study, const Variant& base, const Capture& capture) {
  std::vector<Variant> all = study == "encoders"    ? encoder_study(base)
                             : study == "views"     ? view_study(base, capture)
                             : study == "face"      ? face_study(base)
                             : study == "losses"    ? loss_study(base)
                             : study == "size"      ? size_study(base)
                             : study == "stability" ? stability_study(base)
                                                    : std::vector<Variant>();
  if (all.empty())
    throw Error::format("--study {}: no such study; there are {}", study, fmt::join(study_names(), ", "));
  if (all.size() < 2) throw Error::format("--study {}: the config leaves nothing to compare", study);
  return all;
}

std::vector<Variant> named_variants(const std::vector<Variant>& variants, const std::vector<std::string>& names) {
  std::vector<std::string> there;
  for (const Variant& variant : variants) there.push_back(variant.name);
  for (const std::string& name : names) {
    if (std::find(there.begin(), there.end(), name) == there.end())
      throw Error::format("--only '{}': no such variant; there are '{}'", name, fmt::join(there, "', '"));
  }
  std::vector<Variant> chosen;
  for (const Variant& variant : variants) {
    if (chosen.empty() || std::find(names.begin(), names.end(), variant.name) != names.end()) chosen.push_back(variant);
  }
  return chosen;
}

}  // namespace degas
