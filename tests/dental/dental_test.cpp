// Predicted colours of flat samples against physical laws and published data on teeth and ceramics.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "base/error.h"
#include "capture/capture.h"
#include "dental/flat_prediction.h"
#include "dental/shades_file.h"
#include "dental/translucency.h"
#include "optics/aperture.h"
#include "optics/quadrature.h"
#include "optics/shading_terms.h"
#include "path/slab_walk.h"
#include "photo/colour_difference.h"
#include "support/channels.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

MaterialRecord OneLayer(double ior, const glm::dvec3& reduced_scattering, const glm::dvec3& absorption) {
  MaterialRecord record;
  Material::Layer layer;
  layer.name = "ceramic";
  for (size_t i = 0; i < kParameters.size(); ++i) layer.values[i].fill(kParameters[i].initial);
  layer[Quantity::kIor].fill(ior);
  layer[Quantity::kReducedScattering] = reduced_scattering;
  layer[Quantity::kAbsorption] = absorption;
  record.material.layers = {layer};
  record.layers.resize(1);
  return record;
}

FlatQuestion Question(const MaterialRecord& material, double mm) {
  FlatQuestion q;
  q.material = material;
  q.design_mm = {mm};
  q.threads = 1;
  q.draws = 40;
  return q;
}

FlatPrediction Predict(const FlatQuestion& q) {
  return PredictFlat(q, [](double) {});
}

Slab OneSlab(double ior, double g, double scattering, double absorption, double mm) {
  Slab slab;
  slab.layers = {{ior, g, 0.0, scattering, absorption, mm}};
  return slab;
}

TEST(ViewSlab, WhiteFurnaceReturnsAllLightThatEnters) {
  const double cosine = std::cos(8.0 * M_PI / 180.0);
  for (const double ior : {1.0, 1.54, 2.16})
    EXPECT_NEAR(ViewSlab(OneSlab(ior, 0.8, 40, 0, 1), {{1.0}}, MeasuredAt::kD_8)[0].Over(1.0),
                1.0 - Terms<double>::FresnelReflectance(cosine, ior), 2e-5);
}

TEST(ViewSlab, HalfSpaceAgreesWithChandrasekharAt45Degrees) {
  // Isotropic scattering, index 1: albedo H(mu) H(mu0) / (4 (mu + mu0)), H by its own equation.
  const double albedo = 0.95, root = std::sqrt(1.0 - albedo);
  const Quadrature q = GaussLegendre(64, 0.0, 1.0);
  std::vector<double> h(q.node.size(), 1.0);
  const auto next = [&](double mu) {
    double sum = 0;
    for (size_t i = 0; i < h.size(); ++i) sum += q.weight[i] * q.node[i] * h[i] / (mu + q.node[i]);
    return 1.0 / (root + 0.5 * albedo * sum);
  };
  for (int step = 0; step < 300; ++step) {
    std::vector<double> better;
    for (const double mu : q.node) better.push_back(next(mu));
    h = better;
  }
  const double cosine = std::sqrt(0.5), want = albedo * next(1.0) * next(cosine) / (4.0 * (1.0 + cosine));
  EXPECT_NEAR(ViewSlab(OneSlab(1.0, 0.0, 19.0, 1.0, 20.0), {{20.0}}, MeasuredAt::k45_0)[0].reflectance, want, 2e-5);
}

TEST(ViewSlab, BackedSlabAgreesWithAddingDoubling) {
  // By reciprocity, a view along the normal under diffuse light equals the total for light along the normal; 8 degrees
  // are close. The change with the backing must agree closely.
  for (const double rho : {0.2, 0.9}) {
    Slab slab = OneSlab(1.54, 0.8, 15, 0.05, 1);
    const ViewedSlab v = ViewSlab(slab, {{1.0}}, MeasuredAt::kD_8, {24})[0];
    slab.backing_reflectance = rho;
    EXPECT_NEAR(v.Over(rho), SolveByAddingDoubling(slab).value.reflectance_collimated, 1e-3);
  }
}

