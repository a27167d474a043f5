// The crown as the graphics processor draws it, against the same model on the CPU. Runs without a display.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>

#include "base/error.h"
#include "fit_steps.h"
#include "report/colour_difference.h"
#include "viewer/crown_renderer.h"

namespace crownfit {
namespace {

struct Pair {
  Image cpu, gpu;
  std::vector<uint8_t> mask;
};

/// One photograph of a capture with its own material, both ways.
class BothWays {
 public:
  explicit BothWays(const std::string& folder) : capture_(ReadCapture(folder)) {
    input_ = ReadInput(capture_, 0, /*with_images=*/false);
    material_ = StatedMaterial(capture_);
    thickness_ = StatedThicknesses(capture_);
    crown_ = BuildCrown(capture_, input_.source, thickness_, 0);
    renderer_.emplace(crown_);
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
  /// Scenery and tile alone: differences of the pixels that show them on both, as shares of the greatest, sorted.
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
      greatest = std::max(greatest, pixel.value.y);
      differences.push_back(std::abs(gpu.at(pixel.x, pixel.y, 1) - pixel.value.y));
    }
    for (double& d : differences) d /= greatest;
    std::sort(differences.begin(), differences.end());
    return differences;
  }
  const Capture& capture() const { return capture_; }

 private:
  /// The CPU's prediction, of the chosen terms alone.
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
        const double sum = (terms.diffuse ? r.diffuse : 0) + (terms.first_order ? r.first_order : 0) +
                           (terms.gloss ? SpecularFactor(photo.polarisation) * r.gloss : 0);
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

class Viewer : public testing::TestWithParam<const char*> {
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

TEST_P(Viewer, DrawsWhatTheCpuPredicts) {
  BothWays scene(std::string(CROWNFIT_DATASETS) + "/" + GetParam());
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
  BothWays scene(std::string(CROWNFIT_DATASETS) + "/" + GetParam());
  size_t with_gloss = 0;
  while (with_gloss + 1 < scene.capture().photographs.size() &&
         scene.capture().photographs[with_gloss].polarisation == Polarisation::kCross)
    ++with_gloss;
  for (const ShownTerms& only :
       {ShownTerms{true, false, false}, ShownTerms{false, true, false}, ShownTerms{false, false, true}}) {
    const Pair pair = scene.Photograph(with_gloss, only);
    double difference = 0, light = 0;
    for (size_t k = 0; k < pair.cpu.values.size(); ++k)
      if (pair.mask[k / 3]) {
        difference += std::abs(pair.cpu.values[k] - pair.gpu.values[k]);
        light += pair.cpu.values[k];
      }
    std::printf("  diffuse %d, first order %d, gloss %d: mean difference %.4f %% of the light\n", only.diffuse,
                only.first_order, only.gloss, 100 * difference / std::max(light, 1e-9));
    EXPECT_LE(difference, 0.002 * light + 1e-6);
  }
}

TEST_P(Viewer, DrawsSceneryAndTileWithTheCrownsShadow) {
  BothWays scene(std::string(CROWNFIT_DATASETS) + "/" + GetParam());
  for (size_t i = 0; i < scene.capture().photographs.size(); ++i) {
    const std::vector<double> d = scene.SceneryDifferences(i);
    if (d.empty()) continue;
    // Shaded at vertices 0.4 mm apart: edges of shadows and of things are off by as much, some pixels in a hundred.
    std::printf("  %-12s median %.4f, 95 %% %.4f\n", scene.capture().photographs[i].name.c_str(), d[d.size() / 2],
                d[d.size() * 95 / 100]);
    EXPECT_LE(d[d.size() / 2], 0.01) << scene.capture().photographs[i].name;
    EXPECT_LE(d[d.size() * 95 / 100], 0.1) << scene.capture().photographs[i].name;
  }
}

INSTANTIATE_TEST_SUITE_P(BundledCaptures, Viewer, testing::Values("incisor_shader", "incisor", "disc", "sphere"),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace crownfit
