#pragma once
// A light rig from photographs: places of lamps from mirror balls, intensities and colours from a card.

#include <string>
#include <vector>

#include "calibrate/mirror_ball.h"
#include "calibrate/product.h"
#include "calibration/light_rig.h"

namespace crownfit {

/// One photograph of mirror balls under one lamp.
struct BallPhotograph {
  std::string light;
  const Image* linear;
  std::vector<BallOutline> balls;
};

/// Directions, or places where two balls show the lamp from different sides and its distance is known to 30 %; in the
/// camera frame, irradiance 1 at the balls. Notes say what could not be found.
std::vector<Light> LightsFromBalls(const std::vector<BallPhotograph>& photographs, const Camera* camera,
                                   double radius_mm, std::vector<std::string>& notes);

/// The photographs with their balls outlined and the reflections that were taken for the lamp.
Image BallsPicture(const std::vector<BallPhotograph>& photographs);

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

/// What cards say of one lamp.
struct CardFit {
  Light light;             ///< in the camera frame of the cards, its intensity found, its place refined if asked
  glm::dvec3 stddev{0.0};  ///< of the intensity, relative, per channel
  double rms = 0;          ///< of what is left of the readings, relative
  double moved_mm = 0;     ///< by the refinement
  struct Sample {
    glm::dvec2 pixel;
    double left;  ///< reading over prediction, less 1
  };
  std::vector<std::vector<Sample>> samples;  ///< per photograph
};

/// Fits the intensity of `start` (in the camera frame) to all cards under it; with `refine`, its place as well, whose
/// standard deviation (5 mm along each axis where not stated) holds it, and which is then known as the cards' own
/// residuals allow. Nothing when no pixel could be read.
std::optional<CardFit> FitCards(const Light& start, const std::vector<const CardPhotograph*>& cards, bool refine);

/// light_rig.json with its figures, gates and picture.
Product LightsProduct(const std::vector<Light>& geometry, const std::vector<CardPhotograph>& cards, bool refine,
                      std::vector<std::string> notes);

}  // namespace crownfit
