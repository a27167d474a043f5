// Several captures of one material, fitted together.

#include "fit_together.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "base/error.h"
#include "fit/judge.h"
#include "support/rendered_truth.h"
#include "support/synthetic_capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

TEST(GaussianInformation, DisagreementCountsOnlySharedParameters) {
  GaussianInformation a{{"a", "b"}, Eigen::Vector2d(1.0 / 0.09, 4).asDiagonal(), {}}, b = a;
  b.precision = Eigen::Vector2d(1.0 / 0.16, 0).asDiagonal();
  a.weighted_mean = a.precision * Eigen::Vector2d(1, 7);
  b.weighted_mean = b.precision * Eigen::Vector2d(2, 0);
  const Disagreement d = Compared(a, b);
  EXPECT_EQ(d.freedom, 1);
  EXPECT_NEAR(d.chi2, 1.0 / (0.09 + 0.16), 1e-9);
  EXPECT_EQ(d.name, "a");
  EXPECT_NEAR(UnlikelyChi2(1), 15.137, 0.001) << "from published tables";
  EXPECT_NEAR(UnlikelyChi2(10), 35.564, 0.001);
}

TEST(GaussianInformation, MarginalsAndSumsAreThoseOfGaussians) {
  Eigen::MatrixXd root(3, 3);
  root << 2, 0.5, -1, 0, 1, 0.3, 0, 0, 1.5;
  const Eigen::Vector3d mean(0.2, -1, 3);
  GaussianInformation all{{"a", "b", "c"}, root.transpose() * root, {}};
  all.weighted_mean = all.precision * mean;
  const GaussianInformation some = Marginal(all, {"c", "a", "unknown"});
  ASSERT_EQ(some.names, (std::vector<std::string>{"a", "c"}));
  const Eigen::MatrixXd covariance = all.precision.inverse();
  EXPECT_NEAR(some.precision.inverse()(0, 1), covariance(0, 2), 1e-12);
  EXPECT_LT((MeanOf(some, Eigen::Vector2d::Zero()) - Eigen::Vector2d(0.2, 3)).norm(), 1e-12);

  GaussianInformation sum = NothingOf({"c", "d"});
  Add(sum, all);
  Add(sum, all);
  EXPECT_NEAR(sum.precision(0, 0), 2.0 / covariance(2, 2), 1e-12) << "b integrated out";
  const Eigen::VectorXd stands = MeanOf(sum, Eigen::Vector2d(7, 8));
  EXPECT_NEAR(stands[0], 3, 1e-12);
  EXPECT_NEAR(stands[1], 8, 1e-12) << "it keeps its value: nothing is known of it";
}

/// Two captures of one crown, some photographs in each, at the true values of model `shader`.
class TwoCaptures : public testing::Test {
 protected:
  TwoCaptures() {
    WriteSyntheticCapture(folder_.path / "all", {.pixels = 12, .levels = 9, .initial_factor = 1.5});
    all_ = ReadCapture(folder_.path / "all");
    std::erase_if(all_.photographs, [](const PhotographSpec& p) {
      return !p.scenery.empty() || p.name == "front_white";  // the same as front_black without tiles
    });
    for (PhotographSpec& p : all_.photographs) {
      p.is_holdout = false;
      p.backing.reset();  // halves the time
    }
    RenderTruth(all_, TruthOf(all_));
    options_.model = Model::kShader;
    options_.profile_points = 0;
    const Material truth = TruthOf(all_);
    options_.overrides.fix = {
        {"surface.roughness", truth.surface[Quantity::kRoughness].list()},
        {"enamel.reduced_scattering_per_mm", truth.layers[0][Quantity::kReducedScattering].list()},
        {"enamel.absorption_per_mm", truth.layers[0][Quantity::kAbsorption].list()},
        {"dentine.reduced_scattering_per_mm", truth.layers[1][Quantity::kReducedScattering].list()}};
  }
  Capture With(const std::vector<size_t>& photographs, const char* name) const {
    Capture capture = all_;
    capture.photographs.clear();
    for (const size_t i : photographs) capture.photographs.push_back(all_.photographs[i]);
    capture.folder = folder_.path / name;  // sets its name
    return capture;
  }
  TemporaryFolder folder_;
  Capture all_;
  FitOptions options_;
  Progress silent_{ProgressMode::kNone};
};

