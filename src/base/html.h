#pragma once
// Text in pages.

#include <string>

namespace crownfit {

/// With what HTML reads as markup written as entities, in text and in quoted attributes alike.
std::string Html(const std::string& text);

}  // namespace crownfit