TEST(ViewSlab, SeveralThicknessesAgreeWithSingleOnes) {
  const Slab slab = OneSlab(1.54, 0.8, 15, 0.05, 1);
  const auto both = ViewSlab(slab, {{0.5}, {2.0}}, MeasuredAt::k45_0);
  EXPECT_DOUBLE_EQ(both[1].reflectance, ViewSlab(slab, {{2.0}}, MeasuredAt::k45_0)[0].reflectance);
  EXPECT_LT(both[0].reflectance, both[1].reflectance);
  EXPECT_GT(both[0].transmittance, both[1].transmittance);
}

TEST(Aperture, AgreesWithMonteCarloWithinStatedErrors) {
  const struct {
    Slab slab;
    double tolerance;  ///< measured errors are 0.6 to 0.9 of it
  } cases[] = {{OneSlab(1.63, 0.68, 6.6, 0.01, 1.0), 0.017},
               {OneSlab(2.16, 0.5, 12.0, 0.02, 0.5), 0.009},
               {OneSlab(1.63, 0.68, 3.125, 0.01, 1.0), 0.037}};
  for (const auto& c : cases) {
    constexpr double kDiameter = 3.0;
    Slab slab = c.slab;
    slab.backing_reflectance = 0.9;
    double model = 0, weights = 0;
    for (const ApertureWave& wave : ApertureWaves(kDiameter)) {
      const Slab under = UnderWave(slab, wave.wave_number_per_mm);
      model += wave.weight * SolveByAddingDoubling(under, {12}).value.reflectance_collimated;
      weights += wave.weight;
    }
    EXPECT_NEAR(weights, 1.0, 1e-12);
    for (int i = 0; i <= 60; ++i) slab.radii_mm.push_back(kDiameter * i / 60.0);
    const SlabAnswer walked = SolveByWalks(slab, {20000, 1, 1}, [](double) {});
    double path = 0;
    for (size_t i = 0; i + 1 < slab.radii_mm.size(); ++i) {
      // For light that enters anywhere in the aperture: the share leaving at this distance that leaves inside it.
      const double r0 = slab.radii_mm[i], r1 = slab.radii_mm[i + 1], x = 0.5 * (r0 + r1) / kDiameter;
      path += walked.radial_reflectance_per_mm2[i] * M_PI * (r1 * r1 - r0 * r0) * 2.0 / M_PI *
              (std::acos(x) - x * std::sqrt(1.0 - x * x));
    }
    EXPECT_NEAR(model, path, c.tolerance);
    EXPECT_LT(path, 0.65 * SolveByAddingDoubling(slab, {12}).value.reflectance_collimated) << "edge loss is large";
  }
}

TEST(Aperture, WideApertureLosesNothing) {
  const Slab slab = OneSlab(1.54, 0.8, 15, 0.05, 1);
  double wide = 0;
  for (const ApertureWave& wave : ApertureWaves(1000.0))
    wide += wave.weight * ViewSlab(UnderWave(slab, wave.wave_number_per_mm), {{1.0}}, MeasuredAt::k45_0)[0].reflectance;
  EXPECT_NEAR(wide, ViewSlab(slab, {{1.0}}, MeasuredAt::k45_0)[0].reflectance, 0.01);
}

TEST(Translucency, KubelkaMunkInvertsItsOwnReflectances) {
  // Kubelka's forward formula.
  const double k = 0.3, s = 1.7, mm = 0.8, a = 1 + k / s, b = std::sqrt(a * a - 1);
  const auto over = [&](double rg) {
    const double coth = 1.0 / std::tanh(b * s * mm);
    return (1 - rg * (a - b * coth)) / (a - rg + b * coth);
  };
  for (const double black : {0.0, 0.03}) {
    const KubelkaMunk km = KubelkaMunkFromCards(over(black), over(0.9), black, 0.9, mm);
    EXPECT_NEAR(km.absorption_per_mm, k, 1e-9);
    EXPECT_NEAR(km.scattering_per_mm, s, 1e-9);
  }
  EXPECT_TRUE(std::isnan(KubelkaMunkFromCards(0.4, 0.4, 0.0, 1.0, 1.0).scattering_per_mm));
}

