// What a capture needs, foreseen, against what the photograph then tells and what leaving a part out then does.

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "fit/choose_pixels.h"
#include "fit/image_residuals.h"
#include "fit/scattering_laws.h"
#include "fit/solve.h"
#include "optics/material_file.h"
#include "plan/exact_statements.h"
#include "plan/foresee_photographs.h"
#include "plan/scene_requirements.h"
#include "plan/start_state.h"
#include "scene/cast_capture.h"
#include "support/channels.h"
#include "support/synthetic_capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// An incisor at its true values, with photographs as model `shader` predicts them at 1 % noise.
class Foreseen : public testing::Test {
 protected:
  Foreseen() {
    WriteSyntheticCapture(folder_.path, {.pixels = 20, .levels = 14, .size = 0.5, .initial_factor = 1.0});
    all_ = ReadCapture(folder_.path);
    for (PhotographSpec& p : all_.photographs) p.is_holdout = false;
  }

  /// The capture with only these of its photographs.
  Capture With(const std::vector<std::string>& names) const {
    Capture capture = all_;
    std::erase_if(capture.photographs,
                  [&](const PhotographSpec& p) { return !std::count(names.begin(), names.end(), p.name); });
    return capture;
  }

  /// Of the layers nothing else is free.
  Capture WithDentinesAbsorptionFree(const std::vector<std::string>& names) const {
    Capture capture = With(names);
    for (LayerSpec& layer : capture.layers)
      for (ParameterSpec& p : layer.parameters) p.fixed = true;
    capture.layers[1][Quantity::kAbsorption].fixed = false;
    return capture;
  }

  /// As if a fit had ended at the start values.
  static std::pair<CrownInput, FitState> FittedAtStart(const Capture& capture, const FreeParameters& free) {
    Progress silent(ProgressMode::kNone);
    CrownInput input = ReadInput(capture, 0, false);
    FitState at;
    at.x = StartVector(free);
    const Material material = MaterialAt(free, at.x);
    at.cast = CastAll(input, ThicknessesOf(capture, material), {}, silent);
    for (size_t i = 0; i < capture.photographs.size(); ++i) {
      const Camera& camera = capture.photographs[i].camera;
      Photograph photo;
      photo.linear = Image(camera.width, camera.height, kChannels);
      photo.variance = Image(camera.width, camera.height, kChannels, 1e-6f);
      photo.usable.assign(static_cast<size_t>(camera.width) * camera.height, 1);
      const auto values = PredictPixels(capture, at.cast, i, material, StatedLightScales(capture), 0);
      for (size_t k = 0; k < values.size(); ++k)
        for (int c = 0; c < kChannels; ++c) {
          const int x = at.cast.photographs[i].pixels[k].x, y = at.cast.photographs[i].pixels[k].y;
          photo.linear.at(x, y, c) = static_cast<float>(values[k][c]);
          photo.variance.at(x, y, c) = static_cast<float>(1e-6 + 1e-4 * values[k][c] * values[k][c]);
        }
      input.photographs.push_back(std::move(photo));
    }
    at.pixels = ChoosePixels(input, at.cast, 6000);
    const Evaluation e = ImageResiduals(capture, at.cast, free, at.pixels, {}, {3.0, 0}).Evaluate(at.x, true);
    at.scales = e.scales;
    at.knowledge = KnowledgeByShader(at.cast, free, at.x, e, at.pixels);
    return {std::move(input), std::move(at)};
  }

  /// With so many times as many pixels along either side.
  static Capture Finer(Capture capture, int times) {
    for (PhotographSpec& p : capture.photographs)
      p.camera = WithPixels(p.camera, times * p.camera.width, times * p.camera.height, 1.0 / times, 1.0 / times);
    return capture;
  }

  static std::vector<SceneRequirement> RequirementsOf(const FitProblem& problem, const CrownInput& input,
                                                      const FitState& at) {
    Progress silent(ProgressMode::kNone);
    const LinearisedPrediction prediction =
        ImageResiduals(problem.capture, at.cast, problem.free, at.pixels, {}, {3.0, 0}).Linearise(at.x);
    return SceneRequirements(problem, input, at, prediction, FitSeconds(problem, at), {}, silent);
  }

  TemporaryFolder folder_;
  Capture all_;
  FitOptions options_;
  std::vector<CalibrationError> no_errors_;
};