TEST_F(TwoCaptures, JointFitMatchesOneFitOfAllPhotographs) {
  const CrownFit one = FitCrown(With({0, 1, 2, 3}, "one"), options_, silent_);
  const std::vector<CrownFit> fits = FitTogether({With({0, 2}, "a"), With({1, 3}, "b")}, options_, silent_);
  for (const CrownFit& fit : fits) {
    ASSERT_TRUE(fit.usable);
    for (size_t k = 0; k < one.entries.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const double stddev = std::sqrt(one.uncertainty.covariance(at, at));
      EXPECT_NEAR(fit.best[at], one.best[at], 0.05 * stddev) << one.entries[k].name;
      EXPECT_NEAR(std::sqrt(fit.uncertainty.covariance(at, at)), stddev, 0.1 * stddev) << one.entries[k].name;
    }
  }
  EXPECT_LT((fits[0].best - fits[1].best).norm(), 1e-9) << "both fits share the material";
  const CrownFit joined = Joined(fits);
  EXPECT_EQ(joined.photographs.size(), 4u);
  EXPECT_EQ(joined.photographs[2].name.substr(0, 2), "b_");
  EXPECT_TRUE(joined.usable);
  CrownFit readings = fits[0];
  readings.model = Model::kLayered;
  EXPECT_EQ(Joined({readings, fits[1]}).model, Model::kShader) << "whichever comes first";
  for (const size_t refused : {0, 1}) {
    std::vector<CrownFit> with = fits;
    with[refused].residual_chi2.regions = {12.0, 0.9, 96.0, 1.0};
    EXPECT_FALSE(Joined(with).usable) << refused << ": noise does not explain its residuals";
    with = fits;
    with[refused].inflation[0] = kMostInflated;
    Judge(with[refused]);
    EXPECT_FALSE(Joined(with).usable) << refused << ": its own calibration is contradicted";
  }
}

TEST_F(TwoCaptures, DifferentMaterialsAreDetected) {
  Capture other = With({1, 3}, "other");
  Material darker = TruthOf(all_);
  darker.layers[1][Quantity::kAbsorption] *= 3.0;
  RenderTruth(other, darker);
  const std::vector<CrownFit> fits = FitTogether({With({0, 2}, "first"), other}, options_, silent_);
  EXPECT_EQ(std::ranges::count(fits[0].caveats, FindingKind::kCapturesDisagree, &Finding::kind), 2)
      << "each disagrees with the other";
}

TEST_F(TwoCaptures, InconsistentCapturesAreRefused) {
  Capture other = With({1, 3}, "other");
  other.layers[1][Quantity::kAsymmetry].value.fill(0.5);
  EXPECT_THROW(FitTogether({With({0, 2}, "first"), other}, options_, silent_), InputError);
  EXPECT_THROW(FitTogether({With({0, 2}, "first"), With({2, 3}, "second")}, options_, silent_), InputError)
      << "both contain one photograph";
  FitOptions without = options_;
  without.leave_out = {"tile:of_nobody"};
  EXPECT_THROW(FitTogether({With({0, 2}, "first"), With({1, 3}, "second")}, without, silent_), InputError);
  for (LayerSpec& layer : other.layers) layer.name += "_of_another";
  EXPECT_THROW(FitTogether({With({0, 2}, "first"), other}, options_, silent_), InputError) << "they share no parameter";
}

TEST_F(TwoCaptures, HeldOutPhotographMayBeSharedInEitherOrder) {
  Capture holds_out = With({0, 2}, "first");
  holds_out.photographs[0].is_holdout = true;
  const Capture fits_it = With({0, 3}, "second");
  EXPECT_NO_THROW(FitTogether({holds_out, fits_it}, options_, silent_));
  EXPECT_NO_THROW(FitTogether({fits_it, holds_out}, options_, silent_));
}

TEST_F(TwoCaptures, JointFitListsParametersOfLaterCaptures) {
  CrownFit first = FitCrown(With({0, 2}, "a"), options_, silent_), second = first;
  first.capture.layers.resize(1);
  std::erase_if(first.uncertainty.parameters,
                [](const FittedParameter& p) { return p.layer != kSurfaceOwner && p.layer > 0; });
  const CrownFit joined = Joined({first, second});
  const auto lists = [&](size_t capture) {
    const auto& own = joined.together[capture].its_own;
    return std::any_of(own.begin(), own.end(),
                       [](const FittedParameter& p) { return p.name == "dentine.absorption_per_mm"; });
  };
  EXPECT_FALSE(lists(0));
  EXPECT_TRUE(lists(1));
}

}  // namespace
}  // namespace crownfit
