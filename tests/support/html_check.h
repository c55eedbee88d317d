#pragma once

#include <set>
#include <string>
#include <vector>

namespace degas::test {

/// What is wrong with a page: elements that are not closed in order, attributes without quotes, addresses that lead out
/// of it. Empty where it is well-formed and needs no other file.
inline std::string html_fault(const std::string& html) {
  static const std::set<std::string> void_elements = {"!doctype", "meta", "img", "br", "input"};
  std::vector<std::string> open;
  for (size_t at = 0; (at = html.find('<', at)) != std::string::npos;) {
    const bool closes = html[at + 1] == '/';
    size_t end = at + 1 + closes;
    const size_t name_start = end;
    while (end < html.size() && (std::isalnum(static_cast<unsigned char>(html[end])) || html[end] == '!')) ++end;
    const std::string name = html.substr(name_start, end - name_start);
    if (name.empty()) return "a stray < at ..." + html.substr(at, 40);
    // To the element's end, past what stands in quotes.
    bool quoted = false;
    std::string bare;
    for (; end < html.size() && (quoted || html[end] != '>'); ++end) {
      if (html[end] == '"') {
        if (!quoted && html[end - 1] != '=') return "a stray quote in <" + name;
        quoted = !quoted;
      } else if (!quoted) {
        bare += html[end];
      }
    }
    if (end >= html.size()) return "<" + name + " has no end";
    if (bare.find('<') != std::string::npos) return "a < within <" + name;
    const bool ends_itself = html[end - 1] == '/';
    at = end + 1;
    if (closes) {
      if (open.empty() || open.back() != name)
        return "</" + name + "> where " + (open.empty() ? "nothing" : open.back()) + " is open";
      open.pop_back();
    } else if (!void_elements.count(name) && !ends_itself) {
      open.push_back(name);
      if (name == "script" || name == "style") at = html.find("</" + name, at);
    }
  }
  if (!open.empty()) return "<" + open.back() + " is never closed";
  std::string rest = html;
  const std::string allowed = "xmlns=\"http://www.w3.org/2000/svg\"";
  for (size_t at; (at = rest.find(allowed)) != std::string::npos;) rest.erase(at, allowed.size());
  for (const char* way_out : {"http:", "https:", "src=\"/", "href", "@import", "url("}) {
    if (rest.find(way_out) != std::string::npos) return std::string("leads out of the page: ") + way_out;
  }
  return "";
}

}  // namespace degas::test
