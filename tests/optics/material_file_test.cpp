// Material files: values and uncertainties of a fit, and values set by hand.

#include "optics/material_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "capture/capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

Capture TwoLayers() {
  Capture capture;
  for (const char* name : {"enamel", "dentine"}) {
    LayerSpec layer;
    layer.name = name;
    for (size_t q = 0; q < kParameters.size(); ++q) layer.parameters[q] = DefaultSpec(kParameters[q]);
    capture.layers.push_back(layer);
  }
  capture.layers[0].surface = "outer.ply";
  for (size_t q = 0; q < kParameters.size(); ++q) capture.surface[q] = DefaultSpec(kParameters[q]);
  PhotographSpec photo;
  photo.name = "front";
  capture.photographs.push_back(photo);
  return capture;
}

const char* const kFitted = R"({"format": "crownfit-material/1", "layers": [
  {"name": "enamel", "thickness_mm": {"value": 0.8, "stddev": 0.1, "interval95": [0.6, 1.1], "status": "fitted"},
   "absorption_per_mm": {"value": [0.01, 0.02, 0.05], "stddev": [1, 1, 1],
                         "interval95": [[0.005, 0.02], [0.01, null], [0.04, 0.06]], "status": "not_identified",
                         "status_by_channel": ["fitted", "not_identified", "fitted"]}},
  {"name": "dentine", "ior": 1.5}], "linear_scales": {"exposure_scale front": 1.25}})";

TEST(MaterialFile, ReadsIntervalsAndStatuses) {
  const TemporaryFolder folder;
  const auto file = folder.path / "material.json";
  WriteTextFile(file, kFitted);
  const MaterialRecord record = ReadMaterialRecord(file, TwoLayers());
  const auto& enamel = record.layers[0];
  const ParameterRecord& thickness = enamel[static_cast<size_t>(Quantity::kThickness)];
  EXPECT_EQ(thickness.status, "fitted");
  ASSERT_EQ(thickness.interval95.size(), 1u);
  EXPECT_EQ(thickness.interval95[0], (std::array{0.6, 1.1}));
  const ParameterRecord& absorption = enamel[static_cast<size_t>(Quantity::kAbsorption)];
  ASSERT_EQ(absorption.interval95.size(), 3u);
  EXPECT_EQ(absorption.interval95[2], (std::array{0.04, 0.06}));
  ASSERT_EQ(absorption.stddev.size(), 3u);
  EXPECT_EQ(absorption.status_by_channel[1], "not_identified");
  EXPECT_TRUE(thickness.status_by_channel.empty());
  EXPECT_EQ(thickness.stddev[0], 0.1);
  EXPECT_TRUE(absorption.is_stated);
  EXPECT_FALSE(record.layers[1][static_cast<size_t>(Quantity::kThickness)].is_stated);
  EXPECT_FALSE(absorption.interval95[1]) << "an unknown end";
  EXPECT_TRUE(record.layers[1][static_cast<size_t>(Quantity::kIor)].interval95.empty());
  EXPECT_EQ(WithLinearScales(TwoLayers(), record.linear_scales).photographs[0].exposure_scale, 1.25);
  EXPECT_EQ(ReadMaterialOutline(file).layers, (std::vector<std::string>{"enamel", "dentine"}));
}

TEST(MaterialFile, HandSetValuesHaveNoIntervals) {
  const TemporaryFolder folder;
  const Capture capture = TwoLayers();
  WriteTextFile(folder.path / "material.json", kFitted);
  MaterialRecord record = ReadMaterialRecord(folder.path / "material.json", capture);
  record.material.layers[0][Quantity::kAbsorption] = {0.1, 0.2, 0.3};
  record.material.layers[0][Quantity::kThickness].fill(0.5);
  record.material.surface[Quantity::kRoughness].fill(0.33);
  const auto file = folder.path / "by_hand.json";
  WriteHandSetMaterial(file, capture, record.material, record.linear_scales, "material.json");
  const MaterialRecord again = ReadMaterialRecord(file, capture);
  for (size_t l = 0; l < capture.layers.size(); ++l)
    for (const ParameterRow& row : kParameters)
      if (IsOfLayer(capture, l, row)) {
        EXPECT_EQ(again.material.layers[l][row.quantity], record.material.layers[l][row.quantity]) << row.key;
        EXPECT_EQ(again.layers[l][static_cast<size_t>(row.quantity)].status, "fixed");
        EXPECT_TRUE(again.layers[l][static_cast<size_t>(row.quantity)].interval95.empty());
      }
  EXPECT_EQ(again.material.surface[Quantity::kRoughness], record.material.surface[Quantity::kRoughness]);
  EXPECT_EQ(again.linear_scales, record.linear_scales);
}

JointValues ReadJoint(const std::string& text, const Material& material) {
  return ReadJointValues(JsonFile("joint.json", text).root(), material, {"R", "G", "B"});
}

