// Diffusion profiles of dentine by every model, as CSV for thesis_figures.py: ring means of the light that leaves per
// mm^2 around a pencil beam. usage: profile_study [PHOTONS]

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "path/slab_walk.h"
#include "shader/diffuser_table.h"

namespace {

using namespace crownfit;
using Term = Terms<double>;

constexpr double kReducedScattering = 2.0, kAbsorption = 0.07, kG = 0.93, kIor = 1.54;
constexpr double kHalfSpace_mm = 60.0;

/// Mean of a profile over a ring.
template <class Profile>
double RingMean(const Profile& profile, double inner, double outer) {
  constexpr int kSteps = 64;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double r = std::sqrt(inner * inner + (i + 0.5) / kSteps * (outer * outer - inner * inner));
    sum += profile(r) / kSteps;
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  SlabWalkOptions options;
  options.photons = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1000000;
  std::vector<double> radii;
  for (int i = 0; i <= 28; ++i) radii.push_back(i == 0 ? 0.0 : 0.05 * std::pow(160.0, (i - 1) / 27.0));
  std::printf(
      "thickness_mm,inner_mm,outer_mm,path,path_stddev,transmitted,transmitted_stddev,model,model_transmitted,"
      "dipole,normalised\n");
  for (const double thickness : {0.5, 1.0, 2.0, kHalfSpace_mm}) {
    Slab slab;
    slab.layers = {{kIor, kG, 0.0, kReducedScattering / (1 - kG), kAbsorption, thickness}};
    slab.radii_mm = radii;
    const SlabAnswer walked = SolveByWalks(slab, options, [](double) {});
    const double share = 1 - walked.specular;  // the models' light is counted below the surface

    DiffusingStack<double> stack;
    stack.inner = {kReducedScattering, kAbsorption, kG, kIor};
    stack.boundary = {kIor};
    const DiffuserTable<double> table(stack, {radii.begin() + 1, radii.end()});
    const auto place = table.At(0.0, thickness);
    const double extinction = kReducedScattering + kAbsorption,
                 diffusion = Term::DiffusionCoefficient(kReducedScattering, kAbsorption, kG),
                 transport = std::sqrt(Term::TransportSquared(kAbsorption, diffusion)),
                 zb = 2 * MomentsOf(kIor).boundary_A * diffusion;
    const auto dipole = [&](double r) {
      return Term::DipoleProfile(kReducedScattering / extinction, 1 / extinction, transport, zb, r);
    };
    const double albedo = walked.value.reflectance_collimated / share;
    const auto within = [&](double r) { return albedo * Term::NormalisedDiffusionWithin(albedo, 1 / extinction, r); };
    for (size_t i = 0; i + 1 < radii.size(); ++i) {
      // Shares of the table's rings, whose windows overlap, add up to all the light, as those of rings do.
      const double a = radii[i], b = radii[i + 1], area = std::numbers::pi * (b * b - a * a);
      const int ring = static_cast<int>(i);
      std::printf("%g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", thickness, a, b,
                  walked.radial_reflectance_per_mm2[i] / share, walked.radial_reflectance_stddev[i] / share,
                  walked.radial_transmittance_per_mm2[i] / share, walked.radial_transmittance_stddev[i] / share,
                  table.Reflected(place, ring) / area, table.Transmitted(place, ring) / area, RingMean(dipole, a, b),
                  (within(b) - within(a)) / area);
    }
  }
}
