#include "fit/solve.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

namespace crownfit {
namespace {

/// All pixels as one cost function. They are computed in parallel in a fixed order, so the sums do not depend on the
/// number of threads.
class ImageCost final : public ceres::CostFunction {
 public:
  ImageCost(const ImageResiduals& residuals, int parameters) : residuals_(residuals), parameters_(parameters) {
    set_num_residuals(residuals.count());
    mutable_parameter_block_sizes()->push_back(parameters);
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(parameters[0], parameters_);
    const bool with_jacobian = jacobians && jacobians[0];
    const Evaluation e = residuals_.Evaluate(x, with_jacobian);
    if (!e.finite) return false;
    std::copy_n(e.robust.data(), e.robust.size(), residuals);
    if (with_jacobian) std::copy_n(e.jacobian.data(), e.jacobian.size(), jacobians[0]);
    return true;
  }

 private:
  const ImageResiduals& residuals_;
  int parameters_;
};

/// (x - mean) / stddev for every entry.
class PriorCost final : public ceres::CostFunction {
 public:
  explicit PriorCost(const FreeParameters& free) : free_(free) {
    set_num_residuals(free.count());
    mutable_parameter_block_sizes()->push_back(free.count());
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const int n = free_.count();
    for (int k = 0; k < n; ++k) {
      const FreeEntry& e = free_.entries[k];
      residuals[k] = (parameters[0][k] - e.prior_mean) / e.prior_stddev;
      if (jacobians && jacobians[0])
        for (int j = 0; j < n; ++j) jacobians[0][k * n + j] = j == k ? 1.0 / e.prior_stddev : 0.0;
    }
    return true;
  }

 private:
  const FreeParameters& free_;
};

/// Information from others, as residuals whose squares sum to its chi2.
class OthersCost final : public ceres::CostFunction {
 public:
  explicit OthersCost(const GaussianInformation& others) {
    const SeenDirections known(others.precision);
    root_ = known.precision.cwiseSqrt().asDiagonal() * known.seen.transpose();
    wanted_ = known.precision.cwiseSqrt().cwiseInverse().asDiagonal() * known.seen.transpose() * others.weighted_mean;
    set_num_residuals(static_cast<int>(root_.rows()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(root_.cols()));
  }
  Eigen::VectorXd Residuals(const Eigen::VectorXd& x) const { return root_ * x - wanted_; }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const auto n = root_.cols();
    Eigen::Map<Eigen::VectorXd>(residuals, root_.rows()) =
        Residuals(Eigen::Map<const Eigen::VectorXd>(parameters[0], n));
    if (jacobians && jacobians[0])
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(jacobians[0], root_.rows(),
                                                                                         n) = root_;
    return true;
  }

