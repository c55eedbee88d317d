#include "model/faces/code_folder.h"

#include <fstream>
#include <vector>

#include "host/error.h"
#include "tests/support/catch.h"
#include "tests/support/temporary_folder.h"

using namespace degas;
using namespace degas::test;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

const nlohmann::json settings = {{"margin", 50}, {"track", false}};
const std::vector<float> code = {1, 2};

}  // namespace

TEST_CASE("a folder goes on with the settings that it was begun with") {
  const TemporaryFolder place;
  const CodeFolder first(place.path(), settings, false);
  CHECK_FALSE(fs::exists(place / "dpe"));
  first.begin();
  first.write(3, 1, code);
  CHECK(fs::exists(place / "dpe/dpe-000003-cam01.pt"));
  const CodeFolder again(place.path(), settings, false);
  CHECK(again.contains(3, 1));
  CHECK_FALSE(again.contains(3, 2));
}

TEST_CASE("codes are never mixed with others nor replaced unasked") {
  const TemporaryFolder place;
  const auto refused = [&](const nlohmann::json& wanted, const char* reason) {
    CHECK_THROWS_WITH(CodeFolder(place.path(), wanted, false),
                      Contains(reason) && Contains("--out DIR") && Contains("--overwrite"));
  };
  SECTION("made with other settings") {
    const CodeFolder first(place.path(), settings, false);
    first.begin();
    first.write(3, 1, code);
    refused({{"margin", 40}, {"track", false}},
            "encoder.json: the codes here were made with another 'margin': 50 (now 40)");
    refused({{"onnx", "x"}}, "another 'onnx': none");
    const CodeFolder other(place.path(), {{"margin", 40}}, true);
    CHECK(other.contains(3, 1));  // until the new ones come
    other.begin();
    CHECK_FALSE(other.contains(3, 1));
    refused(settings, "another 'margin': 40");
  }
  SECTION("made by others") {
    fs::create_directories(place / "dpe");
    std::ofstream(place / "dpe/dpe-000007-cam03.pt") << "x";
    std::ofstream(place / "dpe/notes.txt") << "x";
    refused(settings, "dpe-000007-cam03.pt: there are face codes already");
    const CodeFolder folder(place.path(), settings, true);
    folder.begin();
    CHECK_FALSE(folder.contains(7, 3));
    CHECK(fs::exists(place / "dpe/notes.txt"));
  }
  SECTION("in any place where they would be read") {
    const std::string name = GENERATE("dpe.zip", "dpe/codes.zip", "dpe-000007-cam03.npy", "expression_codes.npy");
    fs::create_directories(place / "dpe");
    std::ofstream(place / name) << "x";
    refused(settings, (name + ": there are face codes already").c_str());
    CodeFolder(place.path(), settings, true).begin();
    CHECK(fs::exists(place / name));
    CodeFolder(place.path(), settings, false);  // goes on
  }
  SECTION("damaged settings") {
    fs::create_directories(place / "dpe");
    std::ofstream(place / "dpe/encoder.json") << "[1,";
    refused(settings, "encoder.json: is no JSON object");
  }
}
