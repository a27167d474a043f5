// Self-consistency: photographs rendered by `shader` are fitted by `shader`. This says that the fit works; it says
// nothing about truth.

#include "fit_crown.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "base/files.h"
#include "base/random.h"
#include "capture/calibration_error.h"
#include "capture/capture.h"
#include "capture/poses.h"
#include "fit/choose_pixels.h"
#include "fit/compare_photographs.h"
#include "fit/fit_shader.h"
#include "optics/material_file.h"
#include "photo/image_io.h"
#include "report/finding_words.h"
#include "report/result_files.h"
#include "scene/cast_capture.h"
#include "support/channels.h"
#include "support/rendered_truth.h"
#include "support/synthetic_capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

CrownFit Fit(const Capture& capture, FitOptions options = {}, Model model = Model::kShader) {
  options.profile_points = 0;  // no test looks at them
  options.advises = false;     // nor at that
  Progress silent(ProgressMode::kNone);
  options.model = model;
  return FitCrown(capture, options, silent);
}

/// Largest relative error of the parameters with status "fitted"; `count`: their number of values.
double WorstError(const CrownFit& fit, const std::filesystem::path& folder, int& count) {
  const Material truth = ReadMaterialFile(folder / "truth.json", fit.capture);
  double worst = 0;
  count = 0;
  for (const auto& p : fit.uncertainty.parameters) {
    if (p.status != Status::kFitted) continue;
    const auto& owner = p.layer == kSurfaceOwner ? truth.surface : truth.layers[p.layer];
    for (int c = 0; c < static_cast<int>(p.value.size()); ++c, ++count)
      worst = std::max(worst, std::abs(p.value[c] / owner[p.quantity][c] - 1.0));
  }
  return worst;
}

/// Few photographs and a fixed outer layer, for tests that do not depend on the number of photographs.
void Keep(const std::vector<size_t>& photographs, Capture& capture, FitOptions& options) {
  std::vector<PhotographSpec> kept;
  for (size_t i : photographs) kept.push_back(capture.photographs[i]);
  capture.photographs = kept;
  for (const auto& row : kParameters)
    if (row.owner == Owner::kLayer) {
      ParameterSpec& outer = capture.layers[0][row.quantity];
      if (!outer.fixed)
        options.overrides.fix.push_back({capture.layers[0].name + "." + std::string(row.key), outer.value.list()});
    }
}

class SelfConsistency : public testing::Test {
 protected:
  Capture Make(SyntheticCapture options) {
    options.size = 0.5;
    WriteSyntheticCapture(folder.path, options);
    const Capture made = ReadCapture(folder.path);
    RenderTruth(made, TruthOf(made));
    return ReadCapture(folder.path);
  }
  TemporaryFolder folder;
};

TEST_F(SelfConsistency, IdentifiedParametersAreRecoveredWithinOnePerCent) {
  const CrownFit fit = Fit(Make({.pixels = 24}), {}, Model::kAuto);
  EXPECT_EQ(fit.model, Model::kShader) << "shader suffices for photographs that it rendered";
  int count = 0;
  EXPECT_LT(WorstError(fit, folder.path, count), 0.01);
  EXPECT_GE(count, 10);  // of twelve coefficients and the roughness
  EXPECT_TRUE(fit.usable);
  EXPECT_LT(fit.photographs[5].difference.p95, 0.05);  // the held-out one
  EXPECT_TRUE(fit.photographs[5].is_holdout);
}

TEST_F(SelfConsistency, FreeThicknessConvergesByRecasting) {
  const Capture capture = Make({.pixels = 24, .initial_factor = 1.5, .free_thickness = true});
  const Material truth = TruthOf(capture);
  FitOptions options;  // six derivatives in place of thirteen: half the time
  options.overrides.fix = {{"surface.roughness", truth.surface[Quantity::kRoughness].list()},
                           {"enamel.reduced_scattering_per_mm", truth.layers[0][Quantity::kReducedScattering].list()}};
  const CrownFit fit = Fit(capture, options);
  int count = 0;
  EXPECT_LT(WorstError(fit, folder.path, count), 0.01);
  EXPECT_GE(count, 7);
  const double thickness = truth.layers[0][Quantity::kThickness][0];  // the start is 1.4 times as thick
  EXPECT_NEAR(fit.material.layers[0][Quantity::kThickness][0], thickness, 0.01 * thickness);
  EXPECT_GT(fit.casts, 1);
  EXPECT_TRUE(fit.converged) << fit.casts << " casts";
}

