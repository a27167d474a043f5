// Readings of flat samples: their prediction, fits to them with uncertainties, and files of iad.

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/files.h"
#include "base/random.h"
#include "dental/flat_prediction.h"
#include "exchange/exporters.h"
#include "exchange/init_measurements.h"
#include "exchange/rxt_file.h"
#include "fit/fit_measurements.h"
#include "fit_crown.h"
#include "fit_together.h"
#include "optics/adding_doubling.h"
#include "optics/flat_reading.h"
#include "optics/material_file.h"
#include "report/result_files.h"
#include "support/channels.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// A capture of one layer with free scattering and absorption in each channel.
Capture OneLayer(double ior, double g) {
  Capture capture;
  LayerSpec layer;
  layer.name = "ceramic";
  for (size_t i = 0; i < kParameters.size(); ++i) layer.parameters[i] = DefaultSpec(kParameters[i]);
  for (size_t i = 0; i < kParameters.size(); ++i) capture.surface[i] = DefaultSpec(kParameters[i]);
  layer[Quantity::kIor].value.fill(ior);
  layer[Quantity::kAsymmetry].value.fill(g);
  for (const Quantity q : {Quantity::kReducedScattering, Quantity::kAbsorption}) layer[q].fixed = false;
  capture.layers = {layer};
  capture.backings = {{.name = "black", .reflectance = glm::dvec3(0.03), .has_place = false},
                      {.name = "white", .reflectance = glm::dvec3(0.9), .has_place = false}};
  return capture;
}

Material Truth(const Capture& capture, const Spectrum& reduced_scattering, const Spectrum& absorption) {
  Material material = StatedMaterial(capture);
  material.layers[0][Quantity::kReducedScattering] = reduced_scattering;
  material.layers[0][Quantity::kAbsorption] = absorption;
  return material;
}

/// Simulates readings of `material` with random errors of the stated size, and of the thickness if its error is stated.
void TakeReadings(Capture& capture, const Material& material, uint64_t seed) {
  for (size_t i = 0; i < capture.measurements.size(); ++i) {
    FlatMeasurement& m = capture.measurements[i];
    FlatMeasurement true_one = m;
    for (double& mm : true_one.thickness_mm) mm += m.thickness_stddev_mm * Gaussian(Key(seed, 99), i);
    std::array<BandReading, kChannels> bands;
    for (int c = 0; c < kChannels; ++c) bands[c] = ReadBand(capture, {true_one}, material, c)[0];
    const std::vector<double> values = PredictedValues(m, bands);
    size_t k = 0;
    for (auto* reading : {&m.reflectance, &m.transmittance, &m.lab})
      for (int c = 0; *reading && c < kChannels; ++c, ++k)
        (*reading)->value[c] = values[k] + (seed ? (*reading)->stddev[c] * Gaussian(Key(seed, i), k) : 0.0);
  }
}

Reading Known(double stddev) { return {Spectrum(kChannels, 0.0), Spectrum(kChannels, stddev)}; }

FlatMeasurement TotalsOf(double mm, double stddev) {
  FlatMeasurement m;
  m.name = std::to_string(mm);
  m.thickness_mm = {mm};
  m.has_specular = true;
  m.reflectance = m.transmittance = Known(stddev);
  return m;
}

CrownFit Fit(const Capture& capture) {
  Progress quiet(ProgressMode::kNone);
  FitOptions options;
  options.profile_points = 0;
  return FitCrown(capture, options, quiet);
}

