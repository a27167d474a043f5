#include "calibration/noise_product.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "calibration/draw.h"
#include "calibration/estimate_noise.h"

namespace crownfit {
namespace {

/// Variance against value, both as logarithms, with the fitted lines.
Image NoisePicture(const std::vector<ChannelNoise>& channels) {
  constexpr int kWidth = 560, kHeight = 420, kLeft = 60, kBottom = 40;
  const glm::dvec3 colours[] = {{0.8, 0.1, 0.1}, {0.1, 0.55, 0.1}, {0.1, 0.2, 0.8}};
  Image picture(kWidth, kHeight, 3, 1.0f);
  double low = 1e300, high = 0;
  for (const auto& channel : channels)
    for (const auto& p : channel.points) low = std::min(low, p.y), high = std::max(high, p.y);
  low *= 0.5;
  high *= 2.0;
  const auto at = [&](double value, double variance) {
    return glm::dvec2(kLeft + (kWidth - kLeft - 10) * (1.0 + std::log10(std::max(value, 1e-3)) / 3.0),
                      (kHeight - kBottom) * std::log(high / std::clamp(variance, low, high)) / std::log(high / low));
  };
  DrawRectangle(picture, {kLeft, 0}, {kWidth - 11, kHeight - kBottom}, {0.6, 0.6, 0.6});
  for (size_t c = 0; c < channels.size(); ++c) {
    for (const auto& p : channels[c].points) {
      DrawLine(picture, at(p.x, p.y - p.z), at(p.x, p.y + p.z), colours[c]);
      DrawDot(picture, at(p.x, p.y), 3, colours[c]);
    }
    for (int i = 0; i < 348; ++i) {
      const double v = 1e-3 * std::pow(1.02, i);
      const auto& n = channels[c];
      DrawLine(picture, at(v, n.gain * v + n.read_noise * n.read_noise),
               at(1.02 * v, n.gain * 1.02 * v + n.read_noise * n.read_noise), colours[c]);
    }
  }
  DrawText(picture, kLeft, kHeight - 22, 13, "value above black, 0.001 to 1 of full scale (logarithmic)", 0.0f);
  DrawText(picture, kLeft, kHeight - 6, 13, "dots: variance; lines: gain x value + read noise squared", 0.0f);
  DrawText(picture, 4, 14, 12, Text(high), 0.0f);
  DrawText(picture, 4, kHeight - kBottom, 12, Text(low), 0.0f);
  return picture;
}

}  // namespace

Product NoiseProduct(const std::vector<std::pair<const Image*, const Image*>>& pairs,
                     const std::vector<const Image*>& darks) {
  const int count = pairs.empty() ? 0 : std::min(3, pairs[0].first->channels);
  std::vector<ChannelNoise> channels;
  for (int c = 0; c < count; ++c) {
    const auto channel = EstimateChannelNoise(pairs, darks, c);
    if (!channel)
      throw InputError("", "", "the photographs show too few levels of brightness between black and saturation",
                       "Photograph a scene with everything from dark to nearly white twice, without moving anything.");
    channels.push_back(*channel);
  }
  Product product;
  product.format = "crownfit-noise/1";
  const char* names[] = {"R", "G", "B"};
  const auto each = [&](auto value) {
    std::vector<double> values;
    for (int c = 0; c < 3; ++c) values.push_back(value(channels[std::min<size_t>(c, channels.size() - 1)]));
    return values;
  };
  product.content = {{"gain", each([](const ChannelNoise& n) { return n.gain; })},
                     {"read_noise", each([](const ChannelNoise& n) { return n.read_noise; })},
                     {"black", each([](const ChannelNoise& n) { return n.black; })}};
  constexpr double kFullScale = 0.995;  // for a channel that never saturated, and for an uncalibrated camera
  const bool any_saturates =
      std::any_of(channels.begin(), channels.end(), [](const auto& n) { return n.saturation.has_value(); });
  if (any_saturates)
    product.content.emplace_back("saturation",
                                 each([&](const ChannelNoise& n) { return n.saturation.value_or(kFullScale); }));
  product.content.emplace_back(
      "stddev", JsonValue::Object{{"gain", each([](const ChannelNoise& n) { return n.gain_stddev; })},
                                  {"read_noise", each([](const ChannelNoise& n) { return n.read_noise_stddev; })},
                                  {"black", each([](const ChannelNoise& n) { return n.black_stddev; })}});
  for (size_t c = 0; c < channels.size(); ++c) {
    const ChannelNoise& n = channels[c];
    const std::string suffix = channels.size() > 1 ? std::string("_") + names[c] : "";
    product.figures.push_back({"gain" + suffix, n.gain, "of full scale"});
    product.figures.push_back({"gain" + suffix + "_stddev", n.gain_stddev, "of full scale"});
    product.figures.push_back({"read_noise" + suffix, n.read_noise, "of full scale"});
    product.figures.push_back({"read_noise" + suffix + "_stddev", n.read_noise_stddev, "of full scale"});
    product.figures.push_back({"black" + suffix, n.black, "of full scale"});
    if (n.saturation) product.figures.push_back({"saturation" + suffix, *n.saturation, "of full scale"});
    product.figures.push_back({"electrons_at_full_scale" + suffix, n.gain > 0 ? 1.0 / n.gain : 0.0, ""});
    product.figures.push_back({"nonlinearity" + suffix, 100 * n.nonlinearity, "%"});
    product.figures.push_back({"reduced_chi2" + suffix, n.chi2, ""});
    if (!n.settled)
      product.refusals.push_back("channel " + std::string(names[c]) +
                                 ": no line of variance over value was found, as the levels contradict each other. "
                                 "Photograph one still scene, and change the exposure time alone.");
    if (n.gain < 2 * n.gain_stddev)
      product.refusals.push_back(
          "channel " + std::string(names[c]) + ": the gain is not measured (" + Text(n.gain) + " +- " +
          Text(n.gain_stddev) +
          "). The photographs may be smoothed, or all equally dark: use RAW, and a scene from dark to nearly white.");
    product.figures.push_back({"shift" + suffix, n.shift_px, "px"});
    if (n.shift_px > 0.2)
      product.refusals.push_back("two photographs of a pair are shifted by " + Text(n.shift_px, "px") +
                                 ": the camera or the scene moved. Use a tripod and a remote release.");
    else if (n.shift_px > 0.05)
      product.notes.push_back("two photographs of a pair are shifted by " + Text(n.shift_px, "px") +
                              "; only places without edges were used.");
    if (n.nonlinearity > 0.05)
      product.refusals.push_back(
          "channel " + std::string(names[c]) + ": the values are not proportional to the light; they depart by " +
          Text(100 * n.nonlinearity, "%") + ". Photograph in RAW, or undo the camera's tone curve.");
    constexpr double kPoor = 30.0;
    if (n.chi2 > kPoor)
      product.notes.push_back(
          "channel " + std::string(names[c]) + ": the variance does not follow photon noise (reduced chi2 " +
          Text(n.chi2) +
          "). The files may be smoothed or compressed, or the light flickered. The standard deviations allow for it.");
    if (n.hidden_black > 0)
      product.notes.push_back(
          "channel " + std::string(names[c]) + ": the values suggest a black level of about " + Text(n.hidden_black) +
          " of full scale, which was not subtracted. Photograph with the lens covered and give the files as --dark.");
    else if (n.read_noise == 0)
      product.notes.push_back("channel " + std::string(names[c]) + ": the read noise is too small to be measured.");
  }
  if (!any_saturates) product.notes.push_back("no pixel was saturated, so full scale counts as saturation.");
  for (size_t c = 0; any_saturates && c < channels.size(); ++c)
    if (!channels[c].saturation)
      product.notes.push_back("channel " + std::string(names[c]) +
                              " was not saturated, so full scale counts as its saturation.");
  product.picture = NoisePicture(channels);
  return product;
}

}  // namespace crownfit
