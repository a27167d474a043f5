#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/html.h"
#include "fit/judge.h"
#include "report/finding_words.h"
#include "report/plain_words.h"
#include "report/scatter_plot.h"
#include "report/zones.h"
#include "scene/long_axis.h"
#include "support/shapes.h"

namespace crownfit {
namespace {

bool Says(const std::vector<std::string>& sentences, const std::string& words) {
  for (const std::string& s : sentences)
    if (s.find(words) != std::string::npos) return true;
  return false;
}

/// A grey crown of 24 x 48 pixels, neck at the bottom, whose prediction is `factor` times as bright per third.
PhotographResult ThreeThirds(const std::array<glm::dvec3, 3>& factor) {
  PhotographResult p;
  p.name = "front";
  p.photograph = Image(24, 48, 3, 0.4f);
  p.prediction = p.photograph;
  p.compared.assign(24 * 48, 1);
  p.thirds.assign(24 * 48, 0);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 24; ++x) {
      const int third = 2 - y / 16;
      p.thirds[static_cast<size_t>(y) * 24 + x] = static_cast<uint8_t>(third + 1);
      for (int c = 0; c < 3; ++c) p.prediction.at(x, y, c) *= static_cast<float>(factor[third][c]);
    }
  p.difference = ComparePictures(p.photograph, p.prediction, p.compared);
  return p;
}

TEST(Zones, WordsFollowTheSignsOfTheDifference) {
  EXPECT_EQ(DifferenceWords({0.4, -0.4, 0.5}), "alike");
  EXPECT_EQ(DifferenceWords({1.0, 0, 0}), "a little lighter");
  EXPECT_EQ(DifferenceWords({-3.0, 0, 0}), "darker");
  EXPECT_EQ(DifferenceWords({0, 1.0, -6.0}), "a little redder, much bluer");
  EXPECT_EQ(DifferenceWords({0, -2.5, 2.5}), "greener, yellower");
}

TEST(Zones, ADifferenceStaysInItsThird) {
  const auto zones = ZonesOf(ThreeThirds({glm::dvec3(1.0), glm::dvec3(1.0), {1.0, 1.0, 0.8}}));
  ASSERT_EQ(zones.size(), 3u);
  EXPECT_EQ(zones[0].zone, "cervical");
  EXPECT_EQ(zones[2].zone, "incisal");
  for (int untouched : {0, 1}) {
    EXPECT_NEAR(zones[untouched].off_de00, 0.0, 1e-6);
    EXPECT_EQ(DifferenceWords(zones[untouched].off_lab), "alike");
  }
  EXPECT_GT(zones[2].off_lab.z, 2.0) << "less blue light is yellower";
  EXPECT_NE(DifferenceWords(zones[2].off_lab).find("yellower"), std::string::npos);
}

TEST(Zones, EveryThirdIsComparedAtTheBrightnessOfTheWholePhotograph) {
  // A separate scale would hide that one third of the photograph is darker than the others.
  PhotographResult p = ThreeThirds({glm::dvec3(1.0), glm::dvec3(1.0), glm::dvec3(1.0)});
  for (size_t i = 0; i < p.thirds.size(); ++i)
    for (int c = 0; c < 3 && p.thirds[i] == 1; ++c)
      p.photograph.values[3 * i + c] = 0.2f, p.prediction.values[3 * i + c] = 0.2f;
  const auto zones = ZonesOf(p);
  EXPECT_LT(zones[0].difference.photograph_lab.x + 15.0, zones[2].difference.photograph_lab.x);
}

TEST(Zones, NoThirdsWithoutAnEndOfTheCrown) {
  PhotographResult p = ThreeThirds({glm::dvec3(1.0), glm::dvec3(1.0), glm::dvec3(1.0)});
  p.thirds.clear();
  EXPECT_TRUE(ZonesOf(p).empty());
}

TEST(Zones, TheLongAxisRunsFromNeckToEdge) {
  Capture capture;
  const TriangleMesh incisor = Incisor();
  EXPECT_FALSE(LongAxisOf(capture, incisor)) << "a closed mesh does not say where its edge is";
  capture.long_axis = glm::dvec3(0, 1, 0);
  const auto axis = LongAxisOf(capture, incisor);
  ASSERT_TRUE(axis);
  EXPECT_NEAR(axis->At({3, -5, 1}), 0.0, 1e-9);
  EXPECT_NEAR(axis->At({-2, 0, 0}), 0.5, 1e-9);
  EXPECT_NEAR(axis->At({0, 5, 0}), 1.0, 1e-9);
}

/// A fit that determines both channels of absorption well and confuses the rest.
CrownFit SomeFit() {
  CrownFit fit;
  fit.usable = true;
  fit.capture.photographs.resize(1);
  fit.capture.photographs[0].polarisation = Polarisation::kCross;
  fit.photographs = {ThreeThirds({glm::dvec3(1.0), glm::dvec3(1.0), glm::dvec3(1.0)})};
  fit.uncertainty.parameters = {
      {"dentine.absorption_per_mm",
       0,
       Quantity::kAbsorption,
       {0.1, 0.2},
       {0.004, 0.004},
       {0.092, 0.19},
       {0.108, 0.21},
       Status::kFitted},
      {"dentine.reduced_scattering_per_mm",
       0,
       Quantity::kReducedScattering,
       {2},
       {3},
       {0.5},
       {9},
       Status::kNotIdentified},
      {"surface.roughness", kSurfaceOwner, Quantity::kRoughness, {0.2}, {0.1}, {0.1}, {0.4}, Status::kPrior}};
  for (const char* name : {"dentine.absorption_per_mm[R]", "dentine.reduced_scattering_per_mm"}) {
    fit.entries.emplace_back();
    fit.entries.back().name = name;
  }
  fit.uncertainty.covariance = Eigen::MatrixXd(2, 2);
  fit.uncertainty.covariance << 1.0, -0.98, -0.98, 1.0;
  return fit;
}

TEST(PlainWords, SayHowSureEachParameterIs) {
  const PlainVerdict verdict = PlainVerdictOf(SomeFit());
  EXPECT_EQ(verdict.headline, "Usable.");
  EXPECT_TRUE(Says(verdict.sentences, "Known within 10 %: dentine absorption"));
  EXPECT_TRUE(Says(verdict.sentences, "do not determine: dentine reduced scattering"));
  EXPECT_TRUE(Says(verdict.sentences,
                   "Not measured, but held by their priors (what is usual for the material): surface roughness"));
  EXPECT_TRUE(Says(verdict.sentences, "raising one and lowering the other"));
  EXPECT_TRUE(Says(verdict.sentences, "No photograph was held out"));
}

TEST(Verdict, ListsQuantitiesAssumedExact) {
  CrownFit fit = SomeFit();
  fit.converged = true;
  Judge(fit);
  EXPECT_NE(VerdictInWords(fit).find("with no share in the intervals: the scan."), std::string::npos)
      << VerdictInWords(fit);
  fit.uncertainty.parameters.push_back({"dentine.ior", 0, Quantity::kIor, {1.54}, {}, {}, {}, Status::kFixed});
  fit.uncertainty.parameters.push_back({"surface.wetness", kSurfaceOwner, Quantity::kWetness, {0}, {}, {}, {}});
  Judge(fit);
  EXPECT_NE(VerdictInWords(fit).find("Taken as exact, with no share in the intervals: the scan, dentine.ior."),
            std::string::npos)
      << VerdictInWords(fit);
}

TEST(PlainWords, ListIdentifiedAndUnidentifiedChannelsSeparately) {
  CrownFit fit = SomeFit();
  fit.converged = true;
  FittedParameter& absorption = fit.uncertainty.parameters[0];
  absorption.of_channels = {Status::kNotIdentified, Status::kFitted};
  absorption.status = Status::kNotIdentified;
  Judge(fit);
  EXPECT_TRUE(fit.usable) << "one channel is identified";
  EXPECT_NE(VerdictInWords(fit).find("identify dentine.absorption_per_mm[G]."), std::string::npos)
      << VerdictInWords(fit);
  EXPECT_NE(VerdictInWords(fit).find("photographs: dentine.absorption_per_mm[R], dentine.reduced"), std::string::npos)
      << VerdictInWords(fit);
  const PlainVerdict verdict = PlainVerdictOf(fit);
  EXPECT_TRUE(Says(verdict.sentences, "Known within 10 %: dentine absorption G"));
  EXPECT_TRUE(Says(verdict.sentences, "do not determine: dentine absorption R and dentine reduced scattering"));
}

TEST(PlainWords, UnusableResultIsReportedFirst) {
  CrownFit fit = SomeFit();
  fit.usable = false;
  EXPECT_EQ(PlainVerdictOf(fit).headline, "Do not use this result.");
}

TEST(Findings, UntrustworthyPhotographsAreNamed) {
  Capture capture;
  std::vector<Photograph> photographs(2);
  for (const char* name : {"front", "back"}) {
    capture.photographs.emplace_back();
    capture.photographs.back().name = name;
    capture.photographs.back().has_noise_file = true;
  }
  const auto finds = [&](FindingKind kind, const std::vector<double>& numbers, const std::vector<std::string>& names) {
    return std::ranges::count(PhotographFindings(capture, photographs), Finding{kind, numbers, names}) == 1;
  };
  EXPECT_TRUE(PhotographFindings(capture, photographs).empty());
  photographs[0].white_balance = photographs[1].white_balance = {2.0, 1.0, 1.5};
  EXPECT_TRUE(PhotographFindings(capture, photographs).empty());
  (*photographs[1].white_balance)[0] = 1.9;
  EXPECT_TRUE(finds(FindingKind::kWhiteBalanceDiffers, {}, {"front", "back"}));
  photographs[1].was_jpeg = true;
  EXPECT_TRUE(finds(FindingKind::kJpeg, {}, {"back"}));
  photographs[0].has_foreign_primaries = true;
  photographs[0].encoding = "tone curve (ICC profile 'wide')";
  EXPECT_TRUE(finds(FindingKind::kForeignPrimaries, {}, {"front", photographs[0].encoding}));
  photographs[0].transparent_pixels = 7;
  EXPECT_TRUE(finds(FindingKind::kTransparentPixels, {7}, {"front"}));
  EXPECT_FALSE(finds(FindingKind::kFalseColours, {600, 540, 450}, {}));
  capture.wavelengths_nm = {450, 540, 600};
  EXPECT_TRUE(finds(FindingKind::kFalseColours, {450, 540, 600}, {}));
  for (PhotographSpec& p : capture.photographs) p.has_colour_file = true;
  EXPECT_FALSE(finds(FindingKind::kFalseColours, {450, 540, 600}, {})) << "the colour file describes the bands";
}

TEST(Findings, NameTheMostContradictedCalibration) {
  CrownFit fit = SomeFit();
  fit.model = Model::kPath;
  fit.converged = true;
  fit.calibration = {{CalibrationKind::kExposure, "the exposure of 'front'", 1, 1.0, 0.01},
                     {CalibrationKind::kExposure, "the exposure of 'back'", 1, 64.0, -0.08},
                     {CalibrationKind::kPlace, "the place of light 'left'", 3, 3.0}};
  fit.inflation[static_cast<size_t>(CalibrationKind::kExposure)] = 4.0;
  fit.entries.clear();
  const std::vector<std::string> caveats = InWords(ModelFindings(fit));
  ASSERT_EQ(caveats.size(), 1);
  EXPECT_TRUE(Says(caveats, "the exposure of 'back' is 8 % less than stated, which is 8 times")) << caveats[0];
  Judge(fit);
  EXPECT_TRUE(fit.usable) << "their errors are in the intervals";
  fit.inflation[static_cast<size_t>(CalibrationKind::kExposure)] = kMostInflated;
  Judge(fit);
  EXPECT_FALSE(fit.usable);
}

TEST(Findings, NameThePhotographsThatNoiseDoesNotExplain) {
  CrownFit fit = SomeFit();
  fit.model = Model::kPath;
  fit.entries.clear();
  PhotographResult& p = fit.photographs[0];
  p.name = "edge";
  for (const auto& [misfit, few_patches] : {std::pair{1.4, 1e6}, {3.0, 6.0}}) {
    p.residual_chi2 = ResidualChi2{{misfit, 0.5, few_patches, 0.0}, {}};
    EXPECT_TRUE(ModelFindings(fit).empty()) << misfit << " of " << few_patches << " values is small, or chance";
  }
  p.residual_chi2 = ResidualChi2{{4.4, 0.5, 300.0, 0.1}, {}};
  EXPECT_TRUE(Says(InWords(ModelFindings(fit)), "'edge' (patches 4.4)"));
  p.residual_chi2 = ResidualChi2{{1.1, 0.9, 300.0, 0.1}, {6.0, 0.9, 48.0, 0.5}};
  EXPECT_TRUE(Says(InWords(ModelFindings(fit)), "'edge' (image regions 6)")) << "noise hides it in patches";
}

TEST(Verdict, RejectsRegionResidualsHiddenInPatchNoise) {
  CrownFit fit = SomeFit();
  fit.model = Model::kPath;
  fit.converged = true;
  fit.entries.clear();
  for (const auto& [misfit, few] : {std::pair{2.0, 1e6}, {3.5, 3.0}}) {
    fit.residual_chi2.regions = PatchChi2{misfit, 0.9, few, 0.0};
    Judge(fit);
    EXPECT_TRUE(fit.usable) << misfit << " of " << few << " values is small, or chance";
  }
  fit.residual_chi2.regions = PatchChi2{12.0, 0.9, 96.0, 1.0};
  Judge(fit);
  EXPECT_FALSE(fit.usable);
  EXPECT_TRUE(Says(InWords(fit.reasons), "squared residuals are 12 times"));
}

TEST(Verdict, RejectsLightsThatAllSceneryContradicts) {
  CrownFit fit = SomeFit();
  fit.model = Model::kPath;
  fit.converged = true;
  fit.entries.clear();
  const auto usable = [&](const std::vector<SceneryLevel>& levels) {
    fit.scenery = levels;
    Judge(fit);
    return fit.usable;
  };
  const SceneryLevel black{"black", {"black"}, {"left"}, {0.88, 0.89, 0.88}, {0.004, 0.004, 0.004}, 0.01};
  SceneryLevel white = black, bright = black, uncertain = black;
  white.shows = {"white"};
  bright.shows = {"blade"}, bright.ratio = {1.01, 1.0, 1.0};
  uncertain.shows = {"white"}, uncertain.stated = 0.05;
  EXPECT_TRUE(usable({black, black})) << "its reflectance may be stated wrongly";
  EXPECT_TRUE(usable({black, white, bright})) << "one photograph shows that the light is right";
  EXPECT_TRUE(usable({black, uncertain})) << "the other may be as stated";
  EXPECT_FALSE(usable({black, white}));
  EXPECT_TRUE(Says(InWords(fit.reasons), "In every photograph lit by 'left'"));
  bright.lights = {"right"};
  EXPECT_FALSE(usable({black, white, bright})) << "another light may be right";
  white.ratio = {1.12, 0.88, 1.12};
  EXPECT_FALSE(usable({black, white})) << "only green is off equally";
  white.ratio = {0.7, 0.72, 0.71};
  EXPECT_TRUE(usable({black, white})) << "guessed reflectances are not off equally";
}

TEST(Findings, NameThePriorThatPhotographsContradict) {
  CrownFit fit = SomeFit();
  fit.model = Model::kPath;
  for (FreeEntry& e : fit.entries) e.quantity = Quantity::kAbsorption, e.prior_mean = 1.0, e.prior_stddev = 0.3;
  fit.knowledge.by_photographs = Eigen::Vector2d(3.0, 3.0);
  fit.knowledge.covariance = Eigen::Vector2d(0.16, 4.0).asDiagonal();
  fit.knowledge.unseen = Eigen::MatrixXd::Zero(2, 0);
  const std::vector<std::string> caveats = InWords(ModelFindings(fit));
  EXPECT_TRUE(Says(caveats, "dentine.absorption_per_mm[R]' (4)")) << "2 off, with errors of 0.3 and 0.4";
  EXPECT_FALSE(Says(caveats, "dentine.reduced_scattering_per_mm")) << "the photographs hardly constrain it";
  fit.options.use_priors = false;
  EXPECT_TRUE(ModelFindings(fit).empty());
}

TEST(Findings, NameTheHeldOutPhotographThatIsPredictedWrongly) {
  CrownFit fit = SomeFit();
  fit.model = Model::kPath;
  fit.entries.clear();
  PhotographResult& p = fit.photographs[0];
  p.name = "side", p.is_holdout = true, p.level = 0.89, p.level_stddev = 0.01;
  EXPECT_TRUE(Says(InWords(ModelFindings(fit)), "'side', which was held out, is 11 % darker"));
  fit.capture.photographs[0].exposure_stddev = 0.05;
  EXPECT_TRUE(ModelFindings(fit).empty()) << "its exposure was known no better";
}

TEST(PlainWords, RequestOnlyMissingPhotographs) {
  CrownFit fit = SomeFit();
  const auto asked = [&] { return PlainVerdictOf(fit).photographs_that_would_help; };
  EXPECT_TRUE(Says(asked(), "black and on a white"));
  EXPECT_TRUE(Says(asked(), "blade"));
  EXPECT_TRUE(Says(asked(), "without polarisers"));
  PhotographSpec more = fit.capture.photographs[0];
  fit.capture.photographs[0].backing = 0;
  more.backing = 1;
  more.scenery = {0};
  more.polarisation = Polarisation::kNone;
  fit.capture.photographs.push_back(more);
  EXPECT_EQ(asked().size(), 1);
  EXPECT_TRUE(Says(asked(), "No photograph is known"));
  for (FittedParameter& p : fit.uncertainty.parameters) p.status = Status::kFitted, p.of_channels.clear();
  EXPECT_TRUE(asked().empty()) << "everything is determined";
}

TEST(Profiles, IntegrateDerivativesAndAreExactForQuartics) {
  const auto chi2 = [](double x) { return x * x * (2.0 - 0.6 * x + 0.1 * x * x); };
  std::vector<SlopeAt> derivatives;
  for (const double x : {-1.5, 0.0, 2.0})
    derivatives.push_back({x, 4.0 * x - 1.8 * x * x + 0.4 * x * x * x, 4.0 - 3.6 * x + 1.2 * x * x});
  const LikelihoodProfile profile = ProfileOfSlopes(derivatives);
  ASSERT_EQ(profile.at.size(), 21u);
  EXPECT_NEAR(profile.at.back(), 2.0, 1e-12);
  for (size_t i = 0; i < profile.at.size(); ++i) EXPECT_NEAR(profile.delta_chi2[i], chi2(profile.at[i]), 1e-12);
}

TEST(Profiles, WeakIntervalIsWiderThanAFactorOfOneAndAHalf) {
  FreeEntry entry;
  entry.scale = Scale::kLog;
  const double limit = std::log(1.5) / (2 * 1.959963984540054);
  EXPECT_FALSE(IsWeak(entry, 0.0, 0.99 * limit));
  EXPECT_TRUE(IsWeak(entry, 0.0, 1.01 * limit));
  entry.scale = Scale::kLinear;
  EXPECT_FALSE(IsWeak(entry, 1.5, 0.01));
  EXPECT_TRUE(IsWeak(entry, 0.1, 0.1)) << "an interval that reaches below 0";
}

TEST(ScatterPlot, ParetoFrontIsNonDominated) {
  std::vector<ScatterPoint> points{{1, 10, "a"}, {2, 5, "b"}, {2, 6, "c"}, {3, 5, "d"}, {9, 1, "e"}, {9, 1, "f"}};
  MarkFront(points);
  std::string front;
  for (const ScatterPoint& p : points) front += p.is_on_front ? p.label : "";
  EXPECT_EQ(front, "abef") << "two equal points both stay";
}

TEST(ScatterPlot, LabelsAreEscapedAndDoNotOverlap) {
  ScatterPlot plot{"<title>", "x", "y", {"one"}, {}, {{0.5, "floor"}}};
  for (int i = 0; i < 5; ++i) plot.points.push_back({1.0 + 0.01 * i, 2.0, "label <" + std::to_string(i) + ">"});
  const std::string svg = ScatterPlotSvg(plot);
  EXPECT_EQ(svg.find("<title>"), svg.npos);
  std::set<std::string> places;
  for (size_t at = 0; (at = svg.find("<text", at)) != svg.npos; ++at)
    EXPECT_TRUE(places.insert(svg.substr(at, svg.find('>', at) - at)).second) << "one text over another";
}

TEST(Page, TextIsEscaped) { EXPECT_EQ(Html("<a href=\"x\">&"), "&lt;a href=&quot;x&quot;&gt;&amp;"); }

}  // namespace
}  // namespace crownfit
