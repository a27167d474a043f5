#pragma once
// Colours of single values: CIELAB, CIEDE2000.

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "photo/spectrum.h"

namespace crownfit {

/// Three channels as a vector.
inline glm::dvec3 VectorOf(const Spectrum& rgb) { return {rgb[0], rgb[1], rgb[2]}; }

/// CIELAB (D65) of linear sRGB; white is (1, 1, 1).
glm::dvec3 LabFromLinearRgb(const glm::dvec3& rgb);

/// CIE Y of linear sRGB; white is 1.
double LuminanceOf(const glm::dvec3& rgb);

/// The inverse of LabFromLinearRgb; may leave [0, 1].
glm::dvec3 LinearRgbFromLab(const glm::dvec3& lab);

/// Linear sRGB of X, Y, Z, each relative to D65's.
glm::dvec3 LinearRgbFromRelativeXyz(const glm::dvec3& xyz);

/// CIEDE2000 (Sharma, Wu and Dalal 2005), kL = kC = kH = 1.
double Ciede2000(const glm::dvec3& lab1, const glm::dvec3& lab2);

/// Linear sRGB (may leave [0, 1]) of CIELAB under D50, as charts are published.
glm::dvec3 LinearRgbFromLabD50(const glm::dvec3& lab);

/// Whether a picture's first, second and third band are red, green and blue light.
bool AreRedGreenBlue(std::span<const double> wavelengths_nm);

/// Within 10 nm, one by one.
bool AreSameBands(std::span<const double> some_nm, std::span<const double> others_nm);

/// "600, 540, 450 nm"
std::string BandsText(std::span<const double> wavelengths_nm);

/// From a camera's own values to linear sRGB.
struct ColourTransform {
  /// Linear sRGB of each channel's value 1. Empty: three channels are linear sRGB themselves, and the mean of any other
  /// number is shown as grey.
  std::vector<glm::dvec3> columns = {};
  /// Used instead if present: columns for r, g, b, sqrt(rg), sqrt(gb), sqrt(rb) (Finlayson, Mackiewicz and Hurlbert
  /// 2015). As with a matrix, twice the light gives twice the colour.
  std::optional<std::array<glm::dvec3, 6>> root_polynomial = {};
  glm::dvec3 operator()(const Spectrum& sensor) const;
};

/// From a surface's reflectances in the camera's bands to its colour; white is 1.
struct BandColour {
  ColourTransform rgb_from_sensor;
  Spectrum white_sensor = Spectrum(1.0);
  glm::dvec3 LinearRgb(const Spectrum& reflectance) const { return rgb_from_sensor(white_sensor * reflectance); }
  /// The reflectance of `channels` channels that has the given colour: in closed form for a matrix, else by Newton's
  /// method. Of several, it is the one nearest to a grey of the same luminance. Throws InputError where there is none.
  Spectrum Reflectance(const glm::dvec3& linear_rgb, int channels = 3) const;
};

/// The six terms of a root polynomial of the second degree.
std::array<double, 6> RootTerms(const glm::dvec3& sensor);

}  // namespace crownfit
