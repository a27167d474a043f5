// The shading terms and the diffusing stack in double, and their derivatives, against the same text in 50 digits, over
// corner and random points of a capture's valid range and beyond: stability_study [--points N] [--csv FILE]. Exit code
// 1 when a tolerance is exceeded.
//
// A value may differ by 1e-12 of itself or by the effect of kSteps roundings of its arguments: no formula in double can
// promise more. The same holds for a derivative and its own derivatives.

#include <ceres/jet.h>

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "base/random.h"
#include "shader/layered_diffusion.h"
#include "support/term_rows.h"

namespace crownfit {
namespace {

using Wide = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>, boost::multiprecision::et_off>;

}  // namespace

// Wide numbers use the code for numbers with derivatives, which computes everything in their type.
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
// The tolerance of the stack is wider.
constexpr double kTermBar = 1e-12, kStackBar = 1e-8, kSteps = 16;

struct Term {
  TermRow row;
  double bar;  ///< relative error that is allowed in any case
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

/// Every shading term, and the stack.
std::vector<Term> AllTerms() {
  std::vector<Term> terms;
  ForEachTerm([&](const TermRow& row, const auto& call) { terms.push_back({row, kTermBar, call, call, call}); });
  for (const bool transmitted : {false, true}) {
    const auto call = [transmitted](const auto* x) { return OfStack(x, transmitted); };
    terms.push_back({{transmitted ? "two layers, transmittance" : "two layers, reflectance",
                      "",
                      1,
                      {kScattering, kAbsorption, kScattering, kAbsorption, Plain(kThickness), Plain(kThickness)}},
                     kStackBar,
                     call,
                     call,
                     call});
  }
  return terms;
}

/// Results of one term: the largest errors in units of the tolerance, and the points beyond it.
struct Seen {
  size_t points = 0, beyond = 0, derivatives = 0, slopes_beyond = 0, not_finite = 0, negative = 0, above = 0;
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
  if (value > term.row.highest * (1 + term.bar)) ++seen.above;
  constexpr double kNothing = 1e-290;  // below, double has fewer digits
  const double error = static_cast<double>(abs(Wide(value) - exact));
  const double allowed = std::max({term.bar * size, kSteps * eps * static_cast<double>(rounding), kNothing});
  if (size > kNothing) seen.worst_relative = std::max(seen.worst_relative, error / size);
  if (!(error <= allowed)) ++seen.beyond;
  if (!(error / allowed <= seen.worst)) seen.worst = error / allowed, seen.where = x;
  const Jet jet = term.jet(jets.data());
  for (size_t i = 0; i < n; ++i) {
    if (!term.row.ranges[i].has_slope) continue;
    const double scale = static_cast<double>(abs(left[i]) + abs(right[i]));
    if (static_cast<double>(abs(left[i] - right[i])) > 1e-6 * scale) continue;  // a kink, without a derivative
    // The effect of rounding the arguments on the derivative: its differences over larger steps.
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
    ++seen.derivatives;
    if (!std::isfinite(jet.v[static_cast<int>(i)])) ++seen.not_finite;
    if (!(wrong <= may)) ++seen.slopes_beyond;
    if (!(wrong / may <= seen.worst_slope)) seen.worst_slope = wrong / may, seen.where_slope = x;
  }
}

Seen LookAt(const Term& term, size_t index, size_t points) {
  Seen seen;
  for (size_t p = 0; p < points; ++p) {
    std::vector<double> x;
    for (size_t i = 0; i < term.row.ranges.size(); ++i) x.push_back(term.row.ranges[i].Draw(Key(index, p, i)));
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
    if (!only.empty() && only != terms[i].row.name) continue;
    const Seen s = LookAt(terms[i], i, points);
    const size_t bad = s.beyond + s.slopes_beyond + s.not_finite + s.negative + s.above;
    faults += bad;
    std::printf("%-32s %9.1e %9.1e %9.1e", terms[i].row.name, s.worst_relative, s.worst, s.worst_slope);
    if (bad)
      std::printf("  %zu values, %zu slopes, %zu not finite, %zu negative, %zu above; worst at (%s), slope (%s)",
                  s.beyond, s.slopes_beyond, s.not_finite, s.negative, s.above, Text(s.where).c_str(),
                  Text(s.where_slope).c_str());
    std::printf("\n");
    char row[400];
    std::snprintf(row, sizeof row, "\"%s\",%zu,%.3g,%.3g,%zu,%zu,%.3g,%zu,%zu,%zu,%zu,%s,%s\n", terms[i].row.name,
                  s.points, s.worst_relative, s.worst, s.beyond, s.derivatives, s.worst_slope, s.slopes_beyond,
                  s.not_finite, s.negative, s.above, Text(s.where).c_str(), Text(s.where_slope).c_str());
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
