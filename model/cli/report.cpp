#include "model/train/report.h"

#include <cstdio>
#include <memory>

#include "host/error.h"
#include "model/cli/commands.h"

namespace degas {

void add_report_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("report", "Write a self-contained HTML page of a run and its evaluations");
  struct Options {
    ReportInputs inputs;
    std::filesystem::path output;
  };
  auto options = std::make_shared<Options>();
  command->add_option("--run", options->inputs.run, "Run folder of `degas train`")->required();
  command->add_option("--evaluation", options->inputs.evaluations,
                      "Folder of `degas eval`; may be given several times");
  command->add_option("--title", options->inputs.title, "Heading of the page")->capture_default_str();
  command->add_option("--pictures", options->inputs.pictures, "Sheets shown of each evaluation")->capture_default_str();
  command->add_option("--out", options->output, "HTML file to write")->required();
  command->callback([options] {
    write_report(options->output, options->inputs);
    fmt::print("wrote {}\n", options->output.string());
  });
}

}  // namespace degas