TEST_F(SelfConsistency, FreeThicknessEscapesTheEqualOpticalDepthMinimum) {
  // Black glass: reflected light determines scattering over absorption, transmitted light absorption times depth. Only
  // the shadow's edge determines the scale of length.
  std::filesystem::copy(CROWNFIT_DATASETS "/disc", folder.path, std::filesystem::copy_options::recursive);
  Capture capture = ReadCapture(folder.path);
  for (PhotographSpec& p : capture.photographs) p.camera = WithPixels(p.camera, 24, 24, 4.0, 4.0);
  const auto set = [&](Quantity q, const Spectrum& value, bool is_free) {
    ParameterSpec& spec = capture.layers[0][q];
    spec.value = value;
    spec.fixed = !is_free;
    spec.sharing = q == Quantity::kAbsorption ? Sharing::kNone : Sharing::kOneValue;
  };
  set(Quantity::kReducedScattering, {0.00726, 0.00726, 0.00726}, true);
  set(Quantity::kAbsorption, {10.58, 5.19, 6.63}, true);
  set(Quantity::kIor, {1.354, 1.354, 1.354}, false);
  set(Quantity::kAsymmetry, {0.0, 0.0, 0.0}, false);
  set(Quantity::kThickness, {1.0, 1.0, 1.0}, true);
  capture.surface[static_cast<size_t>(Quantity::kRoughness)].value.fill(0.03);
  capture.surface[static_cast<size_t>(Quantity::kRoughness)].fixed = true;
  std::erase_if(capture.photographs, [](const PhotographSpec& p) { return p.is_holdout; });
  for (Light& light : capture.lights) light.intensity_scale = 100.0;  // far above the assumed read noise
  for (PhotographSpec& p : capture.photographs) p.files.variance.reset();
  RenderTruth(capture, StatedMaterial(capture));
  set(Quantity::kReducedScattering, {0.0034, 0.0034, 0.0034}, true);
  set(Quantity::kAbsorption, {13.6, 8.9, 3.8}, true);
  set(Quantity::kThickness, {2.6, 2.6, 2.6}, true);
  const CrownFit fit = Fit(capture);
  EXPECT_NEAR(fit.material.layers[0][Quantity::kThickness][0], 1.0, 0.02);
  EXPECT_NEAR(fit.material.layers[0][Quantity::kAbsorption][1], 5.19, 0.1);
}

TEST_F(SelfConsistency, FreeExposuresAreFoundInClosedForm) {
  const CrownFit fit = Fit(Make({.pixels = 24, .free_exposures = true}));
  int count = 0;
  EXPECT_LT(WorstError(fit, folder.path, count), 0.01);
  EXPECT_GE(count, 8);
  for (const auto& p : fit.photographs) EXPECT_NEAR(p.exposure, 1.0, 0.01) << p.name;
}

TEST_F(SelfConsistency, AFreeLightScaleIsFoundInClosedForm) {
  Capture capture = Make({.pixels = 24});
  for (auto& light : capture.lights) {
    if (light.name != "behind") continue;
    light.scale_is_free = true;
    light.intensity_scale = 3.0;
  }
  const CrownFit fit = Fit(capture);
  EXPECT_NEAR(fit.scales.light[3], 1.0, 0.01);
  int count = 0;
  EXPECT_LT(WorstError(fit, folder.path, count), 0.01);
}

