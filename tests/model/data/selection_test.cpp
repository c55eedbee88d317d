#include "model/data/selection.h"

#include "host/error.h"
#include "tests/support/catch.h"

using namespace degas;
using Catch::Contains;

namespace {

std::vector<int> frames(const std::string& text) {
  return selected_frames(selection_parts(text), 10, "--frames");
}
std::vector<int> cameras(const std::string& text) {
  return selected_cameras(selection_parts(text), {"cam00", "cam01", "left", "cam09"}, "--cameras");
}

}  // namespace

TEST_CASE("frames are single ones and ranges without their end") {
  CHECK(frames("") == std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  CHECK(frames("0:10:4") == std::vector<int>{0, 4, 8});
  CHECK(frames("7,2:4") == std::vector<int>{7, 2, 3});
  CHECK(frames("::5") == std::vector<int>{0, 5});
  CHECK(frames("1::2147483647") == std::vector<int>{1});
  CHECK(frames("8:") == std::vector<int>{8, 9});
  CHECK(frames(":2") == std::vector<int>{0, 1});
}

TEST_CASE("cameras are selected by name, and by range in the capture's order") {
  CHECK(cameras("") == std::vector<int>{0, 1, 2, 3});
  CHECK(cameras("cam09,left") == std::vector<int>{3, 2});
  CHECK(cameras("cam01:cam09") == std::vector<int>{1, 2});
  CHECK(cameras("::2") == std::vector<int>{0, 2});
  CHECK(cameras("left:") == std::vector<int>{2, 3});
}

TEST_CASE("a selection that is wrong is refused with the part and what there is") {
  CHECK_THROWS_WITH(frames("0:11"),
                    "--frames: '0:11' lies outside the capture; give frames of 0 .. 9 as in 0,4,8:20:2");
  for (const char* text : {"10", "-1", "-2:4"}) CHECK_THROWS_WITH(frames(text), Contains("lies outside the capture"));
  for (const char* text : {"x", "1,,2", "1:y", "1e3", " 1", "99999999999999999999"}) {
    CHECK_THROWS_WITH(frames(text), Contains("--frames: '") && Contains("is no number"));
  }
  CHECK_THROWS_WITH(frames("4:4"), Contains("'4:4' is empty: ranges leave their last one out"));
  CHECK_THROWS_WITH(frames("4:2"), Contains("'4:2' is empty"));
  for (const char* text : {"0:4:0", "0:4:-1", "0:4:x"}) CHECK_THROWS_WITH(frames(text), Contains("stride"));
  CHECK_THROWS_WITH(frames("0:4:1:1"), Contains("no range"));
  CHECK_THROWS_WITH(frames("0:4,2"), Contains("'2' selects some twice"));
  CHECK_THROWS_WITH(cameras("cam00,cam7"), "--cameras: no camera 'cam7'; cameras here: cam00, cam01, left, cam09");
  CHECK_THROWS_WITH(cameras("cam00:cam00"), Contains("is empty"));
  CHECK_THROWS_WITH(cameras("left,cam01:"), Contains("'cam01:' selects some twice"));
}