TEST_F(Foreseen, TheAdvisedPhotographNarrowsTheWeakestIntervalAsForeseen) {
  for (const char* alone : {"front", "side"}) {
    const Capture capture = With({alone});
    const FreeParameters free = FreeParametersOf(capture);
    const auto [input, at] = FittedAtStart(capture, free);
    Progress silent(ProgressMode::kNone);
    const Foresight foresight = ForeseePhotographs({capture, free, no_errors_, options_}, input, at, silent);
    ASSERT_TRUE(foresight.IsWorthTaking()) << alone;
    const ForeseenPhotograph& advised = foresight.best[0];
    const auto taken = FittedAtStart(WithIdea(capture, advised.idea), free).second;
    const double stddev =
        std::sqrt(taken.knowledge.Variance(Eigen::RowVectorXd::Unit(free.count(), foresight.weakest)));
    EXPECT_LT(stddev, 1.5 * advised.stddev) << alone << ": " << AdviceIn(free, foresight);
    EXPECT_GT(stddev, advised.stddev / 1.5) << alone << ": " << AdviceIn(free, foresight);
    EXPECT_LT(stddev, 0.9 * foresight.stddev);
  }
}

TEST_F(Foreseen, OnePredictionGivesTheDerivativesOfEveryQuestionAboutItsPixels) {
  const Capture capture = With({"front_black", "side"});
  Capture other = capture;  // frees more, and shares scattering otherwise
  for (LayerSpec& layer : other.layers) layer[Quantity::kIor].fixed = false;
  for (LayerSpec& layer : other.layers) layer[Quantity::kReducedScattering].sharing = Sharing::kNone;
  const FreeParameters free = FreeParametersOf(capture), others = FreeParametersOf(other);
  ASSERT_GT(others.count(), free.count());
  const auto [input, at] = FittedAtStart(capture, free);
  const LinearisedPrediction prediction =
      ImageResiduals(capture, at.cast, free, at.pixels, {}, {3.0, 0}).Linearise(at.x);
  std::vector<FitPixels> noisy = at.pixels;
  for (FitPixels& p : noisy)
    for (Spectrum& s : p.stddev) s *= 3.0;
  const ImageResiduals residuals(other, at.cast, others, noisy, {}, {0.0, 0});
  const Eigen::VectorXd x = StartVector(others);
  const Evaluation by_model = residuals.Evaluate(x, true), by_prediction = residuals.EvaluateBy(prediction, x);
  EXPECT_LT((by_prediction.residuals - by_model.residuals).norm(), 1e-6 * by_model.residuals.norm() + 1e-9);
  for (int k = 0; k < others.count(); ++k)
    EXPECT_LT((by_prediction.jacobian - by_model.jacobian).col(k).norm(), 1e-6 * by_model.jacobian.col(k).norm())
        << others.entries[k].name;
}

TEST_F(Foreseen, CoarsePhotographsForeseeTheSameDeviations) {
  Capture capture = Finer(With({"front_black", "front_white", "side", "back"}), 12);
  for (size_t n = capture.photographs.size(); n < 8; ++n) {  // the same once more, held out
    capture.photographs.push_back(capture.photographs[n % 4]);
    capture.photographs.back().is_holdout = true;
  }
  const FreeParameters free = FreeParametersOf(capture);
  const FitProblem problem{capture, free, no_errors_, options_};
  CrownInput input = FittedAtStart(capture, free).first;
  Progress silent(ProgressMode::kNone);
  const auto deviations = [&](const Coarseness& coarse, const Capture& seen) {
    LinearisedPrediction prediction;
    const FitProblem as_seen{seen, free, no_errors_, options_};
    const FitState at = StateAtStart(as_seen, input, prediction, silent, coarse);
    const Evaluation e = AgreeingEvaluation(as_seen, at, at.pixels, prediction, at.x);
    const DataEstimate knowledge = KnowledgeByShader(at.cast, free, at.x, e, at.pixels, /*with_model_errors=*/false);
    return Eigen::VectorXd(knowledge.covariance.diagonal().cwiseSqrt());
  };
  const Eigen::VectorXd fine = deviations({}, capture);
  const int width = input.capture.photographs[0].camera.width;
  const Coarseness coarse = Coarsen(input);
  ASSERT_LT(input.capture.photographs[0].camera.width, width);
  const Eigen::VectorXd foreseen = deviations(coarse, input.capture);
  for (int k = 0; k < free.count(); ++k) EXPECT_NEAR(foreseen[k] / fine[k], 1.0, 0.15) << free.entries[k].name;
}

