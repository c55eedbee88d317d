#include <charconv>
#include <memory>

#include "host/error.h"
#include "model/body/body_model.h"
#include "model/body/makehuman_import.h"
#include "model/cli/commands.h"

namespace degas {
namespace {

struct BodyOptions {
  std::string from;
  MakeHumanSource source;
  std::vector<std::string> shapes;
  std::filesystem::path output;
};

/// "FILE" or "FILE=WEIGHT".
std::pair<std::filesystem::path, double> parse_shape(const std::string& text) {
  const size_t sign = text.rfind('=');
  if (sign == text.npos) return {text, 1};
  double weight = 0;
  const auto [end, failure] = std::from_chars(text.data() + sign + 1, text.data() + text.size(), weight);
  if (failure != std::errc() || end != text.data() + text.size()) {
    throw Error::format("--shape {}: '{}' is no weight; write FILE=0.5", text, text.substr(sign + 1));
  }
  return {text.substr(0, sign), weight};
}

void make_body(BodyOptions& options) {
  for (const std::string& shape : options.shapes) options.source.shapes.push_back(parse_shape(shape));
  const MakeHumanBody made = import_makehuman(options.source);
  write_body_npz(options.output, made.arrays);
  const BodyModel body = BodyModel::load(options.output);  // what is written must be readable
  double top = 0;
  for (const Eigen::Vector3d& vertex : made.arrays.vertices) top = std::max(top, vertex.y());
  fmt::print("wrote {}: {} vertices, {} triangles, {} joints, {:.2f} m tall, {} expressions\n", options.output.string(),
             body.vertex_count(), body.face_count(), body.joint_count(), top, made.expression_names.size());
  for (size_t i = 0; i < made.expression_names.size(); ++i) {
    fmt::print("expression {}: {}\n", i, made.expression_names[i]);
  }
}

}  // namespace

void add_body_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "body",
      "Make a body model in SMPL-X's npz layout of MakeHuman's files (CC0), with SMPL-X's joints and the head in the\n"
      "top-left quarter of its UV atlas. docs/bodies.md has an example");
  auto options = std::make_shared<BodyOptions>();
  command->add_option("--from", options->from, "What the files are: makehuman")
      ->required()
      ->check(CLI::IsMember({"makehuman"}));
  command->add_option("--base", options->source.base, "Base mesh, base.obj")->required();
  command->add_option("--rig", options->source.rig, "Skeleton, default.mhskel")->required();
  command->add_option("--weights", options->source.weights, "Skinning weights, default_weights.mhw")->required();
  command->add_option("--shape", options->shapes,
                      "Target that shapes the body, FILE or FILE=WEIGHT: sex, age, build; may be repeated");
  command->add_option("--targets", options->source.targets,
                      "Folder of targets that become expressions, in the order of their names");
  command->add_option("--out", options->output, "File to write, .npz")->required();
  command->callback([options] { make_body(*options); });
}

}  // namespace degas
