#include "fit_path/walk_unknowns.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/linear_algebra.h"
#include "capture/capture.h"
#include "fit/gaussian_information.h"
#include "path/path_derivatives.h"

namespace crownfit {

WalkUnknowns::WalkUnknowns(const FitProblem& problem, FitState& at) : problem_(problem), at_(at) {
  const Nuisances nuisances(problem.capture, at.pixels, at.calibration);
  stated_ = nuisances.Stated();
  material_ = problem.free.count();
  exposures_ = static_cast<int>(stated_.exposure.size());
  errors_ = static_cast<int>(problem.errors.size());
  lights_ = nuisances.lights();
  first_photograph_.resize(exposures_);
  for (auto p = at.pixels.rbegin(); p != at.pixels.rend(); ++p)
    if (p->exposure >= 0) first_photograph_[p->exposure] = p->photograph;
  untold_ = HeldByWalks(problem.capture, problem.free.entries);
  for (int e = 0; e < exposures_; ++e)
    if (const double stddev = problem.capture.photographs[first_photograph_[e]].exposure_stddev; stddev > 0)
      statements_.push_back({CalibrationKind::kExposure, exposure(e), stated_.exposure[e], stddev});
  for (size_t l = 0; l < lights_.size(); ++l)
    if (const Light& spec = problem.capture.lights[lights_[l]]; !spec.scale_is_free)
      statements_.push_back({CalibrationKind::kIntensity, light(l), stated_.light[lights_[l]], spec.intensity_stddev});
  for (int e = 0; e < errors_; ++e)
    statements_.push_back(
        {problem.errors[e].light ? CalibrationKind::kPlace : CalibrationKind::kPose, error(e), 0.0, 1.0});
  at_.scales.calibration.assign(problem.errors.size(), 0.0);
}

int WalkUnknowns::EntryOf(const DerivativeParameter& p) const {
  const size_t layer = p.layer < problem_.capture.layers.size() ? p.layer : kSurfaceOwner;
  const auto& entries = problem_.free.entries;
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const FreeEntry& e) { return e.layer == layer && e.quantity == p.quantity; });
  return found == entries.end() ? -1 : static_cast<int>(found - entries.begin());
}

double WalkUnknowns::InItsScale(int entry, double value) const {
  const FreeEntry& e = problem_.free.entries[entry];
  return std::clamp(e.scale == Scale::kLog ? std::log(value) : value, e.low, e.high);
}

Eigen::VectorXd WalkUnknowns::Here() const {
  Eigen::VectorXd here(count());
  here.head(material_) = at_.x;
  for (int e = 0; e < exposures_; ++e) here[exposure(e)] = at_.scales.exposure[e];
  for (size_t l = 0; l < lights_.size(); ++l) here[light(l)] = at_.scales.light[lights_[l]];
  for (int e = 0; e < errors_; ++e) here[error(e)] = at_.calibration.amounts[e];
  return here;
}

Eigen::VectorXd WalkUnknowns::Stated() const {
  Eigen::VectorXd stated = Eigen::VectorXd::Zero(count());
  stated.head(material_) = StartVector(problem_.free);
  for (int e = 0; e < exposures_; ++e) stated[exposure(e)] = stated_.exposure[e];
  for (size_t l = 0; l < lights_.size(); ++l) stated[light(l)] = stated_.light[lights_[l]];
  return stated;
}

LinearScales WalkUnknowns::ScalesOf(const Eigen::VectorXd& unknowns) const {
  LinearScales scales{std::vector<double>(exposures_), std::vector<double>(problem_.capture.lights.size(), 0.0),
                      std::vector<double>(errors_)};
  for (int e = 0; e < exposures_; ++e) scales.exposure[e] = unknowns[exposure(e)];
  for (size_t l = 0; l < lights_.size(); ++l) scales.light[lights_[l]] = unknowns[light(l)];
  for (int e = 0; e < errors_; ++e) scales.calibration[e] = unknowns[error(e)];
  return scales;
}

