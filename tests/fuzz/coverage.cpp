// The targets under libFuzzer (-fsanitize=fuzzer-no-link, Clang): which inputs are worth damaging again it learns from
// the code that they reach.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/io/file_bytes.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/kept_inputs.h"

#ifdef DEGAS_LIBFUZZER
extern "C" int LLVMFuzzerRunDriver(int* count, char*** arguments, int (*take)(const uint8_t* bytes, size_t size));

namespace degas::test {
namespace fs = std::filesystem;
namespace {

const FuzzTarget* fuzzed = nullptr;  // libFuzzer's callback takes no more than bytes
fs::path place;

int take(const uint8_t* bytes, size_t size) {
  fs::remove_all(place);
  write_input(*fuzzed, parts_of_input(*fuzzed, std::as_bytes(std::span(bytes, size))), place);
  const std::string fault = fault_of(*fuzzed, place);
  if (!fault.empty()) {
    std::fprintf(stderr, "%s: seed %d, part %d: %s\n", fuzzed->input.c_str(), size > 0 ? bytes[0] : 0,
                 size > 1 ? bytes[1] : 0, fault.c_str());
    std::abort();
  }
  return 0;
}

/// The seeds' parts, each an input, and what is kept of earlier searches. Gives the size of the largest.
size_t write_seeds(const FuzzTarget& target, const fs::path& folder) {
  size_t largest = 0;
  for (size_t seed = 0; seed < std::min<size_t>(target.seeds.size(), 256); ++seed) {
    size_t number = 0;
    for (const auto& [name, bytes] : target.seeds[seed]) {
      if (number == 256) break;
      Bytes input = {static_cast<std::byte>(seed), static_cast<std::byte>(number)};
      input.insert(input.end(), bytes.begin(), bytes.end());
      largest = std::max(largest, input.size());
      write_file_atomically(folder / fmt::format("seed-{}-{}", seed, number++), input);
    }
  }
  size_t number = 0;
  for (const Bytes& input : kept_inputs(target.input)) {
    largest = std::max(largest, input.size());
    write_file_atomically(folder / fmt::format("kept-{}", number++), input);
  }
  return largest;
}

}  // namespace

void fuzz_by_coverage(const FuzzTarget& target, const fs::path& corpus) {
  fuzzed = &target;
  place = corpus / "now" / target.input;
  const fs::path own = corpus / target.input;
  fs::create_directories(own);
  fs::create_directories(place.parent_path());
  const size_t largest = write_seeds(target, own);
  const char* seconds = std::getenv("DEGAS_FUZZ_SECONDS");
  std::vector<std::string> words = {"fuzz_tests",
                                    fmt::format("-max_total_time={}", seconds ? seconds : "600"),
                                    fmt::format("-max_len={}", largest + 4096),
                                    fmt::format("-artifact_prefix={}/fault-", own.string()),
                                    "-timeout=60",
                                    "-print_final_stats=1",
                                    own.string()};
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  int count = static_cast<int>(pointers.size());
  pointers.push_back(nullptr);
  char** arguments = pointers.data();
  std::exit(LLVMFuzzerRunDriver(&count, &arguments, take));
}

}  // namespace degas::test

#else

void degas::test::fuzz_by_coverage(const FuzzTarget&, const std::filesystem::path&) {
  throw std::logic_error("built without libFuzzer; take the program of cmake --preset fuzzer");
}

#endif
