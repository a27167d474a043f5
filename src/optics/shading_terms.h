#pragma once
// shaders/terms.glsl as C++: Terms<double>::FresnelReflectance(...), Terms<ceres::Jet<double, N>>::... (found by ADL).

#include <cmath>
#include <cstdlib>

namespace crownfit {
namespace terms_detail {

using std::abs;
using std::exp;
using std::log;
using std::sqrt;

#define TERM static inline
#define OUT(T) T&

/// The text's functions as static members. Only min, max and clamp may be members beside them: a member called exp
/// would hide the functions of other number types.
template <class Float>
struct Terms {
  static Float max(const Float& a, const Float& b) { return b > a ? b : a; }
  static Float min(const Float& a, const Float& b) { return b < a ? b : a; }
  static Float clamp(const Float& x, const Float& low, const Float& high) { return max(low, min(x, high)); }
#include "terms.glsl"
};

#undef TERM
#undef OUT

}  // namespace terms_detail

using terms_detail::Terms;

/// For numbers that carry derivatives: whether any of them is not 0.
template <class T>
bool HasDerivative(const T& x) {
  if constexpr (requires { x.v.isZero(0.0); })
    return !x.v.isZero(0.0);
  else
    return false;
}

template <class T>
double PlainValue(const T& x) {
  if constexpr (requires { x.a; })
    return x.a;
  else
    return x;
}

}  // namespace crownfit