TEST_F(Foreseen, APhotographThatShowsLittleIsNotMadeCoarser) {
  const Capture capture = Finer(With({"front_black", "side"}), 24);
  CrownInput input = FittedAtStart(capture, FreeParametersOf(capture)).first;
  const int width = capture.photographs[0].camera.width;
  std::vector<uint8_t>& usable = input.photographs[0].usable;
  for (size_t i = 0; i < usable.size(); ++i) {
    const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
    usable[i] = std::abs(x - width / 2) < 8 && std::abs(y - width / 2) < 8;
  }
  const Coarseness coarse = Coarsen(input);
  EXPECT_EQ(input.capture.photographs[0].camera.width, width);
  EXPECT_EQ(coarse.Merged(0), 1.0);
  EXPECT_LT(input.capture.photographs[1].camera.width, width);
  EXPECT_GT(coarse.Merged(1), 1.0);
}

TEST_F(Foreseen, NoPhotographIsAdvisedWhereAllIsKnown) {
  Capture capture = With({"front", "back"});
  for (LayerSpec& layer : capture.layers)
    for (ParameterSpec& p : layer.parameters) p.fixed = true;
  const FreeParameters free = FreeParametersOf(capture);  // the roughness is left, which the front tells
  const auto [input, at] = FittedAtStart(capture, free);
  Progress silent(ProgressMode::kNone);
  const Foresight foresight = ForeseePhotographs({capture, free, no_errors_, options_}, input, at, silent);
  EXPECT_FALSE(foresight.IsWorthTaking());
}

TEST_F(Foreseen, WhatLeavingATileOutShiftsIsWhatAFitWithoutItFinds) {
  const Capture capture = WithDentinesAbsorptionFree({"front_black", "front_white"});
  const FreeParameters free = FreeParametersOf(capture);
  const auto [input, at] = FittedAtStart(capture, free);
  Progress silent(ProgressMode::kNone);
  const FitProblem problem{capture, free, no_errors_, options_};
  const auto requirements = RequirementsOf(problem, input, at);
  const auto tile = std::find_if(requirements.begin(), requirements.end(),
                                 [](const SceneRequirement& r) { return r.what == "tile 'black'"; });
  ASSERT_NE(tile, requirements.end());
  EXPECT_TRUE(tile->is_needed);
  EXPECT_GT(tile->de00, 0.1);

  Capture without = capture;
  for (PhotographSpec& p : without.photographs)
    if (p.backing && capture.backings[*p.backing].name == "black") p.backing.reset();
  CrownInput bare = input;
  bare.capture = without;
  CastState cast = CastAll(bare, ThicknessesOf(without, MaterialAt(free, at.x)), {}, silent);
  const auto pixels = ChoosePixels(bare, cast, 6000);
  SolveOptions solve;
  const SolveResult solved =
      Solve(ImageResiduals(without, cast, free, pixels, {}, {0.0, 0}), free, at.x, solve, [](int, double) {});
  const Evaluation e = ImageResiduals(capture, at.cast, free, at.pixels, {}, {0.0, 0}).Evaluate(at.x, true);
  double most = 0;  // every entry is of a channel of its own
  for (int k = 0; k < free.count(); ++k)
    most = std::max(most, std::abs(solved.x[k] - at.x[k]) * e.jacobian.col(k).norm());
  EXPECT_GT(tile->shift, most / 2.0) << "of " << tile->parameter;
  EXPECT_LT(tile->shift, most * 2.0) << "of " << tile->parameter;
}

