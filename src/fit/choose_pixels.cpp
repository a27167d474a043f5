#include "fit/choose_pixels.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "capture/capture.h"
#include "fit/fit_result.h"

namespace crownfit {
namespace {

/// Variance of a prediction near the neck's cut, added to the photograph's, as the surroundings beyond the cut are
/// unknown. Replacing one plausible root by another changes the light there by about 30 % at the cut and by little 3 mm
/// away.
double NeckVariance(const PixelCast& pixel, double value) {
  const double relative = 0.3 * std::max(0.0, 1.0 - pixel.from_cut_mm / kNeckReachMm);
  return relative * relative * value * value;
}

/// Per pixel of a photograph with stated blur: whether more than a hundredth of its value comes from unknown areas, the
/// object's rim and what lies behind it. There the blur would decide the value.
std::vector<uint8_t> IsBlurredIntoTheUnknown(const PhotographSpec& spec, const PhotographCast& cast, int threads) {
  Image unknown(spec.camera.width, spec.camera.height, 1, 1.0f);
  for (const BackgroundPixel& b : cast.background) unknown.at(b.x, b.y, 0) = 0.0f;
  for (const PixelCast& pixel : cast.pixels)
    if (!pixel.at_silhouette) unknown.at(pixel.x, pixel.y, 0) = 0.0f;
  const Image share = Seen(unknown, {spec.blur->psf, 0.0}, threads);
  std::vector<uint8_t> is(share.values.size());
  std::transform(share.values.begin(), share.values.end(), is.begin(), [](float v) { return v > 0.01f; });
  return is;
}

/// Finds the sharp pixels that the lens spreads into the chosen ones.
void AddBlur(const PhotographSpec& spec, const PhotographCast& cast, const Photograph& photo, FitPixels& p) {
  if (!spec.blur) {
    p.sources = p.pixels;
    for (size_t i = 0; i <= p.pixels.size(); ++i) p.first_term.push_back(static_cast<int>(i));
    for (size_t i = 0; i < p.pixels.size(); ++i) p.terms.push_back({static_cast<int>(i), 1.0f});
    return;
  }
  const PsfKernel kernel = KernelOf(*spec.blur);
  const auto kept = static_cast<float>(1.0 - spec.blur->veiling_glare);
  const int width = photo.linear.width, height = photo.linear.height;
  constexpr int kUnknown = -1, kScenery = -2;
  std::vector<int> at(static_cast<size_t>(width) * height, kUnknown);  // index into the cast's pixels
  const int channels = photo.linear.channels;
  Image scenery(width, height, channels);
  for (size_t k = 0; k < cast.pixels.size(); ++k)
    if (!cast.pixels[k].at_silhouette)
      at[static_cast<size_t>(cast.pixels[k].y) * width + cast.pixels[k].x] = static_cast<int>(k);
  for (const BackgroundPixel& b : cast.background) {
    at[static_cast<size_t>(b.y) * width + b.x] = kScenery;
    for (int c = 0; c < channels; ++c) scenery.at(b.x, b.y, c) = static_cast<float>(b.value[c]);
  }
  Spectrum mean(channels, 0.0);  // veiling glare is a share of this mean
  for (size_t i = 0; i < photo.linear.values.size(); ++i)
    mean[static_cast<int>(i % channels)] += photo.linear.values[i] / (static_cast<double>(width) * height);

  std::vector<int> source_of(cast.pixels.size(), -1);
  p.first_term.push_back(0);
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    const PixelCast& pixel = cast.pixels[p.pixels[i]];
    double unknown = 0;
    Spectrum of_scenery(channels, 0.0);
    std::vector<std::pair<int, float>> of_object;
    for (int dy = -kernel.radius; dy <= kernel.radius; ++dy)
      for (int dx = -kernel.radius; dx <= kernel.radius; ++dx) {
        const int x = std::clamp(pixel.x + dx, 0, width - 1), y = std::clamp(pixel.y + dy, 0, height - 1);
        const float weight = kept * kernel.at(dx, dy);
        const int k = at[static_cast<size_t>(y) * width + x];
        if (k == kUnknown) unknown += weight;
        if (k == kScenery)
          for (int c = 0; c < channels; ++c) of_scenery[c] += weight * scenery.at(x, y, c);
        if (k >= 0) of_object.emplace_back(k, weight);
      }
    for (const auto& [k, weight] : of_object) {
      if (source_of[k] < 0) {
        source_of[k] = static_cast<int>(p.sources.size());
        p.sources.push_back(k);
      }
      // The small unknown share is taken to look like its surroundings.
      p.terms.push_back({source_of[k], static_cast<float>(weight / (1.0 - unknown))});
    }
    p.first_term.push_back(static_cast<int>(p.terms.size()));
    p.values[i] -= spec.blur->veiling_glare * mean;
    p.scenery.push_back(of_scenery);
  }
}

}  // namespace

