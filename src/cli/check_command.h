#pragma once
// `crownfit check`, which also runs after `crownfit capture`.

#include <filesystem>

#include "cli/common_options.h"

namespace crownfit {

struct CheckCommand {
  std::filesystem::path capture, output;  ///< output: a picture of slices through the layers; empty: none
  bool json = false;
  CommonOptions common;
};

int RunCheck(const CheckCommand& asked);

}  // namespace crownfit