TEST(Colour, LabRoundTrips) {
  for (const glm::dvec3 lab : {glm::dvec3(68, 1, 18), glm::dvec3(3, 0.5, -1), glm::dvec3(95, -3, 12)})
    EXPECT_LT(glm::length(LabFromLinearRgb(LinearRgbFromLab(lab)) - lab), 1e-9);
}

TEST(Colour, ReflectanceRoundTripsThroughAColourFile) {
  BandColour colour;
  colour.rgb_from_sensor.columns = {{1.6, -0.3, 0.0}, {-0.5, 1.5, -0.4}, {-0.1, -0.2, 1.4}};
  colour.white_sensor = {0.4, 0.8, 0.6};
  const Spectrum bands{0.6, 0.45, 0.3};
  EXPECT_LT(Distance(colour.Reflectance(colour.LinearRgb(bands)), bands), 1e-9);
}

TEST(Prediction, TranslucencyFallsAlmostExponentiallyWithThickness) {
  // Wang et al. 2013 found this for eight glass-ceramics, 0.6 to 2.0 mm, TP 2.2 to 25.3.
  FlatQuestion q = Question(OneLayer(1.55, glm::dvec3(1.5), glm::dvec3(0.02)), 1.0);
  q.other_totals_mm = {0.6, 1.0, 1.5, 2.0};
  const FlatPrediction p = Predict(q);
  std::vector<double> mm{0.6, 1.0, 1.5, 2.0}, log_tp;
  for (size_t g = 1; g < p.groups.size(); ++g) log_tp.push_back(std::log(p.groups[g]["tp_ab"].value));
  const double slope = (log_tp[3] - log_tp[0]) / (mm[3] - mm[0]);
  for (size_t i = 1; i < 3; ++i) EXPECT_NEAR(log_tp[i], log_tp[0] + slope * (mm[i] - mm[0]), 0.06);
  EXPECT_LT(slope, -0.4);
  for (size_t g = 2; g < p.groups.size(); ++g)
    EXPECT_GT(p.groups[g]["contrast_ratio"].value, p.groups[g - 1]["contrast_ratio"].value);
}

TEST(Prediction, MeasuredTranslucencyLiesBetween3mmAndWideAperture) {
  // Yu, Ahn and Lee 2009: TP 18.7 and 16.4 of 1 mm of human enamel and dentine, 3 mm aperture; the abstract does not
  // say which area was lit. Mid-visible coefficients, as far as the literature agrees
  // (reduced scattering 1.0 to 2.3 / mm).
  for (const auto& [ior, scattering, absorption, measured] :
       {std::tuple{1.63, 1.0, 0.01, 18.7}, {1.54, 1.2, 0.02, 16.4}}) {
    FlatQuestion q = Question(OneLayer(ior, glm::dvec3(scattering), glm::dvec3(absorption)), 1.0);
    q.black = glm::dvec3(0.03);
    q.white = glm::dvec3(0.9);
    const double wide = Predict(q).groups[0]["tp_ab"].value;
    q.aperture_mm = 3.0;
    const double narrow = Predict(q).groups[0]["tp_ab"].value;
    std::printf("TP %.1f through 3 mm, %.1f wide, measured %.1f\n", narrow, wide, measured);
    EXPECT_LT(narrow, measured);
    EXPECT_GT(wide, measured);
    EXPECT_GT(narrow, 0.5 * measured);
  }
}