TEST(ViewSlab, SphereTotalsAgreeWithAddingDoubling) {
  Slab slab;
  slab.layers = {{1.63, 0.7, 0.1, 6, 0.03, 0.6}, {1.54, 0.9, 0.0, 20, 0.1, 1.1}};
  for (const double rho : {0.0, 0.8}) {
    slab.backing_reflectance = rho;
    const SlabAnswer want = SolveByAddingDoubling(slab);
    const ViewedSlab beam = ViewSlab(slab, {{0.6, 1.1}}, MeasuredAt::k0_D, {24})[0],
                     diffuse = ViewSlab(slab, {{0.6, 1.1}}, MeasuredAt::kD_D, {24})[0];
    EXPECT_NEAR(beam.Over(rho), want.value.reflectance_collimated, 1e-9);
    EXPECT_NEAR(diffuse.Over(rho), want.value.reflectance_diffuse, 1e-9);
    EXPECT_NEAR(beam.mirrored, want.specular, 1e-12);
    EXPECT_NEAR(diffuse.mirrored, want.specular_diffuse, 1e-4);
    if (rho > 0) continue;
    EXPECT_NEAR(beam.transmittance, want.value.transmittance_collimated, 1e-9);
    EXPECT_NEAR(diffuse.transmittance, want.value.transmittance_diffuse, 1e-9);
  }
}

TEST(FlatReading, IndexMatchedSlidesChangeNothing) {
  const Capture capture = OneLayer(1.5, 0.8);
  const Material material = Truth(capture, glm::dvec3(2), glm::dvec3(0.05));
  FlatMeasurement m = TotalsOf(1.0, 0.01);
  const BandReading bare = ReadBand(capture, {m}, material, 0)[0];
  m.slide = Slide{1.5, 1.0};
  const BandReading same = ReadBand(capture, {m}, material, 0)[0];
  EXPECT_NEAR(same.reflectance, bare.reflectance, 1e-9);
  EXPECT_NEAR(same.transmittance, bare.transmittance, 1e-9);
  m.slide = Slide{1.9, 1.0};
  EXPECT_GT(ReadBand(capture, {m}, material, 0)[0].reflectance, bare.reflectance + 0.01) << "glass mirrors";
}

TEST(FlatReading, DerivativesMatchFiniteDifferences) {
  const Capture capture = OneLayer(1.5, 0.8);
  const Material material = Truth(capture, glm::dvec3(2), glm::dvec3(0.05));
  FlatMeasurement wide = TotalsOf(1.0, 0.01), small = wide;
  wide.slide = Slide{1.52, 1.0};
  wide.has_specular = true;
  small.geometry = MeasuredAt::k45_0;
  small.aperture_mm = 3.0;
  small.backing = 1;
  constexpr double kStep = 1e-4;
  for (const FlatMeasurement& m : {wide, small})
    for (const Quantity q :
         {Quantity::kReducedScattering, Quantity::kAbsorption, Quantity::kAsymmetry, Quantity::kIor}) {
      MaterialStep step{material, material};
      step.from.layers[0][q][0] *= 1 - kStep;
      step.to.layers[0][q][0] *= 1 + kStep;
      const BandReading change = ReadBandChanges(capture, {m}, material, 0, {step})[0][0],
                        from = ReadBand(capture, {m}, step.from, 0)[0], to = ReadBand(capture, {m}, step.to, 0)[0];
      const double tolerance = 1e-4 * std::abs(change.reflectance) + 1e-9;  // curvature and rounding of the differences
      EXPECT_NEAR(change.reflectance, to.reflectance - from.reflectance, tolerance) << static_cast<int>(q);
      EXPECT_NEAR(change.transmittance, to.transmittance - from.transmittance, tolerance) << static_cast<int>(q);
      EXPECT_NEAR(change.edge_loss, to.edge_loss - from.edge_loss, tolerance) << static_cast<int>(q);
      EXPECT_EQ(ReadBandChanges(capture, {m}, material, 1, {step})[0][0].reflectance, 0.0) << "another band";
    }
}