 private:
  Eigen::MatrixXd root_;
  Eigen::VectorXd wanted_;
};

bool IsKnown(const GaussianInformation& others) { return others.precision.size() > 0 && !others.precision.isZero(); }

/// Reports progress, and stops when a fitted thickness is too far from the cast one.
class Watch final : public ceres::IterationCallback {
 public:
  Watch(const FreeParameters& free, const SolveOptions& options, const Eigen::VectorXd& cast_at, const double* x,
        const SolveProgress& progress, SolveResult& result)
      : free_(free), options_(options), cast_at_(cast_at), x_(x), progress_(progress), result_(result) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (progress_) progress_(summary.iteration, summary.cost);
    for (int k = 0; k < free_.count(); ++k) {
      if (!free_.entries[k].moves_surface) continue;
      if (std::abs(std::exp(x_[k] - cast_at_[k]) - 1.0) > options_.stop_when_thickness_moved) {
        result_.thickness_moved = true;
        return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
      }
    }
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const FreeParameters& free_;
  const SolveOptions& options_;
  const Eigen::VectorXd& cast_at_;
  const double* x_;
  const SolveProgress& progress_;
  SolveResult& result_;
};

double CostAt(const ImageResiduals& residuals, const FreeParameters& free, const SolveOptions& options,
              const Eigen::VectorXd& x) {
  const Evaluation e = residuals.Evaluate(x, false);
  if (!e.finite) return HUGE_VAL;
  double cost = 0.5 * e.robust.squaredNorm();
  for (int k = 0; options.use_priors && k < free.count(); ++k) {
    const double r = (x[k] - free.entries[k].prior_mean) / free.entries[k].prior_stddev;
    cost += 0.5 * r * r;
  }
  if (IsKnown(options.others)) cost += 0.5 * OthersCost(options.others).Residuals(x).squaredNorm();
  return cost;
}

/// Index of the factor on the body's depth, where it is free (flat samples); -1: none.
int DepthOf(const FreeParameters& free) {
  for (int k = 0; k < free.count(); ++k)
    if (free.entries[k].quantity == Quantity::kThickness && !free.entries[k].moves_surface) return k;
  return -1;
}

/// The body made `factor` times as deep, at the same optical depth.
Eigen::VectorXd TimesAsDeep(double factor, int depth, const FreeParameters& free, Eigen::VectorXd x) {
  for (int k = 0; k < free.count(); ++k) {
    const FreeEntry& e = free.entries[k];
    const bool is_coefficient = e.quantity == Quantity::kAbsorption || e.quantity == Quantity::kReducedScattering;
    if (e.layer != free.entries[depth].layer || e.role == FreeEntry::Role::kPowerExponent) continue;
    if (k != depth && !is_coefficient) continue;
    x[k] = std::clamp(x[k] + std::log(k == depth ? factor : 1.0 / factor), e.low, e.high);
  }
  return x;
}

/// `cast_at`: where the geometry was cast.
SolveResult SolveFrom(const ImageResiduals& residuals, const FreeParameters& free, const Eigen::VectorXd& cast_at,
                      const Eigen::VectorXd& start, const SolveOptions& options, const SolveProgress& progress) {
  SolveResult result;
  result.x = start;
  if (free.count() == 0) {
    result.converged = true;
    result.message = "nothing was free to fit";
    return result;
  }
  // A fit starts a little inside its bounds, as the optimiser can't see a bound it stands on.
  for (int k = 0; k < free.count(); ++k) {
    const FreeEntry& e = free.entries[k];
    const double margin = 1e-3 * (e.high - e.low);
    result.x[k] = std::clamp(result.x[k], e.low + margin, e.high - margin);
  }
  ceres::Problem problem;
  problem.AddResidualBlock(new ImageCost(residuals, free.count()), nullptr, result.x.data());
  if (options.use_priors) problem.AddResidualBlock(new PriorCost(free), nullptr, result.x.data());
  if (IsKnown(options.others)) problem.AddResidualBlock(new OthersCost(options.others), nullptr, result.x.data());
  for (int k = 0; k < free.count(); ++k) {
    problem.SetParameterLowerBound(result.x.data(), k, free.entries[k].low);
    problem.SetParameterUpperBound(result.x.data(), k, free.entries[k].high);
  }
  ceres::Solver::Options ceres_options;
  ceres_options.num_threads = 1;  // with two Ceres sums in another order; the residuals are parallel by themselves
  ceres_options.linear_solver_type = ceres::DENSE_QR;
  ceres_options.dense_linear_algebra_library_type = ceres::EIGEN;
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.function_tolerance = 1e-8;
  ceres_options.parameter_tolerance = 1e-7;
  ceres_options.gradient_tolerance = 1e-9;
  ceres_options.logging_type = ceres::SILENT;
  ceres_options.update_state_every_iteration = true;
  Watch watch(free, options, cast_at, result.x.data(), progress, result);
  ceres_options.callbacks.push_back(&watch);
  ceres::Solver::Summary summary;
  ceres::Solve(ceres_options, &problem, &summary);
  result.cost = summary.termination_type == ceres::FAILURE ? HUGE_VAL : summary.final_cost;
  result.iterations = static_cast<int>(summary.iterations.size()) - 1;
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.message = summary.message;
  return result;
}

}  // namespace

Eigen::VectorXd BracketStart(const ImageResiduals& residuals, const FreeParameters& free, const SolveOptions& options,
                             Eigen::VectorXd x) {
  double best = CostAt(residuals, free, options, x);
  for (int round = 0; round < 2; ++round) {
    for (Quantity quantity : {Quantity::kAbsorption, Quantity::kReducedScattering, Quantity::kRoughness}) {
      const Eigen::VectorXd from = x;
      for (int power : {-3, -2, -1, 1, 2, 3}) {
        Eigen::VectorXd trial = from;
        bool moved = false;
        for (int k = 0; k < free.count(); ++k) {
          const FreeEntry& e = free.entries[k];
          if (e.quantity != quantity || e.role == FreeEntry::Role::kPowerExponent) continue;
          trial[k] = std::clamp(from[k] + power * std::log(2.0), e.low, e.high);
          moved = true;
        }
        if (!moved) break;
        const double cost = CostAt(residuals, free, options, trial);
        if (cost >= best) continue;
        best = cost;
        x = trial;
      }
    }
  }
  return x;
}

SolveResult Solve(const ImageResiduals& residuals, const FreeParameters& free, const Eigen::VectorXd& start,
                  const SolveOptions& options, const SolveProgress& progress) {
  constexpr double kGain = 0.5;  // of the cost: chi2 by 1
  constexpr int kMostRounds = 4;
  SolveResult best = SolveFrom(residuals, free, start, start, options, progress);
  const int depth = DepthOf(free);
  if (depth < 0) return best;
  const auto show_best = [&](int iteration, double cost) {
    if (progress) progress(best.iterations + iteration, std::min(cost, best.cost));
  };
  bool gained = true;
  for (int round = 0; gained && round < kMostRounds; ++round) {
    const double before = best.cost;
    const Eigen::VectorXd found = best.x;
    for (const double factor : {0.5, 0.75, 1.33, 2.0}) {
      if (best.thickness_moved) return best;  // its geometry must be cast first
      SolveResult again =
          SolveFrom(residuals, free, start, TimesAsDeep(factor, depth, free, found), options, show_best);
      again.iterations += best.iterations;
      if (again.cost < best.cost)
        best = std::move(again);
      else
        best.iterations = again.iterations;
    }
    gained = before - best.cost > kGain;
  }
  return best;
}

}  // namespace crownfit
