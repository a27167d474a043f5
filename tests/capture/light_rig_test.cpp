// Light rigs as they are read from files.

#include "capture/light_rig.h"

#include <gtest/gtest.h>

#include <fstream>

#include "photo/image_io.h"
#include "scene/light_samples.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

TEST(LightRigs, AGreyPanoramaLightsEveryChannelAlike) {
  const TemporaryFolder folder;
  Image grey(8, 4, 1);
  grey.values.assign(grey.values.size(), 0.25f);
  WriteImageFile(folder.path / "sky.exr", grey, false, {"Y"});
  std::ofstream(folder.path / "rig.json") << R"({"format": "crownfit-light-rig/1",
    "lights": [{"name": "sky", "type": "environment", "file": "sky.exr"}]})";
  for (const int channels : {1, 3, 5}) {
    std::vector<std::string> names;
    for (int c = 0; c < channels; ++c) names.push_back(std::to_string(400 + 50 * c));
    const LightRig rig = ReadLightRig(folder.path / "rig.json", names);
    const auto along = LightAlong(rig.lights[0].shape, glm::dvec3(0.0), {0, 0, 1});
    ASSERT_TRUE(along);
    EXPECT_EQ(along->radiance.list(), std::vector<double>(static_cast<size_t>(channels), 0.25));
    std::vector<LightSample> samples;
    SampleLight(rig.lights[0].shape, glm::dvec3(0.0), {0, 0, 1}, 2, samples);
    ASSERT_FALSE(samples.empty());
    EXPECT_EQ(samples[0].weight.size(), channels);
    EXPECT_TRUE(samples[0].weight.IsGrey());
  }
}

}  // namespace
}  // namespace crownfit
