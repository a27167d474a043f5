#pragma once
// Light from all around, as a latitude-longitude picture.

#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "photo/image.h"

namespace crownfit {

/// Constant over each pixel. +y is up, the picture's centre lies along +z, a quarter of the width to its left along +x
/// (the convention of OpenEXR).
class EnvironmentMap {
 public:
  /// Linear radiance, three channels, nowhere negative and not black.
  explicit EnvironmentMap(Image radiance);

  glm::dvec3 Radiance(const glm::dvec3& direction) const;
  /// Two uniform numbers to a direction, distributed as the mean of the channels.
  glm::dvec3 Sample(const glm::dvec2& uniform) const;
  double Density(const glm::dvec3& direction) const;  ///< of Sample, per steradian

 private:
  size_t PixelOf(const glm::dvec3& direction) const;
  double SolidAngle(int row) const;
  Image radiance_;
  std::vector<double> row_ends_;     ///< cumulative, up to 1
  std::vector<double> column_ends_;  ///< cumulative within each row
  double total_ = 0;                 ///< integral of the mean of the channels
};

/// Reads the picture; sRGB-encoded files are decoded. Throws InputError.
std::shared_ptr<const EnvironmentMap> ReadEnvironmentMap(const std::filesystem::path& file);

}  // namespace crownfit
