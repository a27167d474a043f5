#include "plan/foresee_photographs.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/linear_algebra.h"
#include "base/text.h"
#include "fit/choose_pixels.h"
#include "fit/image_residuals.h"
#include "fit/profile.h"
#include "scene/cast_photograph.h"

namespace crownfit {
namespace {

constexpr double kZ95 = 1.959963984540054;

/// Every n-th pixel, with as little noise as all of them have together.
FitPixels Thinned(const FitPixels& all) {
  constexpr size_t kMost = 1000;
  const int stride = static_cast<int>((all.pixels.size() + kMost - 1) / kMost);
  std::vector<int> which;
  for (int i = 0; i < static_cast<int>(all.pixels.size()); i += std::max(1, stride)) which.push_back(i);
  FitPixels thinned = Subset(all, which);
  const double share = static_cast<double>(which.size()) / static_cast<double>(std::max<size_t>(1, all.pixels.size()));
  for (Spectrum& s : thinned.stddev) s *= std::sqrt(share);
  return thinned;
}

/// What photographs tell where they agree with the fit; those of several add up.
struct Information {
  Eigen::MatrixXd normal, scatter;  ///< of the noise; of what else model `shader` is off by
};

class Foreseer {
 public:
  Foreseer(const FitProblem& problem, const CrownInput& input, const FitState& at, Progress& progress)
      : problem_(problem), input_(input), at_(at), progress_(progress) {
    cast_options_.threads = problem.options.threads;
    cast_options_.strata = cast_options_.gather_strata = 2;
    idea_.crown = at.cast.crown;
    idea_.thickness_mm = at.cast.thickness_mm;
    idea_.photographs.resize(input.capture.photographs.size() + 1);
  }

  Foresight Run() {
    Foresight result;
    const int n = problem_.free.count();
    if (n == 0) return result;
    Eigen::VectorXd by_prior(n);
    for (int k = 0; k < n; ++k)
      by_prior[k] = !IsTold(k) ? 0.0
                               : std::sqrt(at_.knowledge.Variance(Eigen::RowVectorXd::Unit(n, k))) /
                                     problem_.free.entries[k].prior_stddev;
    by_prior.maxCoeff(&result.weakest);
    const FreeEntry& weakest = problem_.free.entries[result.weakest];
    result.stddev = by_prior[result.weakest] * weakest.prior_stddev;
    if (!IsWeak(weakest, at_.x[result.weakest], result.stddev)) return result;

    Information here;
    if (!IsByWalks()) {
      std::vector<FitPixels> pixels;
      for (const FitPixels& p : at_.pixels) pixels.push_back(Thinned(p));
      here = InformationOf(input_.capture, at_.cast, pixels);
    }
    const std::vector<PhotographIdea> ideas = PhotographIdeas(input_.capture, Centre());
    for (size_t i = 0; i < ideas.size(); ++i) {
      progress_.Show("next photograph", static_cast<double>(i) / static_cast<double>(ideas.size()));
      if (const std::optional<Information> more = InformationOf(ideas[i]))
        result.best.push_back({ideas[i], StddevWith(here, *more, result.weakest)});
    }
    constexpr size_t kMost = 3;
    std::stable_sort(result.best.begin(), result.best.end(),
                     [](const auto& a, const auto& b) { return a.stddev < b.stddev; });
    if (result.best.size() > kMost) result.best.resize(kMost, result.best.front());
    return result;
  }

 private:
  bool IsTold(int k) const { return !IsByWalks() || HasWalkDerivative(problem_.free.entries[k]); }

  bool IsByWalks() const { return at_.knowledge.of_walks.size() > 0; }

  glm::dvec3 Centre() const {
    glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
    for (const glm::dvec3& v : at_.cast.crown->surfaces[0].vertices) low = glm::min(low, v), high = glm::max(high, v);
    return 0.5 * (low + high);
  }

