#pragma once
// A photograph that an option names.

#include <optional>
#include <string>

#include "capture/capture.h"

namespace crownfit {

/// Its index; nothing when the name is empty. Throws InputError.
std::optional<size_t> NamedPhotograph(const Capture& capture, const std::string& name);

}  // namespace crownfit
