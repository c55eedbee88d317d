#include "host/io/json_node.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "host/error.h"
#include "host/io/file_bytes.h"
#include "host/io/input_limits.h"

namespace degas {

using json = nlohmann::ordered_json;

json read_json(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  try {
    return json::parse(checked_json(bytes, path.string()));
  } catch (const json::exception& failure) {
    throw Error::format("{}: is no JSON: {:.300}", path.string(), failure.what());
  }
}

void JsonNode::fail(const std::string& reason) const {
  throw Error::format("{}: {}", label_, reason);
}

JsonNode JsonNode::operator[](const std::string& key) const {
  if (!has(key)) fail(fmt::format("has no key '{}'", key));
  return {value_.at(key), fmt::format("{}: {}", label_, key)};
}

JsonNode JsonNode::operator[](size_t index) const {
  return {value_.at(index), fmt::format("{}[{}]", label_, index)};
}

std::vector<std::string> JsonNode::keys() const {
  if (!value_.is_object()) fail("is no object of names and values");
  std::vector<std::string> keys;
  for (const auto& [key, value] : value_.items()) keys.push_back(key);
  return keys;
}

size_t JsonNode::size() const {
  if (!value_.is_array()) fail("is no list");
  return value_.size();
}

double JsonNode::number() const {
  if (!value_.is_number() || !std::isfinite(value_.get<double>())) fail("is no number");
  return value_.get<double>();
}

int JsonNode::integer(int low, int high) const {
  const double value = number();
  if (value != std::floor(value) || value < low || value > high) {
    fail(fmt::format("is {}, expected a whole number from {} to {}", value, low, high));
  }
  return static_cast<int>(value);
}

std::string JsonNode::text() const {
  if (!value_.is_string()) fail("is no text");
  return value_.get<std::string>();
}

std::vector<double> JsonNode::numbers(size_t count) const {
  std::vector<double> values;
  for (size_t i = 0; i < size(); ++i) {
    const JsonNode item = (*this)[i];
    if (!item.value_.is_array()) {
      values.push_back(item.number());
      continue;
    }
    for (size_t k = 0; k < item.size(); ++k) values.push_back(item[k].number());
  }
  if (values.size() != count) fail(fmt::format("has {} numbers, expected {}", values.size(), count));
  return values;
}

Eigen::Matrix3d JsonNode::rotation() const {
  const std::vector<double> values = numbers(9);
  const Eigen::Matrix3d matrix = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
  const double error = (matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (!(error < 1e-3)) fail(fmt::format("is no rotation: |R R^T - 1| = {:.3g}", error));
  if (matrix.determinant() < 0) {
    fail("is a mirror, no rotation (its determinant is -1); an axis was flipped when it was written: undo that");
  }
  return matrix;
}

}  // namespace degas
