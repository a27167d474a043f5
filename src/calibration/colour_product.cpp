#include "calibration/colour_product.h"

#include <algorithm>
#include <cmath>

#include "calibration/draw.h"
#include "capture/colour_file.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

/// The photograph with every patch outlined in its reference colour, with its number and its difference.
Image ColourPicture(const Chart& chart, const std::vector<PatchReading>& readings, const ColourEstimate* estimate,
                    const Image& photograph) {
  const double zoom = std::clamp(900.0 / photograph.width, 0.2, 3.0);
  Image picture = DisplayCopy(photograph, zoom);
  for (size_t p = 0; p < readings.size(); ++p) {
    glm::dvec3 colour;
    for (int c = 0; c < 3; ++c) colour[c] = SrgbFromLinear(chart.patches[p].linear_rgb[c]);
    const glm::dvec3 frame = readings[p].damage.empty() ? glm::dvec3(1.0) : glm::dvec3(1, 0, 0);
    glm::dvec2 middle(0.0);
    for (int k = 0; k < 4; ++k) {
      DrawLine(picture, zoom * readings[p].corners[k], zoom * readings[p].corners[(k + 1) % 4], frame);
      middle += 0.25 * zoom * readings[p].corners[k];
    }
    DrawDot(picture, middle, 6, colour);
    DrawText(picture, static_cast<int>(middle.x) - 10, static_cast<int>(middle.y) - 8, 11,
             estimate ? Text(estimate->de00[p]) : std::to_string(p + 1), colour.y > 0.45 ? 0.0f : 1.0f);
  }
  return picture;
}

}  // namespace

Product ColourProduct(const Chart& chart, const std::vector<PatchReading>& found, const ColourSource& source) {
  constexpr double kLargestMean = 5.0, kGoodMean = 3.0, kLargestTone = 0.25, kGoodTone = 0.08;
  constexpr size_t kLeastPatches = 18;
  Product product;
  product.format = "crownfit-colour/1";
  std::string fault;
  std::vector<PatchReading> readings = InOrder(chart, found, fault);
  if (!fault.empty()) {
    product.refusals.push_back(fault);
    if (source.picture) product.picture = ColourPicture(chart, found, nullptr, *source.picture);
    return product;
  }
  const auto estimate = EstimateColour(chart, readings);
  if (!estimate) {
    size_t saturated = 0, undamaged = 0;
    for (const auto& r : readings) {
      saturated += r.damage == "saturated";
      undamaged += r.damage.empty();
    }
    product.refusals.push_back(
        "only " + std::to_string(undamaged) + " of " + std::to_string(readings.size()) + " patches can be used" +
        (saturated ? ", " + std::to_string(saturated) + " are saturated. Expose the white patch to 0.8 of full scale."
                   : ". Keep the whole chart in the picture and out of glare."));
    if (source.picture) product.picture = ColourPicture(chart, readings, nullptr, *source.picture);
    return product;
  }
  product.content = ColourContent({estimate->transform, estimate->white});
  JsonValue::Object residual{{"de00_mean", estimate->mean}, {"de00_worst", estimate->worst}}, of_patch;
  for (size_t p = 0; p < readings.size(); ++p) of_patch.emplace_back(chart.patches[p].name, estimate->de00[p]);
  residual.emplace_back("de00", of_patch);
  product.content.emplace_back("residual", residual);
  product.figures = {{"de00_mean", estimate->mean, ""},
                     {"de00_worst", estimate->worst, ""},
                     {"de00_leave_one_out", estimate->leave_one_out, ""},
                     {"de00_leave_one_out_matrix", estimate->leave_one_out_matrix, ""},
                     {"patches_used", static_cast<double>(estimate->used.size()), ""},
                     {"tone_slope", estimate->tone_slope, ""},
                     {"fall_off", 100 * estimate->fall_off, "% across the chart"},
                     {"fall_off_stddev", 100 * estimate->fall_off_stddev, "%"}};
  if (estimate->transform.root_polynomial)
    product.notes.push_back("a root polynomial is used, because it predicts left-out patches better than a matrix.");
  for (size_t p = 0; p < readings.size(); ++p)
    if (!readings[p].damage.empty())
      product.notes.push_back("patch " + std::to_string(p + 1) + " (" + chart.patches[p].name +
                              ") is not used: " + readings[p].damage);
  if (source.is_encoded)
    product.notes.push_back(std::string("the photograph is encoded for display") + (source.is_jpeg ? " (JPEG)" : "") +
                            ". Its white balance and tone curve may differ from picture to picture, so this file is "
                            "only valid for this picture. Photograph in RAW.");
  if (std::abs(estimate->tone_slope - 1) > kLargestTone)
    product.refusals.push_back("grey patches follow the light with a slope of " + Text(estimate->tone_slope) +
                               " instead of 1, because of a tone curve or glare. Photograph in RAW, and tilt the chart "
                               "out of the lamp's reflection.");
  else if (std::abs(estimate->tone_slope - 1) > kGoodTone)
    product.notes.push_back("grey patches follow the light with a slope of " + Text(estimate->tone_slope) +
                            " instead of 1.");
  if (estimate->fall_off > std::max(0.1, 3 * estimate->fall_off_stddev))
    product.notes.push_back("the light changes by " + Text(100 * estimate->fall_off, "%") +
                            " across the chart. Photograph a white card in its place and give it as --flat-field.");
  if (estimate->used.size() < kLeastPatches)
    product.refusals.push_back("only " + std::to_string(estimate->used.size()) + " patches can be used, fewer than " +
                               std::to_string(kLeastPatches));
  if (estimate->mean > kLargestMean)
    product.refusals.push_back("the mean dE00 of the patches is " + Text(estimate->mean) + ", above the limit of " +
                               Text(kLargestMean) +
                               ". Check for mixed light, over-exposure, a tone curve, or another chart (--chart).");
  else if (estimate->mean > kGoodMean)
    product.notes.push_back("a mean dE00 of " + Text(estimate->mean) +
                            " is large; 1 to 2 is usual for RAW and even light.");
  if (source.picture) product.picture = ColourPicture(chart, readings, &*estimate, *source.picture);
  return product;
}

