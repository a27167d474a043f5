#include "optics/stack.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"

namespace crownfit {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

enum class Rule { kRadau, kLegendre };

/// A rule's nodes on [low, high]; those on [0, 1] are cached, because computing them takes longer than solving a slab.
Quadrature Nodes(Rule rule, int count, double low, double high) {
  static std::mutex mutex;
  static std::map<std::pair<Rule, int>, Quadrature> known;
  Quadrature q;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    const auto [at, is_new] = known.try_emplace({rule, count});
    if (is_new) at->second = rule == Rule::kRadau ? GaussRadau(count, 0.0, 1.0) : GaussLegendre(count, 0.0, 1.0);
    q = at->second;
  }
  for (double& x : q.node) x = low + (high - low) * x;
  for (double& w : q.weight) w *= high - low;
  return q;
}

/// Critical cosine in the denser medium; exact however small the index step.
double CriticalCosine(double rare, double dense) { return std::sqrt((dense - rare) / dense * (1.0 + rare / dense)); }

Matrix Identity(Eigen::Index n) { return Matrix::Identity(n, n); }

}  // namespace

AllDirections::AllDirections(const std::vector<double>& indices, int nodes, const std::vector<double>& views)
    : normal_(nodes - 1) {
  std::vector<double> ascending = indices;
  std::sort(ascending.begin(), ascending.end());
  for (const double n : ascending)
    if (indices_.empty() || n > (1.0 + kSameIndex) * indices_.back()) indices_.push_back(n);
  for (size_t k = 0; k < indices_.size(); ++k) {
    const double end = k == 0 ? 1.0 : CriticalCosine(indices_[k - 1], indices_[k]);
    const double next = k + 1 < indices_.size() ? CriticalCosine(indices_[k], indices_[k + 1]) : HUGE_VAL;
    // If `next` lies below the group's fourth node, no node resolves the bend of the denser medium's cosines.
    const bool is_narrow = next < std::pow(6.0 / nodes, 2) * end;
    const double begin = is_narrow ? 0.2 * end : 0.0;
    Quadrature q = Nodes(k == 0 ? Rule::kRadau : Rule::kLegendre, nodes, begin, end);
    if (k == 0) {
      constexpr double kNextToNothing = 1e-12;
      q.node.insert(q.node.end(), views.begin(), views.end());
      q.weight.insert(q.weight.end(), views.size(), kNextToNothing);
    }
    if (is_narrow) {
      // Cosines are next sinh(t) here and next cosh(t) there: both are smooth in t.
      const Quadrature t = Nodes(Rule::kLegendre, nodes, 0.0, std::asinh(begin / next));
      for (size_t i = 0; i < t.node.size(); ++i) {
        q.node.push_back(next * std::sinh(t.node[i]));
        q.weight.push_back(next * std::cosh(t.node[i]) * t.weight[i]);
      }
    }
    groups_.push_back(std::move(q));
  }
}

Directions AllDirections::In(double ior) const {
  const auto end = std::upper_bound(indices_.begin(), indices_.end(), ior);
  const double same = *std::prev(end);
  std::vector<double> cosine, weight;
  for (size_t k = 0; k < static_cast<size_t>(end - indices_.begin()); ++k) {
    const double ratio = indices_[k] / same, critical = CriticalCosine(indices_[k], same);
    for (size_t i = 0; i < groups_[k].node.size(); ++i) {
      const double mu = groups_[k].node[i];
      cosine.push_back(std::hypot(critical, ratio * mu));
      weight.push_back(groups_[k].weight[i] * ratio * ratio * mu / cosine.back());
    }
  }
  const auto n = static_cast<Eigen::Index>(cosine.size());
  return {Eigen::Map<Vector>(cosine.data(), n), Eigen::Map<Vector>(weight.data(), n), same};
}