TEST(MeasurementFit, RecoversCoefficientsFromPrahlAddingDoublingTotals) {
  // Totals by S. Prahl's `ad` (adding-doubling) at 64 angles: n 1.54, g 0.8, in air. His inverse program finds no
  // solution for the first and the seventh, which hardly absorb.
  const struct {
    double mm;
    Spectrum scattering, absorption, r, t;
  } rows[] = {{0.5, {2, 5, 10}, {0.01, 0.01, 0.1}, {0.399823, 0.530936, 0.549507}, {0.577123, 0.444560, 0.249045}},
              {1.0, {2, 5, 10}, {0.03, 0.3, 0.3}, {0.445723, 0.326420, 0.429449}, {0.423661, 0.081055, 0.032736}},
              {2.0, {10, 5, 2}, {0.01, 0.01, 0.1}, {0.808852, 0.719288, 0.351562}, {0.103770, 0.189936, 0.144718}}};
  for (const auto& row : rows) {
    Capture capture = OneLayer(1.54, 0.8);
    capture.measurements = {TotalsOf(row.mm, 3e-5)};  // the difference between 24 and 64 angles
    capture.measurements[0].reflectance->value = row.r;
    capture.measurements[0].transmittance->value = row.t;
    const CrownFit fit = Fit(capture);
    EXPECT_TRUE(fit.usable);
    for (int c = 0; c < kChannels; ++c) {
      EXPECT_NEAR(fit.material.layers[0][Quantity::kReducedScattering][c], row.scattering[c], 1e-3 * row.scattering[c]);
      EXPECT_NEAR(fit.material.layers[0][Quantity::kAbsorption][c], row.absorption[c], 0.005 * row.absorption[c]);
    }
  }
}

TEST(MeasurementFit, IntervalsHaveNominalCoverage) {
  // Errors of half a per cent of the light and of 0.02 mm in the samples' thickness.
  Capture capture = OneLayer(1.55, 0.75);
  const Material truth = Truth(capture, {1.5, 2.5, 4.0}, {0.02, 0.05, 0.2});
  capture.measurements = {TotalsOf(0.5, 0.005), TotalsOf(1.5, 0.005)};
  for (auto& m : capture.measurements) m.thickness_stddev_mm = 0.02;
  int held = 0, count = 0;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    TakeReadings(capture, truth, seed);
    const CrownFit fit = Fit(capture);
    ASSERT_TRUE(fit.converged);
    for (const FittedParameter& p : fit.uncertainty.parameters)
      for (int c = 0; c < static_cast<int>(p.stddev.size()); ++c, ++count)
        held += p.low95[c] <= truth.layers[0][p.quantity][c] && truth.layers[0][p.quantity][c] <= p.high95[c];
  }
  std::printf("%d of %d intervals hold the truth\n", held, count);
  // Channels of a sample share its thickness, so about half of the values are independent: 4 sigma of 36.
  EXPECT_GT(held, 0.95 * count - 4 * std::sqrt(0.05 * 0.95 / 36) * count);
  EXPECT_LT(held, count) << "otherwise they are too wide";
}

TEST(MeasurementFit, UncertainThicknessWidensIntervals) {
  Capture capture = OneLayer(1.55, 0.75);
  const Material truth = Truth(capture, glm::dvec3(2), glm::dvec3(0.05));
  capture.measurements = {TotalsOf(1.0, 0.001)};
  TakeReadings(capture, truth, 0);
  const double sharp = std::sqrt(Fit(capture).uncertainty.covariance(0, 0));
  capture.measurements[0].thickness_stddev_mm = 0.05;
  const double wide = std::sqrt(Fit(capture).uncertainty.covariance(0, 0));
  // Totals depend only on scattering times thickness: 5 % of one is 5 % of the other.
  EXPECT_NEAR(wide, std::hypot(sharp, 0.05), 0.002);
}

TEST(MeasurementFit, EntriesOfOneSampleShareItsThickness) {
  const auto stddev = [](const char* sample) {
    Capture capture = OneLayer(1.54, 0.8);
    for (int i = 0; i < 6; ++i) {
      FlatMeasurement m = TotalsOf(1.0, 0.003);
      m.name += "_" + std::to_string(i);
      m.sample = sample;
      m.thickness_stddev_mm = 0.05;
      capture.measurements.push_back(m);
    }
    TakeReadings(capture, Truth(capture, glm::dvec3(2.5), glm::dvec3(0.05)), 0);
    return std::sqrt(Fit(capture).uncertainty.covariance(0, 0));
  };
  EXPECT_GT(stddev("disc"), 1.8 * stddev("")) << "otherwise it counts as six samples, each cut separately";
}

