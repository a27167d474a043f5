#pragma once
// What an instrument has read of a flat sample of a capture's material.

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/json_file.h"
#include "capture/parameters.h"
#include "photo/colour.h"

namespace crownfit {

/// Light from / detector at, degrees from the normal, as CIE 15 names it; d is diffuse light, or a sphere that collects
/// all. By reciprocity each stands for its reverse too.
enum class MeasuredAt {
  k0_D,   ///< share of a beam along the normal
  k45_0,  ///< radiance factor
  kD_8,   ///< radiance factor, all around lit
  kD_D    ///< share of diffuse light
};

/// One value per band, or L*, a*, b*.
struct Reading {
  std::array<double, kChannels> value{}, stddev{};
};

/// Glass in optical contact before and behind a sample.
struct Slide {
  double ior = 1.5, thickness_mm = 1.0;
};

struct FlatMeasurement {
  std::string name;
  std::string sample;                ///< entries that name the same are of one piece; empty: of none that another is of
  std::vector<double> thickness_mm;  ///< per layer of the capture
  double thickness_stddev_mm = 0;    ///< of each layer by itself
  MeasuredAt geometry = MeasuredAt::k0_D;
  bool has_specular = false;          ///< the reflectance contains what the first surface mirrors
  std::optional<size_t> backing;      ///< of the capture; nothing: air
  std::optional<double> aperture_mm;  ///< diameter that is lit and seen; nothing: wide
  std::optional<Slide> slide;         ///< nothing: air
  std::optional<Reading> reflectance, transmittance, lab;
  BandColour colour;  ///< what `lab` was found with
  bool is_holdout = false;
};

/// What a measurement may refer to.
struct MeasurementContext {
  size_t layers;
  std::function<size_t(const JsonNode&)> backing;              ///< its index by name
  std::function<std::filesystem::path(const JsonNode&)> file;  ///< a path in the capture
};

/// Reads one entry of "measurements". Throws InputError.
FlatMeasurement ReadFlatMeasurement(const JsonNode& node, const MeasurementContext& context);

}  // namespace crownfit