TEST_F(SelfConsistency, OneAndTwoThreadsGiveTheSameBytes) {
  Capture capture = Make({.pixels = 24});
  FitOptions one, two;
  Keep({0, 3}, capture, one);
  two = one;
  one.threads = 1;
  two.threads = 2;
  EXPECT_EQ(MaterialJson(Fit(capture, one)), MaterialJson(Fit(capture, two)));
}

TEST_F(SelfConsistency, HeldOutPhotographDoesNotAffectTheFit) {
  Capture capture = Make({.pixels = 24});
  FitOptions options;
  Keep({0, 5}, capture, options);
  const CrownFit before = Fit(capture, options);
  WriteImageFile(capture.photographs[1].files.image, Image(24, 24, 3, 0.123f));
  const CrownFit after = Fit(capture, options);
  for (size_t i = 0; i < before.uncertainty.parameters.size(); ++i)
    EXPECT_EQ(before.uncertainty.parameters[i].value, after.uncertainty.parameters[i].value);
  EXPECT_NE(before.photographs[1].difference.median, after.photographs[1].difference.median);
}

TEST_F(SelfConsistency, ConvergesFromBothEndsOfTheRange) {
  Capture capture = Make({.pixels = 24, .initial_factor = 1.0});
  FitOptions options;
  Keep({0, 3}, capture, options);
  const CrownFit near = Fit(capture, options);
  EXPECT_TRUE(near.usable);
  for (const bool from_top : {false, true}) {
    for (const Quantity q : {Quantity::kReducedScattering, Quantity::kAbsorption}) {
      ParameterSpec& spec = capture.layers[1][q];
      spec.value.fill(from_top ? spec.high : spec.low);
    }
    const CrownFit far = Fit(capture, options);
    EXPECT_TRUE(far.usable);
    for (const Quantity q : {Quantity::kReducedScattering, Quantity::kAbsorption})
      for (int c = 0; c < kChannels; ++c)
        EXPECT_NEAR(far.material.layers[1][q][c] / near.material.layers[1][q][c], 1.0, 1e-3) << from_top;
  }
}

TEST_F(SelfConsistency, ContradictoryPhotographsAreDetected) {
  Capture capture = Make({.pixels = 24, .initial_factor = 1.0});
  FitOptions options;
  Keep({0, 1, 3}, capture, options);
  const CrownFit good = Fit(capture, options);
  ASSERT_TRUE(good.usable) << InWords(good.reasons[0]);
  Image image = ReadImageFile(capture.photographs[1].files.image).image;
  for (size_t i = 0; i < image.values.size(); i += kChannels) std::swap(image.values[i], image.values[i + 2]);
  WriteImageFile(capture.photographs[1].files.image, image);
  const CrownFit fit = Fit(capture, options);
  EXPECT_FALSE(fit.usable);
  ASSERT_FALSE(fit.reasons.empty());
  EXPECT_EQ(fit.reasons[0].kind, FindingKind::kChi2) << InWords(fit.reasons[0]);
}

TEST_F(SelfConsistency, WrongSharedScatteringIsRejected) {
  WriteSyntheticCapture(folder.path, {.pixels = 24, .size = 0.5, .initial_factor = 1.0});
  Capture capture = ReadCapture(folder.path);
  Material truth = TruthOf(capture);
  constexpr double kExponent = 1.5;
  for (int c = 0; c < kChannels; ++c)
    truth.layers[1][Quantity::kReducedScattering][c] *= std::pow(capture.wavelengths_nm[c] / 540.0, -kExponent);
  RenderTruth(capture, truth);
  capture = ReadCapture(folder.path);
  FitOptions options;
  Keep({0, 1, 2}, capture, options);
  for (PhotographSpec& p : capture.photographs) p.files.noise.relative = 0.1;  // which hides a wrong law
  for (const Sharing law : {Sharing::kPowerLaw, Sharing::kOneValue}) {
    options.overrides.share = {{"dentine.reduced_scattering_per_mm", law}};
    const CrownFit fit = Fit(capture, options);
    ASSERT_EQ(fit.departures.size(), 1u) << Word(law);
    const LawDeparture& d = fit.departures[0];
    const bool holds = law == Sharing::kPowerLaw;
    EXPECT_EQ(d.freedom, holds ? 1 : 2);
    EXPECT_EQ(fit.usable, holds) << (fit.reasons.empty() ? "" : InWords(fit.reasons[0]));
    for (int c = 0; c < kChannels && holds; ++c) EXPECT_LT(std::abs(d.off[c]), 0.3 * d.stddev[c]);
    if (holds) continue;
    EXPECT_LT(d.off[0], 0.0);
    EXPECT_GT(d.off[2], 0.0);
    ASSERT_FALSE(fit.reasons.empty());
    EXPECT_EQ(fit.reasons[0].kind, FindingKind::kSharingRejected) << InWords(fit.reasons[0]);
    EXPECT_EQ(fit.reasons[0].names[0], "dentine.reduced_scattering_per_mm");
  }
}

