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
  Spectrum Radiance(size_t photograph, const LatticeStencil& at) const { return Interpolated(photograph, 0, at); }
  /// Its derivatives by ln reduced scattering and ln absorption of a layer.
  Spectrum ByScattering(size_t photograph, size_t layer, const LatticeStencil& at) const {
    return Interpolated(photograph, 1 + 2 * layer, at);
  }
  Spectrum ByAbsorption(size_t photograph, size_t layer, const LatticeStencil& at) const {
    return Interpolated(photograph, 2 + 2 * layer, at);
  }

 private:
  Spectrum Interpolated(size_t photograph, size_t which, const LatticeStencil& at) const {
    const SpectrumArray<>& field = fields_[photograph * kinds_ + which];
    Spectrum sum(field.channels(), 0.0);
    for (int c = 0; c < sum.size(); ++c) {
      double of_channel = 0;
      for (size_t k = 0; k < 8; ++k) of_channel += at.weight[k] * field.at(static_cast<size_t>(at.node[k]), c);
      sum[c] = of_channel;
    }
    return sum;
  }
  const VolumeLattice* lattice_;
  size_t kinds_;                         ///< fields per photograph: values and derivatives
  std::vector<SpectrumArray<>> fields_;  ///< index photograph * kinds + kind; per node
};

}  // namespace crownfit
