#include "plan/exact_statements.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/linear_algebra.h"
#include "capture/capture.h"
#include "plan/start_state.h"

namespace crownfit {
namespace {

/// As far apart as measurements of one material lie, or as a careful hand is off; in the parameter's own scale. Neither
/// g nor roughness: model `shader` knows neither what g does beside reduced scattering, nor what a rough surface does
/// to light that goes through it.
struct UsualError {
  double size;
  const char* words;
};
const std::map<Quantity, UsualError> kUsualErrors = {{Quantity::kThickness, {0.1, "10 %"}},
                                                     {Quantity::kThicknessScale, {0.1, "10 %"}},
                                                     {Quantity::kIor, {0.05, "0.05"}}};

/// The capture with what its layers fix, and errors are usual of, free.
Capture Freed(Capture capture) {
  for (LayerSpec& layer : capture.layers)
    for (const ParameterRow& row : kParameters) {
      ParameterSpec& spec = layer[row.quantity];
      if (!spec.fixed || !kUsualErrors.count(row.quantity)) continue;
      if (spec.value[0] <= row.low || spec.value[0] >= row.high) continue;
      spec.fixed = false, spec.low = row.low, spec.high = row.high, spec.sharing = Sharing::kOneValue;
    }
  return capture;
}

/// Of what is fitted, on a scale of logarithms: by what share of itself each moves with the entries.
std::vector<ExactStatement::Shift> Shares(const FitProblem& problem, const Eigen::VectorXd& x,
                                          const Eigen::VectorXd& moved) {
  constexpr double kSaid = 0.01;
  const Material material = MaterialAt(problem.free, x);
  std::map<std::string, double> largest;
  for (const FreeEntry& entry : problem.free.entries) {
    if (RowOf(entry.quantity).scale != Scale::kLog) continue;
    const bool is_surface = entry.layer == kSurfaceOwner;
    double& share =
        largest[(is_surface ? "surface" : problem.capture.layers[entry.layer].name) + "." + RowOf(entry.quantity).key];
    for (int c = 0; c < material.channels(); ++c) {
      const double value =
          is_surface ? material.surface[entry.quantity][c] : material.layers[entry.layer][entry.quantity][c];
      const double by = ValueGradient(problem.free, x, entry.layer, entry.quantity, c).dot(moved);
      share = std::max(share, std::abs(by) / value);
    }
  }
  std::vector<ExactStatement::Shift> shares;
  for (const auto& [name, share] : largest)
    if (share >= kSaid) shares.push_back({name, share});
  std::ranges::sort(shares, std::greater{}, &ExactStatement::Shift::share);
  return shares;
}

}  // namespace

std::vector<ExactStatement> ExactStatements(const FitProblem& problem, const FitState& at,
                                            const LinearisedPrediction& prediction) {
  const Capture freed = Freed(problem.capture);
  FreeParameters all = FreeParametersOf(freed);
  Eigen::VectorXd start = StartVector(all);
  std::vector<Eigen::Index> fitted, exact;
  for (int k = 0; k < all.count(); ++k) {
    const auto own = std::ranges::find(problem.free.entries, all.entries[k].name, &FreeEntry::name);
    (own == problem.free.entries.end() ? exact : fitted).push_back(k);
    if (own != problem.free.entries.end()) start[k] = at.x[own - problem.free.entries.begin()];
  }
  const Evaluation e =
      AgreeingEvaluation({freed, all, problem.errors, problem.options}, at, at.pixels, prediction, start);
  std::vector<ExactStatement> statements;
  if (!e.finite || fitted.empty()) return statements;
  const Eigen::MatrixXd own = e.jacobian(Eigen::all, fitted);
  Eigen::MatrixXd precision = own.transpose() * own;
  for (int k = 0; k < problem.free.count(); ++k)
    precision(k, k) += std::pow(problem.free.entries[k].prior_stddev, -2.0);
  for (const Eigen::Index k : exact) {
    const FreeEntry& entry = all.entries[k];
    const UsualError& error = kUsualErrors.at(entry.quantity);
    const Eigen::VectorXd pull = own.transpose() * e.jacobian.col(k) * error.size;
    ExactStatement s{entry.name, entry.scale == Scale::kLog ? std::exp(entry.start) : entry.start, error.words,
                     Shares(problem, at.x, SolveSymmetric(precision, pull))};
    if (!s.shifts.empty()) statements.push_back(std::move(s));
  }
  std::ranges::sort(statements, std::greater{}, [](const ExactStatement& s) { return s.shifts[0].share; });
  return statements;
}

}  // namespace crownfit
