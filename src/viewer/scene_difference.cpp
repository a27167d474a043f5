#include "viewer/scene_difference.h"

#include "capture/capture.h"
#include "photo/figures.h"
#include "scene/cast_photograph.h"
#include "scene/cast_samples.h"

namespace crownfit {
namespace {

constexpr glm::vec3 kNotCompared{0.20f, 0.20f, 0.21f};

/// The exposure that fits a prediction to its photograph best.
double FittingExposure(const Photograph& photo, const Image& prediction, const std::vector<uint8_t>& mask) {
  double top = 0, bottom = 0;
  for (size_t k = 0; k < prediction.values.size(); ++k) {
    if (!mask[k / 3]) continue;
    const double weight = 1.0 / photo.variance.values[k], p = prediction.values[k];
    top += weight * p * photo.linear.values[k];
    bottom += weight * p * p;
  }
  return bottom > 0 ? top / bottom : 1.0;
}

}  // namespace

std::vector<uint8_t> PixelsToCompare(const CrownInput& input, const Capture& capture, const Crown& crown,
                                     const Photograph& photo, size_t photograph, int threads) {
  CastOptions options;
  options.strata = options.gather_strata = 1;  // light is not needed
  options.threads = threads;
  const PhotographCast cast = CastPhotograph(capture, crown, input.scenery, photograph, options);
  std::vector<uint8_t> mask(photo.usable.size(), 0);
  for (const PixelCast& pixel : cast.pixels) {
    const size_t i = static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x;
    mask[i] = !pixel.at_silhouette && photo.usable[i];
  }
  return mask;
}

std::vector<uint8_t> LitPixels(const Image& picture) {
  std::vector<uint8_t> is_lit(picture.values.size() / 3);
  for (size_t p = 0; p < is_lit.size(); ++p)
    is_lit[p] = picture.values[3 * p] + picture.values[3 * p + 1] + picture.values[3 * p + 2] > 0;
  return is_lit;
}

SceneDifference Compare(const PhotographSpec& spec, const Photograph& photo, Image prediction,
                        const std::vector<uint8_t>& mask) {
  SceneDifference d;
  // A free exposure that a fit has determined is not 1.
  const bool exposure_is_known = !spec.exposure_is_free || spec.exposure_scale != 1.0;
  d.exposure = exposure_is_known ? spec.exposure_scale : FittingExposure(photo, prediction, mask);
  for (float& v : prediction.values) v *= static_cast<float>(d.exposure);
  d.colours = ComparePictures(photo.linear, prediction, mask, spec.rgb_from_sensor);
  d.map = DifferenceColours(d.colours, kNotCompared);
  return d;
}

}  // namespace crownfit
