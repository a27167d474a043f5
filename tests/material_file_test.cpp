// Material files: what a fit says of its values, and values set by hand.

#include "exchange/material_file.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
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
                         "interval95": [[0.005, 0.02], [0.01, null], [0.04, 0.06]], "status": "not_identified"}},
  {"name": "dentine", "ior": 1.5}], "linear_scales": {"exposure_scale front": 1.25}})";

TEST(MaterialFile, TellsIntervalsAndStatuses) {
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
  EXPECT_EQ(thickness.stddev[0], 0.1);
  EXPECT_TRUE(absorption.is_stated);
  EXPECT_FALSE(record.layers[1][static_cast<size_t>(Quantity::kThickness)].is_stated);
  EXPECT_FALSE(absorption.interval95[1]) << "an end that is not known";
  EXPECT_TRUE(record.layers[1][static_cast<size_t>(Quantity::kIor)].interval95.empty());
  EXPECT_EQ(WithLinearScales(TwoLayers(), record.linear_scales).photographs[0].exposure_scale, 1.25);
  EXPECT_EQ(ReadMaterialOutline(file).layers, (std::vector<std::string>{"enamel", "dentine"}));
}

TEST(MaterialFile, ValuesSetByHandComeBackWithoutIntervals) {
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

TEST(MaterialFile, SaysWhichLayerIsMissing) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "material.json", R"({"format": "crownfit-material/1", "layers": [{"name": "enamel"}]})");
  EXPECT_THROW(ReadMaterialRecord(folder.path / "material.json", TwoLayers()), InputError);
}

}  // namespace
}  // namespace crownfit
