#include "host/device/tuning_table.h"

#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;

namespace {

const TuningKey key = {"device", "driver 1", "conv2d/gather", "8x8", "abc"};
const TuningChoice choice = {{{"pixels", 6}, {"vectors", 2}}, TuneMode::Full, 0.5, 0.75};

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TuningKey numbered(int writer, int number) {
  TuningKey result = key;
  result.shape = std::to_string(writer) + " " + std::to_string(number);
  return result;
}

}  // namespace

TEST_CASE("choices outlive the process that made them, each for its own device, driver, kernel, shape and source") {
  const TemporaryFolder folder;
  const auto file = folder / "deeper/tuning.json";
  CHECK(TuningTable(file).size() == 0);
  CHECK(TuningTable(file).add(key, choice));
  const TuningTable table(file);
  const std::optional<TuningChoice> found = table.find(key);
  REQUIRE(found);
  CHECK(found->parameters == choice.parameters);
  CHECK(found->mode == TuneMode::Full);
  CHECK(found->milliseconds == 0.5);
  CHECK(found->default_milliseconds == 0.75);
  for (std::string TuningKey::*part :
       {&TuningKey::device, &TuningKey::driver, &TuningKey::kernel, &TuningKey::shape, &TuningKey::source}) {
    TuningKey other = key;
    other.*part += "x";
    CHECK(!table.find(other));
  }
}

TEST_CASE("a new driver's choices stand beside the old one's; a new source's replace it") {
  const TemporaryFolder folder;
  const auto file = folder / "tuning.json";
  TuningTable table(file);
  TuningKey driver = key, source = key;
  driver.driver = "driver 2";
  source.source = "def";
  table.add(key, choice);
  table.add(driver, choice);
  CHECK(TuningTable(file).find(key));
  CHECK(TuningTable(file).find(driver));
  table.add(source, choice);
  CHECK(TuningTable(file).size() == 2);
  CHECK(TuningTable(file).find(source));
  CHECK(!TuningTable(file).find(key));
}

TEST_CASE("a damaged table counts as empty and is made anew") {
  const TemporaryFolder folder;
  const auto file = folder / "tuning.json";
  TuningTable(file).add(key, choice);
  const std::string whole = text_of(file);
  const auto with_pixels = [&](const std::string& number) {
    const std::string written = "\"pixels\": 6";
    REQUIRE(whole.find(written) != std::string::npos);
    return std::string(whole).replace(whole.find(written), written.size(), "\"pixels\": " + number);
  };
  const std::string damage =
      GENERATE_COPY(std::string(), std::string("\0\xff{", 3), std::string("[]"), std::string("{\"version\": 1}"),
                    std::string("{\"version\": 1, \"choices\": [{\"device\": 3}]}"), whole.substr(0, whole.size() / 2),
                    with_pixels("6.5"), with_pixels("1e26"), with_pixels("4294967302"), with_pixels("null"));
  std::ofstream(file, std::ios::trunc) << damage;
  TuningTable table(file);
  CHECK(table.size() == 0);
  CHECK(!table.find(key));
  CHECK(table.add(key, choice));
  CHECK(text_of(file) == whole);
}

TEST_CASE("another version's table is of no use, and damage done while a process runs loses nothing it knew") {
  const TemporaryFolder folder;
  const auto file = folder / "tuning.json";
  std::ofstream(file) << R"({"version": 2, "anything": 1})";
  TuningTable table(file);
  CHECK(table.size() == 0);
  table.add(numbered(0, 0), choice);
  std::ofstream(file, std::ios::trunc) << "{";
  table.add(numbered(0, 1), choice);
  CHECK(TuningTable(file).size() == 2);
}

TEST_CASE("processes that write at once never leave a damaged table, and lose nothing that is written again") {
  constexpr int writers = 4, choices = 60;
  const TemporaryFolder folder;
  const auto file = folder / "tuning.json";
  TuningTable(file).add(key, choice);
  std::vector<pid_t> processes;
  for (int writer = 0; writer < writers; ++writer) {
    processes.push_back(fork());
    REQUIRE(processes.back() >= 0);
    if (processes.back() == 0) {
      TuningTable table(file);
      for (int number = 0; number < choices; ++number) table.add(numbered(writer, number), choice);
      _exit(table.size() > choices ? 0 : 1);
    }
  }
  int running = writers, reads = 0;
  while (running > 0) {
    const nlohmann::json document = nlohmann::json::parse(text_of(file), nullptr, false);
    REQUIRE(!document.is_discarded());
    CHECK(document.at("choices").size() >= 1);
    ++reads;
    int status = 0;
    if (waitpid(-1, &status, WNOHANG) > 0) {
      CHECK(status == 0);
      --running;
    }
  }
  CHECK(reads > 0);
  // Whoever lacks a choice finds it again; nobody undoes another's.
  for (int writer = 0; writer < writers; ++writer) {
    TuningTable table(file);
    for (int number = 0; number < choices; ++number) {
      if (!table.find(numbered(writer, number))) table.add(numbered(writer, number), choice);
    }
  }
  const TuningTable table(file);
  CHECK(table.size() == 1 + writers * choices);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) CHECK(entry.path() == file);
}

TEST_CASE("a table that cannot be written says so and goes on in memory") {
  const TemporaryFolder folder;
  std::ofstream(folder / "file") << "in the way";
  TuningTable table(folder / "file/tuning.json");
  CHECK(!table.add(key, choice));
  CHECK(table.find(key));
}
