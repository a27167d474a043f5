#pragma once
// The crown's geometry: nested closed surfaces, and the outer one as a fine mesh on which light is gathered.

#include <array>
#include <vector>

#include "geometry/ray_caster.h"
#include "geometry/triangle_mesh.h"
#include "photo/spectrum.h"
#include "scene/tap_kernel.h"

namespace crownfit {

/// A length in the outer layer: scaled with its thickness where a ray hit the inner layer, fixed where it missed.
struct OuterLength {
  double fixed_mm = 0, scaled_mm = 0;
  double total_mm() const { return fixed_mm + scaled_mm; }
  void Add(double weight, const OuterLength& other) {
    fixed_mm += weight * other.fixed_mm;
    scaled_mm += weight * other.scaled_mm;
  }
};

/// A straight line through the object, inward from its surface.
struct Chord {
  OuterLength front;    ///< in the outer layer on this side (half the chord where the inner layer is missed)
  OuterLength back;     ///< in the outer layer beyond the inner one
  double total_mm = 0;  ///< 0: the ray misses the object at a sharp corner
};

/// The object below one vertex of the outer surface, for the shader model: flat layers in which light that enters here
/// travels about as far as in the object. Their thickness is the mean over cosines of chord times cosine. That is the
/// thickness itself where layers are flat, and half the mean chord of cosine-distributed rays; its mean over a convex
/// body is 2 V / S. So weak absorption attenuates light that enters from everywhere as in the body, for any scattering
/// (Blanco and Fournier 2003). Chords that leave far to the side count as the straight one: scattered light does not go
/// there.
struct Column {
  OuterLength front;    ///< outer layer on this side
  OuterLength back;     ///< outer layer beyond the inner one
  double total_mm = 0;  ///< from side to side
  Chord straight;       ///< along the inward normal, for display
};

struct Crown {
  std::vector<TriangleMesh> surfaces;  ///< outer surface of each layer, outermost first
  std::vector<double> thickness_mm;    ///< per layer: area mean of the distance to the next one (last: to the far side)
  std::vector<RayCaster> casters;      ///< one per surface
  TriangleMesh fine;                   ///< surfaces[0], refined; its vertices carry the light
  std::vector<std::array<glm::dvec3, 3>> fine_corner_normals;
  std::vector<glm::dvec3> fine_vertex_normals;
  std::vector<Column> columns;             ///< per vertex of `fine`
  std::vector<Spectrum> outer_absorption;  ///< per vertex: factor of the outer layer's texture; empty: none
  TapKernel kernel;
  std::vector<int> first_tap;  ///< per vertex of `fine` + 1
  std::vector<Tap> taps;       ///< of one vertex: ring by ring
  RayCaster fine_caster{{}};
  TriangleMesh cut;  ///< of surfaces[0]: where the scan ends; empty when it is closed
  RayCaster cut_caster{{}};
  bool has_outer_layer() const { return surfaces.size() > 1; }
  double OuterAbsorption(size_t vertex, int channel) const {
    return outer_absorption.empty() ? 1.0 : outer_absorption[vertex][channel];
  }
};

/// Shading normal at a place of the fine surface.
glm::dvec3 ShadingNormal(const Crown& crown, const SurfacePoint& p);

}  // namespace crownfit
