#pragma once
// The light inside the object, per photograph, for camera walks that end after some collisions.
//
// Light is followed from lamps, tiles and scenery into the object and through as many collisions of the true random
// walk (light_rays.h). Its fluence is tallied on a lattice. One more flight with the reduced coefficient follows. The
// light scattered at its end is the source q of diffuse light:
//
//   -div(n^2 D grad psi) + n^2 absorption psi = q,   D = 1 / (3 (absorption + reduced scattering))
//
// (thesis, equation 4.12; Ishimaru 1978), for psi = fluence / n^2, which is continuous where the index steps. The
// boundary condition is J = n^2 psi / (2 A), A = (1 + 3 C2) / (1 - 2 C1) (thesis, equation 4.18 with its sign
// corrected; decision 8). Diffuse light that leaves and comes back off a tile or scenery enters again. The resistance
// of inner index steps is not modelled; its effect on totals is 0.2 to 0.6 %.
//
// A camera walk takes the mean radiance where it ends. So diffusion describes neither end of the light's path, where
// light is not yet or no longer diffuse. With more collisions the model converges to the random walk.

#include <array>
#include <vector>

#include "diffusion/volume_lattice.h"
#include "path/light_rays.h"
#include "path/path_context.h"
#include "path/score_derivatives.h"

namespace crownfit {

class LightFields {
 public:
  /// Fields of all the context's photographs, with derivatives by every layer's ln scattering and ln absorption where
  /// the context wants them. `lattice` must outlive the fields. `lit` and `seed` determine the light rays.
  LightFields(const PathContext& context, const VolumeLattice& lattice, const Lighting& lit, uint64_t seed,
              int threads);

  std::optional<LatticeStencil> At(const glm::dvec3& p) const {
    const auto place = lattice_->PlaceOf(p);
    return place ? std::optional(lattice_->StencilOf(*place)) : std::nullopt;
  }
  /// Mean radiance around a point, over the square of the index, for a walk that came from outside.
  glm::dvec3 Radiance(size_t photograph, const LatticeStencil& at) const { return Interpolated(photograph, 0, at); }
  /// Its derivatives by ln reduced scattering and ln absorption of a layer.
  glm::dvec3 ByScattering(size_t photograph, size_t layer, const LatticeStencil& at) const {
    return Interpolated(photograph, 1 + 2 * layer, at);
  }
  glm::dvec3 ByAbsorption(size_t photograph, size_t layer, const LatticeStencil& at) const {
    return Interpolated(photograph, 2 + 2 * layer, at);
  }

 private:
  glm::dvec3 Interpolated(size_t photograph, size_t which, const LatticeStencil& at) const {
    const std::vector<glm::vec3>& field = fields_[photograph * kinds_ + which];
    glm::dvec3 sum(0.0);
    for (int k = 0; k < 8; ++k) {
      const glm::vec3& v = field[at.node[k]];
      sum += at.weight[k] * glm::dvec3(v.x, v.y, v.z);
    }
    return sum;
  }
  const VolumeLattice* lattice_;
  size_t kinds_;                                ///< fields per photograph: values and derivatives
  std::vector<std::vector<glm::vec3>> fields_;  ///< index photograph * kinds + kind; per node
};

}  // namespace crownfit
