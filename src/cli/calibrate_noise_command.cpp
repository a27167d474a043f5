#include "base/error.h"
#include "base/progress.h"
#include "calibration/noise_product.h"
#include "cli/calibrate_parts.h"

namespace crownfit {
namespace {

struct NoiseTask {
  ProductOptions product;
  std::vector<std::filesystem::path> images, darks;
  bool is_series = false;  ///< neighbours in the list are pairs
  bool is_linear = false;  ///< the files are proportional to the light, whatever they say of themselves
};

int RunNoise(const NoiseTask& asked) {
  Progress progress(asked.product.common.progress);
  progress.Show("reading", 0.0);
  const auto photos = ReadLinear(asked.images, asked.is_linear);
  const auto dark_files = ReadLinear(asked.darks, asked.is_linear);
  if (photos.size() < 2 || (!asked.is_series && photos.size() % 2))
    throw InputError("", "IMAGES", "expected pairs of photographs, found " + std::to_string(photos.size()),
                     "Photograph every scene twice, A A' B B'; or say --series.");
  std::vector<std::pair<const Image*, const Image*>> pairs;
  for (size_t i = 0; i + 1 < photos.size(); i += asked.is_series ? 1 : 2)
    pairs.emplace_back(&photos[i].image, &photos[i + 1].image);
  std::vector<const Image*> darks;
  for (const auto& dark : dark_files) darks.push_back(&dark.image);
  progress.Show("photon transfer", 0.5);
  const Product product = NoiseProduct(pairs, darks);
  progress.Clear();
  auto inputs = asked.images;
  inputs.insert(inputs.end(), asked.darks.begin(), asked.darks.end());
  return Finish(product, inputs, asked.product);
}

}  // namespace

void AddCalibrateNoise(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<NoiseTask>();
  auto* noise = AddProduct(&calibrate, asked->product, "noise",
                           "Gain, read noise, black level and saturation from pairs of photographs of a still scene.");
  AddImages(noise, asked->images,
            "Pairs A A' B B' ..., each twice the same, with light and dark places, nothing moved. RAW or linear.");
  noise->add_option("--dark", asked->darks, "Frames with the lens cap on (at least two for the read noise).");
  noise->add_flag("--series", asked->is_series,
                  "IMAGES are one still scene at rising exposures: neighbours make pairs, and linearity is checked.");
  noise->add_flag("--linear", asked->is_linear, "Take the files as linear, such as a machine-vision camera's.");
  RunWith(noise, command, asked, RunNoise);
}

}  // namespace crownfit
