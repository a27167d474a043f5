#include "fit/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "base/linear_algebra.h"
#include "base/text.h"
#include "capture/capture.h"

namespace crownfit {
namespace {

constexpr double kNullRatio = 1e-7;  // singular values below this share of the largest are null directions
constexpr double kUnidentifiedFactor = 4.0;
constexpr double kWeak = 0.35;  // standard deviation from which a direction is listed
constexpr double kZ95 = 1.959963984540054;
// Errors of the model `shader` that many pixels share, relative to the signal: at the true values of the path-traced
// incisor and disc its level is off by 4 % rms per photograph, its channels by 2 % against each other, its patches by 3
// % (docs/validation.md).
constexpr double kPatchError = 0.03;       // common to a patch, in one channel
constexpr double kPhotographError = 0.04;  // common to a photograph
constexpr double kChannelError = 0.02;     // common to a photograph, in one channel

/// Calls visit(rows) for every patch of neighbouring pixels and every channel: its residuals' indices, and their signal
/// in standard deviations.
template <class Visit>
void ForEachPatch(const CastState& state, const std::vector<FitPixels>& pixels, const Visit& visit) {
  int row = 0;
  for (const FitPixels& p : pixels) {
    std::map<std::tuple<int, int, int>, std::vector<std::pair<int, double>>> patches;
    for (size_t i = 0; i < p.pixels.size(); ++i) {
      const PixelCast& pixel = state.photographs[p.photograph].pixels[p.pixels[i]];
      for (int c = 0; c < p.channels(); ++c, ++row)
        patches[{pixel.x / kPatch, pixel.y / kPatch, c}].emplace_back(row, p.values[i][c] / p.stddev[i][c]);
    }
    for (const auto& [place, rows] : patches) visit(rows);
  }
}

/// Mean square of (sum of residuals over a patch) / sqrt(count): 1 when pixel errors are independent and well stated.
double BlockChi2(const CastState& state, const Evaluation& e, const std::vector<FitPixels>& pixels) {
  double total = 0;
  size_t patches = 0;
  ForEachPatch(state, pixels, [&](const std::vector<std::pair<int, double>>& rows) {
    double sum = 0;
    for (const auto& [row, signal] : rows) sum += e.residuals[row];
    total += sum * sum / static_cast<double>(rows.size());
    ++patches;
  });
  return patches ? total / static_cast<double>(patches) : 0.0;
}

WeakDirection WeakDirectionOf(const FreeParameters& free, const Eigen::VectorXd& direction, double stddev) {
  constexpr size_t kMost = 4;
  constexpr double kLeast = 0.2;
  std::vector<int> order(free.count());
  for (int k = 0; k < free.count(); ++k) order[k] = k;
  std::sort(order.begin(), order.end(), [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  const double sign = direction[order[0]] < 0 ? -1.0 : 1.0;
  WeakDirection weak{{}, stddev};
  for (const int k : order)
    if (weak.parts.size() < kMost && std::abs(direction[k]) >= kLeast)
      weak.parts.push_back({free.entries[k].name, free.entries[k].scale, sign * direction[k]});
  return weak;
}

}  // namespace

const char* Word(Status status) {
  switch (status) {
    case Status::kFitted:
      return "fitted";
    case Status::kFixed:
      return "fixed";
    case Status::kPrior:
      return "prior";
    case Status::kNotIdentified:
      return "not_identified";
    case Status::kAtBound:
      return "at_bound";
  }
  return "";
}

std::vector<size_t> FittedParameter::ChannelsThatAre(Status s) const {
  std::vector<size_t> channels;
  for (size_t c = 0; c < value.size(); ++c)
    if (Of(c) == s) channels.push_back(c);
  return channels;
}

double DataEstimate::Variance(const Eigen::RowVectorXd& g) const {
  constexpr double kLeans = 1e-4;
  if (unseen.cols() > 0 && (g * unseen).cwiseAbs().maxCoeff() > kLeans * g.norm()) return HUGE_VAL;
  return (g * covariance * g.transpose())(0, 0);
}

Eigen::MatrixXd DataEstimate::Precision() const {
  const auto [values, vectors] = EigenOfSymmetric(covariance);
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(covariance.rows());
  for (Eigen::Index i = unseen.cols(); i < inverse.size(); ++i)  // the covariance is 0 along unseen directions
    if (values[i] > 0) inverse[i] = 1.0 / values[i];
  return Congruent(vectors, inverse.asDiagonal());
}

GaussianInformation DataEstimate::Of(const std::vector<FreeEntry>& entries) const {
  GaussianInformation known = NothingOf(NamesOf(entries));
  known.precision = Precision();
  known.weighted_mean = known.precision * by_photographs;
  return known;
}

DataEstimate DataEstimate::With(const GaussianInformation& others) const {
  DataEstimate all = *this;
  if (others.names.empty()) return all;
  const SeenDirections seen(Precision() + others.precision);
  all.covariance = seen.Inverse();
  all.unseen = seen.unseen;
  all.condition = seen.condition;
  return all;
}

Eigen::MatrixXd ModelScatter(const CastState& state, const Evaluation& e, const std::vector<FitPixels>& pixels) {
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(e.jacobian.cols(), e.jacobian.cols());
  ForEachPatch(state, pixels, [&](const std::vector<std::pair<int, double>>& rows) {
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(e.jacobian.cols());
    for (const auto& [row, signal] : rows) pull += kPatchError * signal * e.jacobian.row(row).transpose();
    scatter += pull * pull.transpose();
  });
  int row = 0;
  for (const FitPixels& p : pixels) {
    std::vector<Eigen::VectorXd> pull(static_cast<size_t>(p.channels()), Eigen::VectorXd::Zero(e.jacobian.cols()));
    for (size_t i = 0; i < p.pixels.size(); ++i)
      for (int c = 0; c < p.channels(); ++c, ++row)
        pull[static_cast<size_t>(c)] += p.values[i][c] / p.stddev[i][c] * e.jacobian.row(row).transpose();
    Eigen::VectorXd all = Eigen::VectorXd::Zero(e.jacobian.cols());
    for (const auto& of_channel : pull) all += kPhotographError * of_channel;
    scatter += all * all.transpose();
    for (const auto& of_channel : pull) scatter += kChannelError * kChannelError * of_channel * of_channel.transpose();
  }
  return scatter;
}

DataEstimate KnowledgeByShader(const CastState& state, const FreeParameters& free, const Eigen::VectorXd& x,
                               const Evaluation& e, const std::vector<FitPixels>& pixels, bool with_model_errors,
                               const Eigen::MatrixXd& beside) {
  const int n = free.count();
  DataEstimate k;
  k.covariance = Eigen::MatrixXd::Zero(n, n);
  k.unseen = Eigen::MatrixXd::Identity(n, n);
  k.by_photographs = x;
  if (!e.finite) return k;  // no information
  double fitted = n;
  if (beside.size() > 0) {
    const Eigen::MatrixXd normal = e.jacobian.transpose() * e.jacobian;
    fitted = SolveSymmetric(normal + beside, normal).trace();
  }
  k.freedom = std::max(1.0, static_cast<double>(e.residuals.size()) - fitted);
  k.reduced_chi2 = e.residuals.squaredNorm() / k.freedom;
  k.block_chi2 = BlockChi2(state, e, pixels);
  k.inflation = std::max({1.0, k.reduced_chi2, k.block_chi2});
  if (n == 0) return k;
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(std::max<Eigen::Index>(e.jacobian.rows(), n), n);
  jacobian.topRows(e.jacobian.rows()) = e.jacobian;
  const auto [singular, v] = SingularOf(jacobian);
  const auto seen = (singular.array() > kNullRatio * singular[0]).count();
  k.condition = singular[n - 1] > 0 ? singular[0] / singular[n - 1] : HUGE_VAL;
  const Eigen::VectorXd variances = singular.head(seen).cwiseAbs2().cwiseInverse();
  const Eigen::MatrixXd inverse = Congruent(v.leftCols(seen), variances.asDiagonal());
  k.covariance = k.inflation * inverse;
  if (with_model_errors) k.covariance += Congruent(inverse, ModelScatter(state, e, pixels));
  k.unseen = v.rightCols(n - seen);
  k.by_photographs = x - inverse * (e.jacobian.transpose() * e.robust);
  return k;
}

Uncertainty Quantify(const Capture& capture, const FreeParameters& free, const Eigen::VectorXd& x,
                     const DataEstimate& data, bool use_priors) {
  Uncertainty result;
  const Material material = MaterialAt(free, x);
  const int n = free.count();
  result.reduced_chi2 = data.reduced_chi2;
  result.block_chi2 = data.block_chi2;
  result.freedom = data.freedom;
  result.inflation = data.inflation;
  result.condition = data.condition;
  result.of_walks.assign(data.of_walks.begin(), data.of_walks.end());
  Eigen::MatrixXd posterior(n, n);
  Eigen::VectorXd prior_variance(n), without_prior = Eigen::VectorXd::Zero(n);
  for (int k = 0; k < n; ++k) prior_variance[k] = free.entries[k].prior_stddev * free.entries[k].prior_stddev;
  if (n > 0) {
    // Information of the photographs plus the priors, or instead of priors that a value lies in its range.
    Eigen::MatrixXd precision = data.Precision();
    const auto [variances, directions] = EigenOfSymmetric(data.covariance);
    const auto unseen = data.unseen.cols();
    for (Eigen::Index i = 0; i < unseen; ++i)
      result.weak_directions.push_back(WeakDirectionOf(free, data.unseen.col(i), HUGE_VAL));
    for (Eigen::Index i = n - 1; i >= unseen; --i) {
      const double stddev = std::sqrt(std::max(0.0, variances[i]));
      if (stddev > kWeak) result.weak_directions.push_back(WeakDirectionOf(free, directions.col(i), stddev));
    }
    for (int k = 0; k < n; ++k) {
      const double range = (free.entries[k].high - free.entries[k].low) / std::sqrt(12.0);
      precision(k, k) += use_priors ? 1.0 / prior_variance[k] : 1.0 / (range * range);
    }
    posterior = InverseOfSymmetric(precision);
    // Shift to the optimum of the photographs alone, in the linear model.
    for (int k = 0; use_priors && k < n; ++k)
      without_prior += (x[k] - free.entries[k].prior_mean) / prior_variance[k] * data.covariance.col(k);
  }
  result.covariance = posterior;

  const auto report = [&](const ParameterSpec& spec, const ParameterRow& row, size_t layer, const std::string& owner) {
    FittedParameter p;
    p.name = owner + "." + row.key;
    p.layer = layer;
    p.quantity = row.quantity;
    const Spectrum& values = (layer == kSurfaceOwner ? material.surface : material.layers[layer])[row.quantity];
    const bool one = spec.sharing == Sharing::kOneValue;
    p.value.assign(values.begin(), one ? values.begin() + 1 : values.end());
    if (spec.fixed) {
      result.parameters.push_back(p);
      return;
    }
    struct Interval {
      double low, high;
    };
    const bool log = row.scale == Scale::kLog;  // where the fit uses ln; standard deviations are relative then
    for (size_t c = 0; c < p.value.size(); ++c) {
      const double value = p.value[c], unit = log ? value : 1.0;
      const Eigen::RowVectorXd g = ValueGradient(free, x, layer, row.quantity, static_cast<int>(c)) / unit;
      const double data_sd = std::sqrt(std::max(0.0, data.Variance(g)));
      const double posterior_sd = std::sqrt((g * posterior * g.transpose())(0, 0));
      const double prior_sd = std::sqrt((g.transpose().cwiseAbs2().cwiseProduct(prior_variance)).sum());
      const double off = g.dot(without_prior);
      // Light is linear in the logarithm of a large coefficient, and in the value itself of a small one: the lower end
      // allows for both. So does the upper end of an absorption, with twice the deviation in the value itself.
      const bool may_be_little = row.quantity == Quantity::kAbsorption;
      const auto interval = [&](double from, double to) -> Interval {
        const double high = log ? value * std::exp(to) : value + to;
        return {value + unit * from, may_be_little ? std::min(high, value * (1.0 + 2.0 * to)) : high};
      };
      const Interval by_data = interval(std::min(0.0, off) - kZ95 * data_sd, std::max(0.0, off) + kZ95 * data_sd);
      const Interval with_prior = interval(-kZ95 * posterior_sd, kZ95 * posterior_sd);
      const auto is_wide = [&](const Interval& i) {
        return log ? !(i.high <= kUnidentifiedFactor * i.low)
                   : !(i.high - i.low <= std::log(kUnidentifiedFactor) * std::max(std::abs(value), row.prior_stddev));
      };
      // A prior that is narrow enough to bound the value gives status `prior`; with a wider one it is not identified.
      const bool seen = std::isfinite(data_sd), entry_prior = use_priors && data_sd > 0.5 * prior_sd;
      const bool unidentified = !seen || (is_wide(by_data) && (!entry_prior || is_wide(with_prior)));
      const bool held = seen && entry_prior && !is_wide(with_prior);
      const auto [low, high] = held ? with_prior : by_data;
      p.stddev.push_back(seen ? unit * (held ? posterior_sd : data_sd) : spec.high - spec.low);
      p.low95.push_back(seen ? std::max(low, spec.low) : spec.low);
      p.high95.push_back(seen ? std::min(high, spec.high) : spec.high);
      const bool at_bound =
          value <= spec.low + 1e-3 * std::abs(spec.low) || value >= spec.high - 1e-3 * std::abs(spec.high);
      p.of_channels.push_back(at_bound       ? Status::kAtBound
                              : unidentified ? Status::kNotIdentified
                              : held         ? Status::kPrior
                                             : Status::kFitted);
    }
    p.status = *std::max_element(p.of_channels.begin(), p.of_channels.end());
    result.parameters.push_back(p);
  };
  for (size_t l = 0; l < capture.layers.size(); ++l)
    for (size_t i = 0; i < kParameters.size(); ++i)
      if (kParameters[i].owner == Owner::kLayer)
        report(capture.layers[l].parameters[i], kParameters[i], l, capture.layers[l].name);
  for (size_t i = 0; i < kParameters.size(); ++i)
    if (kParameters[i].owner == Owner::kSurface) report(capture.surface[i], kParameters[i], kSurfaceOwner, "surface");
  return result;
}

}  // namespace crownfit
