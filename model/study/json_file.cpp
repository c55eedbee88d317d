#include "model/study/json_file.h"

#include "host/io/file_bytes.h"
#include "host/io/json_node.h"

namespace degas {

nlohmann::json read_json_if_any(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) return {};
  return read_json(path);
}

void write_json(const std::filesystem::path& path, const nlohmann::json& json) {
  write_text(path, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace degas
