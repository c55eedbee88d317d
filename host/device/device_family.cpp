#include "host/device/device_family.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>

#include "host/device/device_list.h"

namespace degas {

DeviceFamily family_of(const DeviceDescription& description) {
  if (description.is_cpu) return description.vector_width >= 16 ? DeviceFamily::WideCpu : DeviceFamily::NarrowCpu;
  // The name too: Mesa's drivers name themselves as the vendor.
  std::string maker = description.vendor + " " + description.name;
  std::transform(maker.begin(), maker.end(), maker.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto made_by = [&](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(), [&](const char* name) { return maker.find(name) != maker.npos; });
  };
  if (made_by({"nvidia"})) return DeviceFamily::Nvidia;
  if (made_by({"qualcomm", "adreno", "mali", "imagination", "powervr"})) return DeviceFamily::Mobile;
  if (made_by({"advanced micro devices", "amd", "radeon"})) return DeviceFamily::Amd;
  if (made_by({"intel"})) return DeviceFamily::Intel;
  constexpr size_t smallest_of_desktops = 512;
  const bool small = !description.local_memory_is_own || description.largest_work_group < smallest_of_desktops;
  return small ? DeviceFamily::Mobile : DeviceFamily::OtherGpu;
}

std::string to_string(DeviceFamily family) {
  switch (family) {
    case DeviceFamily::WideCpu:
      return "wide CPU";
    case DeviceFamily::NarrowCpu:
      return "narrow CPU";
    case DeviceFamily::Nvidia:
      return "NVIDIA";
    case DeviceFamily::Amd:
      return "AMD";
    case DeviceFamily::Intel:
      return "Intel";
    case DeviceFamily::Mobile:
      return "mobile GPU";
    case DeviceFamily::OtherGpu:
      return "other GPU";
  }
  return "";
}

}  // namespace degas
