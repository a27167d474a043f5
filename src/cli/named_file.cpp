#include "cli/named_file.h"

#include "base/error.h"

namespace crownfit {

std::pair<std::string, std::filesystem::path> NamedFile(const std::string& text, const char* option) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw InputError("", option, "expected NAME=FILE, such as left=ball_left.dng, found '" + text + "'");
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace crownfit
