#pragma once
// colour.json ("crownfit-colour/1"): from a camera's own values to linear sRGB, with one column per channel.

#include <filesystem>

#include "base/json_file.h"
#include "photo/colour.h"

namespace crownfit {

ColourTransform ReadColourTransform(const std::filesystem::path& file, int channels = 3);

/// Sensor value of a perfectly white Lambertian surface, the file's "white_sensor_rgb" or "white_sensor".
Spectrum ReadSensorWhite(const std::filesystem::path& file, int channels = 3);

/// The transform and the white.
BandColour ReadBandColour(const std::filesystem::path& file, int channels = 3);

/// The JSON content of such a file.
JsonValue::Object ColourContent(const BandColour& colour);

}  // namespace crownfit