TEST(MeasurementFit, JointFitOfSingleDiscsMatchesOneFitOfAllDiscs) {
  Capture all = OneLayer(1.54, 0.8);
  for (const double mm : {0.5, 1.0, 2.0}) all.measurements.push_back(TotalsOf(mm, 0.003));
  TakeReadings(all, Truth(all, {2.0, 2.3, 2.9}, {0.02, 0.04, 0.12}), 5);
  std::vector<Capture> each;
  for (const FlatMeasurement& m : all.measurements) {
    each.push_back(all);
    each.back().file = m.name;
    each.back().measurements = {m};
  }
  Progress quiet(ProgressMode::kNone);
  FitOptions options;
  options.profile_points = 0;
  options.use_priors = false;
  const CrownFit one = FitCrown(all, options, quiet), together = Joined(FitTogether(each, options, quiet));
  EXPECT_TRUE(one.usable);
  EXPECT_TRUE(together.usable);
  for (size_t p = 0; p < one.uncertainty.parameters.size(); ++p) {
    const FittedParameter &a = one.uncertainty.parameters[p], &b = together.uncertainty.parameters[p];
    for (size_t c = 0; c < a.stddev.size(); ++c) {
      EXPECT_NEAR(b.stddev[c] / a.stddev[c], 1.0, 0.2) << a.name;
      EXPECT_NEAR(b.value[c], a.value[c], 0.3 * a.stddev[c]) << a.name;
    }
  }
  EXPECT_THROW(FitTogether({each[0], each[0]}, options, quiet), InputError) << "duplicate readings";
  options.leave_out = {"tile:black"};
  EXPECT_THROW(FitTogether({each[0], each[1]}, options, quiet), InputError) << "tiles of photographs";
  EXPECT_THROW(FitCrown(each[0], options, quiet), InputError) << "tiles of photographs";
}

TEST(MeasurementFit, SharedScatteringIsRejectedOnlyIfItIsWrong) {
  Capture capture = OneLayer(1.54, 0.8);
  for (const double mm : {0.5, 1.0, 2.0}) capture.measurements.push_back(TotalsOf(mm, 0.003));
  capture.layers[0][Quantity::kReducedScattering].sharing = Sharing::kOneValue;
  Progress quiet(ProgressMode::kNone);
  FitOptions options;
  options.profile_points = 0;
  const auto fit = [&](const Spectrum& scattering, uint64_t seed) {
    TakeReadings(capture, Truth(capture, scattering, {0.02, 0.04, 0.12}), seed);
    return FitCrown(capture, options, quiet);
  };
  constexpr int kDraws = 12;
  double chi2 = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const CrownFit shared = fit(glm::dvec3(2.3), 100 + draw);
    EXPECT_TRUE(shared.usable) << draw;
    ASSERT_EQ(shared.departures.size(), 1u);
    chi2 += shared.departures[0].chi2 / kDraws;
  }
  EXPECT_GT(chi2, 0.7);  // two degrees of freedom: the mean of twelve lies outside these bounds 4 times in 1000
  EXPECT_LT(chi2, 4.0);

  const CrownFit denied = fit({2.3 * 0.95, 2.3, 2.3 * 1.1}, 1);
  EXPECT_FALSE(denied.usable);
  ASSERT_FALSE(denied.reasons.empty());
  EXPECT_EQ(denied.reasons.back().kind, FindingKind::kSharingRejected);
  EXPECT_NEAR(denied.departures[0].off[2] - denied.departures[0].off[0], std::log(1.1 / 0.95), 0.03);
}

