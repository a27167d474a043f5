#include "path/pooled_derivatives.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "base/linear_algebra.h"

namespace crownfit {
namespace {

/// Monomials of degree <= `degree` in three variables, lower degrees first.
int MonomialCount(int degree) { return (degree + 1) * (degree + 2) * (degree + 3) / 6; }

void Monomials(int degree, double x, double y, double z, double* out) {
  std::array<std::array<double, 8>, 3> power;
  for (int k = 0; k <= degree; ++k)
    for (size_t axis = 0; axis < 3; ++axis)
      power[axis][k] = k == 0 ? 1.0 : power[axis][k - 1] * (axis == 0 ? x : axis == 1 ? y : z);
  for (int total = 0; total <= degree; ++total)
    for (int i = 0; i <= total; ++i)
      for (int j = 0; i + j <= total; ++j) *out++ = power[0][i] * power[1][j] * power[2][total - i - j];
}

}  // namespace

PooledDerivatives::PooledDerivatives(const PathPhotograph& photo, const std::vector<FiniteDifferences>& differences)
    : groups_(static_cast<int>(photo.groups)), channels_(photo.group_values.channels()), ranks_(photo.ranks) {
  const size_t layers = photo.layers, groups = photo.groups;
  constexpr size_t kKinds = 3, kFewestGroups = 4;
  static_assert(kMaxTerms == (kMaxDegree + 1) * (kMaxDegree + 2) * (kMaxDegree + 3) / 6);
  Check(groups >= kFewestGroups && photo.derivatives.size() == photo.rendered.size() * groups * layers,
        "a picture with slopes");
  for (const FiniteDifferences& d : differences)
    Check(d.values.size() == photo.rendered.size() * groups, "slopes of the same groups");
  constexpr double kExact = 1e-12;  // smallest noise variance, in squares of the value
  for (size_t l = 0; l < layers; ++l)
    for (const Quantity q : {Quantity::kReducedScattering, Quantity::kAbsorption, Quantity::kAsymmetry})
      parameters_.push_back({l, q});
  for (const FiniteDifferences& d : differences) parameters_.push_back(d.parameter);
  FindPlaces(photo);
  KeepRim(photo, differences);
  std::vector<size_t> used;  // ranks of pixels on the object
  for (size_t rank = 0; rank < places_.size(); ++rank)
    if (places_[rank].on_object) used.push_back(rank);
  fields_.assign(IndexOf(parameters_.size(), 0), {0, {0.0}, std::vector<std::vector<double>>(groups, {0.0})});
  if (used.empty()) return;

  const auto count = static_cast<Eigen::Index>(used.size());
  const auto n_controls = static_cast<Eigen::Index>(2 * layers);
  const int terms = MonomialCount(kMaxDegree);
  for (int c = 0; c < channels_; ++c) {
    if (!(places_[used[0]].brightness[c] > 0)) continue;  // no light
    // Rows are weighted by the noise of the values, which is proportional to that of the derivatives.
    Eigen::MatrixXd basis(count, terms);
    Eigen::VectorXd weight(count), brightness(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Place& place = places_[used[i]];
      const auto row = TermsAt(kMaxDegree, c, used[i]);
      brightness[i] = place.brightness[c];
      weight[i] = 1.0 / std::sqrt(place.variance[c] + kExact * place.brightness[c] * place.brightness[c]);
      for (int k = 0; k < terms; ++k) basis(i, k) = weight[i] * brightness[i] * row[k];
    }
    const Eigen::MatrixXd gram = basis.transpose() * basis;

    const GroupDerivatives& s = photo.derivatives;
    // Per group: weighted derivatives (one column a parameter) and controls (brightness times them).
    std::vector<Eigen::MatrixXd> derivatives(groups), controls(groups);
    Eigen::MatrixXd mean_slope = Eigen::MatrixXd::Zero(count, static_cast<Eigen::Index>(parameters_.size())),
                    mean_control = Eigen::MatrixXd::Zero(count, n_controls);
    for (size_t g = 0; g < groups; ++g) {
      derivatives[g].resize(count, mean_slope.cols());
      controls[g].resize(count, n_controls);
      for (Eigen::Index i = 0; i < count; ++i)
        for (size_t l = 0; l < layers; ++l) {
          const size_t at = (used[i] * groups + g) * layers + l;
          const auto j = static_cast<Eigen::Index>(l);
          derivatives[g](i, kKinds * j) = weight[i] * s.scattering.at(at, c);
          derivatives[g](i, kKinds * j + 1) = weight[i] * s.absorption.at(at, c);
          derivatives[g](i, kKinds * j + 2) = weight[i] * s.asymmetry.at(at, c);
          controls[g](i, 2 * j) = weight[i] * brightness[i] * s.scattering_control.at(at, c);
          controls[g](i, 2 * j + 1) = weight[i] * brightness[i] * s.asymmetry_control.at(at, c);
        }
      for (size_t d = 0; d < differences.size(); ++d)
        for (Eigen::Index i = 0; i < count; ++i)
          derivatives[g](i, static_cast<Eigen::Index>(kKinds * layers + d)) =
              weight[i] * differences[d].values.at(used[i] * groups + g, c);
      mean_slope += derivatives[g] / static_cast<double>(groups);
      mean_control += controls[g] / static_cast<double>(groups);
    }
    // Coefficients of the control variates; each half of the groups uses those found by the other half.
    std::array<Eigen::MatrixXd, 2> multiples;
    for (const size_t half : {0, 1}) {
      Eigen::MatrixXd square = Eigen::MatrixXd::Zero(n_controls, n_controls),
                      product = Eigen::MatrixXd::Zero(n_controls, mean_slope.cols());
      for (size_t g = 1 - half; g < groups; g += 2) {
        const Eigen::MatrixXd d = controls[g] - mean_control;
        square += d.transpose() * d;
        product += d.transpose() * (derivatives[g] - mean_slope);
      }
      multiples[half] = ShortestNearest(square, product);
    }
    std::vector<Eigen::MatrixXd> right(groups);
    for (size_t g = 0; g < groups; ++g)
      right[g] = basis.transpose() * (derivatives[g] - controls[g] * multiples[g % 2]);

    for (size_t j = 0; j < parameters_.size(); ++j) {
      const auto column = static_cast<Eigen::Index>(j);
      // The mean of all groups, and of all but each.
      const double n = static_cast<double>(groups);
      Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(terms, static_cast<Eigen::Index>(groups) + 1);
      for (const Eigen::MatrixXd& r : right) sums.col(0) += r.col(column);
      for (size_t g = 0; g < groups; ++g)
        sums.col(static_cast<Eigen::Index>(g) + 1) = (sums.col(0) - right[g].col(column)) / (n - 1.0);
      sums.col(0) /= n;
      // For every degree the polynomials without each group, and their error on that group, less a term common to all
      // polynomials.
      std::vector<Field> fits;
      std::vector<Eigen::VectorXd> errors;
      for (int degree = 0; degree <= kMaxDegree; ++degree) {
        const int size = MonomialCount(degree);
        if (4 * size > count && degree > 0) break;
        Eigen::MatrixXd some = gram.topLeftCorner(size, size);
        some.diagonal().array() += 1e-10 * some.trace() / size;
        const Eigen::MatrixXd found = SolveSymmetric(some, sums.topRows(size));
        Field fit{degree, {found.col(0).begin(), found.col(0).end()}, {}};
        Eigen::VectorXd error(static_cast<Eigen::Index>(groups));
        for (size_t g = 0; g < groups; ++g) {
          const auto x = found.col(static_cast<Eigen::Index>(g) + 1);
          fit.without.emplace_back(x.begin(), x.end());
          error[static_cast<Eigen::Index>(g)] =
              x.dot(gram.topLeftCorner(size, size) * x) - 2.0 * x.dot(right[g].col(column).head(size));
        }
        fits.push_back(std::move(fit));
        errors.push_back(error);
      }
      const auto best = std::min_element(errors.begin(), errors.end(),
                                         [](const auto& a, const auto& b) { return a.mean() < b.mean(); });
      size_t chosen = best - errors.begin();
      for (size_t d = chosen; d < fits.size(); ++d) {
        const Eigen::VectorXd worse = errors[d] - *best;
        const double spread = std::sqrt((worse.array() - worse.mean()).square().sum() / (n - 1.0));
        if (worse.mean() <= spread / std::sqrt(n)) chosen = d;
      }
      fields_[IndexOf(j, c)] = std::move(fits[chosen]);
    }
  }
}

void PooledDerivatives::KeepRim(const PathPhotograph& photo, const std::vector<FiniteDifferences>& differences) {
  const size_t layers = photo.layers, groups = photo.groups, entries = IndexOf(parameters_.size(), 0);
  const double n = static_cast<double>(groups);
  for (size_t rank = 0; rank < places_.size(); ++rank) {
    if (places_[rank].on_object) continue;
    Eigen::ArrayXXd of_group(static_cast<Eigen::Index>(entries), static_cast<Eigen::Index>(groups));
    for (size_t g = 0; g < groups; ++g) {
      Eigen::Index entry = 0;
      const auto put = [&](const SpectrumArray<>& slopes, size_t at) {
        for (int c = 0; c < channels_; ++c) of_group(entry++, static_cast<Eigen::Index>(g)) = slopes.at(at, c);
      };
      const GroupDerivatives& s = photo.derivatives;
      for (size_t l = 0; l < layers; ++l)
        for (const SpectrumArray<>* slopes : {&s.scattering, &s.absorption, &s.asymmetry})
          put(*slopes, (rank * groups + g) * layers + l);
      for (const FiniteDifferences& d : differences) put(d.values, rank * groups + g);
    }
    if ((of_group == 0.0).all()) continue;
    std::vector<OfPixel>& kept = rim_[rank];
    for (Eigen::Index entry = 0; entry < of_group.rows(); ++entry) {
      const double mean = of_group.row(entry).mean();
      kept.push_back({mean, std::sqrt((of_group.row(entry) - mean).square().sum() / (n * (n - 1.0)))});
    }
  }
}

PooledDerivatives::OfPixel PooledDerivatives::DerivativeOf(size_t parameter, int channel, size_t place) const {
  if (IsOnObject(place)) {
    const double here = brightness(channel, place);
    return {here * At(parameter, channel, place), here * Stddev(parameter, channel, place)};
  }
  const auto rim = rim_.find((*ranks_)[place]);
  return rim == rim_.end() ? OfPixel{} : rim->second[IndexOf(parameter, channel)];
}

void PooledDerivatives::FindPlaces(const PathPhotograph& photo) {
  constexpr int kReach = 2, kNoiseReach = 4, kFewest = 4;
  constexpr double kDark = 1e-3;  // of the mean: smallest brightness
  places_.resize(photo.pixels.size());
  glm::dvec2 low(1e9), high(-1e9);
  Spectrum mean(channels_, 0.0);
  double n = 0;
  for (size_t p = 0; p < places_.size(); ++p) {
    Place& place = places_[p];
    place.on_object = photo.pixels[p].on_object;
    if (!place.on_object) continue;
    const auto row = photo.rendered[p] / photo.width;
    place.x = static_cast<double>(photo.rendered[p] % photo.width);
    place.y = static_cast<double>(row);
    low = glm::min(low, glm::dvec2(place.x, place.y)), high = glm::max(high, glm::dvec2(place.x, place.y));
    mean += photo.pixels[p].mean, ++n;
  }
  mean /= std::max(1.0, n);
  const int furthest = std::max(photo.width, photo.height);
  const auto around = [&](size_t p, int reach, bool with_itself, const auto& value) {
    const int x = static_cast<int>(photo.rendered[p] % photo.width),
              y = static_cast<int>(photo.rendered[p] / photo.width);
    for (; reach < furthest; reach *= 2) {  // further where only some pixels were rendered
      Spectrum sum(channels_, 0.0);
      double count = 0;
      for (int v = std::max(0, y - reach); v <= std::min(photo.height - 1, y + reach); ++v)
        for (int u = std::max(0, x - reach); u <= std::min(photo.width - 1, x + reach); ++u) {
          const uint32_t rank = photo.RankOf(static_cast<size_t>(v) * photo.width + u);
          if (rank == PathPhotograph::kNotRendered || (rank == p && !with_itself)) continue;
          if (const PixelEstimate& near = photo.pixels[rank]; near.on_object) sum += value(near), ++count;
        }
      if (count >= kFewest) return sum / count;
    }
    return value(photo.pixels[p]);
  };
  for (size_t p = 0; p < places_.size(); ++p) {
    Place& place = places_[p];
    if (!place.on_object) continue;
    place.brightness = Max(kDark * mean, around(p, kReach, false, [](const PixelEstimate& e) { return e.mean; }));
    place.variance = around(p, kNoiseReach, true, [](const PixelEstimate& e) { return e.variance(); });
    const Spectrum least(1e-300);
    place.log_brightness = 0.5 * Log(Max(place.brightness, least) / Max(mean, least));
    place.x = (2.0 * place.x - low.x - high.x) / std::max(1.0, high.x - low.x);
    place.y = (2.0 * place.y - low.y - high.y) / std::max(1.0, high.y - low.y);
  }
}

std::array<double, PooledDerivatives::kMaxTerms> PooledDerivatives::TermsAt(int degree, int channel,
                                                                            size_t rank) const {
  std::array<double, kMaxTerms> terms{};
  const Place& place = places_[rank];
  Monomials(degree, place.x, place.y, place.log_brightness[channel], terms.data());
  return terms;
}

double PooledDerivatives::At(size_t parameter, int channel, size_t place) const {
  if (!IsOnObject(place)) return 0.0;
  const Field& field = fields_[IndexOf(parameter, channel)];
  const auto terms = TermsAt(field.degree, channel, (*ranks_)[place]);
  return std::inner_product(field.coefficients.begin(), field.coefficients.end(), terms.begin(), 0.0);
}

std::vector<double> PooledDerivatives::Without(size_t parameter, int channel, size_t place) const {
  std::vector<double> values(groups_, 0.0);
  if (!IsOnObject(place)) return values;
  const Field& field = fields_[IndexOf(parameter, channel)];
  const auto terms = TermsAt(field.degree, channel, (*ranks_)[place]);
  for (int g = 0; g < groups_; ++g)
    values[g] = std::inner_product(field.without[g].begin(), field.without[g].end(), terms.begin(), 0.0);
  return values;
}

double PooledDerivatives::Stddev(size_t parameter, int channel, size_t place) const {
  double sum = 0, square = 0;
  for (const double v : Without(parameter, channel, place)) sum += v, square += v * v;
  return std::sqrt(std::max(0.0, square - sum * sum / groups_) * (groups_ - 1.0) / groups_);
}

}  // namespace crownfit
