#pragma once
// The `path` model: photographs by random walks from the camera through nested layers to the lamps. The truth that the
// other models are measured against; docs/path_model.md says what it models and what it was checked with.

#include <functional>
#include <memory>
#include <vector>

#include "diffusion/volume_lattice.h"
#include "optics/material.h"
#include "path/path_options.h"
#include "path/random_walk.h"

namespace crownfit {

struct Capture;

/// Mean of a pixel and the covariance of that mean, per channel pair RR RG RB GG GB BB.
struct PixelEstimate {
  glm::dvec3 mean{0.0};
  std::array<double, 6> covariance{};
  bool on_object = false;  ///< the ray through the pixel's centre meets the object
  glm::dvec3 variance() const { return {covariance[0], covariance[3], covariance[5]}; }
};

/// Means over a group of one pixel's paths, of one layer: derivatives of the value by ln reduced scattering, ln
/// absorption and g, and their zero-mean controls (score_derivatives.h).
struct GroupDerivatives {
  glm::vec3 scattering{0.0f}, absorption{0.0f}, asymmetry{0.0f}, scattering_control{0.0f}, asymmetry_control{0.0f};
};

struct PathPhotograph {
  int width = 0, height = 0;
  std::vector<size_t> rendered;       ///< places in the picture, y * width + x, in order
  std::vector<PixelEstimate> pixels;  ///< of those; exposure 1
  WalkCounters counters;
  static constexpr size_t kMaxGroups = 16;
  size_t layers = 0, groups = 0;              ///< groups of a pixel's samples, each with means of its own
  std::vector<glm::vec3> group_values;        ///< index rank * groups + group
  std::vector<GroupDerivatives> derivatives;  ///< index (rank * groups + group) * layers + layer

  static constexpr uint32_t kNotRendered = 0xffffffff;
  std::shared_ptr<const std::vector<uint32_t>> ranks;  ///< per place, where in `rendered`; photographs may share it
  uint32_t RankOf(size_t place) const { return (*ranks)[place]; }
};

/// Covariances of pixel means by rank, averaged over neighbours (on the object, or off it), without the pixel itself:
/// its own estimate goes up and down with its value, and weights that know of it favour the dark ones. Even a share of
/// 1 / 49 makes photographs of rare bright paths 8 % too dark at 48 paths a pixel.
std::vector<std::array<double, 6>> SmoothedCovariance(const PathPhotograph& photo);

/// Means over the nearest neighbours likewise: what a derivative by exposure is, without the noise of the pixel itself,
/// that what is left of it shares.
std::vector<glm::dvec3> SmoothedMeans(const PathPhotograph& photo);

/// Renders one photograph. `body`: of BuildSurfaces; `scenery`: all of the capture's, in its order. Every pixel's
/// numbers depend on seed, photograph and pixel alone: the same bytes for any number of threads.
PathPhotograph RenderByPaths(const Capture& capture, const LayeredBody& body, const std::vector<TriangleMesh>& scenery,
                             const Material& material, size_t photograph, const PathOptions& options,
                             const std::function<void(double)>& progress);

/// Several photographs that can share walks (WhichShareWalks), by the same walks: the time of little more than one. A
/// picture's values are those of RenderByPaths up to their noise, which the pictures have in common: group by group of
/// their paths. Counters of all are the first picture's.
std::vector<PathPhotograph> RenderTogether(const Capture& capture, const LayeredBody& body,
                                           const std::vector<TriangleMesh>& scenery, const Material& material,
                                           const std::vector<size_t>& photographs, const PathOptions& options,
                                           const std::function<void(double)>& progress);

/// Groups of photographs by one camera in one pose, with the same tile in contact with the object, if any: positions
/// in `photographs`.
std::vector<std::vector<size_t>> WhichShareWalks(const Capture& capture, const std::vector<size_t>& photographs);

}  // namespace crownfit