TEST(MeasurementFit, ApertureColoursOverBlackAndWhiteGiveBothCoefficients) {
  Capture capture = OneLayer(1.54, 0.8);
  const Material truth = Truth(capture, {2, 2.2, 2.6}, {0.02, 0.04, 0.12});
  for (const size_t backing : {0, 1}) {
    FlatMeasurement m;
    m.name = capture.backings[backing].name;
    m.thickness_mm = {1.0};
    m.geometry = MeasuredAt::kD_8;
    m.backing = backing;
    m.aperture_mm = 6.0;
    m.lab = Known(0.2);
    capture.measurements.push_back(m);
  }
  TakeReadings(capture, truth, 0);
  const CrownFit fit = Fit(capture);
  for (const FittedParameter& p : fit.uncertainty.parameters)
    for (int c = 0; c < static_cast<int>(p.stddev.size()); ++c) {
      EXPECT_NEAR(p.value[c], truth.layers[0][p.quantity][c], 0.02 * p.value[c]) << p.name;
      EXPECT_GT(p.stddev[c], 0.02 * p.value[c]) << "edge loss is modelled only to within 5 %";
    }
  // Without the aperture, edge loss is taken for absorption.
  for (auto& m : capture.measurements) m.aperture_mm.reset();
  const CrownFit wrong = Fit(capture);
  EXPECT_GT(wrong.material.layers[0][Quantity::kAbsorption][1], 2 * truth.layers[0][Quantity::kAbsorption][1]);
}

TEST(MeasurementFit, ReflectanceAloneIsReportedAsUnidentified) {
  Capture capture = OneLayer(1.54, 0.8);
  const Material truth = Truth(capture, glm::dvec3(3), glm::dvec3(0.1));
  FlatMeasurement m = TotalsOf(20.0, 0.003);
  m.transmittance.reset();
  capture.measurements = {m};
  TakeReadings(capture, truth, 0);
  const CrownFit fit = Fit(capture);
  for (const FittedParameter& p : fit.uncertainty.parameters) EXPECT_NE(p.status, Status::kFitted) << p.name;
  EXPECT_FALSE(fit.usable);
  EXPECT_FALSE(fit.uncertainty.weak_directions.empty());
}

TEST(MeasurementFit, JointFitOfTwoCapturesMatchesOneFitOfAllReadings) {
  Capture both = OneLayer(1.5, 0.8);
  both.measurements = {TotalsOf(0.5, 0.002), TotalsOf(2.0, 0.002)};
  both.measurements[0].transmittance.reset();  // each alone leaves one coefficient undetermined
  both.measurements[1].reflectance.reset();
  TakeReadings(both, Truth(both, {3, 4, 5}, {0.02, 0.05, 0.2}), 5);
  std::vector<Capture> parts{both, both};
  parts[0].measurements.pop_back();
  parts[1].measurements.erase(parts[1].measurements.begin());
  parts[0].folder = "thin", parts[1].folder = "thick";
  const CrownFit one = Fit(both);
  Progress quiet(ProgressMode::kNone);
  FitOptions options;
  options.profile_points = 0;
  const std::vector<CrownFit> fits = FitTogether(parts, options, quiet);
  for (Eigen::Index k = 0; k < one.best.size(); ++k) {
    const double stddev = std::sqrt(one.uncertainty.covariance(k, k));
    EXPECT_NEAR(fits[0].best[k], one.best[k], 0.05 * stddev) << one.entries[static_cast<size_t>(k)].name;
    EXPECT_NEAR(std::sqrt(fits[1].uncertainty.covariance(k, k)), stddev, 0.05 * stddev);
  }
}

TEST(MeasurementFit, AHeldOutReadingIsPredictedAndNotFitted) {
  Capture capture = OneLayer(1.54, 0.8);
  const Material truth = Truth(capture, glm::dvec3(3), glm::dvec3(0.1));
  capture.measurements = {TotalsOf(0.5, 0.003), TotalsOf(2.0, 0.003)};
  TakeReadings(capture, truth, 0);
  capture.measurements[1].is_holdout = true;
  capture.measurements[1].reflectance->value += Spectrum(0.1);
  const CrownFit fit = Fit(capture);
  EXPECT_LT(fit.uncertainty.reduced_chi2, 1e-3) << "the held-out reading was fitted";
  ASSERT_EQ(fit.readings.size(), 4u);
  EXPECT_TRUE(fit.readings[2].is_holdout);
  EXPECT_NEAR(fit.readings[2].predicted[0], fit.readings[2].read.value[0] - 0.1, 1e-3);
}