TEST(JointValues, DrawsFollowASingularCovariance) {
  // A power law: the middle one is the mean of the others, so the matrix has no variance in one direction.
  const Material material = StatedMaterial(TwoLayers());
  const double half = std::sqrt(0.5);
  const std::string r = std::to_string(half);
  const JointValues joint =
      ReadJoint(R"({"names": ["dentine.absorption_per_mm[R]", "dentine.absorption_per_mm[G]",
    "dentine.absorption_per_mm[B]", "pulp.absorption_per_mm[R]"], "stddev": [0.2, )" +
                    std::to_string(0.2 * half) + R"(, 0.2, 1], "correlation": [[1, )" + r + ", 0, 0.3], [" + r +
                    ", 1, " + r + ", 0], [0, " + r + ", 1, 0], [0.3, 0, 0, 1]]}",
                material);
  ASSERT_EQ(joint.entries.size(), 3u) << "the entry of an absent layer is dropped";
  constexpr int kDraws = 4000;
  double square = 0, product = 0, off = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Material drawn = Drawn(joint, material, static_cast<uint64_t>(i));
    std::array<double, 3> ln{};
    for (int c = 0; c < 3; ++c)
      ln[c] = std::log(drawn.layers[1][Quantity::kAbsorption][c] / material.layers[1][Quantity::kAbsorption][c]);
    square += ln[0] * ln[0] / kDraws;
    product += ln[0] * ln[1] / kDraws;
    off = std::max(off, std::abs(ln[1] - 0.5 * (ln[0] + ln[2])));
    EXPECT_EQ(drawn.layers[0][Quantity::kAbsorption], material.layers[0][Quantity::kAbsorption]);
  }
  EXPECT_NEAR(square, 0.04, 4 * 0.04 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(product, 0.02, 4 * 0.04 / std::sqrt(kDraws));
  EXPECT_LT(off, 1e-5);  // six digits of the correlation
}

TEST(JointValues, InvalidNamesAndMatricesAreRefused) {
  const Material material = StatedMaterial(TwoLayers());
  for (const char* text :
       {R"({"names": ["dentine.absorbtion_per_mm"], "stddev": [1], "correlation": [[1]]})",
        R"({"names": ["dentine.absorption_per_mm[X]"], "stddev": [1], "correlation": [[1]]})",
        R"({"names": ["dentine.ior"], "stddev": [-1], "correlation": [[1]]})",
        R"({"names": ["dentine.ior"], "stddev": [1], "correlation": [[0.5]]})",
        R"({"names": ["dentine.ior", "enamel.ior"], "stddev": [1, 1], "correlation": [[1, 1.5], [1.5, 1]]})",
        R"({"names": ["dentine.ior", "enamel.ior"], "stddev": [1, 1], "correlation": [[1, 0.5]]})"})
    EXPECT_THROW(ReadJoint(text, material), InputError) << text;
}

TEST(JointValues, AsymmetricCorrelationsAndRepeatedNamesAreRefusedByKey) {
  const Material material = StatedMaterial(TwoLayers());
  const auto refusal = [&](const std::string& second, const std::string& correlation) -> std::string {
    try {
      ReadJoint(
          R"({"names": ["dentine.ior", ")" + second + R"("], "stddev": [1, 1], "correlation": )" + correlation + "}",
          material);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal("enamel.ior", "[[1, 0.9], [0.1, 1]]").find("correlation: is not symmetric"), std::string::npos);
  EXPECT_NE(refusal("enamel.ior", "[[1, 0.1], [0.9, 1]]").find("correlation: is not symmetric"), std::string::npos);
  EXPECT_NE(refusal("enamel.ior", "[[1, 0.1], [0.1, 0.9]]").find("correlation[1]: a value's"), std::string::npos);
  EXPECT_NE(refusal("dentine.ior", "[[1, 0.5], [0.5, 1]]").find("names[1]: 'dentine.ior' occurs twice"),
            std::string::npos);
  EXPECT_NE(refusal("pulp.ior", "[[1, 0.9], [0.1, 1]]").find("is not symmetric"), std::string::npos)
      << "of a layer that the material lacks";
  EXPECT_EQ(refusal("enamel.ior", "[[1, 0.3333333], [0.3333330, 1]]"), "") << "digits cut by hand";
}

TEST(MaterialFile, OtherBandsAreRefused) {
  const TemporaryFolder folder;
  const auto file = folder.path / "material.json";
  const auto write = [&](const char* nm0, const char* nm1, const char* nm2) {
    std::string channels;
    for (const char* nm : {nm0, nm1, nm2})
      channels +=
          std::string(channels.empty() ? "" : ", ") + R"({"name": "x)" + nm + R"(", "wavelength_nm": )" + nm + "}";
    WriteTextFile(file, R"({"format": "crownfit-material/1", "channels": [)" + channels +
                            R"(], "layers": [{"name": "enamel"}, {"name": "dentine"}]})");
  };
  Capture capture = TwoLayers();
  capture.wavelengths_nm = {605, 540, 450};
  write("600", "549", "450");
  EXPECT_NO_THROW(ReadMaterialRecord(file, capture));
  write("450", "540", "600");
  EXPECT_THROW(ReadMaterialRecord(file, capture), InputError) << "the same bands in another order";
  EXPECT_EQ(ReadMaterialRecord(file).wavelengths_nm, (std::vector{450.0, 540.0, 600.0}))
      << "without a capture, the file's own bands hold";
}

TEST(MaterialFile, UnequalChannelsOfAScalarAreRefused) {
  const TemporaryFolder folder;
  const auto read = [&](const char* index) {
    WriteTextFile(folder.path / "material.json",
                  std::string(R"({"format": "crownfit-material/1", "layers": [{"name": "enamel", "ior": )") + index +
                      R"(}, {"name": "dentine"}]})");
    return ReadMaterialRecord(folder.path / "material.json", TwoLayers()).material.layers[0][Quantity::kIor][2];
  };
  EXPECT_EQ(read("[1.6, 1.6, 1.6]"), 1.6);
  EXPECT_THROW(read("[1.6, 1.6, 1.7]"), InputError);
}

TEST(MaterialFile, SaysWhichLayerIsMissing) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "material.json", R"({"format": "crownfit-material/1", "layers": [{"name": "enamel"}]})");
  EXPECT_THROW(ReadMaterialRecord(folder.path / "material.json", TwoLayers()), InputError);
}

}  // namespace
}  // namespace crownfit
