#pragma once
// A path-traced photograph with its derivatives by scattering, absorption, g, index, thickness and roughness.

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

/// VolumeLattice::ElementFor the material's shortest transport path, at least `shortest_resolved_mm`.
double ElementFor(const std::vector<TriangleMesh>& surfaces, const Material& material, double shortest_resolved_mm);

/// The bodies that materials' thicknesses shape; the last few are cached.
class Bodies {
 public:
  Bodies(const CrownInput& input, int threads) : input_(input), threads_(threads) {}
  /// The reference stays valid until four others were requested.
  const LayeredBody& Of(const Material& material);
  /// The lattice over that body that resolves the material's transport paths.
  const VolumeLattice& LatticeOf(const Material& material);
  /// From now on lattices count shorter transport paths as this long; 0: no limit.
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

/// Parameters that need finite differences of pictures: thicknesses that shape the crown, indices, roughness.
std::vector<DerivativeParameter> DifferencedParameters(const Capture& capture);
inline DerivativeParameter RoughnessOf(const Capture& capture) { return {capture.layers.size(), Quantity::kRoughness}; }

/// Derivatives by scattering, absorption and g come from the paths themselves. Derivatives by `differenced` parameters
/// come from pictures with changed values and the same random numbers (thickness by +-20 % and the parabola through
/// three points: smaller steps have ten times the noise and no less bias). Photographs that share walks
/// (RenderTogether) share their groups of paths. `stage` labels the progress.
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
