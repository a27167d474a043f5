#include "fit_steps.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"

namespace crownfit {
namespace {

void CheckObjectIsInPicture(const Capture& capture, const TriangleMesh& outer) {
  for (const PhotographSpec& photo : capture.photographs) {
    bool seen = false;
    for (size_t v = 0; v < outer.vertices.size() && !seen; ++v) {
      const auto pixel = PixelFromPoint(photo.camera, photo.camera_from_object.Point(outer.vertices[v]));
      seen = pixel && pixel->x >= 0 && pixel->y >= 0 && pixel->x < photo.camera.width && pixel->y < photo.camera.height;
    }
    if (!seen)
      throw InputError(
          capture.file, photo.key + ".camera_from_object",
          "in photograph '" + photo.name + "' no part of the object is in front of the camera and in the picture",
          "Check translation_mm (z is the distance along the view) and the mesh's origin.");
  }
}

bool IsUsable(const Photograph& photo, const PixelCast& pixel) {
  return photo.usable[static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x] != 0;
}

/// Variance that a prediction near the neck's cut adds to a photograph's: what lies beyond is not known. Replacing one
/// plausible root by another moves the light there by about 30 % at the cut and by little 3 mm away.
double NeckVariance(const PixelCast& pixel, double value) {
  const double relative = 0.3 * std::max(0.0, 1.0 - pixel.from_cut_mm / kNeckReachMm);
  return relative * relative * value * value;
}

double MedianDepth(const Crown& crown) {
  std::vector<double> depth;
  for (const Column& c : crown.columns) depth.push_back(c.straight.total_mm);
  std::nth_element(depth.begin(), depth.begin() + static_cast<long>(depth.size() / 2), depth.end());
  return depth[depth.size() / 2];
}

/// Per pixel of a photograph with stated blur: whether more than a hundredth of what it shows comes from where nothing
/// is known, the object's rim and what lies behind it. Blur would decide there.
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

/// A prediction as the lens shows it. Around the object stands what scenery shows, and elsewhere the photograph itself,
/// which is blurred already: wrong within a blur's width of the rim, where nothing is known.
Image SeenOverPhotograph(const Image& prediction, const PhotographCast& cast, const Photograph& photo, const Blur& blur,
                         double exposure, int threads) {
  Image whole = photo.linear;
  for (const BackgroundPixel& b : cast.background)
    for (int c = 0; c < kChannels; ++c) whole.at(b.x, b.y, c) = static_cast<float>(exposure * b.value[c]);
  for (const PixelCast& pixel : cast.pixels)
    if (!pixel.at_silhouette)
      for (int c = 0; c < kChannels; ++c) whole.at(pixel.x, pixel.y, c) = prediction.at(pixel.x, pixel.y, c);
  const Image seen = Seen(whole, blur, threads);
  Image result = prediction;
  for (const PixelCast& pixel : cast.pixels)
    for (int c = 0; c < kChannels; ++c) result.at(pixel.x, pixel.y, c) = seen.at(pixel.x, pixel.y, c);
  return result;
}

/// Which sharp pixels the lens spreads into the chosen ones.
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
  Image scenery(width, height, 3);
  for (size_t k = 0; k < cast.pixels.size(); ++k)
    if (!cast.pixels[k].at_silhouette)
      at[static_cast<size_t>(cast.pixels[k].y) * width + cast.pixels[k].x] = static_cast<int>(k);
  for (const BackgroundPixel& b : cast.background) {
    at[static_cast<size_t>(b.y) * width + b.x] = kScenery;
    for (int c = 0; c < kChannels; ++c) scenery.at(b.x, b.y, c) = static_cast<float>(b.value[c]);
  }
  glm::dvec3 mean(0.0);  // of what veils the picture
  for (size_t i = 0; i < photo.linear.values.size(); ++i)
    mean[static_cast<int>(i % 3)] += photo.linear.values[i] / (static_cast<double>(width) * height);

  std::vector<int> source_of(cast.pixels.size(), -1);
  p.first_term.push_back(0);
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    const PixelCast& pixel = cast.pixels[p.pixels[i]];
    double unknown = 0;
    glm::dvec3 of_scenery(0.0);
    std::vector<std::pair<int, float>> of_object;
    for (int dy = -kernel.radius; dy <= kernel.radius; ++dy)
      for (int dx = -kernel.radius; dx <= kernel.radius; ++dx) {
        const int x = std::clamp(pixel.x + dx, 0, width - 1), y = std::clamp(pixel.y + dy, 0, height - 1);
        const float weight = kept * kernel.at(dx, dy);
        const int k = at[static_cast<size_t>(y) * width + x];
        if (k == kUnknown) unknown += weight;
        if (k == kScenery)
          for (int c = 0; c < kChannels; ++c) of_scenery[c] += weight * scenery.at(x, y, c);
        if (k >= 0) of_object.emplace_back(k, weight);
      }
    for (const auto& [k, weight] : of_object) {
      if (source_of[k] < 0) {
        source_of[k] = static_cast<int>(p.sources.size());
        p.sources.push_back(k);
      }
      // What little is unknown looks like its surroundings.
      p.terms.push_back({source_of[k], static_cast<float>(weight / (1.0 - unknown))});
    }
    p.first_term.push_back(static_cast<int>(p.terms.size()));
    p.values[i] -= spec.blur->veiling_glare * mean;
    p.scenery.push_back(of_scenery);
  }
}

}  // namespace

