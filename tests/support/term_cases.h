#pragma once
// Every shading term as a function of up to four numbers in its natural range: in double, as Jet, and as GLSL.

#include <ceres/jet.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "optics/shading_terms.h"

namespace crownfit {

struct TermCase {
  std::string name, call;  ///< call: as written in C++, with T:: before every term and arguments x[0], x[1], ...
  std::vector<std::pair<double, double>> ranges;
  std::function<double(const double*)> plain;
  std::function<ceres::Jet<double, 4>(const ceres::Jet<double, 4>*)> jet;
};

#define TERM_CASE(name, call, ...)                \
  TermCase {                                      \
    name, #call, {__VA_ARGS__},                   \
        [](const double* x) {                     \
          using T = Terms<double>;                \
          return call;                            \
        },                                        \
        [](const ceres::Jet<double, 4>* x) {      \
          using T = Terms<ceres::Jet<double, 4>>; \
          return call;                            \
        }                                         \
  }

inline std::vector<TermCase> TermCases() {
  return {
      TERM_CASE("ExpRatio", T::ExpRatio(x[0]), {-3, 3}),
      TERM_CASE("Fresnel", T::FresnelReflectance(x[0], x[1]), {0.1, 0.99}, {1.2, 1.8}),
      TERM_CASE("Refracted", T::RefractedCosine(x[0], x[1]), {0.1, 0.99}, {1.2, 1.8}),
      TERM_CASE("HG", T::HenyeyGreenstein(x[0], x[1]), {-0.5, 0.9}, {-0.9, 0.9}),
      TERM_CASE("GGX D", T::GgxDistribution(x[0], x[1]), {0.6, 0.99}, {0.1, 0.9}),
      TERM_CASE("GGX V", T::GgxVisibility(x[0], x[1], x[2]), {0.1, 1}, {0.1, 1}, {0.1, 0.9}),
      TERM_CASE("HK back", T::SingleScatterBackward(x[0], x[1], x[2]), {0.01, 5}, {0.3, 1}, {0.3, 1}),
      TERM_CASE("HK forward", T::SingleScatterForward(x[0], x[1], x[2]), {0.01, 5}, {0.3, 0.6}, {0.61, 1}),
      TERM_CASE("D", T::DiffusionCoefficient(x[0], x[1], x[2]), {0.1, 10}, {0.001, 1}, {0, 0.95}),
      TERM_CASE("flux", T::PointSourceFlux(x[0], x[1], x[2]), {0.01, 2}, {0.05, 3}, {0.1, 4}),
      TERM_CASE("slab R", T::SlabReflectance(x[0], x[0] + x[1], x[1], x[2], x[3], x[3]), {0.5, 5}, {0.05, 1}, {0.1, 5},
                {0.2, 3}),
      TERM_CASE("slab T", T::SlabTransmittance(x[0], x[0] + x[1], x[1], x[2], x[3], x[3]), {0.5, 5}, {0.05, 1},
                {0.1, 5}, {0.2, 3}),
      TERM_CASE("film", T::FilmReflectance(x[0], x[1]), {0, 0.9}, {0, 0.9}),
      TERM_CASE("wet", T::WetReflectance(x[0], x[1], x[2], x[3]), {0.1, 0.99}, {1.4, 1.8}, {1.1, 1.35}, {0, 1}),
      TERM_CASE("under film", T::SurfaceReflectionUnderFilm(x[0], x[0], x[1], x[2], x[3], x[0] + x[1], x[1] + 0.4),
                {0.5, 0.99}, {0.7, 0.99}, {0.5, 0.99}, {0.2, 0.9}),
      TERM_CASE("zeroth order", T::ZerothOrderTransmittance(x[0], x[1], x[2]), {0, 0.9}, {0, 0.9}, {0.01, 1}),
      TERM_CASE("Fdr outside", T::DiffuseFresnelOutside(x[0]), {1.2, 2.2}),
      TERM_CASE("Fdr inside", T::DiffuseFresnelInside(x[0]), {1.2, 2.2}),
      TERM_CASE("fluence moment", T::FresnelFluenceMomentInside(x[0]), {1.2, 2.2}),
      TERM_CASE("Fdr fit", T::DiffuseFresnelFit(x[0]), {1.2, 2.2}),
      TERM_CASE("A of moments", T::BoundaryParameterOfMoments(x[0], x[1]), {0, 0.8}, {0, 0.3}),
      TERM_CASE("Beckmann", T::BeckmannDistribution(x[0], x[1]), {0.6, 0.99}, {0.2, 0.9}),
      TERM_CASE("Kelemen", T::KelemenReflection(x[0], x[1], x[2], x[3]), {0.6, 0.99}, {0.2, 0.99}, {0.2, 0.9},
                {1.2, 1.8}),
      TERM_CASE("D classic", T::DiffusionCoefficientClassic(x[0], x[1]), {0.1, 10}, {0.001, 1}),
      TERM_CASE("D Grosjean", T::DiffusionCoefficientGrosjean(x[0], x[1]), {0.1, 10}, {0.001, 1}),
      TERM_CASE("dipole", T::DipoleProfile(x[0], x[1], x[2], x[1], x[3]), {0.5, 1}, {0.2, 2}, {0.01, 2}, {0, 4}),
      TERM_CASE("dipole total", T::DipoleReflectance(x[0], x[1], x[2], x[3]), {0.5, 1}, {0.2, 2}, {0.01, 2}, {0.2, 4}),
      TERM_CASE("multipole R", T::MultipoleReflectance(x[0], x[1], x[2], x[3], x[1], x[1]), {0.5, 1}, {0.1, 1},
                {0.01, 2}, {1, 4}),
      TERM_CASE("multipole T", T::MultipoleTransmittance(x[0], x[1], x[2], x[3], x[1], x[1]), {0.5, 1}, {0.1, 1},
                {0.01, 2}, {1, 4}),
      TERM_CASE("normalised diffusion", T::NormalisedDiffusionProfile(x[0], x[1], x[2]), {0.1, 0.75}, {0.2, 2},
                {0.1, 4}),
      TERM_CASE("normalised within", T::NormalisedDiffusionWithin(x[0], x[1], x[2]), {0.1, 0.75}, {0.2, 2}, {0, 4}),
      TERM_CASE("table place", T::TablePlace(x[0]), {0, 15}),
      TERM_CASE("table thickness", T::TableThickness(x[0]), {0.5, 20}),
      TERM_CASE("cubic", T::CubicWeight(-1, x[0]) + 3.0 * T::CubicWeight(0, x[0]) + T::CubicWeight(1, x[0]), {0, 1}),
      TERM_CASE("cubic last", T::CubicWeight(2, x[0]), {0.1, 0.9}),
      TERM_CASE("exit", T::ExitLobe(x[0], x[1]), {0.01, 0.9}, {0.02, 0.2})};
}

#undef TERM_CASE

}  // namespace crownfit
