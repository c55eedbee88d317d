#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "model/cli/commands.h"
#include "model/cli/study_options.h"
#include "model/study/ablation.h"
#include "model/study/json_file.h"
#include "model/study/studies.h"

namespace degas {
namespace {

/// Throws Error when the table that lies in the output folder is another study's or has rows that this one lacks.
void require_nothing_lost(const StudySetup& setup, const std::string& study, const std::vector<Variant>& variants) {
  const nlohmann::json before = read_json_if_any(setup.output / "ablation.json");
  if (before.is_null()) return;
  if (before.at("study") != study) {
    throw Error::format("--out {}: holds the study {}, whose table would be lost; name another folder",
                        setup.output.string(), before.at("study").dump());
  }
  for (const nlohmann::json& row : before.at("variants")) {
    const std::string name = row.at("name");
    if (std::none_of(variants.begin(), variants.end(), [&](const Variant& variant) { return variant.name == name; }))
      throw Error::format(
          "--out {}: its table has '{}', which would be lost; leave --only away, or name another folder",
          setup.output.string(), name);
  }
}

struct AblateOptions {
  StudyChoice choice;
  std::string study;
  std::vector<std::string> only;
};

void ablate(const AblateOptions& options) {
  Variant base = options.choice.base();
  const StudySetup setup = options.choice.setup(base);
  base.config.data.hold_out = setup.hold_out;
  const auto capture = open_capture(setup.data, setup.capture);
  std::vector<Variant> variants = study_variants(options.study, base, *capture);
  if (!options.only.empty()) variants = named_variants(variants, options.only);
  reading_own_json(setup.output, [&] { require_nothing_lost(setup, options.study, variants); });
  std::string table;
  const auto write = [&](const StudyResult& result) {
    const nlohmann::json ablation = ablation_json(options.study, setup, variants, result);
    table = ablation_markdown(ablation);
    write_json(setup.output / "ablation.json", ablation);
    write_text(setup.output / "ablation.md", table);
  };
  const auto print = [&] {
    if (!table.empty()) fmt::print("\n{}\nwrote {}\n", table, (setup.output / "ablation.{json,md}").string());
  };
  try {
    run_and_tell(setup, variants, write);
  } catch (...) {
    print();
    throw;
  }
  print();
}

}  // namespace

void add_ablate_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "ablate",
      "Make one of the paper's studies: train each variant with the same budget, measure all on the held-out cameras\n"
      "and novel sequences, and print the paper's table with ours beside it. Writes ablation.json and ablation.md;\n"
      "stopped or killed, the same command goes on");
  auto options = std::make_shared<AblateOptions>();
  command
      ->add_option("--study", options->study,
                   "encoders: each off; views: 3, 6, 12 and all cameras; face: what tells the expression;\n"
                   "losses: each term off; size: width and resolution halved and doubled;\n"
                   "stability: a ramp of the learning rate, bad registration, wrong masks, missing face codes")
      ->required()
      ->check(CLI::IsMember(study_names()));
  command->add_option("--only", options->only,
                      "Only this variant of the study, by its name in the table, and the one that it is compared\n"
                      "with; may be repeated");
  add_study_options(*command, options->choice);
  command->get_option("--out")->required();
  command->callback([options] { ablate(*options); });
}

}  // namespace degas
