#include "model/study/variant.h"

#include <cctype>
#include <set>

#include "host/error.h"

namespace degas {

Variant make_variant(const std::string& name, const std::filesystem::path& config_file,
                     const std::vector<std::string>& overrides) {
  Variant variant;
  variant.name = name;
  variant.config = load_config(config_file);
  variant.config_file = config_file;
  return varied(variant, name, overrides);
}

Variant varied(const Variant& base, const std::string& name, const std::vector<std::string>& overrides) {
  Variant variant = base;
  variant.name = name;
  variant.paper_labels.clear();
  for (const std::string& assignment : overrides) {
    apply_override(variant.config, assignment);
    variant.overrides.push_back(assignment);
  }
  validate(variant.config, fmt::format("variant '{}'", name));
  return variant;
}

std::string StudyBudget::text() const {
  return minutes ? fmt::format("{:g} minutes", *minutes) : fmt::format("{} steps", iterations);
}

std::string folder_name(const std::string& name) {
  std::string folder;
  for (const char c : name) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_';
    if (plain || folder.empty() || folder.back() != '-') folder += plain ? c : '-';
  }
  if (folder.find_first_not_of(".-") == std::string::npos)
    throw Error::format("'{}': a name must hold a letter or digit", name);
  return folder;
}

void require_distinct(const std::vector<Variant>& variants) {
  if (variants.empty()) throw Error("there is nothing to compare: name at least one configuration");
  std::set<std::string> folders;
  for (const Variant& variant : variants) {
    if (!folders.insert(folder_name(variant.name)).second)
      throw Error::format("variant '{}': there are two of this name; name them apart", variant.name);
  }
}

}  // namespace degas
