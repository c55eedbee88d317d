#include "model/train/html.h"

#include <fmt/format.h>

#include <cstdint>

namespace degas {
namespace {

constexpr const char* style =
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#222}"
    "h1,h2{font-weight:600}table{border-collapse:collapse}td,th{padding:.25em .9em;border-bottom:1px solid "
    "#ddd;text-align:right}"
    "td:first-child{text-align:left}img{max-width:100%;display:block}figure{margin:1em 0}figcaption{color:#666}"
    ".charts{display:flex;flex-wrap:wrap;gap:1em}";

}  // namespace

std::string escape(const std::string& text) {
  std::string out;
  for (char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string base64(const std::string& bytes) {
  constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) word = word << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += k <= count ? digits[word >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string page_head(const std::string& title) {
  return fmt::format(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>{1}</style></head>"
      "<body><h1>{0}</h1>",
      escape(title), style);
}

std::string figure(const std::string& bytes, const std::string& kind, const std::string& caption) {
  return fmt::format("<figure><img alt=\"\" src=\"data:image/{};base64,{}\"><figcaption>{}</figcaption></figure>", kind,
                     base64(bytes), caption);
}

}  // namespace degas
