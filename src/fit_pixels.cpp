#include "fit_pixels.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"

namespace crownfit {
namespace {

/// Variance that a prediction near the neck's cut adds to a photograph's: what lies beyond is not known. Replacing one
/// plausible root by another moves the light there by about 30 % at the cut and by little 3 mm away.
double NeckVariance(const PixelCast& pixel, double value) {
  const double relative = 0.3 * std::max(0.0, 1.0 - pixel.from_cut_mm / kNeckReachMm);
  return relative * relative * value * value;
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

bool IsUsable(const Photograph& photo, const PixelCast& pixel) {
  return photo.usable[static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x] != 0;
}

glm::dvec3 VarianceAt(const Photograph& photo, const PixelCast& pixel) {
  glm::dvec3 variance;
  for (int c = 0; c < kChannels; ++c)
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
      const glm::dvec3 variance = VarianceAt(photo, pixel);
      glm::dvec3 value;
      for (int c = 0; c < kChannels; ++c) value[c] = photo.linear.at(pixel.x, pixel.y, c);
      p.pixels.push_back(k);
      p.values.push_back(value);
      p.stddev.push_back(glm::sqrt(variance));
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

/// Takes out the pixels that are not kept.
static void Keep(const std::vector<uint8_t>& kept, FitPixels& p, CalibrationSlopes& slopes) {
  std::vector<int> which, rows;
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    if (!kept[i]) continue;
    which.push_back(static_cast<int>(i));
    for (int c = 0; c < kChannels; ++c) rows.push_back(kChannels * static_cast<int>(i) + c);
  }
  slopes.by_error = Eigen::MatrixXd(slopes.by_error(rows, Eigen::all));
  p = Subset(p, which);
}

std::vector<CalibrationSlopes> SlopesOf(const CrownInput& input, const Capture& stated,
                                        const std::vector<CalibrationError>& errors, const std::vector<double>& amounts,
                                        const CastState& state, const Material& material,
                                        const std::vector<double>& light_scale, CastOptions options,
                                        std::vector<FitPixels>& pixels, Progress& progress) {
  constexpr double kStep = 0.5;  // standard deviations, to either side
  options.shade_scenery = false;
  options.strata = options.gather_strata = kStrataOfMoved;
  std::vector<CalibrationSlopes> slopes;
  for (FitPixels& p : pixels) {
    const PhotographSpec& photo = stated.photographs[p.photograph];
    progress.Show("moving the calibration", static_cast<double>(slopes.size()) / static_cast<double>(pixels.size()),
                  photo.name);
    const PhotographCast& here = state.photographs[p.photograph];
    const auto place = [&](const PixelCast& c) { return static_cast<size_t>(c.y) * photo.camera.width + c.x; };
    std::vector<uint8_t> wanted(static_cast<size_t>(photo.camera.width) * photo.camera.height, 0);
    for (int s : p.sources) wanted[place(here.pixels[s])] = 1;
    CalibrationSlopes of;
    for (size_t e = 0; e < errors.size(); ++e)
      if (std::count(errors[e].photographs.begin(), errors[e].photographs.end(), p.photograph))
        of.errors.push_back(static_cast<int>(e));
    of.by_error.setZero(kChannels * static_cast<Eigen::Index>(p.pixels.size()),
                        static_cast<Eigen::Index>(of.errors.size()));
    std::vector<uint8_t> kept(p.pixels.size(), 1);
    const auto add = [&](Eigen::Index column, double side, const PhotographCast& there,
                         const std::vector<glm::dvec3>& values) {
      std::vector<int> at(wanted.size(), -1);
      for (size_t k = 0; k < there.pixels.size(); ++k)
        if (!there.pixels[k].at_silhouette) at[place(there.pixels[k])] = static_cast<int>(k);
      for (size_t i = 0; i < p.pixels.size(); ++i)
        for (const auto& [source, weight] : p.TermsOf(i)) {
          const int k = at[place(here.pixels[p.sources[source]])];
          if (k < 0) kept[i] = 0;
          for (int c = 0; c < kChannels && k >= 0; ++c)
            of.by_error(kChannels * static_cast<Eigen::Index>(i) + c, column) +=
                side * weight * values[k][c] / (2 * kStep);
        }
    };
    std::vector<PhotographCast> views;  // in the same light: predicted at once
    std::vector<std::pair<Eigen::Index, double>> column_and_side;
    for (size_t e = 0; e < of.errors.size(); ++e)
      for (const double side : {-1.0, 1.0}) {
        const auto column = static_cast<Eigen::Index>(e);
        std::vector<double> amounts_there = amounts;
        amounts_there[of.errors[e]] += side * kStep;
        Capture moved = Moved(stated, errors, amounts_there);
        std::vector<size_t>& lights = moved.photographs[p.photograph].lights;
        const std::optional<size_t> lamp = errors[of.errors[e]].light;
        if (lamp) lights = {*lamp};  // the others' light stays
        if (!lamp &&
            std::none_of(lights.begin(), lights.end(), [&](size_t l) { return moved.lights[l].in_camera_frame; })) {
          views.push_back(CastPixels(moved, *state.crown, input.scenery, p.photograph, options, here, wanted));
          column_and_side.emplace_back(column, side);
        } else {
          const PhotographCast there =
              CastPixels(moved, *state.crown, input.scenery, p.photograph, options,
                         CastVertices(moved, *state.crown, input.scenery, p.photograph, options), wanted);
          add(column, side, there,
              PredictViews(moved, state, p.photograph, {&there, 1}, material, light_scale, options.threads)[0]);
        }
      }
    const auto values = PredictViews(stated, state, p.photograph, views, material, light_scale, options.threads);
    for (size_t v = 0; v < views.size(); ++v)
      add(column_and_side[v].first, column_and_side[v].second, views[v], values[v]);
    Keep(kept, p, of);
    if (p.pixels.empty())
      throw InputError(stated.file, photo.key,
                       "the stated errors of pose and lights leave no pixel that is surely on the object",
                       "Calibrate the pose better, or state a smaller error.");
    slopes.push_back(std::move(of));
  }
  return slopes;
}

bool MoveCalibration(const LinearScales& scales, CalibrationState& calibration) {
  constexpr double kNear = 0.3;  // standard deviations, over which slopes are straight
  bool far = scales.calibration.size() != calibration.amounts.size();
  for (size_t e = 0; e < scales.calibration.size(); ++e) {
    calibration.amounts[e] += scales.calibration[e];
    far |= std::abs(scales.calibration[e]) > kNear;
  }
  return far;
}

std::vector<MovedCalibration> HowFarMoved(const std::vector<CalibrationError>& errors,
                                          const std::vector<double>& amounts) {
  std::vector<MovedCalibration> moved;
  for (size_t e = 0; e < errors.size(); ++e) {
    if (moved.empty() || moved.back().what != errors[e].what)
      moved.push_back({errors[e].light ? StatementKind::kPlace : StatementKind::kPose, errors[e].what});
    moved.back().freedom += 1;
    moved.back().chi2 += amounts[e] * amounts[e];
  }
  return moved;
}

std::vector<MovedCalibration> HowFarScaled(const Capture& capture, const std::vector<FitPixels>& pixels,
                                           const LinearScales& scales) {
  std::vector<MovedCalibration> moved;
  const auto add = [&](StatementKind kind, const std::string& what, double stated, double found, double stddev) {
    moved.push_back({kind, what, 1, std::pow((found - stated) / stddev, 2), found / stated - 1});
  };
  int exposures = 0;
  for (const FitPixels& p : pixels) {
    if (p.exposure < exposures) continue;  // exact, or told with another photograph
    exposures = p.exposure + 1;
    const PhotographSpec& spec = capture.photographs[p.photograph];
    if (spec.exposure_stddev > 0)
      add(StatementKind::kExposure, "the exposure of '" + spec.name + "'", spec.exposure_scale,
          scales.exposure[p.exposure], spec.exposure_stddev);
  }
  const Nuisances nuisances(capture, pixels, {});
  for (const int l : nuisances.lights())
    if (const Light& light = capture.lights[l]; light.intensity_stddev > 0 && !light.scale_is_free)
      add(StatementKind::kIntensity, "the intensity of light '" + light.name + "'", light.intensity_scale,
          scales.light[l], light.intensity_stddev);
  return moved;
}

}  // namespace crownfit
