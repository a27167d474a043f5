#pragma once
// Instrument readings of flat samples of a capture's material.

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
/// all. By reciprocity each also stands for its reverse.
enum class MeasuredAt {
  k0_D,   ///< fraction of a beam along the normal
  k45_0,  ///< radiance factor
  kD_8,   ///< radiance factor, lit from all around
  kD_D    ///< fraction of diffuse light
};

/// One value per band, or L*, a*, b*.
struct Reading {
  Spectrum value, stddev;
};

/// Glass in optical contact before and behind a sample.
struct Slide {
  double ior = 1.5, thickness_mm = 1.0;
};

struct FlatMeasurement {
  std::string name;
  std::string sample;                ///< entries with the same name are of one piece; empty: a piece of its own
  std::vector<double> thickness_mm;  ///< per layer of the capture
  double thickness_stddev_mm = 0;    ///< of each layer independently
  MeasuredAt geometry = MeasuredAt::k0_D;
  bool has_specular = false;          ///< the reflectance includes the first surface's specular reflection
  std::optional<size_t> backing;      ///< index in the capture; absent: air
  std::optional<double> aperture_mm;  ///< diameter that is lit and seen; absent: wide
  std::optional<Slide> slide;         ///< absent: air
  std::optional<Reading> reflectance, transmittance, lab;
  BandColour colour;  ///< by which `lab` was computed
  bool is_holdout = false;
};

/// What a measurement may refer to.
struct MeasurementContext {
  size_t layers;
  std::vector<double> wavelengths_nm;                          ///< of the channels
  std::function<size_t(const JsonNode&)> backing;              ///< index of a backing by name
  std::function<std::filesystem::path(const JsonNode&)> file;  ///< a path in the capture
};

/// Reads one entry of "measurements". Throws InputError.
FlatMeasurement ReadFlatMeasurement(const JsonNode& node, const MeasurementContext& context);

}  // namespace crownfit