TEST(Prediction, CementOverTitaniumLightensOrDarkensAsMeasured) {
  // PMC11458321 (2024), Table 2: opaque cement over titanium lightens zirconia by 6.2 to 8.1 and raises b*, translucent
  // cement darkens it by 5.5 to 10 and lowers b*, less so at 1.0 mm than at 0.7.
  const MaterialRecord zirconia = OneLayer(2.16, glm::dvec3(2.6, 2.7, 2.9), glm::dvec3(0.01, 0.03, 0.12));
  const auto change = [&](double mm, bool opaque) {
    FlatQuestion q = Question(zirconia, mm);
    q.is_cemented = false;
    q.stump = glm::dvec3(0.0);  // the zirconia alone
    const glm::dvec3 alone = Predict(q).lab;
    q.is_cemented = true;
    q.stump_ior = 1.0;
    q.stump = glm::dvec3(0.24, 0.21, 0.18);  // anodised titanium
    q.cement = OneLayer(1.52, glm::dvec3(opaque ? 60.0 : 0.5), glm::dvec3(opaque ? 0.02 : 0.05));
    q.cement_mm = 0.1;
    return Predict(q).lab - alone;
  };
  const glm::dvec3 opaque = change(0.7, true), clear = change(0.7, false), thicker = change(1.0, false);
  std::printf("opaque %+.1f %+.1f %+.1f, translucent %+.1f %+.1f %+.1f, 1 mm %+.1f %+.1f %+.1f\n", opaque.x, opaque.y,
              opaque.z, clear.x, clear.y, clear.z, thicker.x, thicker.y, thicker.z);
  EXPECT_NEAR(opaque.x, 7.2, 2.0);
  EXPECT_GT(opaque.z, 0);
  EXPECT_NEAR(clear.x, -8.0, 3.0);
  EXPECT_LT(clear.z, 0);
  EXPECT_LT(std::abs(thicker.x), std::abs(clear.x));
}

TEST(Prediction, OpticalContactIsTheLimitOfThinClearCement) {
  FlatQuestion q = Question(OneLayer(1.6, glm::dvec3(1.5), glm::dvec3(0.02)), 1.0);
  q.stump = glm::dvec3(0.6);
  q.stump_ior = 1.0;
  const double without = Predict(q).lab.x;
  q.cement = OneLayer(1.54, glm::dvec3(1e-3), glm::dvec3(1e-5));
  q.cement_mm = 0.001;
  EXPECT_NEAR(without, Predict(q).lab.x, 0.02);
  q.is_cemented = false;
  EXPECT_GT(std::abs(without - Predict(q).lab.x), 1.0);  // an air gap differs
}

TEST(Prediction, ForwardScatteringLayersUseEnoughDirections) {
  MaterialRecord enamel = OneLayer(1.63, glm::dvec3(0.3), glm::dvec3(0.01));
  enamel.material.layers[0][Quantity::kAsymmetry].fill(0.96);
  const FlatPrediction p = Predict(Question(enamel, 0.7));
  const ViewedSlab fine = ViewSlab(OneSlab(1.63, 0.96, 0.3 / 0.04, 0.01, 0.7), {{0.7}}, MeasuredAt::k45_0, {64})[0];
  EXPECT_NEAR(p.groups[0]["reflectance_G"].value, fine.reflectance, 3e-4);
  EXPECT_NEAR(p.groups[0]["transmittance_G"].value, fine.transmittance, 3e-4);
}

TEST(Prediction, SmallApertureReflectanceIsNonNegative) {
  FlatQuestion q = Question(OneLayer(1.54, glm::dvec3(3.0), glm::dvec3(0.02)), 1.0);
  q.aperture_mm = 0.5;
  const FlatFigure light = Predict(q).groups[0]["over_white.L"];
  EXPECT_GT(*light.low95, 0.0);
  EXPECT_LT(*light.low95, light.value);
  EXPECT_GT(*light.high95, light.value);
  EXPECT_LT(*light.high95, 100.0);
}

TEST(Prediction, MaskingThicknessGrowsWithStumpContrast) {
  FlatQuestion q = Question(OneLayer(1.54, glm::dvec3(3.0), glm::dvec3(0.02, 0.04, 0.1)), 1.0);
  q.target = glm::dvec3(0.5, 0.4, 0.3);
  q.stump = q.target;
  EXPECT_EQ(Predict(q).groups[0]["stump_shows"].value, 0.0);
  q.stump = 0.5 * q.target;
  const FlatPrediction dim = Predict(q);
  q.stump = 0.1 * q.target;
  const FlatPrediction dark = Predict(q);
  EXPECT_GT(dark.groups[0]["masked_from_at"].value, dim.groups[0]["masked_from_at"].value);
  EXPECT_GT(dim.groups[0]["masked_from_pt"].value, dim.groups[0]["masked_from_at"].value);
  // At the reported thickness, the difference equals the threshold.
  q.design_mm = {dark.groups[0]["masked_from_at"].value};
  EXPECT_NEAR(Predict(q).groups[0]["stump_shows"].value, kAcceptable, 0.05);
}

