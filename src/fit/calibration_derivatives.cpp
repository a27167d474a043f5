#include "fit/calibration_derivatives.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "capture/capture.h"
#include "fit/choose_pixels.h"
#include "scene/cast_photograph.h"
#include "shader/predict.h"

namespace crownfit {
namespace {

/// Removes the pixels that are not kept.
void Keep(const std::vector<uint8_t>& kept, FitPixels& p, CalibrationDerivatives& derivatives) {
  std::vector<int> which, rows;
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    if (!kept[i]) continue;
    which.push_back(static_cast<int>(i));
    for (int c = 0; c < p.channels(); ++c) rows.push_back(p.channels() * static_cast<int>(i) + c);
  }
  derivatives.by_error = Eigen::MatrixXd(derivatives.by_error(rows, Eigen::all));
  p = Subset(p, which);
}

}  // namespace

std::vector<CalibrationDerivatives> CalibrationDerivativesOf(
    const CrownInput& input, const Capture& stated, const std::vector<CalibrationError>& errors,
    const std::vector<double>& amounts, const CastState& state, const Material& material,
    const std::vector<double>& light_scale, CastOptions options, std::vector<FitPixels>& pixels, Progress& progress) {
  constexpr double kStep = 0.5;  // standard deviations, to either side
  options.shade_scenery = false;
  options.strata = options.gather_strata = kStrataOfMoved;
  std::vector<CalibrationDerivatives> derivatives;
  for (FitPixels& p : pixels) {
    const PhotographSpec& photo = stated.photographs[p.photograph];
    progress.Show("calibration errors", static_cast<double>(derivatives.size()) / static_cast<double>(pixels.size()),
                  photo.name);
    const PhotographCast& here = state.photographs[p.photograph];
    const auto place = [&](const PixelCast& c) { return static_cast<size_t>(c.y) * photo.camera.width + c.x; };
    std::vector<uint8_t> wanted(static_cast<size_t>(photo.camera.width) * photo.camera.height, 0);
    for (int s : p.sources) wanted[place(here.pixels[s])] = 1;
    CalibrationDerivatives of;
    for (size_t e = 0; e < errors.size(); ++e)
      if (std::count(errors[e].photographs.begin(), errors[e].photographs.end(), p.photograph))
        of.errors.push_back(static_cast<int>(e));
    of.by_error.setZero(p.channels() * static_cast<Eigen::Index>(p.pixels.size()),
                        static_cast<Eigen::Index>(of.errors.size()));
    std::vector<uint8_t> kept(p.pixels.size(), 1);
    const auto add = [&](Eigen::Index column, double side, const PhotographCast& there,
                         const std::vector<Spectrum>& values) {
      std::vector<int> at(wanted.size(), -1);
      for (size_t k = 0; k < there.pixels.size(); ++k)
        if (!there.pixels[k].at_silhouette) at[place(there.pixels[k])] = static_cast<int>(k);
      for (size_t i = 0; i < p.pixels.size(); ++i)
        for (const auto& [source, weight] : p.TermsOf(i)) {
          const int k = at[place(here.pixels[p.sources[source]])];
          if (k < 0) kept[i] = 0;
          for (int c = 0; c < p.channels() && k >= 0; ++c)
            of.by_error(p.channels() * static_cast<Eigen::Index>(i) + c, column) +=
                side * weight * values[k][c] / (2 * kStep);
        }
    };
    std::vector<PhotographCast> views;  // in the same light: predicted together
    std::vector<std::pair<Eigen::Index, double>> column_and_side;
    for (size_t e = 0; e < of.errors.size(); ++e)
      for (const double side : {-1.0, 1.0}) {
        const auto column = static_cast<Eigen::Index>(e);
        std::vector<double> amounts_there = amounts;
        amounts_there[of.errors[e]] += side * kStep;
        Capture moved = Moved(stated, errors, amounts_there);
        std::vector<size_t>& lights = moved.photographs[p.photograph].lights;
        const std::optional<size_t> lamp = errors[of.errors[e]].light;
        if (lamp) lights = {*lamp};  // the other lights do not change
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
                       "the stated errors of pose and lights are so large that no pixel is certain to show the object",
                       "Calibrate the pose better, or state a smaller error.");
    derivatives.push_back(std::move(of));
  }
  return derivatives;
}

bool MoveCalibration(const LinearScales& scales, CalibrationState& calibration) {
  constexpr double kNear = 0.3;  // standard deviations over which the model is linear
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
      moved.push_back({errors[e].light ? CalibrationKind::kPlace : CalibrationKind::kPose, errors[e].what});
    moved.back().freedom += 1;
    moved.back().chi2 += amounts[e] * amounts[e];
  }
  return moved;
}

std::vector<MovedCalibration> HowFarScaled(const Capture& capture, const std::vector<FitPixels>& pixels,
                                           const LinearScales& scales) {
  std::vector<MovedCalibration> moved;
  const auto add = [&](CalibrationKind kind, const std::string& what, double stated, double found, double stddev) {
    moved.push_back({kind, what, 1, std::pow((found - stated) / stddev, 2), found / stated - 1});
  };
  int exposures = 0;
  for (const FitPixels& p : pixels) {
    if (p.exposure < exposures) continue;  // exact, or already listed with another photograph
    exposures = p.exposure + 1;
    const PhotographSpec& spec = capture.photographs[p.photograph];
    if (spec.exposure_stddev > 0)
      add(CalibrationKind::kExposure, "the exposure of '" + spec.name + "'", spec.exposure_scale,
          scales.exposure[p.exposure], spec.exposure_stddev);
  }
  const Nuisances nuisances(capture, pixels, {});
  for (const int l : nuisances.lights())
    if (const Light& light = capture.lights[l]; light.intensity_stddev > 0 && !light.scale_is_free)
      add(CalibrationKind::kIntensity, "the intensity of light '" + light.name + "'", light.intensity_scale,
          scales.light[l], light.intensity_stddev);
  return moved;
}

}  // namespace crownfit