TEST_F(Foreseen, AFitWithoutWhatIsNotNeededFindsTheSame) {
  Capture capture = WithDentinesAbsorptionFree({"front_black", "front_white", "side"});
  capture.photographs.back().is_holdout = true;
  const size_t dim = capture.photographs[0].lights[0];
  for (PhotographSpec& p : capture.photographs)
    if (!std::count(p.lights.begin(), p.lights.end(), dim)) p.lights.push_back(dim);
  capture.lights[dim].intensity_scale *= 1e-4;
  const FreeParameters free = FreeParametersOf(capture);
  auto [input, at] = FittedAtStart(capture, free);
  Progress silent(ProgressMode::kNone);
  options_.leave_out = {"unneeded"};
  const std::vector<LeftOutPart> left_out = LeaveOut(options_, input, silent);
  ASSERT_EQ(left_out.size(), 1u);
  EXPECT_EQ(left_out[0].name, "light:" + capture.lights[dim].name);
  for (const PhotographSpec& p : input.capture.photographs)
    EXPECT_EQ(std::count(p.lights.begin(), p.lights.end(), dim), p.is_holdout ? 1 : 0) << p.name;

  const Capture& without = input.capture;
  const CastState cast = CastAll(input, ThicknessesOf(without, MaterialAt(free, at.x)), {}, silent);
  const auto pixels = ChoosePixels(input, cast, 6000);
  const SolveResult solved =
      Solve(ImageResiduals(without, cast, free, pixels, {}, {0.0, 0}), free, at.x, {}, [](int, double) {});
  for (int k = 0; k < free.count(); ++k) {
    if (free.entries[k].quantity != Quantity::kAbsorption) continue;  // crossed polarisers show no roughness
    EXPECT_NEAR(solved.x[k], at.x[k], 0.25 * std::sqrt(at.knowledge.covariance(k, k))) << free.entries[k].name;
  }
}

TEST_F(Foreseen, APartThatASceneDoesNotHaveCannotBeLeftOut) {
  const Capture capture = WithDentinesAbsorptionFree({"front_black"});
  auto [input, at] = FittedAtStart(capture, FreeParametersOf(capture));
  Progress silent(ProgressMode::kNone);
  for (const char* part : {"tile 'blakc'", "tile 'white'", "the surface's reflection"}) {
    options_.leave_out = {part};
    try {
      LeaveOut(options_, input, silent);
      FAIL() << part;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("tile:black"), std::string::npos) << e.what();
    }
  }
}

TEST_F(Foreseen, NoPhotographIsLeftWithoutLight) {
  const Capture capture = WithDentinesAbsorptionFree({"front_black"});
  CrownInput input = FittedAtStart(capture, FreeParametersOf(capture)).first;
  Progress silent(ProgressMode::kNone);
  for (const size_t light : capture.photographs[0].lights)
    options_.leave_out.push_back("light:" + capture.lights[light].name);
  EXPECT_THROW(LeaveOut(options_, input, silent), InputError);
  options_.leave_out.pop_back();
  EXPECT_EQ(LeaveOut(options_, input, silent).size(), 1u);
  EXPECT_EQ(input.capture.photographs[0].lights.size(), capture.photographs[0].lights.size() - 1);
}

TEST_F(Foreseen, PartsThatAreNeededTogetherAreNotAllLeftOut) {
  Capture capture = WithDentinesAbsorptionFree({"front_black", "front_white"});
  Progress silent(ProgressMode::kNone);
  options_.leave_out = {"unneeded"};
  // Further lamps in the place of one, each as bright as is just not needed.
  const size_t lamp = capture.photographs[0].lights[0];
  std::vector<size_t> copies;
  for (int i = 0; i < 4; ++i) {
    copies.push_back(capture.lights.size());
    capture.lights.push_back(capture.lights[lamp]);
    capture.lights.back().name += std::to_string(i);
    for (PhotographSpec& p : capture.photographs) p.lights.push_back(copies.back());
  }
  const auto dimmed_to = [&](double share) {
    for (const size_t c : copies) capture.lights[c].intensity_scale = share * capture.lights[lamp].intensity_scale;
    return FittedAtStart(capture, FreeParametersOf(capture));
  };
  constexpr double kDim = 1e-3;
  const auto [dim_input, at] = dimmed_to(kDim);
  const FreeParameters free = FreeParametersOf(capture);
  const FitProblem problem{capture, free, no_errors_, options_};
  double of_limit = 0;  // of one of them, which is in proportion to its light
  for (const SceneRequirement& r : RequirementsOf(problem, dim_input, at))
    if (r.what == "light '" + capture.lights[copies[0]].name + "'")
      of_limit = std::max(r.de00 / kSeenDe00, r.shift / kToldShift);
  ASSERT_GT(of_limit, 0);
  CrownInput input = dimmed_to(0.4 / of_limit * kDim).first;
  EXPECT_EQ(LeaveOut(options_, input, silent).size(), 2u) << "of three or four the limit is passed";
}