TEST(Prediction, IntervalsFollowMaterialStandardDeviations) {
  MaterialRecord record = OneLayer(1.54, glm::dvec3(3.0), glm::dvec3(0.02, 0.04, 0.1));
  FlatQuestion q = Question(record, 1.0);
  EXPECT_FALSE(Predict(q).groups[0]["tp00"].stddev) << "without uncertainty there is no interval";
  const auto tp = [&](double scattering_factor) {
    FlatQuestion moved = q;
    moved.material.material.layers[0][Quantity::kReducedScattering] *= scattering_factor;
    return Predict(moved).groups[0]["tp00"].value;
  };
  // One shared scattering with a standard deviation of 5 %, by finite differences.
  q.material.layers[0][static_cast<size_t>(Quantity::kReducedScattering)].stddev = {0.15};
  const double slope = (tp(1.01) - tp(1 / 1.01)) / (2 * std::log(1.01));
  q.draws = 400;
  const FlatFigure figure = Predict(q).groups[0]["tp00"];
  EXPECT_NEAR(*figure.stddev, std::abs(slope) * 0.05, 0.12 * std::abs(slope) * 0.05);  // 3.5 sigma of 400 draws
  EXPECT_LT(*figure.low95, figure.value);
  EXPECT_GT(*figure.high95, figure.value);
}

TEST(Prediction, IntervalsFollowTheJointDistribution) {
  // Scattering and absorption of each channel are correlated, and so are the channels. First-order propagation by hand,
  // against draws.
  MaterialRecord record = OneLayer(1.54, glm::dvec3(3.0), glm::dvec3(0.02, 0.04, 0.1));
  constexpr int kEntries = 6;
  constexpr double kStddev = 0.1, kSameChannel = 0.95, kOther = 0.5;
  std::string names, stddev, rows;
  std::array<std::array<double, kEntries>, kEntries> correlation{};
  for (int i = 0; i < kEntries; ++i) {
    const std::string between = i ? ", " : "";
    names += between + "\"ceramic." + (i < 3 ? "reduced_scattering" : "absorption") + "_per_mm[" + "RGB"[i % 3] + "]\"";
    stddev += between + std::to_string(kStddev);
    rows += between + "[";
    for (int j = 0; j < kEntries; ++j) {
      correlation[i][j] = i == j ? 1.0 : i % 3 == j % 3 ? kSameChannel : kOther;
      rows += (j ? ", " : "") + std::to_string(correlation[i][j]);
    }
    rows += "]";
  }
  const JsonFile file("joint.json",
                      "{\"names\": [" + names + "], \"stddev\": [" + stddev + "], \"correlation\": [" + rows + "]}");
  FlatQuestion q = Question(record, 1.0);
  q.draws = 300;
  q.threads = 0;
  q.material.joint = ReadJointValues(file.root(), record.material, {"R", "G", "B"});
  const FlatPrediction drawn = Predict(q);
  q.material.joint.reset();
  std::array<FlatPrediction, kEntries> up, down;
  for (int i = 0; i < kEntries; ++i)
    for (const double step : {0.01, -0.01}) {
      FlatQuestion moved = q;
      moved.material.material.layers[0][i < 3 ? Quantity::kReducedScattering : Quantity::kAbsorption][i % 3] *=
          std::exp(step);
      (step > 0 ? up : down)[i] = Predict(moved);
    }
  for (const char* name : {"reflectance_R", "reflectance_B", "over_black.L", "over_black.b"}) {
    std::array<double, kEntries> slope{};
    for (int i = 0; i < kEntries; ++i) slope[i] = (up[i].groups[0][name].value - down[i].groups[0][name].value) / 0.02;
    double joint = 0, apart = 0;
    for (int i = 0; i < kEntries; ++i) {
      apart += kStddev * kStddev * slope[i] * slope[i];
      for (int j = 0; j < kEntries; ++j) joint += kStddev * kStddev * slope[i] * correlation[i][j] * slope[j];
    }
    joint = std::sqrt(joint), apart = std::sqrt(apart);
    const FlatFigure& figure = drawn.groups[0][name];
    std::printf("%s: drawn %.4g, by hand %.4g, if independent %.4g\n", name, *figure.stddev, joint, apart);
    EXPECT_NEAR(*figure.stddev, joint, 0.2 * joint) << name;  // 4 sigma of 300 draws, and second-order terms
    EXPECT_NEAR(*figure.high95 - *figure.low95, 2 * 1.96 * joint, 0.25 * 2 * 1.96 * joint) << name;
    EXPECT_GT(std::max(joint / apart, apart / joint), 1.3)
        << name << ": the case would not distinguish joint from independent";
  }
}

