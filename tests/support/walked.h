#pragma once
// Path-traced images of known scenes, and means with errors.

#include <gtest/gtest.h>

#include <cmath>

#include "path/path_photograph.h"
#include "scene/crown_source.h"
#include "support/known_scene.h"

namespace crownfit {

/// Mean and standard error of independent samples.
struct Mean {
  double sum = 0, square = 0;
  int n = 0;
  double stated = 0;  ///< standard error from elsewhere
  void Add(double x) { sum += x, square += x * x, ++n; }
  double value() const { return sum / n; }
  double error() const { return std::sqrt(std::max(0.0, square / n - value() * value()) / (n - 1)); }
};

/// Unit vector at a polar angle and azimuth about z.
inline glm::dvec3 Towards(double polar, double azimuth) {
  return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)};
}

/// Moves the camera.
inline void LookAtOriginFrom(const glm::dvec3& place, KnownScene& scene) {
  const glm::dvec3 z = -glm::normalize(place), x = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), z)),
                   y = glm::cross(z, x);
  RigidTransform& pose = scene.capture.photographs[0].camera_from_object;
  pose.rotation = glm::transpose(glm::dmat3(x, y, z));
  pose.translation_mm = {0, 0, glm::length(place)};
}

inline LayeredBody BodyOf(const KnownScene& scene) {
  return {BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture)), 0, scene.source.absorption};
}

/// Mean over the pixels on the object, of the green channel, with the standard error that the pixels state.
inline Mean RenderedMean(const KnownScene& scene, int paths, uint64_t seed = 1) {
  const LayeredBody body = BodyOf(scene);
  const PathPhotograph photo = RenderByPaths(scene.capture, body, scene.scenery, StatedMaterial(scene.capture), 0,
                                             {paths, seed, 0, 0}, [](double) {});
  EXPECT_LE(photo.counters.lost_share(), 1e-5);
  Mean mean;
  double variance = 0;
  for (const PixelEstimate& p : photo.pixels)
    if (p.on_object) mean.Add(p.mean[1]), variance += p.covariance[3];
  mean.stated = std::sqrt(variance) / mean.n;
  return mean;
}

inline void SetLayer(KnownScene& scene, size_t layer, double ior, double g, double reduced_scattering,
                     double absorption) {
  LayerSpec& l = scene.capture.layers[layer];
  l[Quantity::kIor].value.fill(ior);
  l[Quantity::kAsymmetry].value.fill(g);
  l[Quantity::kReducedScattering].value.fill(reduced_scattering);
  l[Quantity::kAbsorption].value.fill(absorption);
}

inline void SetSurface(KnownScene& scene, double roughness, double wetness) {
  scene.capture.surface[static_cast<size_t>(Quantity::kRoughness)].value.fill(roughness);
  scene.capture.surface[static_cast<size_t>(Quantity::kWetness)].value.fill(wetness);
}

}  // namespace crownfit