void WalkUnknowns::GoTo(const Eigen::VectorXd& there) {
  constexpr double kDark = 1e-9;
  at_.x = there.head(material_);
  for (int e = 0; e < exposures_; ++e) at_.scales.exposure[e] = std::max(kDark, there[exposure(e)]);
  for (size_t l = 0; l < lights_.size(); ++l) at_.scales.light[lights_[l]] = std::max(kDark, there[light(l)]);
  for (int e = 0; e < errors_; ++e) at_.calibration.amounts[e] = there[error(e)];
}

void WalkUnknowns::ForgetCalibration() {
  Eigen::VectorXd back = Here();
  for (const Statement& s : statements_) back[s.unknown] = s.value;
  GoTo(back);
}

double WalkUnknowns::CalibrationCost() const {
  const auto [precision, pull] = Prior(1.0, From::kPhotographs);
  const Eigen::VectorXd wants = pull.tail(nuisances());
  return wants.cwiseAbs2().cwiseQuotient(precision.diagonal().tail(nuisances())).sum();
}

/// Along each direction in which statements move independently, in units of their errors as taken now: the square of
/// how far they moved, over its mean `told` where errors are as taken; were those f times as large, f^2 told + 1 -
/// told.
WalkUnknowns::Contradiction WalkUnknowns::ContradictionOf(CalibrationKind kind, const Eigen::MatrixXd& covariance,
                                                          const Eigen::MatrixXd& of_walks) const {
  constexpr double kLeastTold = 0.1, kByChance = 1e-3;
  const Eigen::VectorXd here = Here();
  std::vector<int> of_kind;
  std::vector<double> moved_by, sharp;
  for (const Statement& s : statements_) {
    if (s.kind != kind) continue;
    of_kind.push_back(s.unknown);
    sharp.push_back(1.0 / StddevOf(s));
    moved_by.push_back((here[s.unknown] - s.value) / StddevOf(s));
  }
  Contradiction c;
  const auto n = static_cast<Eigen::Index>(of_kind.size());
  if (n == 0) return c;
  const auto sharpness = Eigen::Map<const Eigen::VectorXd>(sharp.data(), n).asDiagonal();
  // What photographs do not tell stays where it is stated; what walks add is noise here, and no knowledge.
  const Eigen::MatrixXd left = (covariance - 2.0 * of_walks)(of_kind, of_kind);
  const auto [told, directions] = EigenOfSymmetric(Eigen::MatrixXd::Identity(n, n) - sharpness * left * sharpness);
  const Eigen::VectorXd moved = directions.transpose() * Eigen::Map<const Eigen::VectorXd>(moved_by.data(), n);
  double chi2 = 0, all_told = 0;
  int freedom = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (told[i] < kLeastTold) continue;
    chi2 += moved[i] * moved[i] / told[i];
    all_told += std::min(1.0, told[i]);
    ++freedom;
  }
  if (freedom == 0) return c;
  c.chi2_over_unlikely = chi2 / UnlikelyChi2(freedom, kByChance);
  c.shown = std::sqrt(std::max(0.0, chi2 - freedom + all_told) / all_told);
  return c;
}

bool WalkUnknowns::WidenStatedErrors(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& of_walks) {
  constexpr double kChange = 1.2;
  Contradiction worst{1.0};  // of the kinds that were taken as stated: one at a time, as what is wrong moves others
  std::optional<CalibrationKind> next;
  bool changed = false;
  for (const CalibrationKind kind : kCalibrationKinds) {
    const Contradiction c = ContradictionOf(kind, covariance, of_walks);
    double& inflation = at_.inflation[static_cast<size_t>(kind)];
    if (inflation == 1) {
      if (c.chi2_over_unlikely > worst.chi2_over_unlikely) worst = c, next = kind;
      continue;
    }
    const double shown = std::clamp(inflation * c.shown, 1.0, kMostInflated);
    if (shown < kChange * inflation && inflation < kChange * shown) continue;
    inflation = shown;
    changed = true;
  }
  if (changed || !next) return changed;
  at_.inflation[static_cast<size_t>(*next)] = std::min(worst.shown, kMostInflated);
  return true;
}

