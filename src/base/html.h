#pragma once
// Escaping of text for HTML.

#include <string>

namespace crownfit {

/// Writes markup characters as entities, for text and quoted attributes alike.
std::string Html(const std::string& text);

}  // namespace crownfit