TEST(MeasurementFit, PredictionsUseTheJointDistributionOfTheFit) {
  // If the sample is 5 % thicker, all its coefficients are 5 % smaller together. That hardly changes its hue;
  // independent changes of 5 % would.
  Capture capture = OneLayer(1.54, 0.8);
  const Material truth = Truth(capture, {3, 3.5, 4}, {0.02, 0.04, 0.1});
  capture.measurements = {TotalsOf(1.0, 0.0003)};
  TakeReadings(capture, truth, 0);
  FlatQuestion q;
  q.design_mm = {1.0};
  q.draws = 300;
  const auto predict = [&](bool is_joint) {
    const TemporaryFolder folder;
    WriteTextFile(folder.path / "material.json", MaterialJson(Fit(capture)));
    q.material = ReadMaterialRecord(folder.path / "material.json");
    EXPECT_TRUE(q.material.joint);
    if (!is_joint) q.material.joint.reset();
    return PredictFlat(q, [](double) {}).groups[0]["over_black.b"];
  };
  capture.measurements[0].thickness_mm = {1.05};
  const double thicker = predict(true).value;
  capture.measurements[0].thickness_mm = {0.95};
  const double thinner = predict(true).value;
  capture.measurements[0].thickness_mm = {1.0};
  capture.measurements[0].thickness_stddev_mm = 0.05;
  const FlatFigure with = predict(true), without = predict(false);
  std::printf("b* known to %.3f, if values were independent %.3f; half of what 0.1 mm make: %.3f\n", *with.stddev,
              *without.stddev, 0.5 * std::abs(thicker - thinner));
  EXPECT_NEAR(*with.stddev, 0.5 * std::abs(thicker - thinner), 0.2 * *with.stddev);  // 4 sigma of the draws
  EXPECT_GT(std::max(*without.stddev / *with.stddev, *with.stddev / *without.stddev), 1.5);
}

Capture CaptureOf(const TemporaryFolder& folder, const std::string& measurements) {
  WriteTextFile(folder.path / "capture.json",
                R"({"format": "crownfit-capture/1", "object": {"layers": [{"name": "ceramic",
    "reduced_scattering_per_mm": {"initial": 2}}], "backings": {"white": {"reflectance_rgb": 0.9}}}, "measurements": )" +
                    measurements + "}");
  return ReadCapture(folder.path);
}

TEST(Measurements, AreReadWithDefaults) {
  const TemporaryFolder folder;
  const Capture capture =
      CaptureOf(folder, R"([{"name": "a", "thickness_mm": 0.5, "geometry": "8/d", "backing": "white",
    "reflectance": {"value": [0.5, 0.4, 0.3], "stddev": 0.01}, "specular": "included"}])");
  ASSERT_EQ(capture.measurements.size(), 1u);
  const FlatMeasurement& m = capture.measurements[0];
  EXPECT_EQ(m.geometry, MeasuredAt::kD_8);
  EXPECT_TRUE(m.has_specular);
  EXPECT_EQ(m.backing, 0u);
  EXPECT_EQ(m.reflectance->value[2], 0.3);
  EXPECT_EQ(m.reflectance->stddev[2], 0.01);
  EXPECT_FALSE(m.aperture_mm);
}

