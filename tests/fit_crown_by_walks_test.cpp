// Path-traced photographs, fitted by path tracing: the truth lies within the fitted intervals.

#include <gtest/gtest.h>

#include <cmath>

#include "base/files.h"
#include "base/random.h"
#include "fit/compare_photographs.h"
#include "fit_crown.h"
#include "fit_path/gather_walks.h"
#include "optics/material_file.h"
#include "path/path_photograph.h"
#include "photo/image_io.h"
#include "plan/check_capture.h"
#include "plan/start_state.h"
#include "report/result_files.h"
#include "support/channels.h"
#include "support/rendered_truth.h"
#include "support/synthetic_capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// Path-traces the photographs of a synthetic capture from its truth.json; `exposures`: recorded over stated.
Capture Walked(const std::filesystem::path& folder, const std::vector<double>& exposures, uint64_t seed = 77) {
  WriteSyntheticCapture(folder, {.pixels = 24, .size = 0.5});
  Capture capture = ReadCapture(folder);
  const Material truth = ReadMaterialFile(folder / "truth.json", capture);
  const CrownInput input = ReadInput(capture, 0, false);
  const LayeredBody body(BuildSurfaces(capture, input.source, ThicknessesOf(capture, truth)), 0);
  constexpr double kNoise = 0.01, kFloor = 5e-4;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const PathPhotograph photo =
        RenderByPaths(capture, body, input.scenery, truth, i, {200, seed, 3, 0}, [](double) {});
    const auto of_walks = SmoothedCovariance(photo);
    const double exposure = exposures[i];
    Image picture(photo.width, photo.height, 3), variance = picture;
    for (size_t p = 0; p < photo.pixels.size(); ++p)
      for (int c = 0; c < kChannels; ++c) {
        const double value = exposure * photo.pixels[p].mean[c], sensor = std::hypot(kNoise * value, kFloor);
        picture.values[3 * p + c] = static_cast<float>(value + sensor * Gaussian(Key(5, i, p), c));
        variance.values[3 * p + c] =
            static_cast<float>(sensor * sensor + exposure * exposure * of_walks[p][PairOf(c, c, kChannels)]);
      }
    PhotographFiles& files = capture.photographs[i].files;
    WriteImageFile(files.image, picture);
    files.variance = folder / ("variance" + std::to_string(i) + ".exr");
    WriteImageFile(*files.variance, variance);
  }
  return capture;
}

CrownFit Fit(const Capture& capture, size_t walks, Model model = Model::kAuto) {
  FitOptions options;
  options.model = model;
  options.use_priors = false;
  options.advises = false;     // no test uses it
  options.profile_points = 0;  // nor these
  options.paths_per_photograph = walks;
  options.overrides.fix = {{"surface.roughness", {0.22, 0.22, 0.22}}};
  Progress silent(ProgressMode::kNone);
  return FitCrown(capture, options, silent);
}

struct Coverage {
  int fitted = 0, held = 0;
  double chi2 = 0;
};

Coverage CoverageOf(const CrownFit& fit, const std::filesystem::path& folder) {
  const Material truth = ReadMaterialFile(folder / "truth.json", fit.capture);
  Coverage coverage;
  for (const auto& p : fit.uncertainty.parameters) {
    if (p.status != Status::kFitted) continue;
    const auto& owner = p.layer == kSurfaceOwner ? truth.surface : truth.layers[p.layer];
    for (int c = 0; c < static_cast<int>(p.value.size()); ++c) {
      const double at = owner[p.quantity][c];
      ++coverage.fitted;
      coverage.held += p.low95[c] <= at && at <= p.high95[c];
      coverage.chi2 += std::pow(std::log(p.value[c] / at) / (p.stddev[c] / p.value[c]), 2);
    }
  }
  return coverage;
}

