#include "host/device/program.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

#include "host/device/device_list.h"
#include "host/device/open_cl_status.h"
#include "host/device/user_cache.h"
#include "host/error.h"

namespace degas {
namespace {

namespace fs = std::filesystem;

std::string read_kernel(const std::string& file, const fs::path& folder) {
  if (folder.empty()) {
    const auto found = embedded_kernels().find(file);
    if (found == embedded_kernels().end()) throw Error::format("kernels/{}: no such kernel file in this build", file);
    return found->second;
  }
  std::ifstream stream(folder / file);
  if (!stream) throw Error::format("{}: cannot read this kernel file", (folder / file).string());
  return {std::istreambuf_iterator<char>(stream), {}};
}

void expand(const std::string& file, const fs::path& folder, std::set<std::string>& seen, std::string& out) {
  if (!seen.insert(file).second) return;
  std::istringstream lines(read_kernel(file, folder));
  for (std::string line; std::getline(lines, line);) {
    constexpr std::string_view include = "#include \"";
    if (line.starts_with(include)) {
      expand(line.substr(include.size(), line.rfind('"') - include.size()), folder, seen, out);
    } else {
      out += line;
      out += '\n';
    }
  }
}

/// A cached program is a file of its binary's content_hash and the binary.
constexpr size_t hash_digits = 32;

cl_program from_binary(cl_context context, cl_device_id device, const fs::path& path, const std::string& options) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return nullptr;
  const std::string file{std::istreambuf_iterator<char>(stream), {}};
  // A driver may run a damaged binary rather than refuse it.
  if (file.size() <= hash_digits) return nullptr;
  const std::string binary = file.substr(hash_digits);
  if (file.compare(0, hash_digits, content_hash(binary)) != 0) return nullptr;
  const auto* data = reinterpret_cast<const unsigned char*>(binary.data());
  const size_t bytes = binary.size();
  cl_int status = CL_SUCCESS, binary_status = CL_SUCCESS;
  cl_program program = clCreateProgramWithBinary(context, 1, &device, &bytes, &data, &binary_status, &status);
  if (status != CL_SUCCESS || binary_status != CL_SUCCESS) return nullptr;
  if (clBuildProgram(program, 1, &device, options.c_str(), nullptr, nullptr) == CL_SUCCESS) return program;
  clReleaseProgram(program);
  return nullptr;
}

void store_binary(cl_program program, const fs::path& path) {
  size_t bytes = 0;
  if (clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof(bytes), &bytes, nullptr) != CL_SUCCESS || !bytes)
    return;
  std::string binary(bytes, '\0');
  auto* data = reinterpret_cast<unsigned char*>(binary.data());
  if (clGetProgramInfo(program, CL_PROGRAM_BINARIES, sizeof(data), &data, nullptr) != CL_SUCCESS) return;
  replace_cache_file(path, content_hash(binary) + binary);
}

/// The first line of a build log that tells of an error, or the first at all.
std::string first_complaint(const std::string& log) {
  std::istringstream lines(log);
  std::string first;
  for (std::string line; std::getline(lines, line);) {
    std::string lower = line;
    std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
    if (lower.find("error:") != std::string::npos) return line;
    if (first.empty()) first = line;
  }
  return first.empty() ? "without a reason" : first;
}

}  // namespace

std::string kernel_source(const std::string& file, const fs::path& folder) {
  std::set<std::string> seen;
  std::string out;
  expand(file, folder, seen, out);
  return out;
}

cl_program build_program(cl_context context, cl_device_id device, const std::string& name, const std::string& source,
                         const std::string& options) {
  const std::string key = content_hash(source + '\0' + options + '\0' + device_text(device, CL_DEVICE_NAME) +
                                       device_text(device, CL_DEVICE_VERSION) + device_text(device, CL_DRIVER_VERSION));
  const fs::path path = cache_folder() / "programs" / (fs::path(name).stem().string() + "-" + key + ".bin");
  if (cl_program cached = from_binary(context, device, path, options)) return cached;

  const char* text = source.c_str();
  const size_t length = source.size();
  cl_int status = CL_SUCCESS;
  cl_program program = clCreateProgramWithSource(context, 1, &text, &length, &status);
  if (status == CL_SUCCESS) status = clBuildProgram(program, 1, &device, options.c_str(), nullptr, nullptr);
  if (status != CL_SUCCESS) {
    if (means_lost(status))
      check_status(status, "building kernels/" + name, device_text(device, CL_DEVICE_NAME).c_str());
    size_t bytes = 0;
    clGetProgramBuildInfo(program, device, CL_PROGRAM_BUILD_LOG, 0, nullptr, &bytes);
    std::string log(bytes, '\0');
    clGetProgramBuildInfo(program, device, CL_PROGRAM_BUILD_LOG, bytes, log.data(), nullptr);
    log.resize(log.find_last_not_of(std::string_view(" \n\0", 3)) + 1);  // drivers end it by a zero
    if (program) clReleaseProgram(program);
    const fs::path log_file = fs::path(path).replace_extension(".log");
    const bool kept = replace_cache_file(log_file, fmt::format("kernels/{} [{}]\n{}\n", name, options, log));
    throw Error::format(
        "device {}: its driver ({}) does not build kernels/{} (OpenCL status {}): {}; {}try another driver or --device",
        device_text(device, CL_DEVICE_NAME).c_str(), device_text(device, CL_DRIVER_VERSION).c_str(), name, status,
        first_complaint(log), kept ? "all it says is in " + log_file.string() + "; " : "");
  }
  store_binary(program, path);
  return program;
}

}  // namespace degas
