#pragma once
// Light transport geometry for the shader model, cast once per photograph; the material enters later.

#include <vector>

#include "scene/build_crown.h"
#include "scene/crown.h"
#include "scene/tap_kernel.h"

namespace crownfit {

struct CastOptions {
  int strata = 6;                 ///< per lamp: strata^2 directions (domes: four times as many)
  int gather_strata = 8;          ///< in which a vertex searches for scenery and backings
  CrownDetail crown = {};         ///< for BuildCrown
  double gloss_roughness = 0.15;  ///< lobe by which domes are sampled; any later roughness stays unbiased
  bool shade_scenery = false;  ///< also shade scenery and backing, as pixels or vertices show them (for whole pictures)
  int threads = 0;
};

/// Contribution of one light at one place, in one band of incidence: direct, or via scenery that it shines on. Means
/// are weighted with the irradiance.
struct LightShare {
  int light;
  double cos_incidence;
};
struct LightShares {
  std::vector<LightShare> each;
  SpectrumArray<double> irradiance;  ///< of each at intensity_scale 1, visibility and cosine included
};

struct BackingShare {
  Spectrum reflectance;  ///< reflectance x its fraction of the hemisphere x the object's fraction of its sky
};

/// A direction in which the surface reflects a lamp. Occlusion of lamps is known at the vertices and interpolated.
struct Highlight {
  int light;
  float cos_light, cos_half, cos_light_half;  ///< light.normal, half.normal, light.half
};
struct Highlights {
  std::vector<Highlight> each;
  SpectrumArray<> irradiance;  ///< of each: weight x cos x visibility
};

/// Reflection of a lamp by a smooth film over the surface, in one pixel.
struct Mirrored {
  int light;
  Spectrum radiance;  ///< mean over the pixel, for a perfect mirror
};

struct PixelCast {
  int x, y;
  bool at_silhouette;  ///< a corner of the pixel's square misses the object, or shows the cut at its neck
  float from_cut_mm;   ///< distance to that cut; infinite without one
  double cos_view;
  Interpolation at;  ///< of the values at the vertices around
  int first_highlight, highlight_count, first_mirrored, mirrored_count;
};

struct BackgroundPixel {
  int x, y;
  Spectrum value;  ///< pi x radiance of scenery or backing seen directly, direct light only
};

/// Scenery or a backing tile, with the values at its vertices: pi x radiance at exposure 1, direct light only.
struct ShadedMesh {
  TriangleMesh mesh;
  std::vector<Spectrum> front, back;  ///< on the side its normals point to, and on the other; a tile has no back
};

/// The light of one photograph at the vertices of the fine mesh.
struct VertexCast {
  std::vector<int> first_share;  ///< per vertex + 1
  LightShares vertex_shares;
  std::vector<BackingShare> backing;  ///< per vertex
  bool has_backing = false;
  std::vector<float> visibility;    ///< per vertex, for every light of the photograph in its order: share that arrives
  std::vector<ShadedMesh> scenery;  ///< if requested
};

/// One photograph's casts on one crown.
struct PhotographCast : VertexCast {
  glm::dvec3 camera{0.0};  ///< its place in the object's frame
  std::vector<PixelCast> pixels;
  Highlights highlights;
  std::vector<Mirrored> mirrored;
  std::vector<BackgroundPixel> background;
};

}  // namespace crownfit