TEST(FitByWalks, IntervalsHoldTheTruthWhereShaderFails) {
  const TemporaryFolder folder;
  Capture capture = Walked(folder.path, {1.0, 1.04, 1.0, 0.97, 1.0, 1.0}, 81);
  for (size_t i : {1, 3}) capture.photographs[i].exposure_stddev = 0.04;
  const CrownFit fit = Fit(capture, 120000);
  EXPECT_EQ(fit.model, Model::kPath) << "shader is not enough";
  EXPECT_TRUE(fit.converged);
  EXPECT_TRUE(fit.usable);
  EXPECT_NEAR(fit.uncertainty.block_chi2, 1.0, 0.25)
      << "patch residuals are noise, which is correlated between channels";
  const Coverage c = CoverageOf(fit, folder.path);
  EXPECT_GE(c.fitted, 7);
  EXPECT_GE(c.held, c.fitted - 1);
  EXPECT_LT(c.chi2, 2.5 * c.fitted);
  const auto& dentine = fit.uncertainty.parameters;
  const auto s = std::find_if(dentine.begin(), dentine.end(), [](const FittedParameter& p) {
    return p.layer == 1 && p.quantity == Quantity::kReducedScattering;
  });
  EXPECT_LT(s->stddev[1] / s->value[1], 0.1) << "stated to be well known";
  for (const auto& [photograph, recorded] : {std::pair<size_t, double>{1, 1.04}, {3, 0.97}}) {
    const PhotographResult& p = fit.photographs[photograph];
    EXPECT_NEAR(p.exposure, recorded, 0.03);  // in this draw: about one standard deviation
    EXPECT_LT(std::abs(p.exposure - recorded), 2.0 * p.exposure_stddev) << p.exposure << " +- " << p.exposure_stddev;
    EXPECT_GT(p.exposure_stddev, 0.005) << "pixels with 30 % noise cannot determine it better";
    EXPECT_LT(p.exposure_stddev, 0.04) << "better known than stated";
  }
  EXPECT_EQ(fit.photographs[0].exposure_stddev, 0.0) << "exact";
  for (const PhotographResult& p : fit.photographs) {
    ASSERT_EQ(p.residual_chi2.has_value(), !p.is_holdout);
    if (p.is_holdout) continue;
    EXPECT_LT(std::abs(p.residual_chi2->patches.chi2 - 1), 4.0 * p.residual_chi2->patches.StddevByChance()) << p.name;
  }
  const std::string json = MaterialJson(fit);
  const size_t stddevs = json.find("\"linear_scales_stddev\"");
  ASSERT_NE(stddevs, std::string::npos);
  EXPECT_NE(json.find("\"exposure_scale " + fit.photographs[3].name + "\"", stddevs), std::string::npos);
  EXPECT_EQ(json.find("\"exposure_scale " + fit.photographs[0].name + "\"", stddevs), std::string::npos) << "exact";
  WriteTextFile(folder.path / "material.json", json);
  EXPECT_NO_THROW(ReadMaterialFile(folder.path / "material.json", fit.capture)) << "other commands read it";
  EXPECT_NE(fit.seen_by_shader.layers[0][Quantity::kReducedScattering][1],
            fit.material.layers[0][Quantity::kReducedScattering][1])
      << "the viewer keeps the values that match its own model";
  for (const double share : fit.uncertainty.of_walks) {
    EXPECT_GT(share, 0.0);
    EXPECT_LT(share, 1.0);
  }
}

TEST(FitByWalks, OneStepEstimatesTheDepartureFromAFalseLaw) {
  const TemporaryFolder folder;
  Capture capture = Walked(folder.path, {1.0, 1.0, 1.0, 1.0, 1.0, 1.0});
  Material material = ReadMaterialFile(folder.path / "truth.json", capture);
  Spectrum& dentine = material.layers[1][Quantity::kReducedScattering];
  const Spectrum truth = dentine;
  dentine.fill(std::cbrt(truth[0] * truth[1] * truth[2]));
  capture.layers[1][Quantity::kReducedScattering].sharing = Sharing::kOneValue;
  const Capture freed = WithoutLaws(capture, material);
  const FreeParameters free = FreeParametersOf(freed);
  FitOptions options;
  options.paths_per_photograph = 150000;
  const std::vector<CalibrationError> no_errors;
  const FitProblem problem{freed, free, no_errors, options};
  Progress silent(ProgressMode::kNone);
  CrownInput input = ReadInput(freed, 0);
  LinearisedPrediction prediction;
  FitState at = StateAtStart(problem, input, prediction, silent);
  const WalkUnknowns unknowns(problem, at);
  const WalkedStep::Solution s = WalkGatherer(problem, input, at, unknowns, silent)
                                     .Gather(60000, 60000, "step")
                                     .step.Solve(unknowns.RangesAlone(), unknowns.Untold());
  const int n = free.count();
  const auto departures = DeparturesFromLaws(capture, free, s.step.head(n), s.covariance.topLeftCorner(n, n));
  ASSERT_EQ(departures.size(), 1u);
  for (int c = 0; c < kChannels; ++c) {
    const double off = std::log(truth[c] / dentine[c]);
    EXPECT_NEAR(departures[0].off[c], off, 3.0 * departures[0].stddev[c]) << c;
    EXPECT_LT(departures[0].stddev[c], 0.1) << "otherwise the departure is not identified";
  }
}

