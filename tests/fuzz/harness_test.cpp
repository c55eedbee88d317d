// The harness sees what it is there for: otherwise every other case of this folder is worth nothing.

#include <stdexcept>

#include "host/error.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/kept_inputs.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

/// What the harness says of a reader, given an input of one byte.
std::string verdict(const std::function<void(const fs::path&)>& read, bool never_refuses = false) {
  const TemporaryFolder folder;
  FuzzTarget target{"input.bin", {}, {}, read};
  target.never_refuses = never_refuses;
  const Parts parts = {{"input.bin", Bytes(1)}};
  write_folder(parts, folder.path());
  return fault_of(target, folder / "input.bin");
}

}  // namespace

TEST_CASE("a reader that succeeds or names its input in an Error has no fault") {
  CHECK(verdict([](const fs::path&) {}) == "");
  CHECK(verdict([](const fs::path& path) { throw Error::format("{}: is damaged", path.string()); }) == "");
}

TEST_CASE("whatever else escapes a reader is a fault") {
  CHECK_THAT(verdict([](const fs::path&) { throw Error("is damaged"); }), Contains("does not name the input"));
  CHECK_THAT(verdict([](const fs::path&) { throw std::out_of_range("map::at"); }), Contains("map::at"));
  CHECK_THAT(verdict([](const fs::path&) { throw 7; }), Contains("no exception"));
  CHECK_THAT(verdict([](const fs::path& path) { throw Error(path.string()); }, true), Contains("counts as absence"));
}

TEST_CASE("memory beyond what the input is worth is a fault, even where its failure is caught") {
  CHECK(verdict([](const fs::path&) { std::vector<char>(free_bytes / 2); }) == "");
  CHECK_THAT(verdict([](const fs::path&) { std::vector<char>(size_t{1} << 62); }), Contains("were asked for"));
  CHECK_THAT(verdict([](const fs::path&) {
               try {
                 std::vector<char>(free_bytes + 100);
               } catch (const std::bad_alloc&) {
               }
             }),
             Contains("were asked for"));
  // What is let go again counts no more.
  CHECK(verdict([](const fs::path&) {
          for (int i = 0; i < 8; ++i) std::vector<char>(free_bytes / 2);
        }) == "");
}

TEST_CASE("equal seeds damage alike, others otherwise, and every byte may be met") {
  const Bytes whole(64, std::byte{'7'});
  std::vector<bool> met(whole.size(), false);
  int longer = 0, shorter = 0;
  for (uint64_t seed = 0; seed < 500; ++seed) {
    Bytes first = whole, second = whole;
    Mutator one{Random(seed)}, two{Random(seed)};
    one.damage(first, whole);
    two.damage(second, whole);
    REQUIRE(first == second);
    REQUIRE(one.log() == two.log());
    longer += first.size() > whole.size();
    shorter += first.size() < whole.size();
    for (size_t i = 0; i < std::min(first.size(), whole.size()); ++i) met[i] = met[i] || first[i] != whole[i];
  }
  CHECK(longer > 50);
  CHECK(shorter > 50);
  CHECK(std::count(met.begin(), met.end(), false) == 0);
}

TEST_CASE("what is kept of a search comes back once, smallest first, without seeds and faults") {
  const TemporaryFolder folder;
  const Parts found = {{"seed-0-0", Bytes(7)},       {"fault-1", Bytes(9)}, {"a", bytes_of("4567")},
                       {"kept-0", bytes_of("4567")}, {"b", Bytes(300)},     {"c", {}}};
  write_folder(found, folder / "found");
  keep_inputs(folder / "found", "target", folder / "kept");
  CHECK(kept_inputs("target", folder / "kept") == std::vector<Bytes>{{}, bytes_of("4567"), Bytes(300)});
  CHECK(kept_inputs("another", folder / "kept").empty());

  const FuzzTarget target{"input.bin", {whole(bytes_of("one")), {{"a", {}}, {"b", bytes_of("two")}}}, {}, {}};
  CHECK(parts_of_input(target, {}) == Parts{{"", {}}});
  CHECK(parts_of_input(target, bytes_of("\3\1three")) == Parts{{"a", {}}, {"b", bytes_of("three")}});
}

TEST_CASE("every archive of kept inputs holds some") {
  int archives = 0;
  for (const auto& entry : fs::directory_iterator(kept_inputs_folder())) {
    CAPTURE(entry.path());
    CHECK(!kept_inputs(entry.path().stem().string()).empty());
    ++archives;
  }
  CHECK(archives > 5);
}