Product GreyCardProduct(const Image& linear, const std::array<double, 4>& rectangle, double reflectance,
                        const glm::dvec3& saturation, const ColourSource& source) {
  constexpr int kParts = 4;  // divisions of the rectangle per side, to measure its unevenness
  constexpr double kLargestUnevenness = 0.1, kGoodUnevenness = 0.03, kLeastSignal = 0.05;
  Product product;
  product.format = "crownfit-colour/1";
  const auto [left, top, width, height] = rectangle;
  if (left < 0 || top < 0 || width < 8 || height < 8 || left + width > linear.width || top + height > linear.height) {
    product.refusals.push_back("the rectangle lies outside the photograph, or is smaller than 8 x 8 pixels");
    return product;
  }
  std::array<std::array<glm::dvec4, kParts>, kParts> sums{};
  size_t saturated = 0, all = 0;
  for (int y = static_cast<int>(top); y < static_cast<int>(top + height); ++y)
    for (int x = static_cast<int>(left); x < static_cast<int>(left + width); ++x, ++all) {
      const auto row = static_cast<size_t>(kParts * (y - std::floor(top)) / height),
                 column = static_cast<size_t>(kParts * (x - std::floor(left)) / width);
      glm::dvec4& sum = sums[std::min<size_t>(row, kParts - 1)][std::min<size_t>(column, kParts - 1)];
      bool is_saturated = false;
      for (int c = 0; c < 3; ++c) {
        sum[c] += linear.at(x, y, c);
        is_saturated |= linear.at(x, y, c) >= saturation[c];
      }
      saturated += is_saturated;
      sum.w += 1;
    }
  std::vector<glm::dvec3> parts;
  glm::dvec3 mean(0.0), squares(0.0);
  for (const auto& row : sums)
    for (const glm::dvec4& sum : row) parts.push_back(glm::dvec3(sum) / sum.w);
  for (const glm::dvec3& part : parts) mean += part / static_cast<double>(parts.size());
  double low = 1, high = 1;
  for (const glm::dvec3& part : parts) {
    low = std::min(low, part.y / mean.y);
    high = std::max(high, part.y / mean.y);
    const glm::dvec3 balance = part / part.y - mean / mean.y;
    squares += balance * balance / static_cast<double>(parts.size());
  }
  const glm::dvec3 white = mean / reflectance;
  product.content = ColourContent({{{{1 / white.x, 0, 0}, {0, 1 / white.y, 0}, {0, 0, 1 / white.z}}}, white});
  product.figures = {{"red_over_green", mean.x / mean.y, ""},
                     {"red_over_green_scatter", std::sqrt(squares.x), ""},
                     {"blue_over_green", mean.z / mean.y, ""},
                     {"blue_over_green_scatter", std::sqrt(squares.z), ""},
                     {"unevenness", 100 * (high - low), "% across the card"}};
  product.notes.push_back(
      "a grey card gives only the white balance. Colours stay the camera's own, so CIEDE2000 of coloured objects is "
      "off by some units. Use a ColorChecker for colours.");
  if (source.is_encoded)
    product.notes.push_back(
        "the photograph is encoded for display; its tone curve is assumed to be that of sRGB. Photograph in RAW.");
  if (saturated > all / 1000)
    product.refusals.push_back(Text(100.0 * static_cast<double>(saturated) / static_cast<double>(all), "%") +
                               " of the card is saturated. Expose the card to 0.5 of full scale.");
  if (!(mean.y > kLeastSignal) || !(mean.x > 0) || !(mean.z > 0))
    product.refusals.push_back("the card is too dark (" + Text(mean.y) +
                               "), or the rectangle is not on it. Expose it to 0.5 of full scale.");
  if (high - low > kLargestUnevenness)
    product.refusals.push_back("the light changes by " + Text(100 * (high - low), "%") +
                               " over the rectangle. Avoid glare and shadows, and keep the rectangle on the card.");
  else if (high - low > kGoodUnevenness)
    product.notes.push_back("the light changes by " + Text(100 * (high - low), "%") + " over the rectangle.");
  if (source.picture) {
    const double zoom = std::clamp(900.0 / source.picture->width, 0.2, 3.0);
    product.picture = DisplayCopy(*source.picture, zoom);
    DrawRectangle(product.picture, zoom * glm::dvec2(left, top), zoom * glm::dvec2(left + width, top + height),
                  {0.9, 0.1, 0.1});
  }
  return product;
}

}  // namespace crownfit