TEST(FitByWalks, DiffusionIntervalsIncludeTheModelError) {
  // Clear enamel of g 0.96: ten collisions are less than half a transport mean free path, this model's worst case.
  const TemporaryFolder folder;
  const Capture capture = Walked(folder.path, {1.0, 1.0, 1.0, 1.0, 1.0, 1.0});
  const CrownFit fit = Fit(capture, 200000, Model::kDiffusion);
  EXPECT_EQ(fit.model, Model::kDiffusion);
  EXPECT_TRUE(fit.usable);
  EXPECT_LT(fit.uncertainty.block_chi2, 1.5) << "patch residuals stay within the stated model error";
  const Coverage c = CoverageOf(fit, folder.path);
  EXPECT_GE(c.fitted, 3);
  EXPECT_LT(c.chi2, 6.25 * c.fitted) << "channels share one model error, so that one direction is off in all: "
                                        "at most 2.5 standard deviations, against 2 by chance";
  EXPECT_TRUE(std::ranges::count(fit.caveats, Finding{FindingKind::kSwitchesToDiffusion, {10}}));
}

/// The bundled disc's first photographs at 12 x 12 pixels. Its roughness is fixed, otherwise every fit becomes four.
Capture FewPixels(const std::filesystem::path& folder, size_t photographs) {
  std::filesystem::copy(CROWNFIT_DATASETS "/disc", folder, std::filesystem::copy_options::recursive);
  Capture capture = ReadCapture(folder);
  std::erase_if(capture.photographs, [](const PhotographSpec& p) { return p.is_holdout; });
  capture.photographs.resize(photographs);
  for (PhotographSpec& p : capture.photographs) {
    p.camera = WithPixels(p.camera, 12, 12, 8.0, 8.0);
    p.files.variance.reset();
  }
  capture.surface[static_cast<size_t>(Quantity::kRoughness)].fixed = true;
  return capture;
}

TEST(FitByWalks, MeshThicknessIsHeldFixedAndReported) {
  const TemporaryFolder folder;
  Capture capture = FewPixels(folder.path, 1);
  capture.layers[0][Quantity::kThickness].fixed = false;
  RenderTruth(capture, StatedMaterial(capture));
  FitOptions options;
  options.model = Model::kPath;
  options.paths_per_photograph = 4000;
  Progress silent(ProgressMode::kNone);
  const CrownFit fit = FitCrown(capture, options, silent);
  const auto depth = std::find_if(fit.uncertainty.parameters.begin(), fit.uncertainty.parameters.end(),
                                  [](const FittedParameter& p) { return p.quantity == Quantity::kThickness; });
  EXPECT_EQ(depth->status, Status::kNotIdentified);
  EXPECT_TRUE(std::ranges::count(fit.caveats, Finding{FindingKind::kNotMovedByWalks, {}, {depth->name}}));
  EXPECT_EQ(fit.advice.find("thickness_mm"), fit.advice.npos) << "no photograph helps: " << fit.advice;
}

TEST(FitByWalks, StepCountIsBoundedForContradictoryPhotographs) {
  const TemporaryFolder folder;
  Capture capture = FewPixels(folder.path, 2);
  RenderTruth(capture, StatedMaterial(capture));
  std::swap(capture.photographs[0].files, capture.photographs[1].files);  // brighter before black than before white
  FitOptions options;
  options.model = Model::kPath;
  options.paths_per_photograph = 4000;
  options.advises = false;
  Progress silent(ProgressMode::kNone);
  const CrownFit fit = FitCrown(capture, options, silent);
  EXPECT_FALSE(fit.usable);
  EXPECT_GT(fit.uncertainty.block_chi2, 3.0);
  const auto searched = std::ranges::count(fit.steps, std::string("search"), &WalkedFitStep::stage);
  EXPECT_LE(searched, 14) << "from two starts at most; three steps in vain end a search";
  EXPECT_LT(fit.steps.size(), 20) << "nor do runs";
}

}  // namespace
}  // namespace crownfit
