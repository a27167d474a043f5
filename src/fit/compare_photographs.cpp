#include "fit/compare_photographs.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "capture/capture.h"
#include "fit/choose_pixels.h"
#include "scene/long_axis.h"
#include "shader/predict.h"

namespace crownfit {
namespace {

/// A prediction as the lens shows it. Around the object it shows the predicted scenery, and elsewhere the photograph
/// itself, which is already blurred. Within a blur's width of the rim, where nothing is known, it is wrong.
Image SeenOverPhotograph(const Image& prediction, const PhotographCast& cast, const Photograph& photo, const Blur& blur,
                         double exposure, int threads) {
  Image whole = photo.linear;
  for (const BackgroundPixel& b : cast.background)
    for (int c = 0; c < whole.channels; ++c) whole.at(b.x, b.y, c) = static_cast<float>(exposure * b.value[c]);
  for (const PixelCast& pixel : cast.pixels)
    if (!pixel.at_silhouette)
      for (int c = 0; c < whole.channels; ++c) whole.at(pixel.x, pixel.y, c) = prediction.at(pixel.x, pixel.y, c);
  const Image seen = Seen(whole, blur, threads);
  Image result = prediction;
  for (const PixelCast& pixel : cast.pixels)
    for (int c = 0; c < result.channels; ++c) result.at(pixel.x, pixel.y, c) = seen.at(pixel.x, pixel.y, c);
  return result;
}

Spectrum ValueAt(const Image& image, const PixelCast& pixel) {
  return PixelOf(image, static_cast<size_t>(pixel.y) * image.width + pixel.x);
}

/// Sum of the measured values over the sum of the predicted ones. Least squares would be too dark, because path-traced
/// predictions have noise. The standard deviation comes from the scatter of blocks of 8 x 8 pixels.
class BrightnessRatio {
 public:
  void Add(const PixelCast& pixel, const Spectrum& seen, const Spectrum& predicted) {
    constexpr int kBlock = 8;
    glm::dvec2& sums = of_blocks_[{pixel.x / kBlock, pixel.y / kBlock}];
    sums += glm::dvec2(seen.Sum(), predicted.Sum());
  }
  /// 1 where nothing is predicted.
  double value() const {
    const glm::dvec2 all = Sums();
    return all.y > 0 ? all.x / all.y : 1.0;
  }
  /// Infinite for a single block.
  double stddev() const {
    const double n = static_cast<double>(of_blocks_.size()), ratio = value(), predicted = Sums().y;
    if (n < 2 || !(predicted > 0)) return HUGE_VAL;
    double square = 0;
    for (const auto& [block, sums] : of_blocks_) square += std::pow(sums.x - ratio * sums.y, 2);
    return std::sqrt(square * n / (n - 1)) / predicted;
  }