  /// Of an entry, with one more photograph; infinite where it is not seen.
  double StddevWith(const Information& here, const Information& more, int entry) const {
    constexpr double kNothingKnown = 1e3;  // prior widths: wider counts as not seen
    const double inflation = std::max(1.0, at_.knowledge.inflation);
    Eigen::MatrixXd precision =
        IsByWalks() ? Eigen::MatrixXd(at_.knowledge.Precision() + more.normal / inflation) : here.normal + more.normal;
    for (int k = 0; k < problem_.free.count(); ++k)
      precision(k, k) += 1.0 / std::pow(kNothingKnown * problem_.free.entries[k].prior_stddev, 2);
    const Eigen::VectorXd column = SolveSymmetric(precision, Eigen::VectorXd::Unit(precision.rows(), entry));
    double variance = column[entry];
    if (!IsByWalks()) variance = inflation * variance + column.dot((here.scatter + more.scatter) * column);
    const bool seen = column[entry] < 0.5 * std::pow(kNothingKnown * problem_.free.entries[entry].prior_stddev, 2);
    return seen ? std::sqrt(variance) : HUGE_VAL;
  }

  Information InformationOf(const Capture& capture, const CastState& cast, const std::vector<FitPixels>& pixels) const {
    const int n = problem_.free.count();
    Evaluation e =
        ImageResiduals(capture, cast, problem_.free, pixels, {}, {0.0, problem_.options.threads}).Evaluate(at_.x, true);
    for (int k = 0; k < n; ++k)
      if (!IsTold(k)) e.jacobian.col(k).setZero();
    if (!e.finite) return {Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, n)};
    return {e.jacobian.transpose() * e.jacobian, ModelScatter(cast, e, pixels)};
  }

  /// Of one more by itself; nothing when it would not show the object.
  std::optional<Information> InformationOf(const PhotographIdea& idea) {
    Capture capture = WithIdea(input_.capture, idea);
    capture.measurements.clear();  // what they tell is known already
    for (size_t l = 0; l < at_.scales.light.size(); ++l) capture.lights[l].intensity_scale = at_.scales.light[l];
    for (Light& light : capture.lights) light.scale_is_free = false, light.intensity_stddev = 0.0;
    const FitPixels& base = *std::find_if(at_.pixels.begin(), at_.pixels.end(),
                                          [&](const FitPixels& p) { return p.photograph == idea.base; });
    PhotographSpec& spec = capture.photographs.back();
    if (base.exposure >= 0) spec.exposure_scale = at_.scales.exposure[base.exposure];
    const double coarser = Coarsen(spec.camera);
    idea_.photographs.back() =
        CastPhotograph(capture, *idea_.crown, input_.scenery, capture.photographs.size() - 1, cast_options_);
    const FitPixels pixels = PixelsOf(capture, base, coarser);
    if (pixels.pixels.empty()) return std::nullopt;
    return InformationOf(capture, idea_, {pixels});
  }

  /// Makes pictures small enough to foresee quickly; by which factor in either direction.
  static double Coarsen(Camera& camera) {
    constexpr double kMost = 64;
    const double factor = std::max(1.0, std::max(camera.width, camera.height) / kMost);
    camera.width = static_cast<int>(std::ceil(camera.width / factor));
    camera.height = static_cast<int>(std::ceil(camera.height / factor));
    camera.fx /= factor, camera.fy /= factor, camera.cx /= factor, camera.cy /= factor;
    return factor;
  }

