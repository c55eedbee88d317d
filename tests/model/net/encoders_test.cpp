#include "model/net/encoders.h"

#include "tests/support/catch.h"

using namespace degas;

TEST_CASE("channel lists fit any resolution, bottleneck and joint feature kept") {
  const std::vector<int> encoder = {8, 16, 32, 32, 64, 128, 128}, decoder = {128, 128, 64, 32};
  CHECK(levels_above_bottleneck(512) == 7);
  CHECK(levels_above_bottleneck(8) == 1);
  CHECK(encoder_levels(encoder, 7, 1) == encoder);
  CHECK(encoder_levels(encoder, 5, 1) == std::vector<int>{8, 16, 32, 32, 128});
  CHECK(encoder_levels(encoder, 8, 1) == std::vector<int>{8, 16, 32, 32, 64, 128, 128, 128});
  CHECK(decoder_levels(decoder, 4, 1) == decoder);
  CHECK(decoder_levels(decoder, 2, 1) == std::vector<int>{64, 32});
  CHECK(decoder_levels(decoder, 5, 1) == std::vector<int>{128, 128, 128, 64, 32});
  CHECK(encoder_levels(encoder, 7, 0.5) == std::vector<int>{8, 8, 16, 16, 32, 64, 64});
}

TEST_CASE("width rounds to multiples of 8, and leaves the paper's sizes alone") {
  CHECK(scaled_channels(7, 1) == 7);
  CHECK(scaled_channels(64, 0.5) == 32);
  CHECK(scaled_channels(16, 0.3) == 8);
  CHECK(scaled_channels(128, 0.3) == 40);
  CHECK(scaled_channels(16, 0.75) == 16);
}
