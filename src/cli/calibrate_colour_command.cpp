#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "calibration/colour_product.h"
#include "calibration/find_chart.h"
#include "cli/calibrate_parts.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

struct ColourTask {
  ProductOptions product;
  std::vector<std::filesystem::path> images;
  std::string chart = "colorchecker_classic_2014";
  std::vector<double> chart_corners;                ///< x, y of four corners
  std::vector<double> grey_card;                    ///< x, y, width, height in pixels
  std::optional<double> card_reflectance;           ///< of the grey card; default 0.18
  std::optional<std::filesystem::path> flat_field;  ///< picture of a white card
  std::optional<std::filesystem::path> noise;
  std::string encoding = "file";
};

/// Divides by a white card's picture, smoothed over a twentieth of its width; the middle keeps its value.
void Flatten(Image& image, const Image& card) {
  const int radius = std::max(1, image.width / 40);
  const Image smooth = BoxMean(card, radius);
  for (int c = 0; c < image.channels; ++c) {
    const float middle = smooth.at(image.width / 2, image.height / 2, c);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) image.at(x, y, c) *= middle / std::max(smooth.at(x, y, c), 1e-6f);
  }
}

int RunColour(const ColourTask& asked) {
  if (asked.images.size() != 1) throw InputError("", "IMAGES", "colour is calibrated from one photograph");
  const auto& path = asked.images[0];
  const Chart chart = ReadChart(asked.chart);
  ImageFile photo = ReadLight(path, asked.encoding);
  if (photo.image.channels < 3) throw InputError(path, "", "is grey, but the chart needs a colour photograph");
  const bool encoded = photo.transfer.is_encoded() && asked.encoding == "file";
  photo.transfer.kind = Transfer::Kind::kLinear;
  ImageFile without_black = photo;
  glm::dvec3 saturation = RemoveBlack(without_black, path, asked.noise);
  Image& linear = without_black.image;
  if (asked.flat_field) {
    ImageFile card_photo = ReadLight(*asked.flat_field, asked.encoding);
    Image& card = card_photo.image;
    RequireOneSize(card, linear, *asked.flat_field, path);
    const auto is_saturated = [&, saturation](const Image& image, size_t i) {
      return image.values[i] >= saturation[std::min(2, static_cast<int>(i % image.channels))];
    };
    RemoveBlack(card_photo, *asked.flat_field, asked.noise);
    size_t clipped = 0;
    for (size_t i = 0; i < card.values.size(); ++i) clipped += is_saturated(card, i);
    if (const double share = 100.0 * static_cast<double>(clipped) / static_cast<double>(card.values.size());
        share > 0.1)
      throw InputError(*asked.flat_field, "--flat-field", Text(share, "%") + " of its values are saturated",
                       "Expose the white card to half of full scale.");
    for (size_t i = 0; i < linear.values.size(); ++i)
      if (is_saturated(linear, i)) linear.values[i] = 1e9f;  // stays recognisable after division by the card
    Flatten(linear, card);
    saturation = glm::dvec3(1e6);
  }
  const ColourSource source{&linear, encoded, photo.is_jpeg};
  if (const auto& r = asked.grey_card; !r.empty())
    return Finish(
        GreyCardProduct(linear, {r[0], r[1], r[2], r[3]}, asked.card_reflectance.value_or(0.18), saturation, source),
        asked.images, asked.product);
  ChartCorners corners;
  if (!asked.chart_corners.empty()) {
    for (int k = 0; k < 4; ++k) corners[k] = {asked.chart_corners[2 * k], asked.chart_corners[2 * k + 1]};
  } else {
    const auto found = FindClassicChart(photo, linear, chart);
    if (!found)
      throw InputError(path, "", "no ColorChecker was found: it must be whole, in focus, and at least 150 px wide",
                       "Give the corners of the outer patches by hand: --chart-corners X1,Y1,X2,Y2,X3,Y3,X4,Y4.");
    corners = *found;
  }
  const auto readings = ReadPatches(linear, chart, corners, kClassicGap, saturation);
  return Finish(ColourProduct(chart, readings, source), asked.images, asked.product);
}

}  // namespace

void AddCalibrateColour(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<ColourTask>();
  auto* colour =
      AddProduct(&calibrate, asked->product, "colour",
                 "Finds the transform from camera colours to linear sRGB from a photograph of a ColorChecker.");
  colour->footer(
      "Example:\n"
      "  crownfit calibrate colour chart.dng --noise noise.json -o colour.json\n"
      "Prints de00_mean, the mean CIEDE2000 of the patches: 1 to 2 is usual for RAW and even light.");
  AddImages(colour, asked->images,
            "One photograph of a ColorChecker Classic or Passport in the crown's place and light, its white\n"
            "patch not saturated.");
  colour->add_option("--chart", asked->chart,
                     "colorchecker_classic_2014 (default), colorchecker_classic_before_2014, or a file like those in\n"
                     "calib/.");
  colour
      ->add_option("--chart-corners", asked->chart_corners,
                   "X1,Y1,...,X4,Y4 in pixels, for a chart that is not found: outer corners of the outer patches,\n"
                   "clockwise from the first patch (dark skin).")
      ->expected(8)
      ->delimiter(',');
  colour
      ->add_option("--grey-card", asked->grey_card,
                   "X,Y,WIDTH,HEIGHT in pixels on a grey card: take only the white balance, without a chart.")
      ->expected(4)
      ->delimiter(',');
  colour->add_option("--card-reflectance", asked->card_reflectance, "Reflectance of the grey card (default 0.18).")
      ->check(CLI::Range(0.01, 1.0));
  colour->add_option("--flat-field", asked->flat_field,
                     "Photograph of a white card in the chart's place, which corrects uneven light.");
  colour->add_option("--noise", asked->noise, "noise.json of the camera, for black level and saturation.");
  AddEncodingOptions(colour, asked->encoding);
  RunWith(colour, command, asked, RunColour);
}

}  // namespace crownfit
