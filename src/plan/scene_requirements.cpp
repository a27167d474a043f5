#include "plan/scene_requirements.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "base/linear_algebra.h"
#include "base/text.h"
#include "fit/choose_pixels.h"
#include "fit/image_residuals.h"
#include "photo/colour_difference.h"
#include "plan/start_state.h"
#include "scene/cast_photograph.h"
#include "scene/scene_parts.h"

namespace crownfit {
namespace {

/// Leaves parts out of a scene that a fit has cast.
class PartsLeftOut {
 public:
  /// Casts as `at` was cast: the same directions with a part and without it.
  PartsLeftOut(const FitProblem& problem, const CrownInput& input, const FitState& at,
               const LinearisedPrediction& prediction, const CastOptions& cast_options)
      : problem_(problem),
        input_(input),
        at_(at),
        material_(MaterialAt(problem.free, at.x)),
        cast_options_(cast_options) {
    cast_options_.threads = problem.options.threads;
    for (const FitPixels& p : at.pixels)
      with_.push_back(Predict(input.capture, at.cast, p.photograph, material_, at.scales.light));
    const Evaluation e = AgreeingEvaluation(problem, at, at.pixels, prediction, at.x);
    const int n = problem.free.count();
    jacobian_ = e.finite ? Eigen::MatrixXd(e.jacobian) : Eigen::MatrixXd::Zero(e.residuals.size(), n);
    Eigen::MatrixXd precision = jacobian_.transpose() * jacobian_;
    const double held = problem.options.use_priors ? 1.0 : 1e-6;  // what nothing tells stays finite
    for (int k = 0; k < n; ++k) precision(k, k) += held * std::pow(problem.free.entries[k].prior_stddev, -2.0);
    if (n > 0) covariance_ = InverseOfSymmetric(precision);
  }

