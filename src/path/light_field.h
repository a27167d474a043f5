#pragma once
// The light inside the object, photograph by photograph, for walks from the camera that end after some collisions.
//
// Light is followed from lamps, tiles and scenery into the object and through as many collisions of the true random
// walk (light_rays.h); its fluence is counted on a lattice. One more flight by the reduced coefficient, and what is
// scattered at its end is the source q of diffuse light:
//
//   -div(n^2 D grad psi) + n^2 absorption psi = q,   D = 1 / (3 (absorption + reduced scattering))
//
// (thesis, equation 4.12; Ishimaru 1978), for psi = fluence / n^2, which is continuous where the index steps; with the
// boundary J = n^2 psi / (2 A), A = (1 + 3 C2) / (1 - 2 C1) (thesis, equation 4.18 with its sign mended; decision 8).
// Light that leaves diffusely and comes back off a tile or scenery enters again. What is not modelled: the resistance
// of inner index steps, whose effect on totals is 0.2 to 0.6 %.
//
// A walk from the camera takes the mean radiance where it ends. So neither end of light's way, where it is not diffuse
// yet or no more, is left to diffusion, and with more collisions the model becomes the random walk itself.

#include <array>
#include <vector>

#include "diffusion/volume_lattice.h"
#include "path/light_rays.h"
#include "path/path_context.h"
#include "path/score_derivatives.h"

namespace crownfit {

class LightFields {
 public:
  /// Of all the context's photographs; with derivatives by every layer's ln scattering and ln absorption where the
  /// context wants them. `lattice` must outlive it. `lit` and `seed`: which rays light is followed by.
  LightFields(const PathContext& context, const VolumeLattice& lattice, const Lighting& lit, uint64_t seed,
              int threads);

  std::optional<LatticeStencil> At(const glm::dvec3& p) const {
    const auto place = lattice_->PlaceOf(p);
    return place ? std::optional(lattice_->StencilOf(*place)) : std::nullopt;
  }
  /// Mean radiance around a place over the square of the index, as a walk that came in from outside sees it.
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
  size_t kinds_;                                ///< values, and derivatives
  std::vector<std::vector<glm::vec3>> fields_;  ///< index photograph * kinds + kind; per node
};

}  // namespace crownfit