double WalkUnknowns::ExposureOf(const FitPixels& p) const {
  return p.exposure < 0 ? problem_.capture.photographs[p.photograph].exposure_scale : at_.scales.exposure[p.exposure];
}

WalkedStep::Prior WalkUnknowns::Prior(double reach, From from) const {
  constexpr double kFree = 1e-12;
  WalkedStep::Prior prior{kFree * Eigen::MatrixXd::Identity(count(), count()), Eigen::VectorXd::Zero(count())};
  const auto want = [&](int k, double stddev, double from_here) {
    prior.precision(k, k) += 1.0 / (stddev * stddev);
    prior.pull[k] += from_here / (stddev * stddev);
  };
  for (int k = 0; k < material_; ++k) {
    const FreeEntry& e = problem_.free.entries[k];
    const double of_range = (e.high - e.low) / std::sqrt(12.0);  // where nothing in it is likelier
    want(k, std::min(of_range, reach * (e.scale == Scale::kLog ? 1.0 : e.prior_stddev)), 0.0);
    if (from == From::kAll && problem_.options.use_priors) want(k, e.prior_stddev, e.prior_mean - at_.x[k]);
  }
  if (const GaussianInformation& others = problem_.others; from == From::kAll && !others.names.empty()) {
    prior.precision.topLeftCorner(material_, material_) += others.precision;
    prior.pull.head(material_) += others.weighted_mean - others.precision * at_.x;
  }
  const Eigen::VectorXd here = Here();
  for (const Statement& s : statements_) want(s.unknown, StddevOf(s), s.value - here[s.unknown]);
  return prior;
}

WalkedStep::Prior WalkUnknowns::RangesAlone() const {
  constexpr double kNothingKnown = 3.0;
  return Prior(kNothingKnown, From::kPhotographs);
}

Eigen::VectorXd WalkUnknowns::Bounded(const WalkedStep& step, const WalkedStep::Prior& prior, WalkedStep::Noise noise,
                                      WalkedStep::Solution& s) const {
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(count());
  std::vector<int> held = untold_;
  for (const Statement& known : statements_)
    if (noise == WalkedStep::Noise::kLeft && known.kind != CalibrationKind::kPose) held.push_back(known.unknown);
  for (bool again = true; again;) {
    again = false;
    s = step.Solve(prior, held, noise);
    for (int k = 0; k < material_; ++k) {
      if (std::count(held.begin(), held.end(), k)) continue;
      const FreeEntry& e = problem_.free.entries[k];
      moved[k] = std::clamp(s.step[k], e.low - at_.x[k], e.high - at_.x[k]);
      if (moved[k] == s.step[k]) continue;
      held.push_back(k);
      again = true;
    }
  }
  moved.tail(nuisances()) = s.step.tail(nuisances());
  return moved;
}

double WalkUnknowns::LongestLogarithm(const Eigen::VectorXd& step) const {
  double longest = 0;
  for (int k = 0; k < material_; ++k)
    if (problem_.free.entries[k].scale == Scale::kLog) longest = std::max(longest, std::abs(step[k]));
  return longest;
}

WalkUnknowns::ShortStep WalkUnknowns::Shortened(const Eigen::VectorXd& whole, const Eigen::MatrixXd& covariance,
                                                double longest) const {
  const auto is_more_absorption = [&](int k, double by) {
    return by > 0 && problem_.free.entries[k].quantity == Quantity::kAbsorption;
  };
  const auto over = [&](int k, double by) {  // the furthest it may go
    if (problem_.free.entries[k].scale != Scale::kLog) return 0.0;
    return std::abs(by) / (is_more_absorption(k, by) ? std::expm1(2.0 * longest) : longest);
  };
  ShortStep made{whole, {}};
  std::vector<double> back;  // per entry that is cut
  while (true) {
    int most = -1;
    for (int k = 0; k < material_; ++k)
      if (over(k, made.step[k]) > (most < 0 ? 1.0 : over(most, made.step[most])) &&
          !std::count(made.cut.begin(), made.cut.end(), k))
        most = k;
    if (most < 0) break;
    made.cut.push_back(most);
    back.push_back(made.step[most] / over(most, made.step[most]) - whole[most]);
    made.step =
        whole + covariance(Eigen::all, made.cut) *
                    SolveSymmetric(covariance(made.cut, made.cut),
                                   Eigen::Map<Eigen::VectorXd>(back.data(), static_cast<Eigen::Index>(back.size())))
                        .col(0);
  }
  for (int k = 0; k < material_; ++k) {
    const FreeEntry& e = problem_.free.entries[k];
    if (e.scale == Scale::kLog && is_more_absorption(k, made.step[k])) made.step[k] = std::log1p(made.step[k]);
    made.step[k] = std::clamp(made.step[k], e.low - at_.x[k], e.high - at_.x[k]);
  }
  return made;
}

