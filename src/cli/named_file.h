#pragma once
// NAME=FILE, the format of some options.

#include <filesystem>
#include <string>
#include <utility>

namespace crownfit {

/// Throws InputError naming the option.
std::pair<std::string, std::filesystem::path> NamedFile(const std::string& text, const char* option);

}  // namespace crownfit