 private:
  glm::dvec2 Sums() const {
    glm::dvec2 all(0.0);
    for (const auto& [block, sums] : of_blocks_) all += sums;
    return all;
  }
  std::map<std::pair<int, int>, glm::dvec2> of_blocks_;
};

glm::dvec3 PositionOf(const Crown& crown, const Interpolation& at) {
  glm::dvec3 position(0.0);
  for (int i = 0; at.exists() && i < 3; ++i)
    position += static_cast<double>(at.weights[i]) * crown.fine.vertices[at.vertices[i]];
  return position;
}

/// 0, 1, 2: cervical, middle, incisal.
int ThirdOf(double along) { return std::clamp(static_cast<int>(3.0 * along), 0, 2); }

}  // namespace

Predictor PredictorByShader(const CrownInput& input, const CastState& state, const Material& material,
                            const LinearScales& scales, int threads) {
  return [&input, &state, &material, &scales, threads](size_t photograph) {
    return PredictedPixels{PredictPixels(input.capture, state, photograph, material, scales.light, threads)};
  };
}

std::vector<PhotographResult> ComparePhotographs(const CrownInput& input, const CastState& state,
                                                 const Predictor& predict, const LinearScales& scales,
                                                 const std::vector<FitPixels>& fitted, int threads,
                                                 const LinearScales& stddev) {
  std::vector<PhotographResult> results(input.capture.photographs.size());
  const std::optional<LongAxis> axis = LongAxisOf(input.capture, *input.source.meshes[0]);
  // The fitted exposure of a group holds for its held-out photographs too.
  std::map<std::string, int> exposure_of_group;
  for (const FitPixels& p : fitted)
    if (p.exposure >= 0) exposure_of_group[ExposureGroup(input.capture.photographs[p.photograph])] = p.exposure;
  for (size_t i = 0; i < results.size(); ++i) {
    const PhotographSpec& spec = input.capture.photographs[i];
    const Photograph& photo = input.photographs[i];
    const auto& cast_pixels = state.photographs[i].pixels;
    PhotographResult& r = results[i];
    r.name = spec.name;
    r.is_holdout = spec.is_holdout;
    r.exposure_is_fitted = spec.exposure_is_free || spec.exposure_stddev > 0;
    r.saturated_pixels = photo.saturated_pixels;
    r.rgb_from_sensor = spec.rgb_from_sensor;
    r.photograph = photo.linear;
    r.prediction = Image(photo.linear.width, photo.linear.height, photo.linear.channels);
    r.compared.assign(photo.usable.size(), 0);
    const auto [values, variances] = predict(i);

    r.exposure = spec.exposure_scale;
    if (const auto group = exposure_of_group.find(ExposureGroup(spec)); group != exposure_of_group.end()) {
      r.exposure = scales.exposure[group->second];
      if (!stddev.exposure.empty()) r.exposure_stddev = stddev.exposure[group->second];
    } else if (spec.exposure_is_free) {
      BrightnessRatio own;  // a held-out photograph with its own exposure
      for (size_t k = 0; k < values.size(); ++k)
        if (IsUsable(photo, cast_pixels[k])) own.Add(cast_pixels[k], ValueAt(photo.linear, cast_pixels[k]), values[k]);
      if (own.value() > 0) r.exposure = own.value();
    }
    for (size_t k = 0; k < values.size(); ++k)
      for (int c = 0; c < r.prediction.channels; ++c)
        r.prediction.at(cast_pixels[k].x, cast_pixels[k].y, c) = static_cast<float>(r.exposure * values[k][c]);
    if (spec.blur)
      r.prediction = SeenOverPhotograph(r.prediction, state.photographs[i], photo, *spec.blur, r.exposure, threads);
    if (axis) r.thirds.assign(photo.usable.size(), 0);
    double chi2 = 0;
    BrightnessRatio level;
    const std::vector<int> compared = ComparablePixels(spec, state.photographs[i], photo, threads);
    for (int k : compared) {
      const PixelCast& pixel = cast_pixels[k];
      const size_t place = static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x;
      r.compared[place] = 1;
      if (axis) r.thirds[place] = static_cast<uint8_t>(1 + ThirdOf(axis->At(PositionOf(*state.crown, pixel.at))));
      Spectrum variance = VarianceAt(photo, pixel);
      if (!variances.empty()) variance += r.exposure * r.exposure * variances[k];
      const Spectrum seen = ValueAt(photo.linear, pixel), predicted = ValueAt(r.prediction, pixel);
      const Spectrum off = predicted - seen;
      chi2 += (off * off / variance).Sum();
      level.Add(pixel, seen, predicted);
    }
    r.level = level.value();
    r.level_stddev = level.stddev();
    r.reduced_chi2 = compared.empty()
                         ? 0.0
                         : chi2 / static_cast<double>(compared.size() * static_cast<size_t>(photo.linear.channels));
    r.difference = ComparePictures(r.photograph, r.prediction, r.compared, r.rgb_from_sensor);
  }
  return results;
}

}  // namespace crownfit
