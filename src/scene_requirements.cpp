#include "scene_requirements.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "base/error.h"
#include "base/linear_algebra.h"
#include "base/text.h"
#include "check_capture.h"
#include "fit/image_residuals.h"
#include "report/colour_difference.h"

namespace crownfit {
namespace {

/// One part of the scene, and how to leave it out.
struct Part {
  std::string what;
  std::function<bool(PhotographSpec&)> leave_out;  ///< false: this photograph does not have it
  bool casts_again = true;
  std::optional<size_t> light = {};  ///< that is left out: as if it were off
  bool is_film = false;              ///< of water, which is everywhere
};

std::vector<Part> PartsOf(const Capture& capture) {
  std::vector<Part> parts;
  for (size_t l = 0; l < capture.lights.size(); ++l)
    parts.push_back(
        {"light '" + capture.lights[l].name + "'",
         [l](PhotographSpec& p) { return p.lights.size() > 1 && std::count(p.lights.begin(), p.lights.end(), l) > 0; },
         false, l});
  for (size_t b = 0; b < capture.backings.size(); ++b)
    parts.push_back({"tile '" + capture.backings[b].name + "'", [b](PhotographSpec& p) {
                       const bool has = p.backing == b;
                       if (has) p.backing.reset();
                       return has;
                     }});
  for (size_t s = 0; s < capture.scenery.size(); ++s)
    parts.push_back(
        {"scenery '" + capture.scenery[s].name + "'", [s](PhotographSpec& p) { return std::erase(p.scenery, s) > 0; }});
  parts.push_back({"the surface's reflection",
                   [](PhotographSpec& p) {
                     const bool has = p.polarisation != Polarisation::kCross;
                     if (has) p.polarisation = Polarisation::kCross, p.polarisation_memory_events = 0;
                     return has;
                   },
                   false});
  if (const ParameterSpec& wetness = capture.surface[static_cast<size_t>(Quantity::kWetness)];
      !wetness.fixed || wetness.value[0] > 0)
    parts.push_back({"the film of water", [](PhotographSpec&) { return true; }, false, {}, true});
  return parts;
}

/// "tile:black" for "tile 'black'": what a cell of a batch's table can hold.
std::string WithoutQuotes(std::string what) {
  if (const size_t quote = what.find(" '"); quote != std::string::npos && what.back() == '\'') {
    what.replace(quote, 2, ":");
    what.pop_back();
  }
  return what;
}

/// From the photographs that are fitted; others show what there is.
Capture Without(const Part& part, Capture capture) {
  for (PhotographSpec& p : capture.photographs)
    if (!p.is_holdout && part.leave_out(p) && part.light) std::erase(p.lights, *part.light);
  if (part.is_film) {
    ParameterSpec& wetness = capture.surface[static_cast<size_t>(Quantity::kWetness)];
    wetness.value.fill(0.0);
    wetness.fixed = true;
  }
  return capture;
}

/// Those that some fitted photograph has, and could do without.
std::vector<Part> PartsOfFitted(const Capture& capture) {
  std::vector<Part> parts = PartsOf(capture);
  std::erase_if(parts, [&](const Part& part) {
    return std::none_of(capture.photographs.begin(), capture.photographs.end(),
                        [&](PhotographSpec p) { return !p.is_holdout && part.leave_out(p); });
  });
  return parts;
}

/// As `crownfit check` says it, or as "tile:black". Throws InputError.
Part PartNamed(const std::string& name, const Capture& capture) {
  std::string known;
  for (const Part& part : PartsOfFitted(capture)) {
    if (part.what == name || WithoutQuotes(part.what) == name) return part;
    known += (known.empty() ? "" : ", ") + WithoutQuotes(part.what);
  }
  throw InputError(capture.file, "--leave-out", "no photograph that is fitted has, or could do without, " + name,
                   "Possible are " + known + "; `unneeded` leaves out what the fit does not need.");
}

/// Leaves parts out of a scene that a fit has cast.
class PartsLeftOut {
 public:
  PartsLeftOut(const FitProblem& problem, const CrownInput& input, const FitState& at)
      : problem_(problem), input_(input), at_(at), material_(MaterialAt(problem.free, at.x)), here_(at.cast) {
    cast_options_.threads = problem.options.threads;
    cast_options_.strata = cast_options_.gather_strata = 3;  // the same directions with a part and without it
    for (const FitPixels& p : at.pixels) {
      Cast(input.capture, p.photograph, here_);
      with_.push_back(Predict(input.capture, here_, p.photograph, material_, at.scales.light));
    }
    const Evaluation e =
        ImageResiduals(input.capture, here_, problem.free, at.pixels, {}, {0.0, problem.options.threads})
            .Evaluate(at.x, true);
    const int n = problem.free.count();
    jacobian_ = e.finite ? Eigen::MatrixXd(e.jacobian) : Eigen::MatrixXd::Zero(e.residuals.size(), n);
    Eigen::MatrixXd precision = jacobian_.transpose() * jacobian_;
    for (int k = 0; k < n; ++k) precision(k, k) += std::pow(problem.free.entries[k].prior_stddev, -2.0);
    if (n > 0) covariance_ = InverseOfSymmetric(precision);
  }

