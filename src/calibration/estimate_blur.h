#pragma once
// Sharpness and stray light from a slanted dark square on white (after ISO 12233's slanted edge): the point spread as a
// sum of Gaussians, and veiling glare.

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "calibration/product.h"
#include "photo/image_io.h"

namespace crownfit {

/// A straight edge between a dark and a light side, in pixels; dark lies to the left of from -> to.
struct Edge {
  glm::dvec2 from, to;
};

/// Fit of one edge in one channel. The blur does not include the averaging over a pixel's square.
struct EdgeFit {
  double dark, light;                           ///< levels on both sides of the edge
  double sigma_px, wide_sigma_px, wide_weight;  ///< two Gaussians; weight 0: only one
  double stddev_px, wide_weight_stddev;
  double angle_deg;  ///< of the edge against the nearest row or column of pixels
  double rms;        ///< of the residuals over the step
  size_t pixels;
};

/// Edges of the largest dark quadrilateral that is not aligned with the pixels; empty when there is none.
std::vector<Edge> FindSlantedSquare(const ImageFile& photo);

/// Fits the blurred step to pixels within 12 of the edge's middle four fifths. Absent when they are too few, saturated
/// (from `saturation`) or without contrast.
std::optional<EdgeFit> FitEdge(const Image& linear, const Edge& edge, int channel, double saturation);

struct BlurInput {
  std::vector<Edge> edges;
  std::optional<double> dark_reflectance, light_reflectance;  ///< of ink and paper, for the veiling glare
  glm::dvec3 saturation{0.98};                                ///< of the channels
};

/// blur.json ("crownfit-blur/1") with its figures, gates and picture.
Product BlurProduct(const Image& linear, const BlurInput& input);

}  // namespace crownfit
