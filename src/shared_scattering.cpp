#include "shared_scattering.h"

#include <algorithm>
#include <cmath>

#include "base/linear_algebra.h"

namespace crownfit {
namespace {

constexpr Quantity kScattering = Quantity::kReducedScattering;

/// Enamel's exponent is 3.7 between 543 and 632 nm and 2.7 between 632 and 1053 nm (Fried et al. 1995): over a camera's
/// bands, the value in the middle one is so far off a power law through all.
constexpr double kOffPowerLaw = 0.02;

/// What the logarithms of three channels have beyond a law: a projection.
Eigen::Matrix3d Beyond(Sharing law, const std::array<double, kChannels>& wavelengths_nm) {
  Eigen::Matrix<double, kChannels, 2> basis;
  for (int c = 0; c < kChannels; ++c) basis.row(c) << 1.0, std::log(wavelengths_nm[c] / wavelengths_nm[0]);
  basis.col(1).array() -= basis.col(1).mean();
  Eigen::Matrix3d beyond = Eigen::Matrix3d::Identity();
  for (int i = 0; i < (law == Sharing::kPowerLaw ? 2 : 1); ++i)
    beyond -= basis.col(i) * basis.col(i).transpose() / basis.col(i).squaredNorm();
  return beyond;
}

/// d(departure of the channel that departs most) / d(entries).
Eigen::RowVectorXd DepartureGradient(Sharing law, size_t layer, const FreeParameters& free) {
  const Eigen::VectorXd x = StartVector(free);
  const Material material = MaterialAt(free, x);
  Eigen::MatrixXd logarithms(kChannels, free.count());
  for (int c = 0; c < kChannels; ++c)
    logarithms.row(c) = ValueGradient(free, x, layer, kScattering, c) / material.layers[layer][kScattering][c];
  const Eigen::MatrixXd departures = Beyond(law, free.wavelengths_nm) * logarithms;
  Eigen::Index furthest;
  departures.rowwise().norm().maxCoeff(&furthest);
  return departures.row(furthest);
}

/// As far as exponents of published teeth lie from 0, by the prior of the exponent.
double Published(Sharing law, const FreeParameters& free, const Eigen::RowVectorXd& departure) {
  if (law == Sharing::kPowerLaw) return kOffPowerLaw;
  double published = 0;
  for (int k = 0; k < free.count(); ++k)
    published += std::abs(departure[k]) * std::hypot(free.entries[k].prior_mean, free.entries[k].prior_stddev);
  return published;
}

SharedScattering Ask(Sharing law, size_t layer, const FreeParameters& free, const DataKnowledge& knowledge) {
  SharedScattering asked{};
  asked.law = law;
  const Eigen::RowVectorXd departure = DepartureGradient(law, layer, free);
  asked.published = Published(law, free, departure);
  Eigen::MatrixXd precision = knowledge.Precision();
  for (int k = 0; k < free.count(); ++k)  // what nothing tells stays finite
    precision(k, k) += 1e-6 * std::pow(free.entries[k].prior_stddev, -2.0);
  const Eigen::MatrixXd covariance = InverseOfSymmetric(precision);
  const Eigen::VectorXd with = covariance * departure.transpose();
  asked.told = std::sqrt(departure.dot(with));
  constexpr double kItself = 1e-6;
  for (int k = 0; k < free.count(); ++k) {
    const double before = covariance(k, k), under_law = before - std::pow(with[k] / asked.told, 2);
    if (under_law < kItself * before) continue;  // the law states this one
    const double narrows = std::sqrt(before / under_law);
    if (narrows > asked.narrows) asked.narrows = narrows, asked.narrowed = free.entries[k].name;
  }
  return asked;
}

}  // namespace

std::vector<SharedScattering> ScatteringThatMayBeShared(
    const Capture& capture, const std::function<DataKnowledge(const Capture&, const FreeParameters&)>& foresee) {
  std::vector<SharedScattering> questions;
  if (std::ranges::count(capture.wavelengths_nm, capture.wavelengths_nm[0]) == kChannels) return questions;
  for (size_t l = 0; l < capture.layers.size(); ++l) {
    const ParameterSpec& spec = capture.layers[l][kScattering];
    for (const auto& [law, freer] :
         {std::pair{Sharing::kPowerLaw, Sharing::kNone}, std::pair{Sharing::kOneValue, Sharing::kPowerLaw}}) {
      if (spec.fixed || (spec.sharing != law && spec.sharing != freer)) continue;
      Capture freed = capture;
      freed.layers[l][kScattering].sharing = freer;
      const FreeParameters free = FreeParametersOf(freed);
      SharedScattering asked = Ask(law, l, free, foresee(freed, free));
      asked.parameter = capture.layers[l].name + "." + RowOf(kScattering).key;
      asked.is_stated = spec.sharing == law;
      questions.push_back(std::move(asked));
    }
  }
  return questions;
}

}  // namespace crownfit
