#pragma once
// Everything the shader model needs to know about where light goes, cast once per photograph: the material enters
// later.

#include <vector>

#include "calibration/capture.h"
#include "geometry/crown.h"

namespace crownfit {

/// Offsets at which irradiance is gathered around a point to blur it: groups of taps ("rings") at like distance.
struct TapKernel {
  struct Offset {
    glm::dvec2 mm;
    int ring;
  };
  std::vector<Offset> offsets;
  std::vector<double> outer_radius_mm;  ///< of every ring but the last, which reaches to infinity
  int rings() const { return static_cast<int>(outer_radius_mm.size()) + 1; }
};

/// Centre and 6 rings of 8 taps from 0.15 to 4.8 mm. optics/twelve_taps.h has the thesis's.
TapKernel ConvergedKernel();

struct CastOptions {
  int strata = 6;         ///< per lamp: strata^2 directions (domes: four times as many)
  int gather_strata = 8;  ///< in which a vertex looks for scenery and backings
  TapKernel kernel = ConvergedKernel();
  double gloss_roughness = 0.15;  ///< lobe by which domes are sampled; any later roughness stays unbiased
  bool shade_scenery = false;     ///< also shade the pixels that show scenery or backings (to render whole pictures)
  int threads = 0;
};

/// One light's share at one place, in one band of incidence: direct, or by way of scenery it shines on. Means are
/// weighted with the irradiance.
struct LightShare {
  int light;
  glm::dvec3 irradiance;  ///< per channel at intensity_scale 1, visibility and cosine included
  double cos_incidence;
  OuterLength outer_path;  ///< along the refracted direction
  double cos_light_view;   ///< pixels only: dot(towards the light, towards the camera)
};

struct BackingShare {
  glm::dvec3 reflectance{0.0};  ///< reflectance x share of the cosine-weighted hemisphere it fills
};

/// A direction in which the surface mirrors a lamp.
struct Highlight {
  int light;
  float cos_light, cos_half, cos_light_half;  ///< light.normal, half.normal, light.half
  glm::vec3 irradiance;                       ///< weight x cos, visibility included
};

/// What of a lamp a smooth film over the surface would show in one pixel.
struct Mirrored {
  int light;
  glm::vec3 radiance;  ///< mean over the pixel, of a perfect mirror
};

/// Three vertices of the fine mesh and their weights.
struct Interpolation {
  int vertices[3] = {-1, -1, -1};
  float weights[3] = {0, 0, 0};
  bool exists() const { return vertices[0] >= 0; }
};

struct Tap {
  int ring;
  Interpolation front, opposite;
  bool beyond_neck = false;  ///< below the cut of a scan, where a root is lit as the tooth is here
};

struct PixelCast {
  int x, y;
  bool at_silhouette;  ///< a corner of the pixel's square misses the object, or shows the cut at its neck
  float from_cut_mm;   ///< distance to that cut; infinite without one
  double cos_view;
  OuterLength outer_path;   ///< along the refracted view
  OuterLength front, back;  ///< as in Column
  double total_mm;
  glm::dvec3 outer_absorption{0.0};  ///< as in Column
  int first_tap, tap_count, first_share, share_count, first_highlight, highlight_count, first_mirrored, mirrored_count;
};

struct BackgroundPixel {
  int x, y;
  glm::dvec3 value;  ///< pi x radiance of scenery or backing seen directly, direct light only
};

/// One photograph's casts on one crown.
struct PhotographCast {
  std::vector<int> first_share;  ///< per vertex + 1
  std::vector<LightShare> vertex_shares;
  std::vector<BackingShare> backing;  ///< per vertex
  bool has_backing = false;
  std::vector<PixelCast> pixels;
  std::vector<Tap> taps;           ///< of one pixel: ring by ring
  std::vector<int> taps_per_ring;  ///< of the kernel, those beyond the object's edge included
  std::vector<LightShare> shares;
  std::vector<Highlight> highlights;
  std::vector<Mirrored> mirrored;
  std::vector<BackgroundPixel> background;
  TapKernel kernel;
};

/// Meshes of the capture's scenery, in the order of Capture::scenery.
std::vector<TriangleMesh> ReadScenery(const Capture& capture);

/// Casts one photograph: every pixel that shows the object, and scenery when options say so.
PhotographCast CastPhotograph(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery,
                              size_t photograph, const CastOptions& options);

}  // namespace crownfit
