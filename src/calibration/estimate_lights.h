#pragma once
// A light rig from photographs of cards: intensities and colours of lamps, and their refined positions.

#include <string>
#include <vector>

#include "calibration/product.h"
#include "capture/camera.h"
#include "capture/light_rig.h"
#include "capture/rigid_transform.h"

namespace crownfit {

/// One photograph of an even matt card under one lamp.
struct CardPhotograph {
  std::string light;
  const Image* linear;
  Camera camera;
  RigidTransform camera_from_card;  ///< the card lies in z = 0 of its frame, seen from negative z
  glm::dvec2 low_mm, high_mm;       ///< the part of it to be read
  glm::dvec3 reflectance;
  glm::dvec3 saturation;
};

/// Result for one lamp from its cards.
struct CardFit {
  Light light;             ///< in the camera frame of the cards; intensity fitted, position refined if asked
  glm::dvec3 stddev{0.0};  ///< of the intensity, relative, per channel
  double rms = 0;          ///< relative, of the readings' residuals
  double moved_mm = 0;     ///< by the refinement
  struct Sample {
    glm::dvec2 pixel;
    double left;  ///< reading over prediction, less 1
  };
  std::vector<std::vector<Sample>> samples;  ///< per photograph
};

/// Fits the intensity of `start` (in the camera frame) to all cards under it. With `refine`, it also fits the position,
/// with the stated standard deviation (or 5 mm along each axis) as prior. The refined position's covariance follows
/// from the cards' residuals. Absent when no pixel could be read.
std::optional<CardFit> FitCards(const Light& start, const std::vector<const CardPhotograph*>& cards, bool refine);

/// light_rig.json with its figures, gates and picture.
Product LightsProduct(const std::vector<Light>& geometry, const std::vector<CardPhotograph>& cards, bool refine,
                      std::vector<std::string> notes);

}  // namespace crownfit