TEST_F(Foreseen, TwoLayersOfOneMaterialAreOne) {
  Capture capture = WithDentinesAbsorptionFree({"front_black"});
  Progress silent(ProgressMode::kNone);
  const auto step = [&] {
    const FreeParameters free = FreeParametersOf(capture);
    const auto [input, at] = FittedAtStart(capture, free);
    const FitProblem problem{capture, free, no_errors_, options_};
    const auto all = RequirementsOf(problem, input, at);
    return all.back();
  };
  EXPECT_EQ(step().what, "the step from 'enamel' to 'dentine'");
  EXPECT_TRUE(step().is_needed);
  for (size_t i = 0; i < kParameters.size(); ++i)
    if (kParameters[i].quantity != Quantity::kThickness)
      capture.layers[1].parameters[i].value = capture.layers[0].parameters[i].value;
  EXPECT_FALSE(step().is_needed);
  EXPECT_EQ(step().de00, 0.0);
}

TEST_F(Foreseen, AFilmThatIsFreeIsAQuestionToTheFit) {
  Capture capture = WithDentinesAbsorptionFree({"front_black"});
  ParameterSpec& wetness = capture.surface[static_cast<size_t>(Quantity::kWetness)];
  wetness.value.fill(1e-6);
  Progress silent(ProgressMode::kNone);
  options_.leave_out = {"unneeded"};
  for (const bool fixed : {true, false}) {
    wetness.fixed = fixed;
    CrownInput input = FittedAtStart(capture, FreeParametersOf(capture)).first;
    const auto left_out = LeaveOut(options_, input, silent);
    EXPECT_EQ(left_out.size(), fixed ? 1u : 0u);
    EXPECT_EQ(input.capture.surface[static_cast<size_t>(Quantity::kWetness)].fixed, fixed);
  }
}

TEST_F(Foreseen, WhatHidesTheObjectCannotBeLeftOut) {
  const Capture capture = WithDentinesAbsorptionFree({"edge"});
  auto [input, at] = FittedAtStart(capture, FreeParametersOf(capture));
  for (glm::dvec3& v : input.scenery[0].vertices) v.x += 1.5;  // over a part of the crown
  Progress silent(ProgressMode::kNone);
  options_.leave_out = {"scenery:blade"};
  EXPECT_THROW(LeaveOut(options_, input, silent), InputError);
  options_ = {};
  options_.model = Model::kShader;
  options_.leave_out = {"unneeded"};
  for (const LeftOutPart& part : LeaveOut(options_, input, silent)) EXPECT_NE(part.name, "scenery:blade");
}

TEST_F(Foreseen, WhatAWrongIndexShiftsIsWhatAFitWithItFinds) {
  const Capture capture = WithDentinesAbsorptionFree({"front_black", "front_white"});
  const FreeParameters free = FreeParametersOf(capture);
  const auto [input, at] = FittedAtStart(capture, free);
  const LinearisedPrediction prediction =
      ImageResiduals(capture, at.cast, free, at.pixels, {}, {3.0, 0}).Linearise(at.x);
  const auto statements = ExactStatements({capture, free, no_errors_, options_}, at, prediction);
  const std::string name = capture.layers[1].name + ".ior";
  const auto index = std::ranges::find(statements, name, &ExactStatement::name);
  ASSERT_NE(index, statements.end());
  const auto shift = std::ranges::find(index->shifts, capture.layers[1].name + ".absorption_per_mm",
                                       &ExactStatement::Shift::parameter);
  ASSERT_NE(shift, index->shifts.end());

  Capture wrong = capture;
  wrong.layers[1][Quantity::kIor].value = {index->value + 0.05, index->value + 0.05, index->value + 0.05};
  const FreeParameters same = FreeParametersOf(wrong);
  const SolveResult solved =
      Solve(ImageResiduals(wrong, at.cast, same, at.pixels, {}, {0.0, 0}), same, at.x, {}, [](int, double) {});
  double most = 0;
  for (int k = 0; k < free.count(); ++k)
    if (free.entries[k].quantity == Quantity::kAbsorption)
      most = std::max(most, std::abs(std::expm1(solved.x[k] - at.x[k])));
  EXPECT_GT(shift->share, most / 1.5);
  EXPECT_LT(shift->share, most * 1.5);
}

