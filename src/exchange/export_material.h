#pragma once
// `crownfit export`: a material, and with a capture its scene, in another program's files, with a list of losses and
// pictures to compare with.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"

namespace crownfit {

struct ExportOptions {
  std::string format;                            ///< one of the keys of Exporters()
  std::optional<std::filesystem::path> capture;  ///< adds shape, lamps, cameras and reference pictures
  int paths_per_pixel = 256;                     ///< of the reference pictures
  uint64_t seed = 1;
  int threads = 0;
};

/// Writes the folder; returns notes for the user. Throws InputError.
std::vector<std::string> ExportMaterial(const std::filesystem::path& material, const ExportOptions& options,
                                        const std::filesystem::path& folder, Progress& progress);

}  // namespace crownfit
