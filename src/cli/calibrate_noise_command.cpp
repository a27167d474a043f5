#include <algorithm>

#include "base/error.h"
#include "base/progress.h"
#include "calibration/noise_product.h"
#include "cli/calibrate_parts.h"

namespace crownfit {
namespace {

struct NoiseTask {
  ProductOptions product;
  std::vector<std::filesystem::path> images, darks;
  bool is_series = false;  ///< neighbours in the list form pairs
  std::string encoding = "file";
};

/// Refuses two photographs whose pixels are the same, as of one file given twice or copied. Frames of one value are
/// left alone: a series may be saturated all over.
void RequireNoise(const Image& a, const Image& b, const std::filesystem::path& file_a,
                  const std::filesystem::path& file_b) {
  const bool is_even =
      std::equal(a.values.begin() + std::min<size_t>(a.channels, a.values.size()), a.values.end(), a.values.begin());
  if (is_even || a.values != b.values) return;
  throw InputError(file_b, "", "holds the same pixels as " + file_a.string() + ", so there is no noise between them",
                   "Photograph the scene twice: a pair is two exposures, not a file and its copy.");
}

/// Dark frames may be equal by chance, where they hold few levels; so only one file given twice is refused.
void RequireDistinctDarks(const std::vector<std::filesystem::path>& darks) {
  std::error_code ignored;
  for (size_t i = 0; i < darks.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      if (std::filesystem::equivalent(darks[i], darks[j], ignored))
        throw InputError(darks[i], "--dark", "is the same file as " + darks[j].string(), "Give each dark frame once.");
}

int RunNoise(const NoiseTask& asked) {
  Progress progress(asked.product.common.progress);
  progress.Show("reading", 0.0);
  const auto photos = ReadLinear(asked.images, asked.encoding);
  const auto dark_files = ReadLinear(asked.darks, asked.encoding);
  if (photos.size() < 2 || (!asked.is_series && photos.size() % 2))
    throw InputError(
        "", "IMAGES", "expected pairs of photographs, found " + std::to_string(photos.size()),
        "Photograph every scene twice and list A A' B B'; or add --series for one scene at rising exposures.");
  std::vector<std::pair<const Image*, const Image*>> pairs;
  for (size_t i = 0; i + 1 < photos.size(); i += asked.is_series ? 1 : 2) {
    RequireNoise(photos[i].image, photos[i + 1].image, asked.images[i], asked.images[i + 1]);
    pairs.emplace_back(&photos[i].image, &photos[i + 1].image);
  }
  RequireDistinctDarks(asked.darks);
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
  auto* noise =
      AddProduct(&calibrate, asked->product, "noise",
                 "Measures gain, read noise, black level and saturation from pairs of photographs of a still scene.");
  noise->footer(
      "Example:\n"
      "  crownfit calibrate noise a1.dng a2.dng b1.dng b2.dng --dark cap1.dng cap2.dng -o noise.json\n"
      "Prints gain, read_noise, black and saturation of each channel, as shares of full scale.");
  AddImages(noise, asked->images,
            "Pairs A A' B B' ..., RAW or linear: each scene twice, with bright and dark places, nothing\n"
            "moved.");
  noise->add_option("--dark", asked->darks, "Frames with the lens cap on; at least two for the read noise.");
  noise->add_flag("--series", asked->is_series,
                  "IMAGES show one still scene at rising exposures. Neighbours in the list make pairs, and\n"
                  "linearity is checked.");
  AddEncodingOptions(noise, asked->encoding);
  RunWith(noise, command, asked, RunNoise);
}

}  // namespace crownfit