TEST_F(Foreseen, AFitUnderALawThatScatteringDoesNotKeepMissesAsForeseen) {
  constexpr double kDeparture = 0.03;  // of the middle channel from a power law
  for (const auto& [law, freer] :
       {std::pair{Sharing::kPowerLaw, Sharing::kNone}, std::pair{Sharing::kOneValue, Sharing::kPowerLaw}}) {
    Capture capture = WithDentinesAbsorptionFree({"front_black", "front_white"});
    ParameterSpec& scattering = capture.layers[1][Quantity::kReducedScattering];
    scattering.fixed = false, scattering.sharing = freer;
    const double level = scattering.value[1];
    for (int c = 0; c < kChannels; ++c)
      scattering.value[c] = level * std::pow(capture.wavelengths_nm[c] / capture.wavelengths_nm[1], -0.1);
    if (freer == Sharing::kNone) scattering.value[1] *= std::exp(kDeparture);
    const FreeParameters free = FreeParametersOf(capture);
    const auto [input, at] = FittedAtStart(capture, free);
    const LinearisedPrediction prediction =
        ImageResiduals(capture, at.cast, free, at.pixels, {}, {3.0, 0}).Linearise(at.x);
    DataEstimate unshared;
    const auto asked = ScatteringThatMayBeShared(capture, [&](const Capture& other, const FreeParameters& others) {
      const Eigen::VectorXd x = StartVector(others);
      const Evaluation e = AgreeingEvaluation({other, others, no_errors_, options_}, at, at.pixels, prediction, x);
      const DataEstimate knowledge = KnowledgeByShader(at.cast, others, x, e, at.pixels, /*with_model_errors=*/false);
      if (others.count() == free.count()) unshared = knowledge;
      return knowledge;
    });
    const auto of_law = std::ranges::find(asked, law, &SharedScattering::law);
    ASSERT_NE(of_law, asked.end());
    EXPECT_FALSE(of_law->is_stated);

    Capture shared = capture;
    shared.layers[1][Quantity::kReducedScattering].sharing = law;
    const FreeParameters fewer = FreeParametersOf(shared);
    ASSERT_EQ(fewer.count(), free.count() - 1);
    const SolveResult solved = Solve(ImageResiduals(shared, at.cast, fewer, at.pixels, {}, {0.0, 0}), fewer,
                                     StartVector(fewer), {}, [](int, double) {});
    // The departure in the channel furthest off: what three logarithms have beyond the law that is nearest to them.
    Eigen::Vector3d beyond;
    for (int c = 0; c < kChannels; ++c) beyond[c] = std::log(scattering.value[c]);
    const PowerLawWeights line = WeightsOfPowerLaw(capture.wavelengths_nm);
    double at_540 = 0, exponent = 0;
    for (int c = 0; c < kChannels; ++c) at_540 += line.level[c] * beyond[c], exponent += line.exponent[c] * beyond[c];
    if (law == Sharing::kOneValue) beyond.array() -= beyond.mean();
    for (int c = 0; c < kChannels && law == Sharing::kPowerLaw; ++c)
      beyond[c] -= at_540 - exponent * std::log(capture.wavelengths_nm[c] / 540.0);
    const double departure = beyond.cwiseAbs().maxCoeff();
    ASSERT_GT(departure, 0.01);

    const auto before = std::ranges::find(free.entries, of_law->narrowed, &FreeEntry::name);
    ASSERT_NE(before, free.entries.end());
    const auto k = before - free.entries.begin();
    const double stddev = std::sqrt(unshared.Variance(Eigen::RowVectorXd::Unit(free.count(), k)));
    const double foreseen = stddev * std::sqrt(1.0 - std::pow(of_law->narrows, -2.0)) * departure / of_law->told;
    const Material found = MaterialAt(fewer, solved.x);
    const double missed = std::abs(std::log(found.layers[1][before->quantity][before->channel] /
                                            capture.layers[1][before->quantity].value[before->channel]));
    EXPECT_GT(of_law->narrows, 1.05);
    EXPECT_NEAR(missed, foreseen, 0.3 * foreseen) << of_law->narrowed << " under " << Word(law);
  }
}

}  // namespace
}  // namespace crownfit
