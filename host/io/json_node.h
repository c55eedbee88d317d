#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace degas {

/// The JSON of a file, names in its order; Error naming it when it is missing, no JSON or beyond check_json.
nlohmann::ordered_json read_json(const std::filesystem::path& path);

/// A value of a JSON file with the way to it ("cameras.json: rigs[1]: fx"), which every Error begins with. The JSON
/// must outlive it.
class JsonNode {
 public:
  JsonNode(const nlohmann::ordered_json& value, std::string label) : value_(value), label_(std::move(label)) {}

  [[noreturn]] void fail(const std::string& reason) const;
  bool is_null() const { return value_.is_null(); }
  bool has(const std::string& key) const { return value_.is_object() && value_.contains(key); }
  JsonNode operator[](const std::string& key) const;
  JsonNode operator[](size_t index) const;
  /// Names of the entries of an object, in the file's order.
  std::vector<std::string> keys() const;
  /// Of a list.
  size_t size() const;
  double number() const;  ///< finite
  int integer(int low, int high) const;
  std::string text() const;
  /// A list of `count` numbers, nested lists laid out one after another: [[1,2],[3,4]] counts as four.
  std::vector<double> numbers(size_t count) const;
  /// Nine numbers, row after row, that make a rotation to 1e-3. A mirror is refused with its remedy.
  Eigen::Matrix3d rotation() const;

 private:
  const nlohmann::ordered_json& value_;
  std::string label_;
};

}  // namespace degas