CrownInput ReadInput(const Capture& capture, int threads, bool with_images) {
  CrownInput input;
  input.capture = capture;
  if (with_images) {
    input.photographs.resize(capture.photographs.size());
    for (size_t i = 0; i < capture.photographs.size(); ++i) {
      const PhotographSpec& spec = capture.photographs[i];
      input.photographs[i] = ReadPhotograph(spec.files);
      const Image& image = input.photographs[i].linear;
      if (image.width != spec.camera.width || image.height != spec.camera.height)
        throw InputError(spec.files.image, "",
                         "is " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels, but " +
                             spec.camera_file.filename().string() + " says " + std::to_string(spec.camera.width) +
                             " x " + std::to_string(spec.camera.height),
                         "Use the camera file of this resolution; the photograph must not be cropped or resized.");
    }
  }
  input.source = ReadCrownSource(capture, threads);
  CheckObjectIsInPicture(capture, *input.source.meshes[0]);
  input.scenery = ReadScenery(capture);
  return input;
}

CastState CastAll(const CrownInput& input, const std::vector<double>& thickness_mm, const CastOptions& options,
                  Progress& progress, std::optional<size_t> only) {
  const Capture& capture = input.capture;
  CastState state;
  progress.Show("building the layers", 0.0);
  state.crown = BuildCrown(capture, input.source, thickness_mm, options.threads, options.kernel);
  state.thickness_mm = CastThicknesses(capture, *state.crown, thickness_mm);
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    state.photographs.emplace_back();
    if (only && *only != i) continue;
    progress.Show("casting rays", static_cast<double>(i) / static_cast<double>(capture.photographs.size()),
                  capture.photographs[i].name);
    state.photographs.back() = CastPhotograph(capture, *state.crown, input.scenery, i, options);
  }
  return state;
}

std::vector<double> ThicknessesOf(const Capture& capture, const Material& material) {
  std::vector<double> thickness;
  for (size_t i = 0; i < capture.layers.size(); ++i)
    thickness.push_back(material.layers[i][ThicknessQuantity(capture, i)][0]);
  return thickness;
}

std::vector<double> CastThicknesses(const Capture& capture, const Crown& crown, std::vector<double> built_mm) {
  if (!capture.layers.back()[Quantity::kThickness].fixed) built_mm.back() = MedianDepth(crown);
  return built_mm;
}

bool GeometryIsStale(const FreeParameters& free, const Eigen::VectorXd& cast_at, const Eigen::VectorXd& x,
                     const Uncertainty& uncertainty) {
  for (int k = 0; k < free.count(); ++k) {
    const FreeEntry& e = free.entries[k];
    if (!e.moves_surface) continue;
    double relative_stddev = 0;
    for (const auto& p : uncertainty.parameters)
      if (p.layer == e.layer && p.quantity == e.quantity) relative_stddev = p.stddev[0] / p.value[0];
    if (std::abs(x[k] - cast_at[k]) > std::max(1e-3, 0.1 * relative_stddev)) return true;
  }
  return false;
}

Eigen::VectorXd HalfWay(const FreeParameters& free, const Eigen::VectorXd& cast_at, Eigen::VectorXd x) {
  for (int k = 0; k < free.count(); ++k)
    if (free.entries[k].moves_surface) x[k] = 0.5 * (cast_at[k] + x[k]);
  return x;
}

bool AnyBlurred(const Capture& capture) {
  return std::any_of(capture.photographs.begin(), capture.photographs.end(),
                     [](const auto& p) { return p.blur.has_value(); });
}

