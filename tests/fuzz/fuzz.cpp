#include "tests/fuzz/fuzz.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <typeinfo>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/zip_archive.h"
#include "tests/fuzz/allocations.h"
#include "tests/fuzz/kept_inputs.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

namespace degas::test {
namespace fs = std::filesystem;
namespace {

constexpr int most_faults = 5;  ///< of a target that are told
/// Of a round, on the processor, sanitizers included; libFuzzer's watch over every comparison costs ten times as much.
#ifdef DEGAS_LIBFUZZER
constexpr double longest_seconds = 60;
#else
constexpr double longest_seconds = 10;
#endif

/// The number in an environment variable, where there is one.
std::optional<int> number_in(const char* variable) {
  const char* text = std::getenv(variable);
  return text ? std::optional(std::atoi(text)) : std::nullopt;
}

size_t size_of(const fs::path& path) {
  if (fs::is_regular_file(path)) return fs::file_size(path);
  size_t total = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path)) {
    if (entry.is_regular_file()) total += entry.file_size();
  }
  return total;
}

/// Without the flush to the disk that the product's own writers wait for: there are many rounds.
void write_bytes(const fs::path& path, const Bytes& bytes) {
  fs::create_directories(path.parent_path());
  std::ofstream stream(path, std::ios::binary | std::ios::trunc);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream) throw std::runtime_error(path.string() + ": cannot be written");
}

/// A seed with one of its parts damaged, now and then two.
Parts damaged(const FuzzTarget& target, Mutator& mutator, std::string& log) {
  const Parts& donor = target.seeds[mutator.draw(target.seeds.size())];
  Parts parts = target.seeds[mutator.draw(target.seeds.size())];
  for (size_t times = mutator.draw(8) == 0 ? 2 : 1; times > 0; --times) {
    auto part = std::next(parts.begin(), static_cast<ptrdiff_t>(mutator.draw(parts.size())));
    const auto other = std::next(donor.begin(), static_cast<ptrdiff_t>(mutator.draw(donor.size())));
    const size_t told = mutator.log().size();
    mutator.damage(part->second, other->second);
    log += fmt::format("{}{}", part->first.empty() ? "" : part->first + ": ", mutator.log().substr(told));
  }
  return parts;
}

std::string fault_of_exception(const std::exception& failure) {
  return fmt::format("{} escapes: {}", typeid(failure).name(), failure.what());
}

}  // namespace

std::string fault_of(const FuzzTarget& target, const fs::path& input, bool* was_refused) {
  std::string fault;
  bool refused = false;
  const size_t bytes = size_of(input), allowed = 4 * bytes + free_bytes;
  const std::clock_t begin = std::clock();  // a busy machine is no hang
  {
    const AllocationLimit limit(allowed);
    try {
      target.read(input);
    } catch (const Error& error) {
      refused = true;
      const std::string message = error.what();
      if (message.find(input.string()) == message.npos) fault = "an Error does not name the input: " + message;
      if (target.never_refuses) fault = "an Error where damage counts as absence: " + message;
    } catch (const std::exception& failure) {
      fault = fault_of_exception(failure);
    } catch (...) {
      fault = "something that is no exception escapes";
    }
    if (limit.was_exceeded()) {
      fault = fmt::format("{} bytes were asked for of an input of {}, {} are allowed; {}", limit.peak_bytes(), bytes,
                          allowed, fault);
    }
  }
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  if (seconds > longest_seconds) fault += fmt::format("; took {:.1f} s", seconds);
  if (was_refused) *was_refused = refused;
  return fault;
}

void write_input(const FuzzTarget& target, const Parts& parts, const fs::path& path) {
  if (target.write) return target.write(parts, path);
  write_bytes(path, parts.begin()->second);
}

Parts parts_of_input(const FuzzTarget& target, std::span<const std::byte> input) {
  const auto head = [&](size_t place) { return place < input.size() ? std::to_integer<size_t>(input[place]) : 0; };
  Parts parts = target.seeds[head(0) % target.seeds.size()];
  const auto part = std::next(parts.begin(), static_cast<ptrdiff_t>(head(1) % parts.size()));
  const auto bytes = input.subspan(std::min<size_t>(2, input.size()));
  part->second.assign(bytes.begin(), bytes.end());
  return parts;
}