bool IsUsable(const Photograph& photo, const PixelCast& pixel) {
  return photo.usable[static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x] != 0;
}

Spectrum VarianceAt(const Photograph& photo, const PixelCast& pixel) {
  Spectrum variance(photo.linear.channels, 0.0);
  for (int c = 0; c < variance.size(); ++c)
    variance[c] = photo.variance.at(pixel.x, pixel.y, c) + NeckVariance(pixel, photo.linear.at(pixel.x, pixel.y, c));
  return variance;
}

std::string ExposureGroup(const PhotographSpec& spec) {
  return spec.exposure_is_free ? spec.exposure_group : "alone " + spec.name;
}

std::vector<int> ComparablePixels(const PhotographSpec& spec, const PhotographCast& cast, const Photograph& photo,
                                  int threads) {
  std::vector<uint8_t> is_blurred(photo.usable.size(), 0);
  if (spec.blur) is_blurred = IsBlurredIntoTheUnknown(spec, cast, threads);
  std::vector<int> comparable;
  for (size_t k = 0; k < cast.pixels.size(); ++k) {
    const PixelCast& pixel = cast.pixels[k];
    if (!pixel.at_silhouette && IsUsable(photo, pixel) &&
        !is_blurred[static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x])
      comparable.push_back(static_cast<int>(k));
  }
  return comparable;
}

std::vector<FitPixels> ChoosePixels(const CrownInput& input, const CastState& state, size_t max_pixels) {
  std::vector<FitPixels> chosen;
  std::map<std::string, int> exposure_groups;
  for (size_t i = 0; i < input.capture.photographs.size(); ++i) {
    const PhotographSpec& spec = input.capture.photographs[i];
    if (spec.is_holdout) continue;
    FitPixels p{i, -1, {}, {}, {}, {}, {}, {}, {}};
    if (spec.exposure_is_free || spec.exposure_stddev > 0)
      p.exposure =
          exposure_groups.try_emplace(ExposureGroup(spec), static_cast<int>(exposure_groups.size())).first->second;
    const PhotographCast& cast = state.photographs[i];
    const Photograph& photo = input.photographs[i];
    const std::vector<int> usable = ComparablePixels(spec, cast, photo, 0);
    const double every = static_cast<double>(usable.size()) / static_cast<double>(max_pixels);
    const int rows = std::max(1, static_cast<int>(std::sqrt(every))),
              columns = static_cast<int>(std::ceil(every / rows));
    for (int k : usable) {
      const PixelCast& pixel = cast.pixels[k];
      if (pixel.x % columns || pixel.y % rows) continue;
      const Spectrum variance = VarianceAt(photo, pixel);
      p.pixels.push_back(k);
      p.values.push_back(PixelOf(photo.linear, static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x));
      p.stddev.push_back(Sqrt(variance));
    }
    AddBlur(spec, cast, photo, p);
    if (p.pixels.empty())
      throw InputError(input.capture.file, spec.key, "photograph '" + spec.name + "' has no usable pixel on the object",
                       "Check its mask and its saturation, and that no scenery hides the object.");
    chosen.push_back(std::move(p));
  }
  if (chosen.empty())
    throw InputError(input.capture.file, "photographs", "every photograph is held out, so there is nothing to fit",
                     "Give at least one photograph \"use\": \"fit\".");
  return chosen;
}

FitPixels Subset(const FitPixels& p, std::span<const int> which) {
  FitPixels left{p.photograph, p.exposure, {}, {}, {}, p.sources, {0}, {}, {}};
  for (const int i : which) {
    left.pixels.push_back(p.pixels[i]);
    left.values.push_back(p.values[i]);
    left.stddev.push_back(p.stddev[i]);
    if (!p.scenery.empty()) left.scenery.push_back(p.scenery[i]);
    const auto terms = p.TermsOf(i);
    left.terms.insert(left.terms.end(), terms.begin(), terms.end());
    left.first_term.push_back(static_cast<int>(left.terms.size()));
  }
  return left;
}

}  // namespace crownfit