TEST_F(SelfConsistency, PredictionNoiseDoesNotBiasTheComparison) {
  const Capture capture = Make({.pixels = 48, .initial_factor = 1.0});
  const CrownInput input = ReadInput(capture, 0);
  Progress silent(ProgressMode::kNone);
  const Material material = StatedMaterial(input.capture);
  const CastState state = CastAll(input, ThicknessesOf(input.capture, material), {}, silent);
  const LinearScales scales{{}, StatedLightScales(input.capture), {}};
  const Predictor exact = PredictorByShader(input, state, material, scales, 0);
  constexpr double kNoise = 0.7;  // relative to the light; no pixel is darker than black
  const auto noisy = [&](size_t photograph) {
    PredictedPixels p = exact(photograph);
    for (size_t i = 0; i < p.values.size(); ++i) {
      p.variances.push_back(std::pow(kNoise, 2) * p.values[i] * p.values[i]);
      p.values[i] *= std::max(0.0, 1.0 + kNoise * Gaussian(Key(5, photograph), i));
    }
    return p;
  };
  const std::vector<FitPixels> pixels = ChoosePixels(input, state, 6000);
  for (const PhotographResult& r : ComparePhotographs(input, state, noisy, scales, pixels, 0)) {
    EXPECT_LT(std::abs(r.level - 1.0), 4.0 * r.level_stddev) << r.name;
    EXPECT_LT(r.level_stddev, 0.15) << r.name;
    EXPECT_GT(r.level_stddev, 0.01) << r.name;
    EXPECT_NEAR(r.reduced_chi2, 1.0, 0.2) << r.name;
  }
}

TEST_F(SelfConsistency, FullMaskEqualsNoMask) {
  Capture capture = Make({.pixels = 24});
  FitOptions options;
  Keep({0, 3}, capture, options);
  const CrownFit without = Fit(capture, options);
  for (PhotographSpec& p : capture.photographs) {
    p.files.mask = folder.path / "everything.exr";
    WriteImageFile(*p.files.mask, Image(24, 24, 1, 1.0f));
  }
  const CrownFit with = Fit(capture, options);
  for (size_t l = 0; l < with.material.layers.size(); ++l)
    EXPECT_EQ(with.material.layers[l].values, without.material.layers[l].values);
}

TEST_F(SelfConsistency, UnseenParameterIsUnidentifiedWithWideStddev) {
  Capture capture = Make({.pixels = 24});
  FitOptions options;
  Keep({0, 3}, capture, options);
  options.overrides.free = {"enamel.isotropic_fraction"};  // the model depends only on g and reduced scattering
  const CrownFit fit = Fit(capture, options);
  for (const auto& p : fit.uncertainty.parameters) {
    if (p.name != "enamel.isotropic_fraction") continue;
    EXPECT_EQ(p.status, Status::kNotIdentified);
    EXPECT_GE(p.stddev[0], 1.0);  // as wide as its range
    return;
  }
  FAIL() << "enamel.isotropic_fraction is not in the result";
}

