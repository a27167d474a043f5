#pragma once
// Every shading term over corners and the whole valid range of a capture, and beyond: in any number type, and as GLSL
// text.

#include <cmath>
#include <type_traits>
#include <vector>

#include "base/random.h"
#include "optics/shading_terms.h"

namespace crownfit {

// Cosines end where the terms' floors of 1e-6 begin.
/// An argument's range: its corners, and evenly between two ends, in the logarithm where `low` > 0.
struct Range {
  std::vector<double> corners;
  double low, high;
  bool has_slope = true;

  /// Half of the draws stand at corners.
  double Draw(uint64_t key) const {
    const double u = 2 * Uniform(key, 0);
    if (u < 1) return corners[static_cast<size_t>(u * static_cast<double>(corners.size()))];
    return low > 0 ? low * std::pow(high / low, u - 1) : low + (u - 1) * (high - low);
  }
};
inline const Range kAbsorption{{0, 1e-9, 1e3}, 1e-6, 1e3}, kScattering{{0, 1e-9, 1e4}, 1e-4, 1e4},
    kSome{{1e-3, 1e4}, 1e-3, 1e4}, kThickness{{0, 1e-9, 1e3}, 1e-4, 1e3}, kIor{{1, 1 + 1e-12, 1.5, 3}, 1, 3},
    kCosine{{1, 1.5e-6, 0.5}, 1.5e-6, 1}, kRoughness{{1, 0.01}, 0.01, 1}, kG{{-0.99, 0.999}, -0.99, 0.999},
    kG01{{0, 0.99}, 0, 0.99}, kAnyCosine{{-1, 0, 1}, -1, 1}, kShare{{0, 1}, 0, 1}, kBelowOne{{0, 0.95}, 0, 0.95},
    kSigned{{0, 1e-9, -1e-9, 0.05, -0.05, 700}, -50, 700}, kTransport{{1e-4, 1e3}, 1e-4, 1e3},
    kRadius{{0, 1e-6, 1e2}, 1e-4, 1e2}, kDepth{{1e-6, 10}, 1e-4, 1e2}, kZb{{1e-4, 1e2}, 1e-4, 1e2},
    kInside{{1e-6, 0.9}, 1e-4, 0.9}, kBeyond{{1, 1e3}, 1, 1e3}, kSmall{{0, 0.07, -0.07}, -0.07, 0.07};

/// The same without derivatives by it.
inline Range Plain(Range range) {
  range.has_slope = false;
  return range;
}

/// A term's name, the text of `call` (T:: before every term, arguments x[0], x[1], ...), the highest value energy
/// allows, and its arguments' ranges.
struct TermRow {
  const char *name, *call;
  double highest;
  std::vector<Range> ranges;
};

#define TERM_ROW(name, highest, call, ...)                               \
  see(TermRow{name, #call, highest, {__VA_ARGS__}}, [](const auto* x) {  \
    using T [[maybe_unused]] = Terms<std::remove_cvref_t<decltype(*x)>>; \
    return call;                                                         \
  })

/// Calls `see` with every row and its function of a pointer to the arguments.
template <class See>
void ForEachTerm(See&& see) {
  using std::sqrt;
  constexpr double any = HUGE_VAL;
  TERM_ROW("ExpRatio", any, T::ExpRatio(x[0]), kSigned);
  TERM_ROW("FresnelReflectance", 1, T::FresnelReflectance(x[0], x[1]), kCosine, kIor);
  TERM_ROW("FresnelReflectance, from inside", 1, T::FresnelReflectance(x[0], 1.0 / x[1]), kCosine, kIor);
  TERM_ROW("FresnelTransmittance", 1, T::FresnelTransmittance(x[0], x[1]), kCosine, kIor);
  TERM_ROW("RefractedCosine", 1, T::RefractedCosine(x[0], x[1]), kCosine, kIor);
  TERM_ROW("FilmReflectance", 1, T::FilmReflectance(x[0], x[1]), kShare, kBelowOne);
  TERM_ROW("WetReflectance", 1, T::WetReflectance(x[0], 0.4 + x[1], x[2] * 0.1 + 1.2, x[3]), kCosine, kIor, kShare,
           kShare);
  TERM_ROW("ZerothOrderTransmittance", 1, T::ZerothOrderTransmittance(x[0], x[1], x[2]), kShare, kBelowOne, kShare);
  TERM_ROW("FresnelMomentOutside", any, T::FresnelMomentOutside(x[0], 1) + 3.0 * T::FresnelMomentOutside(x[0], 2),
           kIor);
  TERM_ROW("DiffuseFresnelOutside", 1, T::DiffuseFresnelOutside(x[0]), kIor);
  TERM_ROW("DiffuseFresnelInside", 1, T::DiffuseFresnelInside(x[0]), kIor);
  TERM_ROW("FresnelFluenceMomentInside", 1, T::FresnelFluenceMomentInside(x[0]), kIor);
  TERM_ROW("DiffuseFresnelFit", 1, T::DiffuseFresnelFit(x[0]), kIor);
  TERM_ROW("BoundaryParameter", any, T::BoundaryParameter(x[0]), kBelowOne);
  TERM_ROW("BoundaryParameterOfMoments", any, T::BoundaryParameterOfMoments(x[0], x[1]), kBelowOne, kShare);
  TERM_ROW("HenyeyGreenstein", any, T::HenyeyGreenstein(x[0], x[1]), kG, kAnyCosine);
  TERM_ROW("GgxDistribution", any, T::GgxDistribution(x[0], x[1]), kCosine, kRoughness);
  TERM_ROW("GgxOfSquares", any, T::GgxOfSquares(x[0], x[1], x[2]), kShare, kCosine, kRoughness);
  TERM_ROW("GgxVisibility", any, T::GgxVisibility(x[0], x[1], x[2]), kCosine, kCosine, kRoughness);
  TERM_ROW("SurfaceReflection", any, T::SurfaceReflection(x[0], x[1], x[2], x[3], x[4], x[5]), kCosine, kCosine,
           kCosine, kCosine, kRoughness, kIor);
  TERM_ROW("SurfaceReflectionUnderFilm", any,
           T::SurfaceReflectionUnderFilm(x[0], x[1], x[2], x[3], x[4], 0.4 + x[5], 1.3 + 0.0 * x[0]), kCosine, kCosine,
           kCosine, kCosine, kRoughness, kIor);
  TERM_ROW("BeckmannDistribution", any, T::BeckmannDistribution(x[0], x[1]), kCosine, kRoughness);
  TERM_ROW("KelemenReflection", any, T::KelemenReflection(x[0], x[1], x[2], x[3]), kCosine, kCosine, kRoughness, kIor);
  TERM_ROW("Attenuation", 1, T::Attenuation(x[0], x[1]), kAbsorption, kThickness);
  TERM_ROW("SingleScatterBackward", any, T::SingleScatterBackward(x[0], x[1], x[2]), kThickness, kCosine, kCosine);
  TERM_ROW("SingleScatterForward", any, T::SingleScatterForward(x[0], x[1], x[2]), kThickness, kCosine, kCosine);
  TERM_ROW("SingleScatterReflection", any,
           T::SingleScatterReflection(x[0], 0.08 + 0.0 * x[0], x[1], x[2], x[3], x[4], x[5]), kShare, kShare, kIor,
           kThickness, kCosine, kCosine);
  TERM_ROW("DiffusionCoefficient", any, T::DiffusionCoefficient(x[0], x[1], x[2]), kSome, kAbsorption, kG);
  TERM_ROW("DiffusionCoefficientClassic", any, T::DiffusionCoefficientClassic(x[0], x[1]), kSome, kAbsorption);
  TERM_ROW("DiffusionCoefficientGrosjean", any, T::DiffusionCoefficientGrosjean(x[0], x[1]), kSome, kAbsorption);
  TERM_ROW("TransportSquared", any, T::TransportSquared(x[0], x[1]), kAbsorption, kSome);
  TERM_ROW("PointSourceFlux", 1, T::PointSourceFlux(x[0], x[1], x[2]), kTransport, kDepth, kRadius);
  TERM_ROW("DecayBetween", 1, T::DecayBetween(x[0], x[1], x[2]), kSome, kTransport, kThickness);
  TERM_ROW("SmallExpDifference", any, T::SmallExpDifference(x[0], x[1]), kSmall, kSmall);
  TERM_ROW("SlabReflectance", any, T::SlabReflectance(x[0], x[1], x[2], x[3], x[4], x[5]), kSome, kSome, kTransport,
           kThickness, kZb, kZb);
  TERM_ROW("SlabTransmittance", any, T::SlabTransmittance(x[0], x[1], x[2], x[3], x[4], x[5]), kSome, kSome, kTransport,
           kThickness, kZb, kZb);
  // Of a material: at most 1. Its derivatives are sums that nearly vanish for white slabs, whatever the terms keep.
  TERM_ROW("SlabReflectance, of a material", 1,
           T::SlabReflectance(x[0], x[0] + x[1],
                              sqrt(T::TransportSquared(x[1], T::DiffusionCoefficientGrosjean(x[0], x[1]))), x[2], x[3],
                              x[4]),
           Plain(kSome), Plain(kAbsorption), Plain(kThickness), Plain(kZb), Plain(kZb));
  TERM_ROW("SlabTransmittance, of a material", 1,
           T::SlabTransmittance(x[0], x[0] + x[1],
                                sqrt(T::TransportSquared(x[1], T::DiffusionCoefficientGrosjean(x[0], x[1]))), x[2],
                                x[3], x[4]),
           Plain(kSome), Plain(kAbsorption), Plain(kThickness), Plain(kZb), Plain(kZb));
  TERM_ROW("TablePlace, from 1", any, 1.0 + T::TablePlace(x[0]), kThickness);
  TERM_ROW("TableThickness", any, T::TableThickness(x[0]), Range{{0, 40}, 0, 40});
  TERM_ROW("CubicWeight", any,
           T::CubicWeight(-1, x[0]) + 2.0 * T::CubicWeight(0, x[0]) + 3.0 * T::CubicWeight(1, x[0]) +
               4.0 * T::CubicWeight(2, x[0]),
           kShare);
  TERM_ROW("ExitLobe", any, T::ExitLobe(x[0], x[1]), kShare, kBelowOne);
  TERM_ROW("DipoleProfile", any, T::DipoleProfile(x[0], x[1], x[2], x[3], x[4]), kShare, kDepth, kTransport, kZb,
           kRadius);
  TERM_ROW("DipoleReflectance", 1, T::DipoleReflectance(x[0], x[1], x[2], x[3]), kShare, kDepth, kTransport, kZb);
  TERM_ROW("MultipoleReflectance", 1, T::MultipoleReflectance(x[0], x[1], x[2], x[3], x[4], x[5]), kShare, kInside,
           kTransport, kBeyond, kZb, kZb);
  TERM_ROW("MultipoleTransmittance", 1, T::MultipoleTransmittance(x[0], x[1], x[2], x[3], x[4], x[5]), kShare, kInside,
           kTransport, kBeyond, kZb, kZb);
  TERM_ROW("NormalisedDiffusionShape", any, T::NormalisedDiffusionShape(x[0]), kShare);
  TERM_ROW("NormalisedDiffusionProfile", any, T::NormalisedDiffusionProfile(x[0], x[1], x[2]), kShare, kDepth, kDepth);
  TERM_ROW("NormalisedDiffusionWithin", 1, T::NormalisedDiffusionWithin(x[0], x[1], x[2]) * x[0], kShare, kDepth,
           kRadius);
  TERM_ROW(
      "HableTapX", any,
      400.0 + x[0] * (1.0 * T::HableTapX(0) + 2.0 * T::HableTapX(1) + 3.0 * T::HableTapX(2) + 4.0 * T::HableTapX(3) +
                      5.0 * T::HableTapX(4) + 6.0 * T::HableTapX(5) + 7.0 * T::HableTapX(6) + 8.0 * T::HableTapX(7) +
                      9.0 * T::HableTapX(8) + 10.0 * T::HableTapX(9) + 11.0 * T::HableTapX(10) +
                      12.0 * T::HableTapX(11) + 13.0 * T::HableTapX(12)),
      kShare);
  TERM_ROW(
      "HableTapY", any,
      400.0 + x[0] * (1.0 * T::HableTapY(0) + 2.0 * T::HableTapY(1) + 3.0 * T::HableTapY(2) + 4.0 * T::HableTapY(3) +
                      5.0 * T::HableTapY(4) + 6.0 * T::HableTapY(5) + 7.0 * T::HableTapY(6) + 8.0 * T::HableTapY(7) +
                      9.0 * T::HableTapY(8) + 10.0 * T::HableTapY(9) + 11.0 * T::HableTapY(10) +
                      12.0 * T::HableTapY(11) + 13.0 * T::HableTapY(12)),
      kShare);
}

#undef TERM_ROW

}  // namespace crownfit
