#include <cstdio>

#include "host/device/device_family.h"
#include "host/device/device_list.h"
#include "host/error.h"
#include "model/cli/commands.h"

namespace degas {

void add_devices_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("devices", "List the OpenCL devices that --device takes");
  command->callback([] {
    const std::vector<FoundDevice> devices = find_devices();
    if (devices.empty()) {
      throw Error("no OpenCL device on this machine; install a driver, or PoCL for the CPU (Debian: pocl-opencl-icd)");
    }
    for (const auto& [id, d] : devices) {
      fmt::print(
          "[{}] {}\n    {}, {}, driver {}\n    {} compute units, {:.1f} GiB, largest buffer {:.1f} GiB, kernels for: "
          "{}\n",
          d.index, d.name, d.platform, d.version, d.driver, d.compute_units,
          static_cast<double>(d.global_bytes) / (1 << 30), static_cast<double>(d.largest_buffer_bytes) / (1 << 30),
          to_string(family_of(d)));
    }
  });
}

}  // namespace degas