/// Directions that only the denser side has are totally reflected. The value is a rounding short of 1: light trapped in
/// a clear layer, which nothing ever enters, would give 0 / 0. Other reflectances are computed on the rarer side, where
/// nothing cancels.
Interface::Interface(const Directions& above, const Directions& below)
    : reflect_down(above.size()), reflect_up(below.size()), transmit(std::min(above.size(), below.size())) {
  constexpr double kTotal = 1.0 - 0x1.0p-50;
  reflect_down.setConstant(kTotal);
  reflect_up.setConstant(kTotal);
  const bool is_denser_below = above.ior < below.ior;
  const Directions &rare = is_denser_below ? above : below, &dense = is_denser_below ? below : above;
  for (Eigen::Index i = 0; i < transmit.size(); ++i) {
    const double f = Terms<double>::FresnelReflectance(rare.cosine[i], dense.ior / rare.ior);
    reflect_down[i] = reflect_up[i] = f;
    transmit[i] = 1.0 - f;
  }
}

Stack AsStack(const Interface& i) {
  const Eigen::Index above = i.reflect_down.size(), below = i.reflect_up.size(), both = i.transmit.size();
  Stack s{Matrix(i.reflect_down.asDiagonal()), Matrix::Zero(below, above), Matrix(i.reflect_up.asDiagonal()),
          Matrix::Zero(above, below)};
  s.transmit_down.diagonal().head(both) = i.transmit;
  s.transmit_up.diagonal().head(both) = i.transmit;
  return s;
}

// Reflections back and forth between two parts: (1 - R R)^-1.

Stack Add(const Stack& a, const Interface& b) {
  const Eigen::Index n = a.reflect_up.rows(), below = b.reflect_up.size(), both = b.transmit.size();
  const Eigen::PartialPivLU<Matrix> between(Identity(n) - a.reflect_up * b.reflect_down.asDiagonal());
  const Matrix down = between.solve(a.transmit_down);
  const Matrix turned = between.solve(Matrix(a.reflect_up.leftCols(both) * b.transmit.asDiagonal()));
  Stack s{a.reflect_down + a.transmit_up * (b.reflect_down.asDiagonal() * down), Matrix::Zero(below, down.cols()),
          Matrix(b.reflect_up.asDiagonal()), Matrix::Zero(a.transmit_up.rows(), below)};
  s.transmit_down.topRows(both) = b.transmit.asDiagonal() * down.topRows(both);
  s.reflect_up.topLeftCorner(both, both) += b.transmit.asDiagonal() * turned.topRows(both);
  s.transmit_up.leftCols(both) = a.transmit_up.leftCols(both) * b.transmit.asDiagonal();
  s.transmit_up.leftCols(both).noalias() += a.transmit_up * (b.reflect_down.asDiagonal() * turned);
  return s;
}

Stack Add(const Interface& a, Stack b) {
  // The same seen from below.
  const Interface turned = [&] {
    Interface i = a;
    std::swap(i.reflect_down, i.reflect_up);
    return i;
  }();
  std::swap(b.reflect_down, b.reflect_up);
  std::swap(b.transmit_down, b.transmit_up);
  Stack s = Add(b, turned);
  std::swap(s.reflect_down, s.reflect_up);
  std::swap(s.transmit_down, s.transmit_up);
  return s;
}

Stack Add(const Stack& a, const Stack& b) {
  const Matrix one = Identity(b.reflect_down.rows());
  const Eigen::PartialPivLU<Matrix> downward(one - a.reflect_up * b.reflect_down),
      upward(one - b.reflect_down * a.reflect_up);
  const Matrix down = downward.solve(a.transmit_down), up = upward.solve(b.transmit_up);
  return {a.reflect_down + a.transmit_up * b.reflect_down * down, b.transmit_down * down,
          b.reflect_up + b.transmit_down * a.reflect_up * up, a.transmit_up * up};
}

Stack Backing(const Directions& d, double reflectance) {
  const Eigen::Index n = d.size();
  const Vector flux = d.FluxWeights() / (d.ior * d.ior);
  const Matrix spread = Vector::Ones(n) * flux.transpose() / flux.sum();
  return {reflectance * spread, (1.0 - reflectance) * Identity(n), Matrix::Zero(n, n), Matrix::Zero(n, n)};
}

}  // namespace crownfit