  /// Nothing when no photograph has it.
  std::optional<SceneRequirement> Without(const ScenePart& part) const {
    SceneRequirement r;
    r.what = part.what;
    Material changed = material_;
    if (part.is_film) changed.surface[Quantity::kWetness].fill(0.0);
    for (const Quantity q : {Quantity::kIor, Quantity::kAsymmetry, Quantity::kIsotropicFraction,
                             Quantity::kReducedScattering, Quantity::kAbsorption})
      if (part.is_step) changed.layers[1][q] = changed.layers[0][q];
    std::vector<double> light = at_.scales.light;
    for (const size_t l : part.lights) light[l] = 0.0;
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(problem_.free.count());
    Eigen::Index row = 0;
    for (size_t g = 0; g < at_.pixels.size(); ++g) {
      const FitPixels& p = at_.pixels[g];
      Capture without = input_.capture;
      PhotographSpec& spec = without.photographs[p.photograph];
      if (part.leave_out(spec)) {
        CastState again;
        if (part.is_solid) Cast(without, p.photograph, again = at_.cast);
        const CastState& cast = part.is_solid ? again : at_.cast;
        if (part.is_solid && ShowsMore(p.photograph, cast)) r.hides = spec.name;
        const double de00 = Compare(g, spec, cast, Predict(without, cast, p.photograph, changed, light), row, pull);
        if (de00 >= r.de00) r.de00 = de00, r.photograph = spec.name;
      }
      row += p.channels() * static_cast<Eigen::Index>(p.pixels.size());
    }
    if (r.photograph.empty()) return std::nullopt;
    if (pull.size() > 0) {
      Eigen::Index most;
      r.shift = (covariance_ * pull).cwiseQuotient(covariance_.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff(&most);
      r.parameter = problem_.free.entries[most].name;
    }
    r.is_needed = !(r.de00 <= kSeenDe00 && r.shift <= kToldShift);
    return r;
  }

 private:
  void Cast(const Capture& capture, size_t photograph, CastState& cast) const {
    cast.photographs[photograph] = CastPhotograph(capture, *cast.crown, input_.scenery, photograph, cast_options_);
  }
  std::vector<Spectrum> Predict(const Capture& capture, const CastState& cast, size_t photograph,
                                const Material& material, const std::vector<double>& light) const {
    return PredictPixels(capture, cast, photograph, material, light, problem_.options.threads);
  }

  /// Whether pixels that would count as the object show something else.
  bool ShowsMore(size_t photograph, const CastState& without) const {
    if (photograph >= input_.photographs.size()) return false;
    const auto count = [&](const CastState& cast) {
      return ComparablePixels(input_.capture.photographs[photograph], cast.photographs[photograph],
                              input_.photographs[photograph], 0)
          .size();
    };
    return count(without) > count(at_.cast);
  }

  /// The mean difference of a photograph's fitted pixels (a median would not see what changes less than half of them),
  /// and how what changes there pulls at the free entries.
  double Compare(size_t g, const PhotographSpec& spec, const CastState& changed, const std::vector<Spectrum>& values,
                 Eigen::Index row, Eigen::VectorXd& pull) const {
    const FitPixels& p = at_.pixels[g];
    const int width = spec.camera.width, height = spec.camera.height;
    const double exposure = p.exposure >= 0 ? at_.scales.exposure[p.exposure] : spec.exposure_scale;
    Image before(width, height, p.channels());  // without scenery a photograph may show more of the object
    std::vector<int> pixel_at(static_cast<size_t>(width) * height, -1);
    const auto& cast_before = at_.cast.photographs[p.photograph].pixels;
    for (size_t i = 0; i < p.pixels.size(); ++i) {
      const PixelCast& pixel = cast_before[p.pixels[i]];
      pixel_at[static_cast<size_t>(pixel.y) * width + pixel.x] = static_cast<int>(i);
    }
    Image after = before;
    std::vector<uint8_t> compared(pixel_at.size(), 0);
    const auto& cast_after = changed.photographs[p.photograph].pixels;
    for (size_t k = 0; k < cast_after.size(); ++k) {
      const int x = cast_after[k].x, y = cast_after[k].y, i = pixel_at[static_cast<size_t>(y) * width + x];
      if (i < 0) continue;
      compared[static_cast<size_t>(y) * width + x] = 1;
      const Spectrum& was = with_[g][p.pixels[i]];
      for (int c = 0; c < p.channels(); ++c) {
        before.at(x, y, c) = static_cast<float>(was[c]);
        after.at(x, y, c) = static_cast<float>(values[k][c]);
        pull +=
            exposure * (values[k][c] - was[c]) / p.stddev[i][c] * jacobian_.row(row + p.channels() * i + c).transpose();
      }
    }
    return ComparePictures(before, after, compared, spec.rgb_from_sensor).mean;
  }

  const FitProblem& problem_;
  const CrownInput& input_;
  const FitState& at_;
  Material material_;
  CastOptions cast_options_;
  std::vector<std::vector<Spectrum>> with_;
  Eigen::MatrixXd jacobian_, covariance_;
};

[[noreturn]] void RefuseToLeaveOut(const std::string& name, const std::string& why, const Capture& capture) {
  std::string known;
  for (const ScenePart& part : PartsOf(capture)) known += (known.empty() ? "" : ", ") + part.name;
  throw InputError(
      capture.file, "--leave-out", name + " can't be left out: " + why,
      "The parts of the scene are " + known + ". `unneeded` leaves out all parts that the fit does not need.");
}

constexpr const char* kUnneeded = "unneeded";

std::vector<ScenePart> AskedFor(const FitOptions& options, const Capture& capture, const PartsLeftOut& left_out) {
  const std::vector<ScenePart> parts = PartsOf(capture);
  std::vector<ScenePart> asked;
  for (const std::string& name : options.leave_out) {
    if (name == kUnneeded || PartNamed(name, asked)) continue;
    const ScenePart* part = PartNamed(name, parts);
    const auto r = part ? left_out.Without(*part) : std::nullopt;
    if (!r) RefuseToLeaveOut(name, "no fitted photograph has this part and could do without it", capture);
    if (!r->hides.empty())
      RefuseToLeaveOut(
          name, "it hides part of the object in '" + r->hides + "', and would then be fitted as the object", capture);
    asked.push_back(*part);
    for (const PhotographSpec& p : Without(AllOf(asked), capture).photographs)
      if (p.lights.empty()) RefuseToLeaveOut(name, "'" + p.name + "' would be left without light", capture);
  }
  return asked;
}

/// Not even together; beside `others`, which are left out in any case.
std::vector<ScenePart> NotNeeded(const FitOptions& options, const Capture& capture,
                                 const std::vector<ScenePart>& others, const PartsLeftOut& left_out,
                                 Progress& progress) {
  std::vector<std::pair<double, ScenePart>> by_shift;
  for (const ScenePart& part : PartsOf(capture)) {
    progress.Show("scene requirements", 0.5, part.what);
    // Beside walks tiles and scenery tell whether the light is as stated; a freed film is a question to the fit.
    const bool asks = part.is_film && !capture.surface[static_cast<size_t>(Quantity::kWetness)].fixed;
    if (asks || (part.is_solid && options.model != Model::kShader) || PartNamed(part.name, others)) continue;
    const auto r = left_out.Without(part);
    if (r && !r->is_needed && r->hides.empty()) by_shift.emplace_back(r->shift, part);
  }
  std::ranges::sort(by_shift, {}, &std::pair<double, ScenePart>::first);
  std::vector<ScenePart> parts;
  for (const auto& [shift, part] : by_shift) parts.push_back(part);
  while (!parts.empty() && left_out.Without(AllOf(parts))->is_needed) parts.pop_back();
  return parts;
}

}  // namespace

std::vector<SceneRequirement> SceneRequirements(const FitProblem& problem, const CrownInput& input, const FitState& at,
                                                const LinearisedPrediction& prediction, const FitSeconds& seconds,
                                                const Coarseness& coarse, Progress& progress) {
  const PartsLeftOut left_out(problem, input, at, prediction, coarse.cast);
  std::vector<ScenePart> parts = PartsOf(input.capture);
  if (const auto step = StepBetweenLayers(input.capture)) parts.push_back(*step);
  std::vector<SceneRequirement> requirements;
  for (size_t i = 0; i < parts.size(); ++i) {
    progress.Show("scene requirements", static_cast<double>(i) / static_cast<double>(parts.size()), parts[i].what);
    auto r = left_out.Without(parts[i]);
    if (!r) continue;
    const FitSeconds less = seconds.Of(Without(parts[i], problem.capture), at);
    const auto walks = static_cast<double>(problem.options.paths_per_photograph);
    r->shader_s = seconds.ByShader() - less.ByShader();
    r->path_s = seconds.ByWalks(walks) - less.ByWalks(walks);
    requirements.push_back(*r);
  }
  return requirements;
}

std::vector<LeftOutPart> LeaveOut(const FitOptions& options, CrownInput& input, Progress& progress) {
  std::vector<LeftOutPart> said;
  if (options.leave_out.empty()) return said;
  CrownInput seen = input;
  const Coarseness coarse = Coarsen(seen);
  const FreeParameters free = FreeParametersOf(seen.capture);
  const std::vector<CalibrationError> no_errors;
  const FitProblem problem{seen.capture, free, no_errors, options};
  LinearisedPrediction prediction;
  const FitState at = StateAtStart(problem, seen, prediction, progress, coarse);
  const PartsLeftOut left_out(problem, seen, at, prediction, coarse.cast);
  std::vector<ScenePart> parts = AskedFor(options, input.capture, left_out);
  for (const ScenePart& part : parts) said.push_back({part.name, {FindingKind::kPartLeftOut, {}, {part.what}}});
  if (std::count(options.leave_out.begin(), options.leave_out.end(), kUnneeded))
    for (const ScenePart& part : NotNeeded(options, input.capture, parts, left_out, progress)) {
      const SceneRequirement r = *left_out.Without(part);
      said.push_back({part.name, {FindingKind::kPartLeftOut, {r.de00, r.shift}, {part.what}}});
      parts.push_back(part);
    }
  input.capture = Without(AllOf(parts), input.capture);
  return said;
}

}  // namespace crownfit
