#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "host/device/device_family.h"
#include "host/device/device_list.h"
#include "host/device/memory_pool.h"
#include "host/device/profiler.h"

namespace degas {

class Device;
class Tuner;

/// The two families of kernel parameters. Wide: explicit vectors of 16, a work-group's loop is one item's (CPUs).
/// Gpu: scalar or short vectors, cooperative work-groups with local memory. Both run on any device.
enum class KernelSet { Wide, Gpu };

/// What REAL is in the kernels. Double is for gradient checks on devices with fp64.
enum class Real { Float, Double };

struct DeviceOptions {
  std::string selector;                 ///< index of `degas devices`, or part of a device or platform name; empty: best
  std::optional<KernelSet> kernel_set;  ///< default: Gpu on GPUs with room for its work-groups, else Wide
  std::optional<DeviceFamily> family;   ///< whose parameters to start from; default: the device's own
  Real real = Real::Float;
  bool profile = false;                 ///< time every launch by events
  bool poison_memory = false;           ///< fill fresh memory with NaN bits: tests see reads of what nobody wrote
  size_t memory_limit = 0;              ///< bytes the pool may hold; 0: the driver decides
  bool flush_denormals = false;         ///< build kernels with -cl-denorms-are-zero, where the device knows it
  std::filesystem::path kernel_folder;  ///< read kernels from here instead of the embedded ones
};

/// A -D option of a kernel build.
struct Define {
  std::string name, value;
  Define(std::string name, std::string value) : name(std::move(name)), value(std::move(value)) {}
  Define(std::string name, const char* value) : name(std::move(name)), value(value) {}
  Define(std::string name, int64_t value) : name(std::move(name)), value(std::to_string(value)) {}
  Define(std::string name, int value) : name(std::move(name)), value(std::to_string(value)) {}
};
using Defines = std::vector<Define>;

/// Launch geometry: up to three sizes. A global size is rounded up to whole work-groups, so kernels guard their ids.
using Range = std::vector<size_t>;

/// A kernel argument of __local memory.
struct LocalMemory {
  size_t bytes;
};

/// A built kernel. Copyable handle; the Device owns the OpenCL object.
class Kernel {
 public:
  Kernel(Device& device, cl_kernel handle, const std::string* name) : device_(&device), handle_(handle), name_(name) {}

  /// Queues one run. Arguments in the kernel's order: Memory, and what has device_memory() (Tensor; null where it is
  /// undefined: an absent optional buffer) -> __global pointer; int -> int; int64_t -> long;
  /// uint32_t -> uint; double -> REAL; LocalMemory -> __local pointer; any other trivially copyable struct by value.
  /// local is always given: a size left to the driver may change from call to call, and PoCL compiles each anew.
  template <typename... Arguments>
  void launch(const Range& global, const Range& local, const Arguments&... arguments) const {
    unsigned index = 0;
    (set_argument(index++, arguments), ...);
    enqueue(global, local);
  }

 private:
  template <typename Holder>
    requires requires(const Holder& holder) { holder.device_memory(); }
  void set_argument(unsigned index, const Holder& holder) const {
    set_memory(index, holder.device_memory());
  }
  void set_argument(unsigned index, const Memory& memory) const { set_memory(index, &memory); }
  void set_argument(unsigned index, double real) const;
  void set_argument(unsigned index, LocalMemory memory) const { set_raw(index, memory.bytes, nullptr); }
  template <typename Value>
  void set_argument(unsigned index, const Value& value) const {
    static_assert(std::is_trivially_copyable_v<Value>);
    static_assert(!std::is_same_v<Value, float>, "pass REAL arguments as double");
    static_assert(!std::is_same_v<Value, bool>, "OpenCL has no bool arguments: pass int");
    set_raw(index, sizeof(Value), &value);
  }
  void set_memory(unsigned index, const Memory* memory) const;
  void set_raw(unsigned index, size_t bytes, const void* value) const;
  void enqueue(const Range& global, const Range& local) const;

  Device* device_;
  cl_kernel handle_;
  const std::string* name_;
};

/// One OpenCL device with its context, its one in-order queue, its built kernels and its memory. Not thread-safe:
/// one thread launches; loaders prepare host memory only.
class Device {
 public:
  /// Throws Error where select_device does, or when Real::Double is not supported.
  explicit Device(const DeviceOptions& options = {});
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const DeviceDescription& description() const { return description_; }
  KernelSet kernel_set() const { return kernel_set_; }
  bool is_wide() const { return kernel_set_ == KernelSet::Wide; }
  /// The device's own, unless its kernel set is not the one for such a device: then one that the set suits.
  DeviceFamily family() const { return family_; }
  /// 4 or 8: bytes of a REAL.
  size_t real_bytes() const { return options_.real == Real::Double ? 8 : 4; }
  /// Vector width V that pointwise kernels are built with: 16 (wide) or 1 (GPU).
  int vector_width() const { return is_wide() ? 16 : 1; }

  /// The kernel `name` of kernels/`file`.cl, built with REAL, V, WIDE (0 or 1) and the given defines; kept.
  Kernel kernel(const std::string& file, const std::string& name, const Defines& defines = {});
  /// What kernels/`file`.cl is built from.
  std::string kernel_text(const std::string& file) const;
  /// Chooses the parameters of kernels that have any to choose; null: they take their defaults.
  Tuner* tuner() const { return tuner_.get(); }
  void set_tuner(std::unique_ptr<Tuner> tuner);
  /// Work-group size for pointwise kernels whose item i owns the V elements from i * V.
  Range pointwise_local() const {
    return {is_wide() ? size_t{64} : family_ == DeviceFamily::Mobile ? size_t{128} : size_t{256}};
  }
  Range pointwise_global(int64_t elements) const {
    return {static_cast<size_t>((elements + vector_width() - 1) / vector_width())};
  }

  std::shared_ptr<Memory> allocate(size_t bytes);
  MemoryPool::Statistics memory_statistics() const { return pool_->statistics(); }

  /// At least so many bytes of zeros, for kernels to read and never to write; valid until a call asks for more.
  const Memory& zeros(size_t bytes);

  /// Copies host bytes into a private staging area and queues the transfer: returns at once.
  void upload(const Memory& target, const void* source, size_t bytes);
  /// Waits for all queued work, then copies.
  void download(const Memory& source, void* target, size_t bytes, size_t offset = 0);
  void copy(const Memory& source, const Memory& target, size_t bytes);
  /// Sets bytes to a repeated one-byte value.
  void fill(const Memory& target, unsigned char value, size_t bytes);
  void finish();

  /// Number of kernel launches so far.
  size_t launches() const { return launches_; }
  bool profiles() const { return options_.profile; }
  /// What the profile counts the commands from here on to.
  void set_stage(Stage stage) { stage_ = stage; }
  Stage stage() const { return stage_; }
  /// Waits, then gives the times of commands since the last call (DeviceOptions::profile).
  std::vector<Profiler::Row> take_profile();

 private:
  friend class Kernel;
  struct OpenCl;
  /// Queues what `enqueue(event)` queues, its event null unless it is to be profiled.
  template <typename Enqueue>
  void profiled(const char* name, const Enqueue& enqueue);
  DeviceOptions options_;
  DeviceDescription description_;
  KernelSet kernel_set_;
  DeviceFamily family_;
  std::unique_ptr<OpenCl> open_cl_;
  std::unique_ptr<MemoryPool> pool_;
  std::shared_ptr<Memory> zeros_;
  Profiler profiler_;
  std::unique_ptr<Tuner> tuner_;
  Stage stage_;
  size_t launches_ = 0;
};

}  // namespace degas
