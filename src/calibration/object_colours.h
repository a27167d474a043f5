#pragma once
// Colours that separate an object from its surroundings in a photograph.

#include <vector>

#include "capture/camera.h"
#include "capture/rigid_transform.h"
#include "geometry/ray_caster.h"
#include "photo/image.h"

namespace crownfit {

/// Pixels whose rays meet the object. Directions are computed once.
class Silhouette {
 public:
  explicit Silhouette(const Camera& camera) : width_(camera.width), height_(camera.height) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) directions_.push_back(DirectionFromPixel(camera, {x + 0.5, y + 0.5}));
  }
  std::vector<uint8_t> Mask(const RayCaster& caster, const RigidTransform& camera_from_object) const {
    const RigidTransform back = camera_from_object.Inverse();
    std::vector<uint8_t> mask(directions_.size());
    for (size_t i = 0; i < directions_.size(); ++i)
      mask[i] = caster.Occluded(back.translation_mm, back.Direction(directions_[i]));
    return mask;
  }
  int width() const { return width_; }

 private:
  int width_, height_;
  std::vector<glm::dvec3> directions_;
};

/// Log odds of object against surroundings by colour: the red and blue fractions of the light, and its amount.
struct ColourOdds {
  static constexpr int kShares = 24, kLevels = 6;
  std::vector<double> odds = std::vector<double>(kShares * kShares * kLevels, 0.0);
  double contrast = 0;

  /// Learned from a picture and a mask of the object; its surroundings are what lies within a tenth of the picture.
  ColourOdds(const Image& image, const std::vector<uint8_t>& mask, double white);
  static int BinOf(const Image& image, size_t pixel, double white);
};

/// A photograph, reduced by a whole factor.
struct Level {
  Image image;
  Camera camera;
  double white;  ///< its 98th percentile
  Level(const Image& linear, const Camera& of_linear, int factor);
};

/// Log odds of every pixel, limited so that no single colour decides.
Image OddsImage(const Level& level, const ColourOdds& colours);

}  // namespace crownfit
