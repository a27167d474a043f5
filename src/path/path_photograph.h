#pragma once
// The `path` model: photographs path-traced from the camera through nested layers to the lamps. It is the reference for
// the other models. docs/path_model.md describes the model and its verification.

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "diffusion/volume_lattice.h"
#include "optics/material.h"
#include "path/path_options.h"
#include "path/pixel_estimate.h"
#include "path/random_walk.h"

namespace crownfit {

struct Capture;

/// Means over groups of a pixel's paths, per layer: derivatives of the value by ln reduced scattering, ln
/// absorption and g, and their zero-mean control variates (score_derivatives.h).
struct GroupDerivatives {
  SpectrumArray<> scattering, absorption, asymmetry, scattering_control, asymmetry_control;
  size_t size() const { return scattering.size(); }
};

struct PathPhotograph {
  int width = 0, height = 0;
  std::vector<size_t> rendered;       ///< pixels of the picture, y * width + x, in order
  std::vector<PixelEstimate> pixels;  ///< of `rendered`; exposure 1
  WalkCounters counters;
  Estimator estimator = Estimator::kExits;  ///< kExits too where cells do not resolve light before its first collision
  static constexpr size_t kMaxGroups = 16;
  size_t layers = 0, groups = 0;  ///< groups of a pixel's samples, each with its own means
  SpectrumArray<> group_values;   ///< index rank * groups + group
  GroupDerivatives derivatives;   ///< index (rank * groups + group) * layers + layer

  static constexpr uint32_t kNotRendered = 0xffffffff;
  std::shared_ptr<const std::vector<uint32_t>> ranks;  ///< per pixel, its index in `rendered`; may be shared
  uint32_t RankOf(size_t place) const { return (*ranks)[place]; }
};

/// Covariances of pixel means by rank, averaged over neighbours (on the object, or off it) without the pixel itself. A
/// pixel's own estimate correlates with its value, so weights that use it favour dark pixels. Even a share of 1 / 49
/// makes photographs of rare bright paths 8 % too dark at 48 paths a pixel.
std::vector<ChannelCovariance> SmoothedCovariance(const PathPhotograph& photo);

/// Means over the nearest neighbours likewise: the derivative by exposure, without the noise that the pixel shares with
/// its residual.
std::vector<Spectrum> SmoothedMeans(const PathPhotograph& photo);

/// Renders one photograph. `body`: of BuildSurfaces; `scenery`: all of the capture's, in its order. Every pixel's
/// numbers depend on seed, photograph and pixel alone: the same bytes for any number of threads.
PathPhotograph RenderByPaths(const Capture& capture, const LayeredBody& body, const std::vector<TriangleMesh>& scenery,
                             const Material& material, size_t photograph, const PathOptions& options,
                             const std::function<void(double)>& progress);

/// Renders several photographs that can share walks (WhichShareWalks) with the same walks, in little more time than
/// one. A picture's values are those of RenderByPaths up to noise. The noise is common to the pictures, group by group
/// of their paths. The first picture holds the counters of all.
std::vector<PathPhotograph> RenderTogether(const Capture& capture, const LayeredBody& body,
                                           const std::vector<TriangleMesh>& scenery, const Material& material,
                                           const std::vector<size_t>& photographs, const PathOptions& options,
                                           const std::function<void(double)>& progress);

/// Groups of photographs by one camera in one pose, with the same tile in contact with the object, if any: positions
/// in `photographs`.
std::vector<std::vector<size_t>> WhichShareWalks(const Capture& capture, const std::vector<size_t>& photographs);

}  // namespace crownfit