TEST_F(SelfConsistency, OneEvenlyLitPhotographDoesNotIdentifyTwoLayers) {
  Capture capture = Make({.pixels = 24});
  for (auto& p : capture.photographs) {
    p.is_holdout = p.name != "front_black";
    p.exposure_is_free = true;
  }
  const CrownFit fit = Fit(capture);
  int fitted = 0, unidentified = 0;
  for (const auto& p : fit.uncertainty.parameters) {
    fitted += p.status == Status::kFitted;
    unidentified += p.status == Status::kNotIdentified || p.status == Status::kPrior || p.status == Status::kAtBound;
  }
  EXPECT_GE(unidentified, 1) << VerdictInWords(fit);
  EXPECT_FALSE(fit.uncertainty.weak_directions.empty());
}

TEST_F(SelfConsistency, IntervalsCoverTheTruthUnderNoise) {
  // 1 % noise in every pixel: the 95 % intervals hold the truth for at least 10 of 13 values (a fit of true coverage
  // 0.95 falls below that once in 300 draws).
  const Capture capture = Make({.pixels = 24});
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    Image image = ReadImageFile(capture.photographs[i].files.image).image;
    for (size_t k = 0; k < image.values.size(); ++k) {
      double normal = -6.0;  // sum of twelve uniforms
      for (int j = 0; j < 12; ++j) normal += Uniform(Key(91, i, k), j);
      image.values[k] += static_cast<float>(normal * std::hypot(0.01 * image.values[k], 0.0005));
    }
    WriteImageFile(capture.photographs[i].files.image, image);
  }
  const CrownFit fit = Fit(capture);
  const Material truth = ReadMaterialFile(folder.path / "truth.json", fit.capture);
  int inside = 0, count = 0;
  for (const auto& p : fit.uncertainty.parameters) {
    if (p.stddev.empty()) continue;
    const auto& owner = p.layer == kSurfaceOwner ? truth.surface : truth.layers[p.layer];
    for (int c = 0; c < static_cast<int>(p.value.size()); ++c, ++count)
      inside += p.low95[c] <= owner[p.quantity][c] && owner[p.quantity][c] <= p.high95[c];
  }
  EXPECT_EQ(count, 13);
  EXPECT_GE(inside, 10);
  EXPECT_NEAR(fit.uncertainty.reduced_chi2, 1.0, 0.1);
}

TEST_F(SelfConsistency, PoseAndLampErrorsWithinStddevAreCorrected) {
  Capture capture = Make({.pixels = 24, .initial_factor = 1.0});
  FitOptions options;
  Keep({0}, capture, options);
  const CrownFit exact = Fit(capture, options);
  for (auto& p : capture.photographs) {
    std::array<double, 36> covariance{};
    for (int k = 0; k < 6; ++k) covariance[7 * k] = k < 3 ? 1e-5 * 1e-5 : 0.1 * 0.1;
    p.pose_covariance = covariance;
    p.camera_from_object.translation_mm += glm::dvec3(0.12, -0.08, 0.0);
  }
  for (auto& light : capture.lights)
    if (auto* lamp = std::get_if<RectangleLight>(&light.shape)) {
      lamp->centre_mm += glm::dvec3(0, 4, 0);
      light.covariance_mm2 = glm::dmat3(9.0);
    }
  const CrownFit moved = Fit(capture, options);
  EXPECT_TRUE(moved.converged);
  EXPECT_LT(moved.uncertainty.reduced_chi2, 1.2 * exact.uncertainty.reduced_chi2 + 0.02);
  ASSERT_GE(moved.calibration.size(), 2u);
  // 0.12 and 0.08 mm against a stated 0.1 mm.
  EXPECT_NEAR(moved.calibration[0].chi2, 1.44 + 0.64, 0.4);
  for (size_t i = 0; i < exact.uncertainty.parameters.size(); ++i) {
    const auto &a = exact.uncertainty.parameters[i], &b = moved.uncertainty.parameters[i];
    for (size_t c = 0; c < a.stddev.size(); ++c) EXPECT_NEAR(a.value[c], b.value[c], 0.5 * b.stddev[c]) << a.name;
  }
}

