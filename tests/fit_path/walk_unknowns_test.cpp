// Steps that are cut short, and what moved calibration costs.

#include "fit_path/walk_unknowns.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "capture/capture.h"
#include "support/synthetic_capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// An incisor's free entries at their start values.
class AnIncisorsUnknowns : public testing::Test {
 protected:
  AnIncisorsUnknowns() {
    WriteSyntheticCapture(folder_.path, {.pixels = 16, .levels = 8});
    capture_ = ReadCapture(folder_.path);
    free_ = FreeParametersOf(capture_);
    at_.x = StartVector(free_);
    unknowns_.emplace(problem_, at_);
  }

  bool IsAbsorption(int k) const { return free_.entries[k].quantity == Quantity::kAbsorption; }

  static constexpr double kLongest = 0.5;
  TemporaryFolder folder_;
  Capture capture_;
  FreeParameters free_;
  std::vector<CalibrationError> errors_;
  FitOptions options_;
  FitProblem problem_{capture_, free_, errors_, options_};
  FitState at_;
  std::optional<WalkUnknowns> unknowns_;
};

TEST_F(AnIncisorsUnknowns, LeaveTheOtherEntriesAtTheLeastSquaresOfWhatIsCut) {
  const int n = unknowns_->count();
  for (int run = 0; run < 20; ++run) {
    Eigen::MatrixXd root(n, n);
    for (int i = 0; i < n * n; ++i) root.data()[i] = Gaussian(Key(run, 1), i);
    const Eigen::MatrixXd covariance = root * root.transpose() / n + 0.1 * Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd whole(n);
    for (int k = 0; k < n; ++k) whole[k] = -0.6 * std::abs(Gaussian(Key(run, 2), k));
    const WalkUnknowns::ShortStep made = unknowns_->Shortened(whole, covariance, kLongest);
    Eigen::VectorXd step = made.step;
    for (int k = 0; k < unknowns_->material(); ++k)
      if (IsAbsorption(k) && step[k] > 0) step[k] = std::expm1(step[k]);
    const Eigen::VectorXd force = covariance.ldlt().solve(step - whole);
    for (int k = 0; k < n; ++k) {
      const bool is_cut = std::count(made.cut.begin(), made.cut.end(), k) > 0;
      if (is_cut) {
        EXPECT_NEAR(std::abs(made.step[k]), kLongest, 1e-9);
      } else {
        EXPECT_NEAR(force[k], 0.0, 1e-9) << "run " << run << " entry " << k;
      }
    }
  }
}

TEST_F(AnIncisorsUnknowns, MoreAbsorptionGoesWithItselfAndNotWithItsLogarithm) {
  const int n = unknowns_->count();
  const Eigen::MatrixXd apart = Eigen::MatrixXd::Identity(n, n);
  for (const double more : {0.1, 1.0, 5.0}) {
    const WalkUnknowns::ShortStep made = unknowns_->Shortened(Eigen::VectorXd::Constant(n, more), apart, kLongest);
    for (int k = 0; k < unknowns_->material(); ++k) {
      if (free_.entries[k].scale != Scale::kLog) continue;
      const double wanted = IsAbsorption(k) ? std::min(std::log1p(more), 2.0 * kLongest) : std::min(more, kLongest);
      EXPECT_NEAR(made.step[k], wanted, 1e-9);
    }
  }
}

TEST_F(AnIncisorsUnknowns, MovedCalibrationCostsItsSquaresAndNothingWhenForgotten) {
  EXPECT_FALSE(unknowns_->HaveStatedErrors());
  errors_.resize(2);
  at_.calibration.amounts = {1.5, -2.0};
  WalkUnknowns moved(problem_, at_);
  EXPECT_TRUE(moved.HaveStatedErrors());
  EXPECT_NEAR(moved.CalibrationCost(), 1.5 * 1.5 + 2.0 * 2.0, 1e-9);
  moved.ForgetCalibration();
  EXPECT_EQ(moved.CalibrationCost(), 0.0);
}

/// Poses that are measured by photographs, and stated, with independent errors.
class AnIncisorsPoses : public AnIncisorsUnknowns {
 protected:
  static constexpr int kErrors = 12;
  static constexpr double kByPhotographs = 0.7;  // standard deviation, in stated ones

  AnIncisorsPoses() {
    errors_.resize(kErrors);
    at_.calibration.amounts.assign(kErrors, 0.0);
    unknowns_.emplace(problem_, at_);
  }

  /// Takes stated errors as they show until that changes nothing, with errors `times` as large as stated.
  double InflationBy(double times, uint64_t draw) {
    at_.inflation = {1, 1, 1, 1};
    double& inflation = at_.inflation[static_cast<size_t>(CalibrationKind::kPose)];
    const int n = unknowns_->count(), first = n - kErrors;
    for (int round = 0; round < 20; ++round) {
      const double told = inflation * inflation / (inflation * inflation + kByPhotographs * kByPhotographs);
      for (int e = 0; e < kErrors; ++e) {
        const double off = times * Gaussian(Key(draw, 1), e) + kByPhotographs * Gaussian(Key(draw, 2), e);
        at_.calibration.amounts[e] = told * off;
      }
      Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(n, n);
      covariance.diagonal().segment(first, kErrors).setConstant(inflation * inflation * (1.0 - told));
      if (!unknowns_->WidenStatedErrors(covariance, Eigen::MatrixXd::Zero(n, n))) return inflation;
    }
    ADD_FAILURE() << "it did not settle";
    return 0.0;
  }
};

TEST_F(AnIncisorsPoses, OfTheStatedErrorAreTakenAsStated) {
  int inflation = 0;
  for (uint64_t draw = 0; draw < 1000; ++draw) inflation += InflationBy(1.0, draw) > 1.0;
  EXPECT_LE(inflation, 5) << "one in a thousand by chance";
}

TEST_F(AnIncisorsPoses, OfLargerErrorsThanStatedAreTakenToBeAsLargeAsTheyAre) {
  for (const double times : {3.0, 6.0}) {
    double mean_log = 0;
    constexpr int kDraws = 50;
    for (uint64_t draw = 0; draw < kDraws; ++draw) mean_log += std::log(InflationBy(times, draw) / times) / kDraws;
    EXPECT_NEAR(mean_log, 0.0, 0.1) << times;  // of one draw: 0.2
  }
}

TEST_F(AnIncisorsPoses, ThatContradictEveryStatementAreNotFollowedWithoutEnd) {
  EXPECT_EQ(InflationBy(100.0, 1), kMostInflated);
}

}  // namespace
}  // namespace crownfit
