#include "cli/named_photograph.h"

#include "base/error.h"

namespace crownfit {

std::optional<size_t> NamedPhotograph(const Capture& capture, const std::string& name) {
  if (name.empty()) return std::nullopt;
  std::string known;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    if (capture.photographs[i].name == name) return i;
    known += (known.empty() ? "" : ", ") + capture.photographs[i].name;
  }
  throw InputError(capture.file, "photographs", "there is no photograph called '" + name + "'",
                   "Known: " + known + ".");
}

}  // namespace crownfit