SlopeChain WalkUnknowns::Chain() const {
  return [this, material = MaterialAt(problem_.free, at_.x)](const DerivativeParameter& p,
                                                             int channel) -> Eigen::RowVectorXd {
    if (!IsFree(p)) return {};
    const size_t layer = p.layer < material.layers.size() ? p.layer : kSurfaceOwner;
    const double value = (layer == kSurfaceOwner ? material.surface : material.layers[layer])[p.quantity][channel];
    return ValueGradient(problem_.free, at_.x, layer, p.quantity, channel) /
           (IsDifferentiatedByLogarithm(p.quantity) ? value : 1.0);
  };
}

WalkUnknowns::Slopes::Slopes(const WalkUnknowns& unknowns, size_t number, const Capture& moved,
                             const Material& material)
    : u_(unknowns), p_(unknowns.at_.pixels[number]), exposure_(unknowns.ExposureOf(p_)) {
  if (u_.errors_ > 0) calibration_ = &u_.at_.calibration.derivatives[number];
  if (u_.errors_ == 0 && u_.lights_.empty()) return;
  const auto predict = [&](const std::vector<double>& scale) {
    shader_.push_back(PredictPixels(moved, u_.at_.cast, p_.photograph, material, scale, u_.problem_.options.threads));
  };
  predict(u_.at_.scales.light);
  for (const int l : u_.lights_) {
    std::vector<double> alone(u_.at_.scales.light.size(), 0.0);
    alone[l] = 1.0;
    predict(alone);
  }
}

void WalkUnknowns::Slopes::AddTo(WalkedRows::Rows& by_nuisances, size_t pixel,
                                 const std::vector<Spectrum>& sharp) const {
  constexpr double kMostScale = 4.0, kDark = 1e-12;
  Spectrum sum = p_.SceneryAt(pixel), of_shader;
  std::vector<Spectrum> of_light(u_.lights_.size());
  for (const auto& [source, share] : p_.TermsOf(pixel)) {
    const double weight = share;
    const int k = p_.sources[source];
    sum += weight * sharp[source];
    if (shader_.empty()) continue;
    of_shader += weight * shader_[0][k];
    for (size_t l = 0; l < of_light.size(); ++l) of_light[l] += weight * shader_[l + 1][k];
  }
  for (int c = 0; c < p_.channels(); ++c) {
    const auto by = [&](int unknown) -> double& { return by_nuisances(c, unknown - u_.material_); };
    if (p_.exposure >= 0) by(u_.exposure(p_.exposure)) += std::as_const(sum)[c];
    const double scale = exposure_ * std::clamp(std::as_const(sum)[c] / std::max(std::as_const(of_shader)[c], kDark),
                                                1.0 / kMostScale, kMostScale);
    for (size_t l = 0; l < of_light.size(); ++l) by(u_.light(l)) += scale * std::as_const(of_light)[l][c];
    if (!calibration_) continue;
    const auto row = p_.channels() * static_cast<Eigen::Index>(pixel) + c;
    for (size_t e = 0; e < calibration_->errors.size(); ++e) {
      const auto column = static_cast<Eigen::Index>(e);
      double& slope = by(u_.error(calibration_->errors[e]));
      slope += scale * calibration_->by_error(row, column);
      if (calibration_->of_photograph.size() > 0)
        slope += calibration_->of_photograph(row, column) - scale * calibration_->of_shader(row, column);
    }
  }
}

}  // namespace crownfit
