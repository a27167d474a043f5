#include "fit/scattering_laws.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "base/linear_algebra.h"
#include "capture/capture.h"

namespace crownfit {
namespace {

constexpr Quantity kScattering = Quantity::kReducedScattering;

/// Enamel's exponent is 3.7 between 543 and 632 nm and 2.7 between 632 and 1053 nm (Fried et al. 1995). Over a camera's
/// bands, the value in the middle band departs from a power law through all by this share.
constexpr double kOffPowerLaw = 0.02;

/// Orthonormal directions (columns) in the logarithms of the channels that a law cannot follow; none where the law has
/// as many parameters as there are channels.
Eigen::MatrixXd DirectionsBeyond(Sharing law, const std::vector<double>& wavelengths_nm) {
  const auto channels = static_cast<Eigen::Index>(wavelengths_nm.size());
  const Eigen::Index followed = std::min<Eigen::Index>(channels, law == Sharing::kPowerLaw ? 2 : 1);
  Eigen::MatrixXd line(channels, 2);  // a level, and a power law's slope
  line.col(0).setOnes();
  for (Eigen::Index c = 0; c < channels; ++c)
    line(c, 1) = std::log(wavelengths_nm[static_cast<size_t>(c)] / wavelengths_nm[0]);
  const Eigen::MatrixXd all = Eigen::HouseholderQR<Eigen::MatrixXd>(line).householderQ();
  return all.rightCols(channels - followed);
}

/// d(logarithms of the channels) / d(entries).
Eigen::MatrixXd LogarithmGradients(size_t layer, const FreeParameters& free) {
  const Eigen::VectorXd x = StartVector(free);
  const Material material = MaterialAt(free, x);
  Eigen::MatrixXd gradients(free.channels(), free.count());
  for (int c = 0; c < free.channels(); ++c)
    gradients.row(c) = ValueGradient(free, x, layer, kScattering, c) / material.layers[layer][kScattering][c];
  return gradients;
}

/// Departure of published teeth: as far as their exponents lie from 0, by the exponent's prior.
double Published(Sharing law, const FreeParameters& free, const Eigen::RowVectorXd& departure) {
  if (law == Sharing::kPowerLaw) return kOffPowerLaw;
  double published = 0;
  for (int k = 0; k < free.count(); ++k)
    published += std::abs(departure[k]) * std::hypot(free.entries[k].prior_mean, free.entries[k].prior_stddev);
  return published;
}

/// `free` has one parameter more than the law.
SharedScattering Ask(Sharing law, size_t layer, const FreeParameters& free, const DataEstimate& knowledge) {
  const Eigen::MatrixXd beyond = DirectionsBeyond(law, free.wavelengths_nm);
  const Eigen::MatrixXd departures = beyond * (beyond.transpose() * LogarithmGradients(layer, free));
  Eigen::Index furthest;
  departures.rowwise().norm().maxCoeff(&furthest);
  const Eigen::RowVectorXd departure = departures.row(furthest);
  SharedScattering asked{};
  asked.law = law;
  asked.published = Published(law, free, departure);
  asked.told = std::sqrt(knowledge.Variance(departure));
  if (!std::isfinite(asked.told)) return asked;
  const Eigen::MatrixXd& covariance = knowledge.covariance;
  const Eigen::VectorXd with = covariance * departure.transpose();
  constexpr double kItself = 1e-6;
  for (int k = 0; k < free.count(); ++k) {
    const double before = covariance(k, k), under_law = before - std::pow(with[k] / asked.told, 2);
    if (under_law < kItself * before) continue;  // the law itself determines this one
    const double narrows = std::sqrt(before / under_law);
    if (narrows > asked.narrows) asked.narrows = narrows, asked.narrowed = free.entries[k].name;
  }
  return asked;
}

std::string NameIn(const Capture& capture, size_t layer) {
  return capture.layers[layer].name + "." + RowOf(kScattering).key;
}

}  // namespace

std::vector<SharedScattering> ScatteringThatMayBeShared(
    const Capture& capture, const std::function<DataEstimate(const Capture&, const FreeParameters&)>& foresee) {
  std::vector<SharedScattering> questions;
  if (HaveOneWavelength(capture.wavelengths_nm)) return questions;
  for (size_t l = 0; l < capture.layers.size(); ++l) {
    const ParameterSpec& spec = capture.layers[l][kScattering];
    for (const auto& [law, freer] :
         {std::pair{Sharing::kPowerLaw, Sharing::kNone}, std::pair{Sharing::kOneValue, Sharing::kPowerLaw}}) {
      if (law == Sharing::kPowerLaw && capture.channels() < 3) continue;  // it follows two channels exactly
      if (spec.fixed || (spec.sharing != law && spec.sharing != freer)) continue;
      Capture freed = capture;
      freed.layers[l][kScattering].sharing = freer;
      const FreeParameters free = FreeParametersOf(freed);
      SharedScattering asked = Ask(law, l, free, foresee(freed, free));
      asked.parameter = NameIn(capture, l);
      asked.is_stated = spec.sharing == law;
      questions.push_back(std::move(asked));
    }
  }
  return questions;
}

bool KeepsALaw(const Capture& capture) {
  return std::ranges::any_of(capture.layers, [](const LayerSpec& l) {
    return !l[kScattering].fixed && l[kScattering].sharing != Sharing::kNone;
  });
}

Capture WithoutLaws(Capture capture, const Material& material) {
  for (size_t i = 0; i < kParameters.size(); ++i) {
    for (size_t l = 0; l < capture.layers.size(); ++l) {
      ParameterSpec& spec = capture.layers[l].parameters[i];
      if (spec.fixed) continue;
      spec.value = material.layers[l].values[i];
      if (!kParameters[i].per_channel) continue;
      spec.sharing = Sharing::kNone;
      spec.low = std::min(spec.low, spec.value.Smallest());  // values under a law may lie outside
      spec.high = std::max(spec.high, spec.value.Largest());
    }
    if (!capture.surface[i].fixed) capture.surface[i].value = material.surface.values[i];
  }
  return capture;
}

std::vector<LawDeparture> DeparturesFromLaws(const Capture& fitted, const FreeParameters& freed,
                                             const Eigen::VectorXd& step, const Eigen::MatrixXd& covariance) {
  std::vector<LawDeparture> departures;
  for (size_t l = 0; l < fitted.layers.size(); ++l) {
    const ParameterSpec& spec = fitted.layers[l][kScattering];
    if (spec.fixed || spec.sharing == Sharing::kNone) continue;
    const Eigen::MatrixXd beyond = DirectionsBeyond(spec.sharing, freed.wavelengths_nm);
    if (beyond.cols() == 0) continue;
    const Eigen::MatrixXd gradients = LogarithmGradients(l, freed);
    const Eigen::VectorXd moved = gradients * step, departure = beyond.transpose() * moved;
    const Eigen::MatrixXd of_all = gradients * covariance * gradients.transpose(),
                          its_covariance = beyond.transpose() * of_all * beyond;
    LawDeparture d{NameIn(fitted, l), spec.sharing};
    d.freedom = static_cast<int>(departure.size());
    d.chi2 = departure.dot(SolveSymmetric(its_covariance, departure).col(0));
    d.moved = d.off = d.stddev = Spectrum(freed.channels(), 0.0);
    for (int c = 0; c < freed.channels(); ++c) {
      d.moved[c] = moved[c];
      d.off[c] = beyond.row(c).dot(departure);
      d.stddev[c] = std::sqrt((beyond.row(c) * its_covariance).dot(beyond.row(c)));
    }
    departures.push_back(d);
  }
  return departures;
}

std::vector<LawDeparture> DeparturesFromLaws(const Capture& fitted, const FreeParameters& freed,
                                             const DataEstimate& knowledge) {
  Eigen::MatrixXd precision = knowledge.Precision();
  for (int k = 0; k < freed.count(); ++k)  // keeps unidentified entries finite
    precision(k, k) += 1e-6 * std::pow(freed.entries[k].prior_stddev, -2.0);
  return DeparturesFromLaws(fitted, freed, knowledge.by_photographs - StartVector(freed),
                            InverseOfSymmetric(precision));
}

}  // namespace crownfit