TEST(Measurements, InvalidEntriesAreRefusedByName) {
  const TemporaryFolder folder;
  const auto complaint = [&](const std::string& rest) -> std::string {
    try {
      CaptureOf(folder, R"([{"name": "a", "thickness_mm": 0.5, )" + rest + "}]");
    } catch (const InputError& e) {
      return e.what();
    }
    return "nothing";
  };
  const struct {
    const char *text, *says;
  } cases[] = {
      {R"("geometry": "0/d")", "has no reading"},
      {R"("geometry": "30/0", "reflectance": {"value": 0.5, "stddev": 0.01})", "geometry"},
      {R"("geometry": "0/d", "reflectance": {"value": 50, "stddev": 0.01})", "per cent"},
      {R"("geometry": "0/d", "reflectance": {"value": 0.5, "stddev": 0})", "stddev"},
      {R"("geometry": "0/d", "reflectance": {"value": 0.5})", "stddev"},
      {R"("geometry": "0/d", "reflectance": {"value": 0.7, "stddev": 0.01}, "transmittance": {"value": 0.4, "stddev": 0.01})",
       "more than all light"},
      {R"("geometry": "d/8", "transmittance": {"value": 0.4, "stddev": 0.01})", "0/d"},
      {R"("geometry": "0/d", "backing": "white", "transmittance": {"value": 0.4, "stddev": 0.01})", "backing"},
      {R"("geometry": "0/d", "backing": "grey", "reflectance": {"value": 0.4, "stddev": 0.01})", "Known: white"},
      {R"("geometry": "45/0", "specular": "included", "reflectance": {"value": 0.4, "stddev": 0.01})", "45/0"},
      {R"("geometry": "0/d", "lab": {"value": 50, "stddev": 1}, "reflectance": {"value": 0.4, "stddev": 0.01})",
       "twice"},
      {R"("geometry": "0/d", "thickness_stddev_mm": 0.4, "reflectance": {"value": 0.4, "stddev": 0.01})", "30 %"},
      {R"("geometry": "0/d", "apperture_mm": 3, "reflectance": {"value": 0.4, "stddev": 0.01})", "aperture_mm"},
  };
  for (const auto& c : cases) EXPECT_NE(complaint(c.text).find(c.says), std::string::npos) << complaint(c.text);
  EXPECT_THROW(CaptureOf(folder, "[]"), InputError) << "nothing to fit";
}

const char* const kRxt = R"(IAD1   # must be first
1.54 # sample
1.5  # slides
1.0  # mm
0    # mm: so there are none
0.1
1
0
203.2
25.4
12.7
1
0.96
203.2
25.4
12.7
1
0.96
)";

std::string RefusalOfRxt(const std::string& table, const std::string& header = kRxt) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "a.rxt", header + table);
  try {
    ReadRxt(folder.path / "a.rxt");
  } catch (const InputError& e) {
    return e.what();
  }
  return "nothing";
}

TEST(RxtFile, ColumnsAreGivenByLettersOrByCount) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "a.rxt",
                std::string(kRxt) + "L d r t g -\n\n450 0.5 0.4 0.3 0.7 # a comment\n550 0.6 0.5 0.2 0.7\n");
  const RxtFile by_letters = ReadRxt(folder.path / "a.rxt");
  ASSERT_EQ(by_letters.rows.size(), 2u);
  EXPECT_EQ(by_letters.slide_ior, 1.0) << "slides without thickness";
  EXPECT_EQ(by_letters.rows[1].thickness_mm, 0.6);
  EXPECT_EQ(by_letters.rows[1].asymmetry, 0.7);
  EXPECT_EQ(by_letters.rows[1].ior, 1.54);
  EXPECT_EQ(by_letters.rows[1].transmittance, 0.2);
  WriteTextFile(folder.path / "a.rxt", std::string(kRxt) + "2\n0.4 0.3\n633 0.5 0.2\n");
  const RxtFile by_count = ReadRxt(folder.path / "a.rxt");
  EXPECT_FALSE(by_count.rows[0].wavelength_nm);
  EXPECT_EQ(by_count.rows[1].wavelength_nm, 633);
  EXPECT_EQ(by_count.rows[1].transmittance, 0.2);
}

TEST(RxtFile, AByteOrderMarkChangesNothing) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "a.rxt", "\xEF\xBB\xBF" + std::string(kRxt) + "L r t\n633 0.5 0.2\n");
  const RxtFile marked = ReadRxt(folder.path / "a.rxt");
  ASSERT_EQ(marked.rows.size(), 1u);
  EXPECT_EQ(marked.rows[0].ior, 1.54);
  EXPECT_EQ(marked.rows[0].reflectance, 0.5);
  EXPECT_NE(RefusalOfRxt("r t\n0.4 0.3\n0.5\n", "\xEF\xBB\xBF" + std::string(kRxt)).find("line 21"), std::string::npos);
}

