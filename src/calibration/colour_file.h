#pragma once
// colour.json ("crownfit-colour/1"): from a camera's own values to linear sRGB.

#include <filesystem>

#include "photo/colour.h"

namespace crownfit {

ColourTransform ReadColourTransform(const std::filesystem::path& file);

}  // namespace crownfit
