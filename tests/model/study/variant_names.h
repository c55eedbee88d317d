#pragma once

#include "model/study/variant.h"

namespace degas::test {

inline std::vector<std::string> names_of(const std::vector<Variant>& variants) {
  std::vector<std::string> names;
  for (const Variant& variant : variants) names.push_back(variant.name);
  return names;
}

}  // namespace degas::test