TEST(RxtFile, ErrorsNameTheLine) {
  EXPECT_NE(RefusalOfRxt("r t\n0.4 0.3\n0.5\n").find("line 21"), std::string::npos) << "a number is missing";
  EXPECT_NE(RefusalOfRxt("r t\n0.4 nan\n").find("line 20"), std::string::npos);
  EXPECT_NE(RefusalOfRxt("r t\n40 30\n").find("between 0 and 1"), std::string::npos);
  EXPECT_NE(RefusalOfRxt("r u\n0.4 0.3\n").find("'u'"), std::string::npos);
  EXPECT_NE(RefusalOfRxt("L\n400\n").find("no column r or t"), std::string::npos);
  EXPECT_NE(RefusalOfRxt("r t\n").find("no row"), std::string::npos);
  EXPECT_NE(RefusalOfRxt("").find("17"), std::string::npos);
  EXPECT_NE(RefusalOfRxt("r\n0.4\n", "IAD2\n").find("IAD1"), std::string::npos);
  std::string one_sphere = kRxt;
  one_sphere.replace(one_sphere.find("\n0\n"), 3, "\n1\n");
  EXPECT_NE(RefusalOfRxt("r\n0.4\n", one_sphere).find("sphere"), std::string::npos);
}

TEST(RxtFile, FitOfAnExportedFileRecoversTheMaterial) {
  const TemporaryFolder folder;
  ExportScene scene;
  scene.channel_names = {"R", "G", "B"};
  scene.wavelengths_nm = {600, 540, 450};
  ExportedLayer layer{"ceramic", 1.54, 0.8, 0.0, glm::dvec3(10, 11, 14), glm::dvec3(0.02, 0.05, 0.2), {}};
  scene.layers = {layer};
  WriteRxt(scene, folder.path);
  InitMeasuredCapture({folder.path / "material.rxt", {}, {}, "again", 1e-4, 0.0}, folder.path / "capture");
  const Capture capture = ReadCapture(folder.path / "capture");
  EXPECT_EQ(capture.measurements.size(), 4u) << "of 0.5, 1, 1.5 and 2 mm";
  const CrownFit fit = Fit(capture);
  for (int c = 0; c < kChannels; ++c) {
    EXPECT_NEAR(fit.material.layers[0][Quantity::kReducedScattering][c], 0.2 * layer.scattering_per_mm[c], 1e-4);
    EXPECT_NEAR(fit.material.layers[0][Quantity::kAbsorption][c], layer.absorption_per_mm[c], 1e-5);
  }
}

TEST(RxtFile, BandsAreInterpolatedOrRowsAreSelected) {
  const TemporaryFolder folder;
  const auto rxt = folder.path / "a.rxt";
  WriteTextFile(rxt, std::string(kRxt) + "L r t\n500 0.4 0.3\n600 0.5 0.2\n");
  InitMeasuredCapture({rxt, {600, 550, 500}}, folder.path);
  EXPECT_NEAR(ReadCapture(folder.path).measurements[0].reflectance->value[1], 0.45, 1e-12);
  EXPECT_THROW(InitMeasuredCapture({rxt, {600, 550, 450}}, folder.path), InputError)
      << "outside the file's wavelengths";
  EXPECT_THROW(InitMeasuredCapture({rxt, {}, {1}}, folder.path), InputError)
      << "rows selected in a file with wavelengths";
  WriteTextFile(rxt, std::string(kRxt) + "r t\n0.4 0.3\n0.5 0.2\n");
  EXPECT_THROW(InitMeasuredCapture({rxt}, folder.path), InputError) << "two rows, none selected";
  EXPECT_THROW(InitMeasuredCapture({rxt, {}, {3}}, folder.path), InputError) << "there are only two rows";
  InitMeasuredCapture({rxt, {}, {2}}, folder.path);
  EXPECT_EQ(ReadCapture(folder.path).measurements[0].transmittance->value, (Spectrum{0.2, 0.2, 0.2}));
}

}  // namespace
}  // namespace crownfit
