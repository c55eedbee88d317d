#pragma once

#include <string>

namespace degas {

struct DeviceDescription;

/// Devices that want the same kernel parameters before any tuning.
enum class DeviceFamily {
  WideCpu,    ///< CPUs whose vectors hold 16 floats, with 32 registers of them (AVX-512)
  NarrowCpu,  ///< CPUs of 8 floats or fewer, 16 registers (AVX2) or as much in smaller pieces (NEON)
  Nvidia,     ///< GPUs of scalar items, warps of 32
  Amd,        ///< wavefronts of 64 or 32
  Intel,      ///< 8 to 32 items a thread, 4 KiB of registers for all of them
  Mobile,     ///< Mali, Adreno and their like: small work-groups, few registers, local memory no faster than global
  OtherGpu,
};

/// Told from what the device reports: type, vector width, vendor, kind of local memory, largest work-group.
DeviceFamily family_of(const DeviceDescription& description);
std::string to_string(DeviceFamily family);

}  // namespace degas