TEST(ShaderSuffices, IfResidualsAndCalibrationAreWithinNoise) {
  const auto moved = [](double stddevs) {
    return MovedCalibration{CalibrationKind::kPlace, "the place of light 'left'", 3, 3 * stddevs * stddevs};
  };
  EXPECT_TRUE(WhetherShaderSuffices(1.2, {}).suffices);
  EXPECT_TRUE(WhetherShaderSuffices(1.2, {moved(1.5), moved(0.2)}).suffices);
  EXPECT_FALSE(WhetherShaderSuffices(1.8, {moved(0.2)}).suffices);
  const ModelChoice far = WhetherShaderSuffices(0.2, {moved(0.2), moved(3.0)});
  EXPECT_FALSE(far.suffices) << "lamps absorb a model's errors before patches show them";
  EXPECT_NE(far.why.find("moved the calibration by 3 times"), std::string::npos) << far.why;
  EXPECT_FALSE(WhetherShaderSuffices(1.2, {}, 4.0).suffices) << "an index far outside its prior";
}

TEST(ModelChoice, ComparesOnlyPriorsNarrowerThanTheDefault) {
  FreeParameters free;
  for (const double stddev : {0.05, RowOf(Quantity::kIor).prior_stddev}) {
    free.entries.emplace_back();
    free.entries.back().quantity = Quantity::kIor;
    free.entries.back().prior_mean = 1.6, free.entries.back().prior_stddev = stddev;
  }
  EXPECT_NEAR(OffNarrowPriors(free, Eigen::Vector2d(1.7, 2.6)), 2.0, 1e-9) << "the default prior does not count";
}

TEST_F(SelfConsistency, UncertainExposureLiesBetweenFixedAndFree) {
  Capture capture = Make({.pixels = 16, .initial_factor = 1.0});
  FitOptions options;
  Keep({0, 3}, capture, options);
  const auto width = [&](double stddev, bool is_free) {
    for (auto& p : capture.photographs) p.exposure_stddev = stddev, p.exposure_is_free = is_free;
    for (const auto& p : Fit(capture, options).uncertainty.parameters)
      if (p.name == "dentine.absorption_per_mm") return p.stddev[0] / p.value[0];
    return 0.0;
  };
  const double exact = width(0, false), free = width(0, true);
  EXPECT_GT(std::abs(free / exact - 1), 0.05);
  EXPECT_NEAR(width(1e-7, false), exact, 1e-3 * exact);
  EXPECT_NEAR(width(1e5, false), free, 1e-3 * free);
}

/// A small capture whose dentine asymmetry is also free, and the uncertainties reported for it.
struct FreeAsymmetry {
  FreeAsymmetry() {
    const TemporaryFolder folder;
    WriteSyntheticCapture(folder.path, {.pixels = 8, .size = 0.5});
    capture = ReadCapture(folder.path);
    capture.layers[1][Quantity::kAsymmetry].fixed = false;
    free = FreeParametersOf(capture);
  }
  /// Start values, but for the asymmetry.
  Eigen::VectorXd At(const std::function<double(const FreeEntry&)>& asymmetry) const {
    Eigen::VectorXd x = StartVector(free);
    for (int k = 0; k < free.count(); ++k)
      if (free.entries[k].quantity == Quantity::kAsymmetry) x[k] = asymmetry(free.entries[k]);
    return x;
  }
  /// The uncertainty if photographs determine every entry independently to within `stddev`.
  Uncertainty Told(const Eigen::VectorXd& x, double stddev) const {
    DataEstimate known;
    known.covariance = stddev * stddev * Eigen::MatrixXd::Identity(free.count(), free.count());
    known.unseen = Eigen::MatrixXd(free.count(), 0);
    known.by_photographs = x;
    return Quantify(capture, free, x, known, false);
  }

  Capture capture;
  FreeParameters free;
};

