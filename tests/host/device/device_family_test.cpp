#include "host/device/device_family.h"

#include "host/device/device.h"
#include "tests/support/catch.h"

using namespace degas;

namespace {

DeviceDescription gpu(const char* vendor, const char* name, bool local_memory_is_own, size_t largest_work_group) {
  DeviceDescription d;
  d.vendor = vendor;
  d.name = name;
  d.local_memory_is_own = local_memory_is_own;
  d.largest_work_group = largest_work_group;
  return d;
}

}  // namespace

TEST_CASE("devices are told apart by what drivers report") {
  // As drivers name them: proprietary ones, ROCm, Mesa's rusticl, and one that nobody knows.
  CHECK(family_of(gpu("NVIDIA Corporation", "NVIDIA H100 80GB HBM3", true, 1024)) == DeviceFamily::Nvidia);
  CHECK(family_of(gpu("Advanced Micro Devices, Inc.", "gfx1100", true, 256)) == DeviceFamily::Amd);
  CHECK(family_of(gpu("AMD", "AMD Radeon RX 6800 (radeonsi, navi21)", true, 1024)) == DeviceFamily::Amd);
  CHECK(family_of(gpu("Intel(R) Corporation", "Intel(R) Arc(TM) A770 Graphics", true, 1024)) == DeviceFamily::Intel);
  CHECK(family_of(gpu("ARM", "Mali-G78", false, 512)) == DeviceFamily::Mobile);
  CHECK(family_of(gpu("QUALCOMM", "QUALCOMM Adreno(TM) 740", true, 1024)) == DeviceFamily::Mobile);
  CHECK(family_of(gpu("Somebody", "Some GPU", false, 1024)) == DeviceFamily::Mobile);
  CHECK(family_of(gpu("Somebody", "Some GPU", true, 256)) == DeviceFamily::Mobile);
  CHECK(family_of(gpu("Somebody", "Some GPU", true, 1024)) == DeviceFamily::OtherGpu);
  DeviceDescription cpu = gpu("GenuineIntel", "pthread-skylake-avx512", false, 4096);
  cpu.is_cpu = true;
  cpu.vector_width = 16;
  CHECK(family_of(cpu) == DeviceFamily::WideCpu);
  cpu.vector_width = 8;
  CHECK(family_of(cpu) == DeviceFamily::NarrowCpu);
}

TEST_CASE("a device starts from its own family, from one that its kernel set suits, or from what is asked for") {
  DeviceOptions options;
  const DeviceFamily own = family_of(find_devices().front().description);
  CHECK(Device(options).family() == own);
  options.kernel_set = find_devices().front().description.is_cpu ? KernelSet::Gpu : KernelSet::Wide;
  CHECK(Device(options).family() == (find_devices().front().description.is_cpu ? DeviceFamily::OtherGpu : DeviceFamily::WideCpu));
  options.family = DeviceFamily::Mobile;
  CHECK(Device(options).family() == DeviceFamily::Mobile);
}