TEST(Shades, AreReadAsWritten) {
  const TemporaryFolder folder;
  const auto table = folder.path / "tabs.csv";
  std::ofstream(table) << "name,L,a,b\nA1,79.6,-1.6,13.1\nA1,76.7,-1.6,16.6\n";
  EXPECT_THROW(ReadShadeTable(table), InputError) << "two tabs of one name";
  std::ofstream(table) << "A1,\"79,6\",\"-1,6\",\"13,1\"\n";
  EXPECT_THROW(ReadShadeTable(table), InputError) << "decimal commas in a comma-separated table";
  std::ofstream(table) << "name;L*;a*;b*\n\"A3,5\";79,6;-1,6;13,1\n";
  const std::vector<ShadeTab> german = ReadShadeTable(table);
  ASSERT_EQ(german.size(), 1u);
  EXPECT_EQ(german[0].name, "A3,5");
  EXPECT_EQ(german[0].lab, glm::dvec3(79.6, -1.6, 13.1));
  std::ofstream(table) << "name,L,a,b,stddev\nA1,79.6,-1.6,13.1,0.3\nB2,76.7,-1.6,16.6,0.4\n";
  ShadeSet set{"measured", "a note", {table}, {}};
  set.tabs = ReadShadeTable(table);
  ASSERT_EQ(set.tabs.size(), 2u);
  WriteShades(folder.path / "tabs.json", set);
  const ShadeSet back = ReadShades(folder.path / "tabs.json");
  EXPECT_EQ(back.tabs[1].name, "B2");
  EXPECT_EQ(back.tabs[1].lab, set.tabs[1].lab);
  EXPECT_EQ(back.tabs[0].stddev, glm::dvec3(0.3));
  EXPECT_EQ(back.note, "a note");
}

/// The tabs of a table, or the message that refuses it.
struct TableRead {
  std::vector<ShadeTab> tabs;
  std::string refusal;
};
TableRead ReadTable(const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder.path / "tabs.csv") << text;
  try {
    return {ReadShadeTable(folder.path / "tabs.csv"), ""};
  } catch (const InputError& error) {
    return {{}, error.what()};
  }
}

TEST(Shades, ColumnsAreFoundByNameInAnyOrder) {
  const glm::dvec3 lab(78, 0.5, 12), each(0.3, 0.2, 0.1);
  for (const char* text : {
           "name,L,a,b,sb,sa,sL\nA1,78,0.5,12,0.1,0.2,0.3\n",
           "b*,sb,a*,sa,L*,sL,Name\n12,0.1,0.5,0.2,78,0.3,A1\n",
           "Zahn;CIE L*;CIE a*;CIE b*;SD L*;a* SD;stddev_b\nA1;78;0,5;12;0,3;0,2;0,1\n",
           "A1,78,0.5,12,0.3,0.2,0.1\n",
           "sep=;\nname;L;a;b;sL;sa;sb;\nA1;78;0,5;12;0,3;0,2;0,1;\n",
       }) {
    const TableRead read = ReadTable(text);
    ASSERT_EQ(read.tabs.size(), 1u) << text << read.refusal;
    EXPECT_EQ(read.tabs[0].name, "A1") << text;
    EXPECT_EQ(read.tabs[0].lab, lab) << text;
    EXPECT_EQ(read.tabs[0].stddev, each) << text;
  }
  const TableRead plain = ReadTable("A1,78,0.5,12\n");
  ASSERT_EQ(plain.tabs.size(), 1u) << plain.refusal;
  EXPECT_EQ(plain.tabs[0].stddev, glm::dvec3(0.0));
}