void fuzz(const FuzzTarget& target) {
  if (std::getenv("DEGAS_FUZZ_LIST")) {
    fmt::print("{}\n", target.input);
    return;
  }
  if (const char* corpus = std::getenv("DEGAS_FUZZ_CORPUS")) {
    const char* wanted = std::getenv("DEGAS_FUZZ_TARGET");
    if (wanted && target.input != wanted) return;
    if (const char* folder = std::getenv("DEGAS_FUZZ_KEEP")) {
      if (!fs::exists(fs::path(corpus) / target.input)) return;
      fmt::print("{}: kept\n", target.input);
      keep_inputs(fs::path(corpus) / target.input, target.input, folder);
      return;
    }
    fuzz_by_coverage(target, corpus);
  }
  std::optional<TemporaryFolder> own;
  const auto chosen = number_in("DEGAS_FUZZ_ROUND");
  const fs::path folder = chosen ? fs::temp_directory_path() / "degas-fuzz" : own.emplace().path();
  const fs::path input = folder / target.input;

  for (const Parts& seed : target.seeds) {
    fs::remove_all(input);
    write_input(target, seed, input);
    REQUIRE_NOTHROW(target.read(input));
    REQUIRE(fault_of(target, input) == "");
  }
  const std::vector<Bytes> kept = kept_inputs(target.input);
  for (size_t i = 0; i < kept.size() && !chosen; ++i) {
    fs::remove_all(input);
    write_input(target, parts_of_input(target, kept[i]), input);
    const std::string fault = fault_of(target, input);
    if (!fault.empty()) FAIL_CHECK(target.input << ": kept input " << i << ": " << fault);
  }
  uint64_t name_seed = 0xcbf29ce484222325u;
  for (const unsigned char c : target.input) name_seed = (name_seed ^ c) * 0x100000001b3u;
  const int rounds = target.rounds * number_in("DEGAS_FUZZ_FACTOR").value_or(1);
  int refused = 0, faults = 0;
  for (int round = chosen.value_or(0); round < (chosen ? *chosen + 1 : rounds) && faults < most_faults; ++round) {
    Mutator mutator(Random::of_step(name_seed, 0, static_cast<uint64_t>(round)));
    std::string log;
    fs::remove_all(input);
    write_input(target, damaged(target, mutator, log), input);
    bool was_refused = false;
    const std::string fault = fault_of(target, input, &was_refused);
    refused += was_refused;
    if (fault.empty()) continue;
    ++faults;
    FAIL_CHECK(target.input << ": round " << round << ": " << log << "\n  " << fault
                            << "\n  again: this test case with DEGAS_FUZZ_ROUND=" << round);
  }
  if (chosen) return;
  std::printf("%s: %zu kept inputs, %d rounds, %d refused, %d faults\n", target.input.c_str(), kept.size(), rounds,
              refused, faults);
  if (!target.never_refuses) CHECK(refused > 0);  // or nothing of what was damaged is looked at
}

Bytes bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span<const char>(text));
  return {bytes.begin(), bytes.end()};
}

Parts whole(Bytes bytes) {
  return {{"", std::move(bytes)}};
}

Parts whole_file(const fs::path& path) {
  return whole(read_file_bytes(path));
}

void write_archive(const Parts& parts, const fs::path& path) {
  std::vector<ZipEntry> entries;
  for (const auto& [name, bytes] : parts) entries.push_back({name, bytes});
  write_bytes(path, make_zip(entries, false));
}

void write_folder(const Parts& parts, const fs::path& path) {
  for (const auto& [name, bytes] : parts) write_bytes(path / name, bytes);
}

Parts archive_parts(const fs::path& path) {
  const ZipReader archive(path);
  Parts parts;
  for (const std::string& name : archive.names()) parts[name] = archive.read(name);
  return parts;
}

Parts folder_parts(const fs::path& path) {
  Parts parts;
  for (const auto& entry : fs::recursive_directory_iterator(path)) {
    if (entry.is_regular_file()) parts[fs::relative(entry.path(), path).string()] = read_file_bytes(entry.path());
  }
  return parts;
}

}  // namespace degas::test
