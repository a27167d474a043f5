#pragma once
// A photograph by walks with its derivatives by scattering, absorption, g, index, thickness and roughness.

#include <list>
#include <string>

#include "base/progress.h"
#include "path/pooled_derivatives.h"
#include "scene/crown_input.h"

namespace crownfit {

struct DifferentiatedPhotograph {
  PathPhotograph photo;
  PooledDerivatives derivatives;
};

/// The bodies that materials' thicknesses shape; the last few are kept.
class Bodies {
 public:
  Bodies(const CrownInput& input, int threads) : input_(input), threads_(threads) {}
  /// Stays until four others were asked for.
  const LayeredBody& Of(const Material& material);
  /// The lattice over that body which resolves the material's transport paths.
  const VolumeLattice& LatticeOf(const Material& material);
  /// From now on lattices take shorter ones for so long; 0: none.
  void ResolvePathsFrom(double shortest_mm) { shortest_resolved_mm_ = shortest_mm; }

 private:
  struct Built {
    std::vector<double> thicknesses;
    LayeredBody body;
    std::optional<VolumeLattice> lattice = {};
  };
  Built& BuiltFor(const Material& material);
  const CrownInput& input_;
  int threads_;
  double shortest_resolved_mm_ = 0;
  std::list<Built> built_;  ///< latest first
};

/// What pictures are needed for: thicknesses that shape the crown, indices, roughness.
std::vector<DerivativeParameter> DifferencedParameters(const Capture& capture);
inline DerivativeParameter RoughnessOf(const Capture& capture) { return {capture.layers.size(), Quantity::kRoughness}; }

/// By scattering, absorption and g from the paths themselves; by `differenced` parameters from pictures with those
/// changed and the same random numbers (thickness by +-20 % and the parabola through three: smaller steps have ten
/// times the noise and no less bias).
/// Photographs that share walks (RenderTogether) share their groups of paths. `stage` is for the progress.
std::vector<DifferentiatedPhotograph> DifferentiateByPaths(const CrownInput& input, Bodies& bodies,
                                                           const Material& material,
                                                           const std::vector<size_t>& photographs,
                                                           const PathOptions& options,
                                                           const std::vector<DerivativeParameter>& differenced,
                                                           const std::string& stage, Progress& progress);

/// Thickness is differentiated by its logarithm, like the coefficients; index, g and roughness as they are.
bool IsDifferentiatedByLogarithm(Quantity quantity);

/// "enamel.absorption_per_mm", "surface.roughness".
std::string NameOf(const DerivativeParameter& parameter, const Material& material);

}  // namespace crownfit
