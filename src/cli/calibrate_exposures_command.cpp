#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "calibration/exposure_series.h"
#include "cli/calibrate_parts.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

struct ExposuresTask {
  ProductOptions product;
  std::vector<std::filesystem::path> images, darks;
  std::vector<double> times;  ///< exposure times of the images
  std::optional<std::filesystem::path> noise;
  std::string encoding = "file";
};

int RunExposures(const ExposuresTask& asked) {
  auto files = asked.images;
  if (asked.times.size() != files.size())
    throw InputError(
        "", "--times",
        std::to_string(asked.times.size()) + " times for " + std::to_string(files.size()) + " photographs");
  if (files.size() < 2) throw InputError("", "IMAGES", "a series needs at least two exposures");
  if (asked.product.output.extension() != ".exr")
    throw InputError(asked.product.output, "-o", "the merged picture is written as EXR: give a name that ends in .exr");
  std::vector<std::pair<double, std::filesystem::path>> order;
  for (size_t i = 0; i < files.size(); ++i) order.emplace_back(asked.times[i], files[i]);
  std::sort(order.begin(), order.end());
  if (order.front().first <= 0) throw InputError("", "--times", "exposure times must be positive");
  std::vector<ImageFile> photos;
  ExposureSeries series;
  for (const auto& [time, file] : order) {
    photos.push_back(ReadImageFile(file));
    RequireOneSize(photos.back().image, photos[0].image, file, order[0].second);
    series.times.push_back(time);
  }
  if (asked.noise) {
    series.noise =
        ReadSensorNoise(*asked.noise, std::max(3, photos[0].image.channels > 4 ? photos[0].image.channels : 0));
    RequireSharesOfFullScale(series.noise, photos[0], order[0].second);
  }
  // Of pictures for display, whose tone curve nobody knows, the response is estimated; others are decoded.
  const bool encoded = asked.encoding == "file" && photos[0].transfer.is_encoded() && photos[0].bits == 8;
  Product product;
  if (!encoded)
    for (size_t i = 0; i < photos.size(); ++i) photos[i] = ReadLight(order[i].second, asked.encoding);
  if (encoded) {
    const auto response = EstimateResponse(photos, series.times);
    double departure = 0;
    for (int v = 8; v < 250; ++v)
      for (int c = 0; c < 3; ++c) departure = std::max(departure, std::abs(SrgbFromLinear(response[v][c]) - v / 255.0));
    product.figures.push_back({"response_from_srgb", 255 * departure, "of 255"});
    for (auto& photo : photos) photo.image = Decoded(photo.image, response);
  }
  for (auto& photo : photos) series.photographs.push_back(std::move(photo.image));
  if (!asked.darks.empty()) {
    const auto darks = ReadLinear(asked.darks, "linear");
    const int channels = darks[0].image.channels > 4 ? darks[0].image.channels : 3;
    series.noise.black = series.noise.black.Expanded(channels);
    for (int c = 0; c < channels; ++c) {
      double sum = 0, count = 0;
      for (const auto& dark : darks)
        for (size_t i = std::min(c, dark.image.channels - 1); i < dark.image.values.size(); i += dark.image.channels)
          sum += dark.image.values[i], ++count;
      series.noise.black[c] = sum / count;
    }
  }
  const MergedExposures merged = MergeExposures(series);
  bool any_compared = false;
  for (size_t k = 0; k < merged.time_ratios.size(); ++k) {
    const std::string times = Text(series.times[k + 1]) + "_to_" + Text(series.times[k]);
    any_compared |= merged.time_ratios[k].has_value();
    if (merged.time_ratios[k])
      product.figures.push_back({"ratio_" + times + "_over_times", *merged.time_ratios[k], ""});
    else
      product.notes.push_back("exposures " + times +
                              ": no value of the longer one lies between 0.15 and 0.5 of saturation, " +
                              "so their times could not be checked.");
  }
  product.figures.push_back({"nonlinearity", 100 * merged.worst_ratio, "%"});
  product.figures.push_back({"shift", merged.shift_px, "px"});
  product.figures.push_back({"saturated_in_all", 100 * merged.share_saturated, "% of pixels"});
  if (merged.worst_ratio > 0.1)
    product.refusals.push_back("exposures differ by " + Text(100 * merged.worst_ratio, "%") +
                               " from the ratio of their times. Check the times, whether the light drifted, and "
                               "whether the files are linear.");
  else if (!any_compared)
    product.refusals.push_back(
        "no two exposures can be compared. Check the times, and whether the pictures are too dark.");
  else if (merged.worst_ratio > 0.03)
    product.notes.push_back("exposures differ by " + Text(100 * merged.worst_ratio, "%") +
                            " from the ratio of their times.");
  constexpr double kMoved = 1.0, kSeen = 0.2;  // px
  if (merged.shift_px > kMoved)
    product.refusals.push_back("two exposures are shifted by about " + Text(merged.shift_px, "px") +
                               ": the camera or the scene moved. Use a tripod and a remote release.");
  else if (merged.shift_px > kSeen)
    product.notes.push_back("two exposures are shifted by " + Text(merged.shift_px, "px") + ", which blurs edges.");
  if (merged.share_saturated > 0)
    product.notes.push_back("pixels that are saturated in every exposure have too low a value. State \"saturation\": " +
                            Text(0.99 * merged.saturation) + " for this picture in the capture.");
  if (product.refusals.empty()) {
    const std::filesystem::path variance = asked.product.output.stem().string() + "_variance.exr";
    WriteImageFile(asked.product.output, merged.linear);
    WriteImageFile(asked.product.output.parent_path() / variance, merged.variance);
  }
  return Finish(product, files, asked.product);
}

}  // namespace

void AddCalibrateExposures(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<ExposuresTask>();
  auto* exposures = AddProduct(&calibrate, asked->product, "exposures",
                               "Merges exposures of a still scene into one linear picture (EXR) and its variance.");
  exposures->footer(
      "Example:\n"
      "  crownfit calibrate exposures a.dng b.dng c.dng --times 10,40,160 --noise noise.json -o front.exr\n"
      "Writes front.exr and front_variance.exr, and prints how far the exposures depart from their times.");
  AddImages(exposures, asked->images,
            "The exposures, in any order. For encoded ones (JPEG, PNG) the response curve is estimated first.");
  exposures->add_option("--times", asked->times, "Exposure times in the same order, in any unit.")
      ->required()
      ->delimiter(',');
  exposures->add_option("--noise", asked->noise, "noise.json of the camera, for black level, weights and variance.");
  exposures->add_option("--dark", asked->darks, "Frames with the lens cap on; their mean is the black level.");
  AddEncodingOptions(exposures, asked->encoding);
  RunWith(exposures, command, asked, RunExposures);
}

}  // namespace crownfit