TEST(Shades, WhatIsNoCielabOrNoStandardDeviationIsRefusedByName) {
  const struct {
    const char* heading;
    const char* named;
  } cases[] = {{"name,L,a,b,X,Y,Z", "'X'"},
               {"name,L,a,b,R,G,B", "'R'"},
               {"name,L*,a*,b*,C*,h,dE", "'C*'"},
               {"name,L,a,b,dE00", "'dE00' holds differences"},
               {"name,L,a,b,n", "'n'"},
               {"name,Hunter L,Hunter a,Hunter b", "'Hunter L' is in Hunter's"},
               {"name,dL*,da*,db*", "'dL*' holds differences"},
               {"name,\u0394L*,\u0394a*,\u0394b*", "'\u0394L*' holds differences"},
               {"name,L*(D50),a*(D50),b*(D50)", "'L*(D50)'"},
               {"name,L* 10\u00b0,a* 10\u00b0,b* 10\u00b0", "'L* 10\u00b0'"},
               {"name,L,a,b,L*", "'L' and 'L*'"},
               {"name,L,a,b,sL", "no column sa"},
               {"name,L,a,b,stddev,sL,sa,sb", "'stddev'"},
               {"name,L,a", "no column b*"}};
  for (const auto& [heading, named] : cases) {
    std::string row = "A1";
    for (const char* c = heading; *c; ++c)
      if (*c == ',') row += ",5";
    const TableRead read = ReadTable(std::string(heading) + "\n" + row + "\n");
    EXPECT_NE(read.refusal.find(named), std::string::npos) << heading << ": " << read.refusal;
    EXPECT_NE(read.refusal.find("line 1"), std::string::npos) << heading << ": " << read.refusal;
  }
}

TEST(Shades, DecimalCommasBetweenCommasAreNeverTakenForCells) {
  for (const char* text : {"name,L,a,b\nA1,78,5,0,1,12,3\n", "name,L,a,b\nA1,78,5,0,12\n", "A1,78,5,0,1,12,3\n",
                           "A1,78,5,0,12\n", "name,L,a,b,stddev\nA1,78,5,0,1,12,3,0,2\n"}) {
    const TableRead read = ReadTable(text);
    EXPECT_TRUE(read.tabs.empty()) << text;
    EXPECT_NE(read.refusal.find("Decimal commas need semicolons"), std::string::npos) << text << read.refusal;
  }
}

TEST(Ciede2000, AgreesWithPublishedZirconiaDifferences) {
  // PMC11458321 (2024), Table 2: means of dL*, da*, db* and of CIEDE2000. The bare zirconia's colour is not printed;
  // 68, 1, 18 fits the column to 0.06 rms.
  const double rows[16][4] = {
      {6.5, -1.3, 4.6, 5.6}, {7.2, -.1, 5.7, 6.2}, {-9.7, -2.3, -11.8, 11.7}, {-7.2, -2.4, -9.8, 9.2},
      {8.1, -1.1, 4.7, 6.7}, {6.5, -.2, 6.2, 5.9}, {-10., -2.2, -9.6, 10.9},  {-8.5, -2.5, -7.5, 9.0},
      {7.3, -1.3, 5.3, 6.3}, {6.3, -.2, 6.6, 6.0}, {-6.1, -1.4, -4.8, 6.0},   {-5.5, -1.4, -4.8, 5.5},
      {6.2, -1.5, 4.2, 5.5}, {6.4, -.4, 5.0, 5.6}, {-8.5, -1.9, -8.6, 9.2},   {-6.5, -2.0, -9.0, 8.1}};
  const glm::dvec3 bare(68, 1, 18);
  for (const auto& r : rows) EXPECT_NEAR(Ciede2000(bare, bare + glm::dvec3(r[0], r[1], r[2])), r[3], 0.15);
}

}  // namespace
}  // namespace crownfit
