#pragma once
// colour.json ("crownfit-colour/1"): from a camera's own values to linear sRGB.

#include <filesystem>

#include "base/json_file.h"
#include "photo/colour.h"

namespace crownfit {

ColourTransform ReadColourTransform(const std::filesystem::path& file);

/// What a perfectly white Lambertian surface gives there, the file's "white_sensor_rgb".
glm::dvec3 ReadSensorWhite(const std::filesystem::path& file);

/// Both.
BandColour ReadBandColour(const std::filesystem::path& file);

/// What such a file holds of them.
JsonValue::Object ColourContent(const BandColour& colour);

}  // namespace crownfit
