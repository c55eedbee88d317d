#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>

#include "host/error.h"
#include "model/cli/commands.h"

int main(int count, char** arguments) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond the user's limit is an error of its writer, not the end
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // or FFmpeg's own complaints stand before our one line
  CLI::App app(
      "degas: trains, evaluates and renders drivable full-body avatars on any OpenCL device.\n"
      "Start with `degas synth`, or point `degas train` at a capture; `degas COMMAND --help` explains each.");
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  degas::add_devices_command(app);
  degas::add_synth_command(app);
  degas::add_body_command(app);
  degas::add_inspect_command(app);
  degas::add_pack_command(app);
  degas::add_train_command(app);
  degas::add_encode_faces_command(app);
  degas::add_eval_command(app);
  degas::add_fit_poses_command(app);
  degas::add_render_command(app);
  degas::add_export_command(app);
  degas::add_ablate_command(app);
  degas::add_pareto_command(app);
  degas::add_report_command(app);
  try {
    app.parse(count, arguments);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;  // --help is no fault
  } catch (const degas::Error& error) {
    std::fprintf(stderr, "degas: %s\n", error.what());
    return 2;
  } catch (const std::filesystem::filesystem_error& error) {
    std::fprintf(stderr, "degas: %s: %s; check the path and its permissions\n", error.path1().c_str(),
                 error.code().message().c_str());
    return 2;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr,
                 "degas: out of memory; lower net.resolution, net.width, train.views_per_step or image_scale\n");
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "degas: internal error: %s\n", error.what());
    return 1;
  }
  return 0;
}