std::vector<FitPixels> ChoosePixels(const CrownInput& input, const CastState& state, size_t max_pixels) {
  std::vector<FitPixels> chosen;
  std::map<std::string, int> exposure_groups;
  for (size_t i = 0; i < input.capture.photographs.size(); ++i) {
    const PhotographSpec& spec = input.capture.photographs[i];
    if (spec.is_holdout) continue;
    FitPixels p{i, -1, {}, {}, {}, {}, {}, {}, {}};
    if (spec.exposure_is_free)
      p.exposure =
          exposure_groups.try_emplace(spec.exposure_group, static_cast<int>(exposure_groups.size())).first->second;
    const PhotographCast& cast = state.photographs[i];
    const Photograph& photo = input.photographs[i];
    std::vector<uint8_t> is_blurred(photo.usable.size(), 0);
    if (spec.blur) is_blurred = IsBlurredIntoTheUnknown(spec, cast, 0);
    const auto is_usable = [&](const PixelCast& c) {
      return !c.at_silhouette && IsUsable(photo, c) && !is_blurred[static_cast<size_t>(c.y) * photo.linear.width + c.x];
    };
    const auto usable = std::count_if(cast.pixels.begin(), cast.pixels.end(), is_usable);
    const double every = std::sqrt(static_cast<double>(usable) / static_cast<double>(max_pixels));
    const int stride = std::max(1, static_cast<int>(std::ceil(every)));
    for (size_t k = 0; k < cast.pixels.size(); ++k) {
      const PixelCast& pixel = cast.pixels[k];
      if (!is_usable(pixel) || pixel.x % stride || pixel.y % stride) continue;
      glm::dvec3 value, stddev;
      for (int c = 0; c < kChannels; ++c) {
        value[c] = photo.linear.at(pixel.x, pixel.y, c);
        stddev[c] = std::sqrt(photo.variance.at(pixel.x, pixel.y, c) + NeckVariance(pixel, value[c]));
      }
      p.pixels.push_back(static_cast<int>(k));
      p.values.push_back(value);
      p.stddev.push_back(stddev);
    }
    AddBlur(spec, cast, photo, p);
    if (p.pixels.empty())
      throw InputError(input.capture.file, spec.key, "photograph '" + spec.name + "' has no usable pixel on the object",
                       "Check its mask, its saturation and whether scenery hides the object.");
    chosen.push_back(std::move(p));
  }
  if (chosen.empty())
    throw InputError(input.capture.file, "photographs", "every photograph is a holdout",
                     "Give at least one \"use\": \"fit\".");
  return chosen;
}

std::vector<PhotographResult> ComparePhotographs(const CrownInput& input, const CastState& state,
                                                 const Material& material, const LinearScales& scales,
                                                 const std::vector<FitPixels>& fitted, int threads) {
  std::vector<PhotographResult> results(input.capture.photographs.size());
  // The exposure of a group that was fitted holds for its held-out photographs too.
  std::map<std::string, double> exposure_of_group;
  for (const FitPixels& p : fitted)
    if (p.exposure >= 0)
      exposure_of_group[input.capture.photographs[p.photograph].exposure_group] = scales.exposure[p.exposure];
  for (size_t i = 0; i < results.size(); ++i) {
    const PhotographSpec& spec = input.capture.photographs[i];
    const Photograph& photo = input.photographs[i];
    const auto& cast_pixels = state.photographs[i].pixels;
    PhotographResult& r = results[i];
    r.name = spec.name;
    r.is_holdout = spec.is_holdout;
    r.exposure_is_free = spec.exposure_is_free;
    r.saturated_pixels = photo.saturated_pixels;
    r.rgb_from_sensor = spec.rgb_from_sensor;
    r.photograph = photo.linear;
    r.prediction = Image(photo.linear.width, photo.linear.height, 3);
    r.compared.assign(photo.usable.size(), 0);
    const std::vector<glm::dvec3> values = PredictPixels(input.capture, state, i, material, scales.light, threads);

    r.exposure = spec.exposure_scale;
    if (const auto group = exposure_of_group.find(spec.exposure_group); group != exposure_of_group.end()) {
      r.exposure = group->second;
    } else if (spec.exposure_is_free) {
      double top = 0, bottom = 0;  // a held-out photograph of its own exposure: least squares on itself
      for (size_t k = 0; k < values.size(); ++k)
        for (int c = 0; c < kChannels && IsUsable(photo, cast_pixels[k]); ++c) {
          const double w = 1.0 / photo.variance.at(cast_pixels[k].x, cast_pixels[k].y, c);
          top += w * values[k][c] * photo.linear.at(cast_pixels[k].x, cast_pixels[k].y, c);
          bottom += w * values[k][c] * values[k][c];
        }
      if (bottom > 0) r.exposure = top / bottom;
    }
    for (size_t k = 0; k < values.size(); ++k)
      for (int c = 0; c < kChannels; ++c)
        r.prediction.at(cast_pixels[k].x, cast_pixels[k].y, c) = static_cast<float>(r.exposure * values[k][c]);
    if (spec.blur)
      r.prediction = SeenOverPhotograph(r.prediction, state.photographs[i], photo, *spec.blur, r.exposure, threads);
    std::vector<uint8_t> is_blurred(photo.usable.size(), 0);
    if (spec.blur) is_blurred = IsBlurredIntoTheUnknown(spec, state.photographs[i], threads);
    double chi2 = 0;
    size_t count = 0;
    for (size_t k = 0; k < values.size(); ++k) {
      const PixelCast& pixel = cast_pixels[k];
      const bool compared = !pixel.at_silhouette && IsUsable(photo, pixel) &&
                            !is_blurred[static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x];
      r.compared[static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x] = compared;
      for (int c = 0; c < kChannels; ++c) {
        if (!compared) continue;
        const double predicted = r.prediction.at(pixel.x, pixel.y, c);
        const double seen = photo.linear.at(pixel.x, pixel.y, c), d = predicted - seen;
        chi2 += d * d / (photo.variance.at(pixel.x, pixel.y, c) + NeckVariance(pixel, seen));
        ++count;
      }
    }
    r.reduced_chi2 = count ? chi2 / static_cast<double>(count) : 0.0;
    r.difference = ComparePictures(r.photograph, r.prediction, r.compared, r.rgb_from_sensor);
  }
  return results;
}

}  // namespace crownfit
