#pragma once

#include <string>

namespace degas {

// Pieces of pages that need no other file.

/// Text with &, <, > and " as entities.
std::string escape(const std::string& text);
/// Standard base64 with padding.
std::string base64(const std::string& bytes);
/// The page up to its heading; close it with </body></html>. The title is escaped here.
std::string page_head(const std::string& title);
/// An embedded picture; `kind` is its type (png, jpeg), the caption is HTML.
std::string figure(const std::string& bytes, const std::string& kind, const std::string& caption);

}  // namespace degas