  /// The pixels of an idea (the last photograph) as a fit would use them: with the noise of its base's, relative to the
  /// signal and no less than its floor, of as many pixels as the fit would take.
  FitPixels PixelsOf(const Capture& capture, const FitPixels& base, double coarser) const {
    std::vector<double> relative;
    double floor = HUGE_VAL;
    for (size_t i = 0; i < base.pixels.size(); ++i)
      for (int c = 0; c < base.channels(); ++c) {
        relative.push_back(base.stddev[i][c] / std::max(1e-9, base.values[i][c]));
        floor = std::min(floor, base.stddev[i][c]);
      }
    std::nth_element(relative.begin(), relative.begin() + static_cast<long>(relative.size() / 2), relative.end());
    const double median = relative[relative.size() / 2];

    const size_t number = capture.photographs.size() - 1;
    const auto predicted = PredictPixels(capture, idea_, number, MaterialAt(problem_.free, at_.x),
                                         StatedLightScales(capture), problem_.options.threads);
    const double exposure = capture.photographs.back().exposure_scale;
    FitPixels p{number, base.exposure >= 0 ? 0 : -1, {}, {}, {}, {}, {0}, {}, {}};
    const auto& cast = idea_.photographs.back().pixels;
    const double shown = coarser * coarser * static_cast<double>(cast.size());
    const FitOptions& options = problem_.options;
    const size_t at_most = IsByWalks() ? options.max_pixels_by_walks() : options.max_pixels_per_photograph;
    const double used = std::min(shown, static_cast<double>(at_most));
    for (size_t k = 0; k < cast.size(); ++k) {
      if (cast[k].at_silhouette) continue;
      const Spectrum value = exposure * predicted[k];
      p.pixels.push_back(static_cast<int>(k));
      p.values.push_back(value);
      p.stddev.push_back(
          Sqrt((median * median * value * value + floor * floor) * (static_cast<double>(cast.size()) / used)));
      p.terms.push_back({static_cast<int>(p.sources.size()), 1.0f});
      p.sources.push_back(static_cast<int>(k));
      p.first_term.push_back(static_cast<int>(p.terms.size()));
    }
    return Thinned(IsByWalks() ? WithNoiseOfWalks(std::move(p), static_cast<double>(options.paths_per_photograph)) : p);
  }

  const FitProblem& problem_;
  const CrownInput& input_;
  const FitState& at_;
  Progress& progress_;
  CastState idea_;  ///< of the one that is being looked at: the last photograph
  CastOptions cast_options_;
};

}  // namespace

bool Foresight::IsWorthTaking() const {
  constexpr double kNarrower = 0.8, kTells = 1.2;  // of a logarithm: an interval from a hundredth to all of a value
  return !best.empty() && best[0].stddev < std::min(kNarrower * stddev, kTells);
}

Foresight ForeseePhotographs(const FitProblem& problem, const CrownInput& input, const FitState& at,
                             Progress& progress) {
  return Foreseer(problem, input, at, progress).Run();
}

FitPixels WithNoiseOfWalks(FitPixels p, double paths) {
  constexpr double kVariance = 7.0;  // relative, of what one walk brings, on path-traced crowns and discs
  const double relative = kVariance * static_cast<double>(p.pixels.size()) / paths;
  for (size_t i = 0; i < p.pixels.size(); ++i)
    p.stddev[i] = Sqrt(p.stddev[i] * p.stddev[i] + relative * p.values[i] * p.values[i]);
  return p;
}

std::string IntervalInWords(const FreeEntry& entry, double stddev) {
  if (!std::isfinite(stddev)) return "not determined";
  constexpr double kVast = 1000.0;
  const double up = std::exp(kZ95 * stddev), down = 1.0 - kZ95 * stddev;  // as Quantify states intervals
  if (entry.scale != Scale::kLog) return Printed("+-%.2g", kZ95 * stddev);
  if (down > 0)
    return Printed(up > kVast * down ? "more than a factor of %.3g" : "a factor of %.3g", std::min(kVast, up / down));
  return up > kVast ? "unlimited" : Printed("0 to %.3g times the value", up);
}

std::string AdviceIn(const FreeParameters& free, const Foresight& foresight) {
  const FreeEntry& e = free.entries[foresight.weakest];
  const ForeseenPhotograph& first = foresight.best[0];
  return "One more photograph would help most with " + e.name +
         " (95 % interval: " + IntervalInWords(e, foresight.stddev) + "): " + first.idea.words +
         " (95 % interval then: " + IntervalInWords(e, first.stddev) + ")";
}

}  // namespace crownfit
