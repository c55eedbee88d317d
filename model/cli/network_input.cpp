#include "model/cli/network_input.h"

#include <charconv>
#include <cmath>
#include <sstream>

#include "host/error.h"

namespace degas {
namespace {

double number_of(const std::string& text, const std::string& option, const std::string& part) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw Error::format("{}: '{}' must be a number", option, part);
  }
  return value;
}

}  // namespace

NetworkInput parse_network_input(const std::string& text, const std::string& option, NetworkInput input) {
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const size_t sign = part.find('=');
    const std::string key = part.substr(0, sign), value = sign == std::string::npos ? "" : part.substr(sign + 1);
    if (key == "side") {
      const double side = number_of(value, option, part);
      if (!(side >= 1 && side <= 4096 && side == std::floor(side))) {
        throw Error::format("{}: '{}' must be a whole number from 1 to 4096", option, part);
      }
      input.picture.side = static_cast<int>(side);
    } else if (key == "mean") {
      input.picture.mean.fill(number_of(value, option, part));
    } else if (key == "scale") {
      input.picture.scale.fill(number_of(value, option, part));
    } else if (key == "output" && !value.empty()) {
      input.output = value;
    } else {
      throw Error::format("{}: '{}' is no KEY=VALUE; keys are side, mean, scale and output", option, part);
    }
  }
  return input;
}

}  // namespace degas