TEST(Uncertainty, BoundsMayBeNegativeAndLowerLimitsAreLinear) {
  const FreeAsymmetry c;
  const Eigen::VectorXd x = c.At([](const FreeEntry& e) { return e.low; });
  for (const FittedParameter& p : c.Told(x, 0.2).parameters) {
    if (p.status == Status::kFixed) continue;
    if (p.quantity == Quantity::kAsymmetry) {
      EXPECT_LT(p.value[0], 0.0);
      EXPECT_EQ(p.status, Status::kAtBound) << p.name << " " << p.value[0];
    }
    if (p.quantity != Quantity::kAbsorption) continue;
    EXPECT_EQ(p.status, Status::kFitted);
    EXPECT_NEAR(p.low95[0] / p.value[0], 1.0 - 1.96 * 0.2, 1e-4);
    EXPECT_NEAR(p.high95[0] / p.value[0], std::exp(1.96 * 0.2), 1e-4);
  }
}

TEST(Uncertainty, ZeroValuesAreIdentifiedByAbsoluteWidth) {
  const FreeAsymmetry c;
  const Eigen::VectorXd x = c.At([](const FreeEntry&) { return 0.0; });
  for (const auto& [stddev, status] : {std::pair{0.01, Status::kFitted}, {0.2, Status::kNotIdentified}})
    for (const FittedParameter& p : c.Told(x, stddev).parameters)
      if (p.quantity == Quantity::kAsymmetry && p.status != Status::kFixed) {
        EXPECT_EQ(p.status, status) << p.name << " +- " << stddev;
      }
}

TEST(CalibrationErrors, PoseErrorsReproduceTheCovariance) {
  Capture capture;
  PhotographSpec photo;
  photo.name = "front";
  std::array<double, 36> covariance{};
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) covariance[6 * r + c] = (r == c ? 2.0 : 0.3) * (1 + r) * (1 + c);
  photo.pose_covariance = covariance;
  capture.photographs = {photo, photo};  // both have one pose
  const auto errors = StatedErrors(capture);
  ASSERT_EQ(errors.size(), 6u);
  EXPECT_EQ(errors[0].photographs, (std::vector<size_t>{0, 1}));
  const auto at = [](const CalibrationError& e, int k) { return k < 3 ? e.turn[k] : e.shift[k - 3]; };
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) {
      double sum = 0;
      for (const auto& e : errors) sum += at(e, r) * at(e, c);
      EXPECT_NEAR(sum, covariance[6 * r + c], 1e-9);
    }
  capture.photographs[0].is_holdout = true;
  EXPECT_EQ(StatedErrors(capture).size(), 6u);
  capture.photographs[1].is_holdout = true;  // neither is fitted
  EXPECT_TRUE(StatedErrors(capture).empty());
}

TEST(CalibrationErrors, LampErrorsReproduceTheCovariance) {
  Capture capture;
  capture.photographs.resize(1);
  capture.photographs[0].lights = {0};
  Light lamp;
  lamp.shape = PointLight{{0, 0, 300}, glm::dvec3(1.0), 1.0};
  lamp.covariance_mm2 = {{4, 1, 3}, {1, 2, 0}, {3, 0, 100}};
  capture.lights = {lamp};
  glm::dmat3 sum(0.0);
  for (const CalibrationError& e : StatedErrors(capture)) sum += glm::outerProduct(e.shift, e.shift);
  for (int c = 0; c < 3; ++c) EXPECT_LT(glm::length(sum[c] - lamp.covariance_mm2[c]), 1e-9);
}

TEST(CalibrationErrors, RotationStddevIsAboutTheObjectNotTheCamera) {
  TemporaryFolder folder;
  WriteTextFile(folder.path / "pose.json", R"({"rotation": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "translation_mm": [1, 2, 250], "stddev": {"rotation_deg": 0.1, "translation_mm": 0.02}})");
  const auto covariance = ReadPoseCovariance(JsonFile(folder.path / "pose.json").root());
  ASSERT_TRUE(covariance);
  const glm::dmat3 place = PlaceCovariance(*covariance, {1, 2, 250});
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(place[k][k], 0.02 * 0.02, 1e-9);
}

}  // namespace
}  // namespace crownfit
