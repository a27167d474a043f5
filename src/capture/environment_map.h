#pragma once
// Light from all around, as a latitude-longitude picture.

#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "photo/image.h"

namespace crownfit {

/// Constant over each pixel. +y is up, the picture's centre lies along +z, a quarter of the width to its left along +x
/// (the convention of OpenEXR).
class EnvironmentMap {
 public:
  /// Linear radiance, nowhere negative and not black. One channel stands for all channels.
  explicit EnvironmentMap(Image radiance);

  Spectrum Radiance(const glm::dvec3& direction) const;
  /// Maps two uniform numbers to a direction, distributed as the mean of the channels.
  glm::dvec3 Sample(const glm::dvec2& uniform) const;
  double Density(const glm::dvec3& direction) const;  ///< of Sample, per steradian

  /// A part of the map, as one distant lamp.
  struct FarLamp {
    glm::dvec3 direction{0, 0, 1};  ///< unit, mean direction of its light
    Spectrum irradiance;            ///< on a surface that faces it
    double radius_rad = 0;          ///< of a disk whose light has the same spread
    glm::dvec2 low, high;           ///< its bounds in the map, as fractions of width and height from the upper left

    bool Holds(const glm::dvec2& place) const {
      return place.x >= low.x && place.x < high.x && place.y >= low.y && place.y < high.y;
    }
  };
  /// The whole map as up to `at_most` (a power of two is taken, at most 512) far lamps. The part with the largest
  /// spread is cut in two where the remaining spread is least (Viriyothai and Debevec 2009, variance minimization light
  /// probe sampling; here about mean directions). Unlike random samples, this keeps small lamps of every colour.
  std::span<const FarLamp> FarLamps(size_t at_most) const;
  /// Position of a direction, as fractions of width and height from the upper left.
  static glm::dvec2 PlaceOf(const glm::dvec3& direction);

 private:
  void CutIntoLamps();
  size_t PixelOf(const glm::dvec3& direction) const;
  double SolidAngle(int row) const;
  Image radiance_;
  std::vector<double> row_ends_;     ///< cumulative, up to 1
  std::vector<double> column_ends_;  ///< cumulative within each row
  double total_ = 0;                 ///< integral of the mean of the channels
  std::vector<FarLamp> far_lamps_;   ///< for 1 part, 2 parts, 4, ...
};

/// Reads the picture; sRGB-encoded files are decoded. It has the capture's `channels`, or one for all. Throws
/// InputError.
std::shared_ptr<const EnvironmentMap> ReadEnvironmentMap(const std::filesystem::path& file,
                                                         const std::vector<std::string>& channels = {});

}  // namespace crownfit
