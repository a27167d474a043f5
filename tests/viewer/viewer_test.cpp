// The crown as the graphics processor draws it, against the same model on the CPU. Runs without a display.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>

#include "base/error.h"
#include "capture/capture.h"
#include "fit/compare_photographs.h"
#include "photo/colour_difference.h"
#include "scene/build_crown.h"
#include "scene/cast_photograph.h"
#include "viewer/crown_renderer.h"

namespace crownfit {
namespace {

struct Pair {
  Image cpu, gpu;
  std::vector<uint8_t> mask;
};

/// One photograph of a capture with its own material, drawn by both processors.
class BothWays {
 public:
  explicit BothWays(Capture capture) : capture_(std::move(capture)) {
    input_ = ReadInput(capture_, 0, /*with_images=*/false);
    material_ = StatedMaterial(capture_);
    thickness_ = StatedThicknesses(capture_);
    crown_ = BuildCrown(capture_, input_.source, thickness_, 0);
    renderer_.emplace(crown_, ShownChannelsOf(capture_));
    renderer_->SetMaterial(capture_, material_, thickness_);
  }
  Pair Photograph(size_t i, const ShownTerms& terms = {}) {
    CastState state{crown_, thickness_, std::vector<PhotographCast>(capture_.photographs.size())};
    state.photographs[i] = CastPhotograph(capture_, *crown_, input_.scenery, i, {});
    const PhotographSpec& photo = capture_.photographs[i];
    Pair pair;
    pair.cpu = OnlyOf(terms, state, i, pair.mask);
    renderer_->SetLight(capture_, i, state.photographs[i]);
    const Canvas canvas(photo.camera.width, photo.camera.height);
    renderer_->Draw(photo, terms, canvas);
    pair.gpu = canvas.Read();
    return pair;
  }
  /// Scenery and tile alone: sorted differences of the pixels that show them, relative to the greatest value.
  std::vector<double> SceneryDifferences(size_t i) {
    CastOptions options;
    options.shade_scenery = true;
    const PhotographCast cast = CastPhotograph(capture_, *crown_, input_.scenery, i, options);
    renderer_->SetLight(capture_, i, CastVertices(capture_, *crown_, input_.scenery, i, options));
    const PhotographSpec& photo = capture_.photographs[i];
    const Canvas canvas(photo.camera.width, photo.camera.height);
    renderer_->Draw(photo, {false, false, false}, canvas);
    const Image gpu = canvas.Read();
    double greatest = 0;
    std::vector<double> differences;
    for (const BackgroundPixel& pixel : cast.background) {
      greatest = std::max(greatest, pixel.value[1]);
      differences.push_back(std::abs(gpu.at(pixel.x, pixel.y, 1) - pixel.value[1]));
    }
    for (double& d : differences) d /= greatest;
    std::sort(differences.begin(), differences.end());
    return differences;
  }
  const Capture& capture() const { return capture_; }

