// The shading terms and the diffusing stack in double, and their derivatives, against the same text in 50 digits, over
// corner and random points of what a capture may state and beyond: stability_study [--points N] [--csv FILE]. Exit code
// 1 when a bar does not hold.
//
// A value may differ by 1e-12 of itself or by what kSteps roundings of its arguments do to it: no formula in double can
// promise more. The same holds for a derivative and its own slopes.

#include <ceres/jet.h>

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "base/random.h"
#include "optics/layered_diffusion.h"
#include "optics/shading_terms.h"

namespace crownfit {
namespace {

using Wide = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>, boost::multiprecision::et_off>;

}  // namespace

// The wide numbers take the way of numbers with derivatives, which computes everything in them.
template <>
bool HasDerivative<Wide>(const Wide&) {
  return true;
}
template <>
double PlainValue<Wide>(const Wide& x) {
  return static_cast<double>(x);
}

namespace {

constexpr int kMost = 6;  // arguments of a term
using Jet = ceres::Jet<double, kMost>;
// Of thin slabs, where near and far lights nearly cancel, of the stack, and of rough surfaces under a film, whose half
// vectors come as cosines, fewer digits are asked for.
constexpr double kBar = 1e-12, kSlabBar = 1e-4, kStackBar = 1e-8, kFilmBar = 1e-10, kSteps = 16;

// Cosines end where the terms' floors of 1e-6 begin.
/// An argument's range: its corners, and evenly between two ends, in the logarithm where `low` > 0.
struct Range {
  std::vector<double> corners;
  double low, high;
  bool has_slope = true;
  double At(double u) const { return low > 0 ? low * std::pow(high / low, u) : low + u * (high - low); }
};
const Range kAbsorption{{0, 1e-9, 1e3}, 1e-6, 1e3}, kScattering{{0, 1e-9, 1e4}, 1e-4, 1e4},
    kSome{{1e-3, 1e4}, 1e-3, 1e4}, kThickness{{0, 1e-9, 1e3}, 1e-4, 1e3}, kIor{{1, 1 + 1e-12, 1.5, 3}, 1, 3},
    kCosine{{1, 1.5e-6, 0.5}, 1.5e-6, 1}, kRoughness{{1, 0.01}, 0.01, 1}, kG{{-0.99, 0.999}, -0.99, 0.999},
    kG01{{0, 0.99}, 0, 0.99}, kAnyCosine{{-1, 0, 1}, -1, 1}, kShare{{0, 1}, 0, 1}, kBelowOne{{0, 0.95}, 0, 0.95},
    kSigned{{0, 1e-9, -1e-9, 0.05, -0.05, 700}, -50, 700}, kTransport{{1e-4, 1e3}, 1e-4, 1e3},
    kRadius{{0, 1e-6, 1e2}, 1e-4, 1e2}, kDepth{{1e-6, 10}, 1e-4, 1e2}, kZb{{1e-4, 1e2}, 1e-4, 1e2},
    kPlainThickness{{0, 1e-9, 1e3}, 1e-4, 1e3, false}, kInside{{1e-6, 0.9}, 1e-4, 0.9}, kBeyond{{1, 1e3}, 1, 1e3};

struct Term {
  const char* name;
  double highest;  ///< no value above it: energy
  double bar;      ///< relative error that is allowed in any case
  std::vector<Range> ranges;
  std::function<double(const double*)> plain;
  std::function<Jet(const Jet*)> jet;
  std::function<Wide(const Wide*)> wide;
};

/// Reflected or transmitted share of a beam by two layers with a film of wetness above, x: scattering and absorption of
/// either, both thicknesses (they carry no derivatives).
template <class F>
F OfStack(const F* x, bool transmitted) {
  const auto plain = [](const F& v) { return PlainValue(v); };
  DiffusingStack<F> stack;
  stack.has_outer = true;
  stack.outer = {x[0], x[1], F(0.8), F(1.63)};
  stack.inner = {x[2], x[3], F(0.7), F(1.54)};
  stack.boundary = {F(1.63)};
  const LayerResponse<F> outer(stack.outer, stack.BeamCosine(stack.outer), plain(x[4]), 0.0),
      inner(stack.inner, stack.BeamCosine(stack.inner), plain(x[5]), 0.0);
  const auto totals = StackTransform<F>(stack).At(&outer, inner);
  return transmitted ? totals.transmitted : totals.reflected;
}

#define TERM_ROW(name, highest, call, ...) BARRED_ROW(name, highest, kBar, call, __VA_ARGS__)
#define BARRED_ROW(name, highest, bar, call, ...)   \
  Term {                                            \
    name, highest, bar, {__VA_ARGS__},              \
        [](const double* x) {                       \
          using T [[maybe_unused]] = Terms<double>; \
          return call;                              \
        },                                          \
        [](const Jet* x) {                          \
          using T [[maybe_unused]] = Terms<Jet>;    \
          return call;                              \
        },                                          \
        [](const Wide* x) {                         \
          using T [[maybe_unused]] = Terms<Wide>;   \
          return call;                              \
        }                                           \
  }

std::vector<Term> AllTerms() {
  const double any = HUGE_VAL;
  return {
      TERM_ROW("ExpRatio", any, T::ExpRatio(x[0]), kSigned),
      TERM_ROW("FresnelReflectance", 1, T::FresnelReflectance(x[0], x[1]), kCosine, kIor),
      TERM_ROW("FresnelReflectance, from inside", 1, T::FresnelReflectance(x[0], 1.0 / x[1]), kCosine, kIor),
      TERM_ROW("FresnelTransmittance", 1, T::FresnelTransmittance(x[0], x[1]), kCosine, kIor),
      TERM_ROW("RefractedCosine", 1, T::RefractedCosine(x[0], x[1]), kCosine, kIor),
      TERM_ROW("FilmReflectance", 1, T::FilmReflectance(x[0], x[1]), kShare, kBelowOne),
      TERM_ROW("WetReflectance", 1, T::WetReflectance(x[0], 0.4 + x[1], x[2] * 0.1 + 1.2, x[3]), kCosine, kIor, kShare,
               kShare),
      TERM_ROW("ZerothOrderTransmittance", 1, T::ZerothOrderTransmittance(x[0], x[1], x[2]), kShare, kBelowOne, kShare),
      TERM_ROW("DiffuseFresnelOutside", 1, T::DiffuseFresnelOutside(x[0]), kIor),
      TERM_ROW("DiffuseFresnelInside", 1, T::DiffuseFresnelInside(x[0]), kIor),
      TERM_ROW("FresnelFluenceMomentInside", 1, T::FresnelFluenceMomentInside(x[0]), kIor),
      TERM_ROW("DiffuseFresnelFit", 1, T::DiffuseFresnelFit(x[0]), kIor),
      TERM_ROW("BoundaryParameter", any, T::BoundaryParameter(x[0]), kBelowOne),
      TERM_ROW("BoundaryParameterOfMoments", any, T::BoundaryParameterOfMoments(x[0], x[1]), kBelowOne, kShare),
      TERM_ROW("HenyeyGreenstein", any, T::HenyeyGreenstein(x[0], x[1]), kG, kAnyCosine),
      TERM_ROW("GgxDistribution", any, T::GgxDistribution(x[0], x[1]), kCosine, kRoughness),
      TERM_ROW("GgxVisibility", any, T::GgxVisibility(x[0], x[1], x[2]), kCosine, kCosine, kRoughness),
      TERM_ROW("SurfaceReflection", any, T::SurfaceReflection(x[0], x[1], x[2], x[3], x[4], x[5]), kCosine, kCosine,
               kCosine, kCosine, kRoughness, kIor),
      BARRED_ROW("SurfaceReflectionUnderFilm", any, kFilmBar,
                 T::SurfaceReflectionUnderFilm(x[0], x[1], x[2], x[3], x[4], 0.4 + x[5], 1.3 + 0.0 * x[0]), kCosine,
                 kCosine, kCosine, kCosine, kRoughness, kIor),
      TERM_ROW("BeckmannDistribution", any, T::BeckmannDistribution(x[0], x[1]), kCosine, kRoughness),
      TERM_ROW("KelemenReflection", any, T::KelemenReflection(x[0], x[1], x[2], x[3]), kCosine, kCosine, kRoughness,
               kIor),
      TERM_ROW("Attenuation", 1, T::Attenuation(x[0], x[1]), kAbsorption, kThickness),
      TERM_ROW("SingleScatterBackward", any, T::SingleScatterBackward(x[0], x[1], x[2]), kThickness, kCosine, kCosine),
      TERM_ROW("SingleScatterForward", any, T::SingleScatterForward(x[0], x[1], x[2]), kThickness, kCosine, kCosine),
      TERM_ROW("SingleScatterReflection", any,
               T::SingleScatterReflection(x[0], 0.08 + 0.0 * x[0], x[1], x[2], x[3], x[4], x[5]), kShare, kShare, kIor,
               kThickness, kCosine, kCosine),
      TERM_ROW("DiffusionCoefficient", any, T::DiffusionCoefficient(x[0], x[1], x[2]), kSome, kAbsorption, kG),
      TERM_ROW("DiffusionCoefficientClassic", any, T::DiffusionCoefficientClassic(x[0], x[1]), kSome, kAbsorption),
      TERM_ROW("DiffusionCoefficientGrosjean", any, T::DiffusionCoefficientGrosjean(x[0], x[1]), kSome, kAbsorption),
      TERM_ROW("TransportSquared", any, T::TransportSquared(x[0], x[1]), kAbsorption, kSome),
      TERM_ROW("PointSourceFlux", 1, T::PointSourceFlux(x[0], x[1], x[2]), kTransport, kDepth, kRadius),
      BARRED_ROW("SlabReflectance", 1, kSlabBar,
                 T::SlabReflectance(x[0], x[0] + x[1],
                                    sqrt(T::TransportSquared(x[1], T::DiffusionCoefficientGrosjean(x[0], x[1]))), x[2],
                                    x[3], x[4]),
                 kSome, kAbsorption, kThickness, kZb, kZb),
      BARRED_ROW("SlabTransmittance", 1, kSlabBar,
                 T::SlabTransmittance(x[0], x[0] + x[1],
                                      sqrt(T::TransportSquared(x[1], T::DiffusionCoefficientGrosjean(x[0], x[1]))),
                                      x[2], x[3], x[4]),
                 kSome, kAbsorption, kThickness, kZb, kZb),
      TERM_ROW("TablePlace, from 1", any, 1.0 + T::TablePlace(x[0]), kThickness),
      TERM_ROW("TableThickness", any, T::TableThickness(x[0]), Range{{0, 40}, 0, 40}),
      TERM_ROW("CubicWeight", any,
               T::CubicWeight(-1, x[0]) + 2.0 * T::CubicWeight(0, x[0]) + 3.0 * T::CubicWeight(1, x[0]) +
                   4.0 * T::CubicWeight(2, x[0]),
               kShare),
      TERM_ROW("ExitLobe", any, T::ExitLobe(x[0], x[1]), kShare, kBelowOne),
      TERM_ROW("DipoleProfile", any, T::DipoleProfile(x[0], x[1], x[2], x[3], x[4]), kShare, kDepth, kTransport, kZb,
               kRadius),
      TERM_ROW("DipoleReflectance", 1, T::DipoleReflectance(x[0], x[1], x[2], x[3]), kShare, kDepth, kTransport, kZb),
      TERM_ROW("MultipoleReflectance", 1, T::MultipoleReflectance(x[0], x[1], x[2], x[3], x[4], x[5]), kShare, kInside,
               kTransport, kBeyond, kZb, kZb),
      TERM_ROW("MultipoleTransmittance", 1, T::MultipoleTransmittance(x[0], x[1], x[2], x[3], x[4], x[5]), kShare,
               kInside, kTransport, kBeyond, kZb, kZb),
      TERM_ROW("NormalisedDiffusionProfile", any, T::NormalisedDiffusionProfile(x[0], x[1], x[2]), kShare, kDepth,
               kDepth),
      TERM_ROW("NormalisedDiffusionWithin", 1, T::NormalisedDiffusionWithin(x[0], x[1], x[2]) * x[0], kShare, kDepth,
               kRadius),
      BARRED_ROW("two layers, reflectance", 1, kStackBar, OfStack(x, false), kScattering, kAbsorption, kScattering,
                 kAbsorption, kPlainThickness, kPlainThickness),
      BARRED_ROW("two layers, transmittance", 1, kStackBar, OfStack(x, true), kScattering, kAbsorption, kScattering,
                 kAbsorption, kPlainThickness, kPlainThickness),
  };
}

/// What was seen of one term: the largest errors in units of what is allowed, and points beyond.
struct Seen {
  size_t points = 0, beyond = 0, slopes = 0, slopes_beyond = 0, not_finite = 0, negative = 0, above = 0;
  double worst = 0, worst_slope = 0, worst_relative = 0;
  std::vector<double> where, where_slope;
};

/// Central differences in 50 digits: exact to some 25 of them.
Wide StepOf(const Wide& x) { return Wide(1e-14) * (abs(x) + Wide(1e-6)); }

void Look(const Term& term, const std::vector<double>& x, Seen& seen) {
  const size_t n = x.size();
  std::vector<Wide> wide(x.begin(), x.end());
  std::vector<Jet> jets;
  for (size_t i = 0; i < n; ++i) jets.emplace_back(x[i], static_cast<int>(i));
  const Wide exact = term.wide(wide.data());
  const auto at = [&](size_t i, int side) {
    std::vector<Wide> moved = wide;
    moved[i] += side * StepOf(wide[i]);
    return term.wide(moved.data());
  };
  std::vector<Wide> slope(n), left(n), right(n);
  Wide rounding = 0;
  for (size_t i = 0; i < n; ++i) {
    left[i] = (exact - at(i, -1)) / StepOf(wide[i]);
    right[i] = (at(i, 1) - exact) / StepOf(wide[i]);
    slope[i] = (left[i] + right[i]) / 2;
    rounding += abs(wide[i] * slope[i]);
  }
  const double value = term.plain(x.data()), size = static_cast<double>(abs(exact)), eps = 0x1p-53;
  ++seen.points;
  if (!std::isfinite(value)) ++seen.not_finite;
  if (value < 0) ++seen.negative;
  if (value > term.highest * (1 + term.bar)) ++seen.above;
  constexpr double kNothing = 1e-290;  // below, double has fewer digits
  const double error = static_cast<double>(abs(Wide(value) - exact));
  const double allowed = std::max({term.bar * size, kSteps * eps * static_cast<double>(rounding), kNothing});
  if (size > kNothing) seen.worst_relative = std::max(seen.worst_relative, error / size);
  if (!(error <= allowed)) ++seen.beyond;
  if (!(error / allowed <= seen.worst)) seen.worst = error / allowed, seen.where = x;
  const Jet jet = term.jet(jets.data());
  for (size_t i = 0; i < n; ++i) {
    if (!term.ranges[i].has_slope) continue;
    const double scale = static_cast<double>(abs(left[i]) + abs(right[i]));
    if (static_cast<double>(abs(left[i] - right[i])) > 1e-6 * scale) continue;  // a bend: there is no derivative
    // What rounding the arguments does to the derivative: its differences over larger steps.
    Wide shake = 0;
    for (size_t k = 0; k < n; ++k) {
      std::vector<Wide> moved = wide;
      const Wide h = Wide(1e-9) * abs(wide[k]);
      moved[k] += h;
      std::vector<Wide> up = moved, down = moved;
      up[i] += StepOf(wide[i]);
      down[i] -= StepOf(wide[i]);
      const Wide there = (term.wide(up.data()) - term.wide(down.data())) / (2 * StepOf(wide[i]));
      shake += h == 0 ? Wide(0) : abs(there - slope[i]) * 1e9;
    }
    const double wrong = static_cast<double>(abs(Wide(jet.v[static_cast<int>(i)]) - slope[i]));
    const double may =
        std::max({term.bar * static_cast<double>(abs(slope[i])), kSteps * eps * static_cast<double>(shake),
                  term.bar * size / std::max(std::abs(x[i]), 1e-3), kNothing});
    ++seen.slopes;
    if (!std::isfinite(jet.v[static_cast<int>(i)])) ++seen.not_finite;
    if (!(wrong <= may)) ++seen.slopes_beyond;
    if (!(wrong / may <= seen.worst_slope)) seen.worst_slope = wrong / may, seen.where_slope = x;
  }
}

Seen LookAt(const Term& term, size_t index, size_t points) {
  Seen seen;
  for (size_t p = 0; p < points; ++p) {
    std::vector<double> x;
    const uint64_t key = Key(1, index, p);
    for (size_t i = 0; i < term.ranges.size(); ++i) {
      const Range& r = term.ranges[i];
      const double u = Uniform(key, 2 * i);
      // Half of the arguments stand at corners, those of the first point all.
      x.push_back(p == 0 || u < 0.5
                      ? r.corners[static_cast<size_t>(Uniform(key, 2 * i + 1) * static_cast<double>(r.corners.size()))]
                      : r.At(2 * u - 1));
    }
    Look(term, x, seen);
  }
  return seen;
}

std::string Text(const std::vector<double>& x) {
  std::string text;
  char number[32];
  for (double v : x) {
    std::snprintf(number, sizeof number, "%.6g", v);
    text += (text.empty() ? "" : " ") + std::string(number);
  }
  return text;
}

int Run(size_t points, const std::string& csv, const std::string& only) {
  std::string table =
      "term,points,worst_relative,worst_over_allowed,beyond,slopes,worst_slope_over_allowed,slopes_beyond,not_finite,"
      "negative,above,where,where_slope\n";
  const std::vector<Term> terms = AllTerms();
  size_t faults = 0;
  std::printf("%-32s %9s %9s %9s  faults\n", "term", "relative", "of bar", "slope");
  for (size_t i = 0; i < terms.size(); ++i) {
    if (!only.empty() && only != terms[i].name) continue;
    const Seen s = LookAt(terms[i], i, points);
    const size_t bad = s.beyond + s.slopes_beyond + s.not_finite + s.negative + s.above;
    faults += bad;
    std::printf("%-32s %9.1e %9.1e %9.1e", terms[i].name, s.worst_relative, s.worst, s.worst_slope);
    if (bad)
      std::printf("  %zu values, %zu slopes, %zu not finite, %zu negative, %zu above; worst at (%s), slope (%s)",
                  s.beyond, s.slopes_beyond, s.not_finite, s.negative, s.above, Text(s.where).c_str(),
                  Text(s.where_slope).c_str());
    std::printf("\n");
    char row[400];
    std::snprintf(row, sizeof row, "\"%s\",%zu,%.3g,%.3g,%zu,%zu,%.3g,%zu,%zu,%zu,%zu,%s,%s\n", terms[i].name, s.points,
                  s.worst_relative, s.worst, s.beyond, s.slopes, s.worst_slope, s.slopes_beyond, s.not_finite,
                  s.negative, s.above, Text(s.where).c_str(), Text(s.where_slope).c_str());
    table += row;
  }
  if (!csv.empty()) std::ofstream(csv) << table;
  std::printf("%zu terms, %zu points each, %zu faults\n", terms.size(), points, faults);
  return faults ? 1 : 0;
}

}  // namespace
}  // namespace crownfit

int main(int argc, char** argv) {
  size_t points = 500;
  std::string csv, only;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (!std::strcmp(argv[i], "--points")) points = std::strtoul(argv[i + 1], nullptr, 10);
    if (!std::strcmp(argv[i], "--csv")) csv = argv[i + 1];
    if (!std::strcmp(argv[i], "--only")) only = argv[i + 1];
  }
  return crownfit::Run(points, csv, only);
}