  /// Nothing when no photograph has it.
  std::optional<SceneRequirement> Without(const Part& part) const {
    SceneRequirement r;
    r.what = part.what;
    Material changed = material_;
    if (part.is_film) changed.surface[Quantity::kWetness].fill(0.0);
    std::vector<double> light = at_.scales.light;
    if (part.light) light[*part.light] = 0.0;
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(problem_.free.count());
    Eigen::Index row = 0;
    for (size_t g = 0; g < at_.pixels.size(); ++g) {
      const FitPixels& p = at_.pixels[g];
      Capture without = input_.capture;
      PhotographSpec& spec = without.photographs[p.photograph];
      if (part.leave_out(spec)) {
        CastState again;
        if (part.casts_again) Cast(without, p.photograph, again = here_);
        const CastState& cast = part.casts_again ? again : here_;
        const double de00 = Compare(g, spec, cast, Predict(without, cast, p.photograph, changed, light), row, pull);
        if (de00 >= r.de00) r.de00 = de00, r.photograph = spec.name;
      }
      row += kChannels * static_cast<Eigen::Index>(p.pixels.size());
    }
    if (r.photograph.empty()) return std::nullopt;
    if (pull.size() > 0) {
      Eigen::Index most;
      r.shift = (covariance_ * pull).cwiseQuotient(covariance_.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff(&most);
      r.parameter = problem_.free.entries[most].name;
    }
    r.is_needed = r.de00 > kSeenDe00 || r.shift > kToldShift;
    return r;
  }

 private:
  void Cast(const Capture& capture, size_t photograph, CastState& cast) const {
    cast.photographs[photograph] = CastPhotograph(capture, *cast.crown, input_.scenery, photograph, cast_options_);
  }
  std::vector<glm::dvec3> Predict(const Capture& capture, const CastState& cast, size_t photograph,
                                  const Material& material, const std::vector<double>& light) const {
    return PredictPixels(capture, cast, photograph, material, light, problem_.options.threads);
  }

  /// The median difference of a photograph's fitted pixels, and how what changes there pulls at the free entries.
  double Compare(size_t g, const PhotographSpec& spec, const CastState& changed, const std::vector<glm::dvec3>& values,
                 Eigen::Index row, Eigen::VectorXd& pull) const {
    const FitPixels& p = at_.pixels[g];
    const int width = spec.camera.width, height = spec.camera.height;
    const double exposure = p.exposure >= 0 ? at_.scales.exposure[p.exposure] : spec.exposure_scale;
    Image before(width, height, kChannels);  // without scenery a photograph may show more of the object
    std::vector<int> pixel_at(static_cast<size_t>(width) * height, -1);
    const auto& cast_before = here_.photographs[p.photograph].pixels;
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
      const glm::dvec3& was = with_[g][p.pixels[i]];
      for (int c = 0; c < kChannels; ++c) {
        before.at(x, y, c) = static_cast<float>(was[c]);
        after.at(x, y, c) = static_cast<float>(values[k][c]);
        pull +=
            exposure * (values[k][c] - was[c]) / p.stddev[i][c] * jacobian_.row(row + kChannels * i + c).transpose();
      }
    }
    return ComparePictures(before, after, compared, spec.rgb_from_sensor).median;
  }

  const FitProblem& problem_;
  const CrownInput& input_;
  const FitState& at_;
  Material material_;
  CastState here_;
  CastOptions cast_options_;
  std::vector<std::vector<glm::dvec3>> with_;
  Eigen::MatrixXd jacobian_, covariance_;
};

}  // namespace

std::vector<SceneRequirement> SceneRequirements(const FitProblem& problem, const CrownInput& input, const FitState& at,
                                                const FitSeconds* seconds, Progress& progress) {
  const PartsLeftOut left_out(problem, input, at);
  const std::vector<Part> parts = PartsOf(input.capture);
  std::vector<SceneRequirement> requirements;
  for (size_t i = 0; i < parts.size(); ++i) {
    progress.Show("what the scene requires", static_cast<double>(i) / static_cast<double>(parts.size()), parts[i].what);
    auto r = left_out.Without(parts[i]);
    if (!r) continue;
    if (seconds) {
      const FitSeconds less = seconds->Of(Without(parts[i], problem.capture), at);
      const auto walks = static_cast<double>(problem.options.paths_per_photograph);
      r->shader_s = seconds->ByShader() - less.ByShader();
      r->path_s = seconds->ByWalks(walks) - less.ByWalks(walks);
    }
    requirements.push_back(*r);
  }
  return requirements;
}

std::vector<std::string> LeaveOut(const FitOptions& options, CrownInput& input, Progress& progress) {
  constexpr const char* kUnneeded = "unneeded";
  std::vector<std::string> sentences;
  for (const std::string& name : options.leave_out) {
    if (name == kUnneeded) continue;
    input.capture = Without(PartNamed(name, input.capture), input.capture);
    sentences.push_back("Left out of the scene: " + name + ", as was asked for.");
  }
  if (!std::count(options.leave_out.begin(), options.leave_out.end(), kUnneeded)) return sentences;
  const FreeParameters free = FreeParametersOf(input.capture);
  const std::vector<CalibrationError> no_errors;
  const FitProblem problem{input.capture, free, no_errors, options};
  Evaluation ignored;
  const FitState at = StateAtStart(problem, input, ignored, progress);
  std::vector<SceneRequirement> least_first = SceneRequirements(problem, input, at, nullptr, progress);
  std::ranges::sort(least_first, {}, &SceneRequirement::shift);
  double de00 = 0, shift = 0;
  for (const SceneRequirement& r : least_first) {
    if (de00 + r.de00 > kSeenDe00 || shift + r.shift > kToldShift) continue;
    de00 += r.de00, shift += r.shift;
    input.capture = Without(PartNamed(r.what, input.capture), input.capture);
    sentences.push_back("Left out of the scene as not needed: " + r.what + " (changes the picture by CIEDE2000 " +
                        Number(r.de00, 2) + ", values by " + Number(r.shift, 2) + " standard deviations at most).");
  }
  return sentences;
}

}  // namespace crownfit