 private:
  /// The CPU's prediction with the chosen terms only.
  Image OnlyOf(const ShownTerms& terms, const CastState& state, size_t i, std::vector<uint8_t>& mask) {
    const PhotographSpec& photo = capture_.photographs[i];
    const PhotographCast& cast = state.photographs[i];
    Image picture(photo.camera.width, photo.camera.height, 3);
    mask.assign(picture.values.size() / 3, 0);
    std::vector<int> pixels(cast.pixels.size());
    std::iota(pixels.begin(), pixels.end(), 0);
    const std::vector<int> vertices = VerticesAround(*crown_, cast, pixels);
    const std::vector<double> lights = StatedLightScales(capture_);
    for (int c = 0; c < 3; ++c) {
      const auto optics = OpticsFromSlots(capture_, SlotValues(capture_, material_, state, c));
      const DiffuserTable<double> table(optics.stack(), crown_->kernel.outer_radius_mm);
      const ShaderPrediction<double> model(*crown_, cast, optics, table, c, lights, vertices, 0);
      for (const PixelCast& pixel : cast.pixels) {
        const auto r = model.TermsOf(pixel);
        const double sum = (terms.diffuse ? r.diffuse : 0) +
                           (terms.first_order ? optics.FirstOrderFactor(photo.polarisers()) * r.first_order : 0) +
                           (terms.gloss ? photo.polarisers().of_kept * r.gloss : 0);
        picture.at(pixel.x, pixel.y, c) = static_cast<float>(std::numbers::pi * sum);
        mask[static_cast<size_t>(pixel.y) * photo.camera.width + pixel.x] = !pixel.at_silhouette;
      }
    }
    return picture;
  }
  Capture capture_;
  CrownInput input_;
  Material material_;
  std::vector<double> thickness_;
  std::shared_ptr<const Crown> crown_;
  std::optional<CrownRenderer> renderer_;
};

std::string Folder(const std::string& name) { return std::string(CROWNFIT_DATASETS) + "/" + name; }

/// Sum of differences over sum of the light.
double TotalDifference(const Pair& pair) {
  double difference = 0, light = 0;
  for (size_t k = 0; k < pair.cpu.values.size(); ++k)
    if (pair.mask[k / 3]) {
      difference += std::abs(pair.cpu.values[k] - pair.gpu.values[k]);
      light += pair.cpu.values[k];
    }
  return difference / std::max(light, 1e-9);
}

class ViewerLight : public testing::Test {
 protected:
  void SetUp() override {
    try {
      context_.emplace();
    } catch (const InputError& e) {
      GTEST_SKIP() << e.what();
    }
  }
  std::optional<OffscreenContext> context_;
};
class Viewer : public ViewerLight, public testing::WithParamInterface<const char*> {};

TEST_P(Viewer, DrawsWhatTheCpuPredicts) {
  BothWays scene(ReadCapture(Folder(GetParam())));
  std::printf("%s\n", GraphicsProcessor().c_str());
  for (size_t i = 0; i < scene.capture().photographs.size(); ++i) {
    const Pair pair = scene.Photograph(i);
    const ColourDifference d = ComparePictures(pair.cpu, pair.gpu, pair.mask);
    std::printf("  %-12s CIEDE2000 median %.3f, 95 %% %.3f; of pixels %.3f, %.3f\n",
                scene.capture().photographs[i].name.c_str(), d.median, d.p95, d.pixel_median, d.pixel_p95);
    EXPECT_LE(d.median, 0.1) << scene.capture().photographs[i].name;
    EXPECT_LE(d.p95, 0.5) << scene.capture().photographs[i].name;
  }
}

TEST_P(Viewer, DrawsEachTermByItself) {
  BothWays scene(ReadCapture(Folder(GetParam())));
  size_t with_gloss = 0;
  while (with_gloss + 1 < scene.capture().photographs.size() &&
         scene.capture().photographs[with_gloss].polarisation == Polarisation::kCross)
    ++with_gloss;
  for (const ShownTerms& only :
       {ShownTerms{true, false, false}, ShownTerms{false, true, false}, ShownTerms{false, false, true}}) {
    const Pair pair = scene.Photograph(with_gloss, only);
    std::printf("  diffuse %d, first order %d, gloss %d: mean difference %.4f %% of the light\n", only.diffuse,
                only.first_order, only.gloss, 100 * TotalDifference(pair));
    EXPECT_LE(TotalDifference(pair), 0.002);
  }
}

TEST_P(Viewer, DrawsSceneryAndTileWithTheCrownsShadow) {
  BothWays scene(ReadCapture(Folder(GetParam())));
  for (size_t i = 0; i < scene.capture().photographs.size(); ++i) {
    const std::vector<double> d = scene.SceneryDifferences(i);
    if (d.empty()) continue;
    // Shading is at vertices 0.4 mm apart. Edges of shadows and objects are off by as much, in a few per cent of
    // pixels.
    std::printf("  %-12s median %.4f, 95 %% %.4f\n", scene.capture().photographs[i].name.c_str(), d[d.size() / 2],
                d[d.size() * 95 / 100]);
    EXPECT_LE(d[d.size() / 2], 0.01) << scene.capture().photographs[i].name;
    EXPECT_LE(d[d.size() * 95 / 100], 0.1) << scene.capture().photographs[i].name;
  }
}

/// The incisor's first photograph without polarisers, under one light.
Capture IncisorUnder(const LightShape& light, double wetness) {
  Capture capture = ReadCapture(Folder("incisor_shader"));
  capture.photographs.resize(1);
  capture.photographs[0].lights = {0};
  capture.photographs[0].backing.reset();
  capture.photographs[0].polarisation = Polarisation::kNone;
  capture.lights.resize(1);
  capture.lights[0].shape = light;
  capture.lights[0].in_camera_frame = false;
  for (const ParameterRow& row : kParameters)
    if (row.quantity == Quantity::kWetness)
      capture.surface[static_cast<size_t>(row.quantity)].value = {wetness, wetness, wetness};
  return capture;
}

TEST_F(ViewerLight, WaterFilmMirrorsLampsOfEveryShape) {
  const glm::dvec3 z(0, 0, 1), white(1.0);
  const std::pair<const char*, LightShape> lights[] = {
      {"ring", DiskLight{{0, 0, 120}, -z, 20.0 * white, 10, 30}},
      {"softbox", RectangleLight{{20, 0, 120}, {0, 25, 0}, {20, 0, 0}, 20.0 * white}},
      {"sun", DirectionalLight{z, white, 0.15}},
      {"bulb", PointLight{{10, 10, 120}, 20000.0 * white, 15}}};
  for (const auto& [name, light] : lights) {
    BothWays scene(IncisorUnder(light, 0.6));
    const Pair pair = scene.Photograph(0, {false, false, true});
    const ColourDifference d = ComparePictures(pair.cpu, pair.gpu, pair.mask);
    const double off = TotalDifference(pair);
    std::printf("  %-8s mean difference %.2f %% of the light, CIEDE2000 median %.3f\n", name, 100 * off, d.median);
    EXPECT_LE(off, 0.03) << name;  // mirrored edges within a pixel are sampled elsewhere
  }
}

TEST_F(ViewerLight, CrossedPolarisersDimFirstOrderLightAsTheCpuPredicts) {
  Capture capture = IncisorUnder(DiskLight{{0, 0, 120}, {0, 0, -1}, glm::dvec3(20.0), 0, 30}, 0.0);
  const auto light = [&](double memory_events) {
    capture.photographs[0].polarisation = Polarisation::kCross;
    capture.photographs[0].polarisation_memory_events = memory_events;
    const Pair pair = BothWays(capture).Photograph(0, {false, true, false});
    EXPECT_LE(TotalDifference(pair), 0.002);
    return std::accumulate(pair.gpu.values.begin(), pair.gpu.values.end(), 0.0);
  };
  EXPECT_LT(light(100.0), 0.5 * light(0.0));
}

TEST_F(ViewerLight, AnEnvironmentIsReflectedDryAndWet) {
  Image map(64, 32, 3);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool window = x > 26 && x < 38 && y > 8 && y < 18;
      for (int c = 0; c < 3; ++c) map.at(x, y, c) = static_cast<float>(0.1 + 0.1 * c * y / 31.0 + (window ? 3.0 : 0.0));
    }
  const EnvironmentLight light{std::make_shared<EnvironmentMap>(map), glm::dvec3(1.0)};
  for (double wetness : {0.0, 0.6}) {
    BothWays scene(IncisorUnder(light, wetness));
    const Pair all = scene.Photograph(0), gloss = scene.Photograph(0, {false, false, true});
    const ColourDifference d = ComparePictures(all.cpu, all.gpu, all.mask);
    std::printf("  wetness %.1f: highlights off by %.1f %% in the mean, whole picture CIEDE2000 %.2f, 95 %% %.2f\n",
                wetness, 100 * TotalDifference(gloss), d.median, d.p95);
    // A lobe is taken as round about the mirrored direction; it is longer at grazing angles.
    EXPECT_LE(TotalDifference(gloss), 0.1);
    EXPECT_LE(d.median, 0.5);
    EXPECT_LE(d.p95, 2.0);
  }
}

INSTANTIATE_TEST_SUITE_P(BundledCaptures, Viewer, testing::Values("incisor_shader", "incisor", "disc", "sphere"),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace crownfit
