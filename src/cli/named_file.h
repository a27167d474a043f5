#pragma once
// NAME=FILE, as options write it.

#include <filesystem>
#include <string>
#include <utility>

namespace crownfit {

/// Throws InputError naming the option.
std::pair<std::string, std::filesystem::path> NamedFile(const std::string& text, const char* option);

}  // namespace crownfit
