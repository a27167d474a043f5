#pragma once
// colour.json ("crownfit-colour/1"): from a camera's own values to linear sRGB.

#include <filesystem>

#include "base/json_file.h"
#include "photo/colour.h"

namespace crownfit {

ColourTransform ReadColourTransform(const std::filesystem::path& file);

/// Sensor value of a perfectly white Lambertian surface, the file's "white_sensor_rgb".
glm::dvec3 ReadSensorWhite(const std::filesystem::path& file);

/// The transform and the white.
BandColour ReadBandColour(const std::filesystem::path& file);

/// The JSON content of such a file.
JsonValue::Object ColourContent(const BandColour& colour);

}  // namespace crownfit
