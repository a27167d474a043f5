// Shading terms in double precision, and their derivatives, against the same text in 50 digits: over random and corner
// points of the ranges that a capture may state, and beyond. stability_study [--points N] [--csv FILE]; exit code 1 when
// a bar does not hold.
//
// A value may differ by 1e-12 of itself, or by what one step of rounding in its arguments does to it, times kSteps: no
// formula in double can promise more. The same holds for derivatives, with the derivative's own slopes.

#include <ceres/jet.h>

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "base/random.h"
#include "optics/layered_diffusion.h"
#include "optics/shading_terms.h"

namespace crownfit {
namespace {

using Wide = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>, boost::multiprecision::et_off>;
constexpr int kMost = 6;  // arguments
using Jet = ceres::Jet<double, kMost>;

/// An argument's range: corners, and between them even in the logarithm where `least` > 0, else even.
struct Range {
  std::vector<double> corners;
  double low, high;
  bool logarithmic;
  double At(double u) const { return logarithmic ? low * std::pow(high / low, u) : low + u * (high - low); }
};
const Range kAbsorption{{0, 1e-9, 1e3}, 1e-6, 1e3, true}, kScattering{{0, 1e-9, 1e4}, 1e-4, 1e4, true},
    kThickness{{0, 1e-9, 1e3}, 1e-4, 1e3, true}, kIor{{1, 1 + 1e-12, 1.5, 3}, 1, 3, false},
    kCosine{{1, 1e-6, 0.5}, 1e-6, 1, true}, kRoughness{{1, 0.01}, 0.01, 1, true}, kG{{0, -0.99, 0.999}, -0.99, 0.999, false},
    kAnyCosine{{-1, 0, 1}, -1, 1, false}, kShare{{0, 1}, 0, 1, false}, kBelowOne{{0, 0.95}, 0, 0.95, false},
    kSigned{{0, 1e-9, -1e-9, 0.05, 700}, -50, 700, false}, kTransport{{1e-4, 1e3}, 1e-4, 1e3, true},
    kRadius{{0, 1e-6, 1e2}, 1e-4, 1e2, true}, kDepth{{-10, -1e-6, 1e-6, 10}, 1e-4, 1e2, true},
    kZb{{1e-4, 1e2}, 1e-4, 1e2, true};

struct Term {
  const char* name;
  std::vector<Range> ranges;
  double highest;  ///< energy: no value above it
  std::function<double(const double*)> plain;
  std::function<Jet(const Jet*)> jet;
  std::function<Wide(const Wide*)> wide;
};

#define TERM(name, call, highest, ...)                    \
  Term {                                                  \
    name, {__VA_ARGS__}, highest,                         \
        [](const double* x) { return Call_##name<double>(x); }, \
        [](const Jet* x) { return Call_##name<Jet>(x); },       \
        [](const Wide* x) { return Call_##name<Wide>(x); }      \
  }
#define BODY(name, call)                  \
  template <class F>                      \
  F Call_##name([[maybe_unused]] const F* x) { \
    using T = Terms<F>;                   \
    return call;                          \
  }
