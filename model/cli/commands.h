#pragma once

#include <CLI/CLI.hpp>

namespace degas {

/// Each adds its subcommand with its help text; the subcommand runs when the line is parsed. One file per command.
void add_devices_command(CLI::App& app);
void add_synth_command(CLI::App& app);
void add_body_command(CLI::App& app);
void add_inspect_command(CLI::App& app);
void add_pack_command(CLI::App& app);
void add_train_command(CLI::App& app);
void add_encode_faces_command(CLI::App& app);
void add_eval_command(CLI::App& app);
void add_fit_poses_command(CLI::App& app);
void add_render_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_ablate_command(CLI::App& app);
void add_pareto_command(CLI::App& app);
void add_report_command(CLI::App& app);

}  // namespace degas
