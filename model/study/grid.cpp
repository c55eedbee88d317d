#include "model/study/grid.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "host/error.h"
#include "host/io/json_node.h"

namespace degas {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// "net.use_pve" -> "use pve"
std::string short_name(const std::string& key) {
  std::string name = key.substr(key.rfind('.') + 1);
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

/// A value as --set takes it.
std::string value_text(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// What a study itself sets, the same for every variant.
void require_free(const std::string& key, const fs::path& file) {
  const std::map<std::string, std::string> options = {
      {"train.iterations", "--iterations or --minutes"}, {"train.seed", "--seeds"}, {"data.hold_out", "--hold-out"}};
  if (const auto taken = options.find(key); taken != options.end()) {
    throw Error::format("{}: '{}' is the same for every variant of a study; give it by {}", file.string(), key,
                        taken->second);
  }
}

void add(std::vector<Variant>& all, Variant variant) {
  const bool is_new = std::none_of(all.begin(), all.end(), [&](const Variant& other) {
    return config_differences(other.config, variant.config).empty();
  });
  if (is_new) all.push_back(std::move(variant));
}

void add_sweep(std::vector<Variant>& all, const Variant& base, const Json& sweep, const fs::path& file) {
  if (!sweep.is_object())
    throw Error::format("{}: 'sweep' must hold keys with lists of values, not {}", file.string(), sweep.dump());
  for (const auto& [key, values] : sweep.items()) {
    if (!values.is_array() || values.empty()) {
      throw Error::format("{}: sweep: '{}' must be a list of values, e.g. [128, 512], not {}", file.string(), key,
                          values.dump());
    }
    require_free(key, file);
    for (const Json& value : values) {
      const std::string text = value_text(value);
      add(all, varied(base, short_name(key) + ' ' + text, {key + '=' + text}));
    }
  }
}

void add_points(std::vector<Variant>& all, const Variant& base, const Json& points, const fs::path& file) {
  if (!points.is_array()) throw Error::format("{}: 'points' must be a list, not {}", file.string(), points.dump());
  for (size_t i = 0; i < points.size(); ++i) {
    const Json& point = points[i];
    const auto refuse = [&](const std::string& why) {
      return Error::format("{}: points[{}]: {}", file.string(), i, why);
    };
    if (!point.is_object() || !point.contains("set") || !point["set"].is_object() || point["set"].empty())
      throw refuse("needs 'set', e.g. {\"name\": \"fast\", \"set\": {\"net.width\": 0.25}}");
    for (const auto& [key, value] : point.items()) {
      if (key != "set" && key != "name") throw refuse("unknown key '" + key + "'; there are 'name' and 'set'");
    }
    std::vector<std::string> overrides, parts;
    for (const auto& [key, value] : point["set"].items()) {
      require_free(key, file);
      overrides.push_back(key + '=' + value_text(value));
      parts.push_back(short_name(key) + ' ' + value_text(value));
    }
    if (point.contains("name") && !point["name"].is_string()) throw refuse("'name' must be a text");
    add(all, varied(base, point.value("name", fmt::format("{}", fmt::join(parts, ", "))), overrides));
  }
}

}  // namespace

std::vector<Variant> grid_variants(const Variant& base, const fs::path& file) {
  const Json grid = read_json(file);
  if (!grid.is_object() || (!grid.contains("sweep") && !grid.contains("points")))
    throw Error::format("{}: a grid must hold 'sweep' or 'points'; see `degas pareto --help`", file.string());
  for (const auto& [key, value] : grid.items()) {
    if (key != "sweep" && key != "points")
      throw Error::format("{}: unknown key '{}'; there are 'sweep' and 'points'", file.string(), key);
  }
  std::vector<Variant> all = {base};
  try {
    if (grid.contains("sweep")) add_sweep(all, base, grid["sweep"], file);
    if (grid.contains("points")) add_points(all, base, grid["points"], file);
    require_distinct(all);
  } catch (const Error& error) {
    const std::string message = error.what();
    throw Error(message.rfind(file.string(), 0) == 0 ? message : file.string() + ": " + message);
  }
  return all;
}

std::vector<Variant> default_grid(const Variant& base) {
  const NetConfig& net = base.config.net;
  const int resolution = net.resolution, views = base.config.train.views_per_step;
  const std::string halved = fmt::format("net.resolution={}", std::max(128, resolution / 2)),
                    doubled = fmt::format("net.resolution={}", std::min(4096, resolution * 2)),
                    narrow = fmt::format("net.width={:g}", net.width / 2),
                    wide = fmt::format("net.width={:g}", net.width * 2);
  std::vector<Variant> all = {base};
  add(all, varied(base, "fewer texels", {halved}));
  add(all, varied(base, "more texels", {doubled}));
  add(all, varied(base, "narrow", {narrow}));
  add(all, varied(base, "wide", {wide}));
  add(all, varied(base, "fewer texels, narrow", {halved, narrow}));
  add(all, varied(base, "fewer texels, wide", {halved, wide}));
  add(all, varied(base, "more texels, narrow", {doubled, narrow}));
  add(all, varied(base, "biases untied to R/2", {fmt::format("net.untied_bias_max_resolution={}", resolution / 2)}));
  add(all, varied(base, "biases tied", {"net.untied_bias=false"}));
  add(all, varied(base, "no PVE", {"net.use_pve=false"}));
  add(all, varied(base, "no PVE, no pose embedding", {"net.use_pve=false", "net.use_pose_embedding=false"}));
  add(all, varied(base, "half the image", {fmt::format("data.image_scale={:g}", base.config.data.image_scale / 2)}));
  add(all, varied(base, "1 view a step", {"train.views_per_step=1"}));
  add(all,
      varied(base, fmt::format("{} views a step", 2 * views), {fmt::format("train.views_per_step={}", 2 * views)}));
  add(all, varied(base, "antialiased", {fmt::format("render.antialias={}", !base.config.render.antialias)}));
  return all;
}

std::vector<Variant> baseline_variants(const fs::path& folder, const std::vector<std::string>& overrides) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Variant> all;
  for (const fs::path& file : files) {
    all.push_back(make_variant("baseline " + file.stem().string(), file, overrides));
    all.back().is_baseline = true;
  }
  return all;
}

}  // namespace degas
