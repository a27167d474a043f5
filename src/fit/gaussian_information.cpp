#include "fit/gaussian_information.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>

#include "base/error.h"
#include "base/linear_algebra.h"

namespace crownfit {
namespace {

constexpr double kRounding = 1e-12;  // of the largest eigenvalue: a standard deviation a million times the smallest

std::vector<Eigen::Index> PlacesOf(const std::vector<std::string>& names, const std::vector<std::string>& in) {
  std::vector<Eigen::Index> places;
  for (const std::string& name : names) places.push_back(std::find(in.begin(), in.end(), name) - in.begin());
  return places;
}

}  // namespace

SeenDirections::SeenDirections(const Eigen::MatrixXd& m) {
  if (m.rows() == 0) return;
  const auto [values, vectors] = EigenOfSymmetric(m);
  const auto known = (values.array() > std::max(0.0, kRounding * values.maxCoeff())).count();
  seen = vectors.rightCols(known);
  unseen = vectors.leftCols(values.size() - known);
  precision = values.tail(known);
  if (known > 0) condition = std::sqrt(precision.maxCoeff() / precision.minCoeff());
}

std::vector<std::string> NamesOf(const std::vector<FreeEntry>& entries) {
  std::vector<std::string> names;
  for (const FreeEntry& e : entries) names.push_back(e.name);
  return names;
}

GaussianInformation NothingOf(const std::vector<std::string>& names) {
  const auto n = static_cast<Eigen::Index>(names.size());
  return {names, Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
}

GaussianInformation Marginal(const GaussianInformation& knowledge, const std::vector<std::string>& names) {
  GaussianInformation m;
  std::vector<Eigen::Index> kept, others;
  for (size_t k = 0; k < knowledge.names.size(); ++k) {
    const bool is_kept = std::count(names.begin(), names.end(), knowledge.names[k]) > 0;
    (is_kept ? kept : others).push_back(static_cast<Eigen::Index>(k));
    if (is_kept) m.names.push_back(knowledge.names[k]);
  }
  const Eigen::MatrixXd across = knowledge.precision(kept, others);
  const Eigen::MatrixXd through = across * SeenDirections(knowledge.precision(others, others)).Inverse();
  m.precision = knowledge.precision(kept, kept) - through * across.transpose();
  m.weighted_mean = knowledge.weighted_mean(kept) - through * knowledge.weighted_mean(others);
  return m;
}

void Add(GaussianInformation& knowledge, const GaussianInformation& more) {
  const GaussianInformation part = Marginal(more, knowledge.names);
  const std::vector<Eigen::Index> places = PlacesOf(part.names, knowledge.names);
  knowledge.precision(places, places) += part.precision;
  knowledge.weighted_mean(places) += part.weighted_mean;
}

Eigen::VectorXd MeanOf(const GaussianInformation& knowledge, const Eigen::VectorXd& otherwise) {
  return otherwise +
         SeenDirections(knowledge.precision).Inverse() * (knowledge.weighted_mean - knowledge.precision * otherwise);
}

Disagreement Compared(const GaussianInformation& a, const GaussianInformation& b) {
  Check(a.names == b.names, "the same entries");
  // Inverse of the sum of both covariances; 0 along directions that only one of them constrains, or none.
  const Eigen::MatrixXd of_difference = a.precision * SeenDirections(a.precision + b.precision).Inverse() * b.precision;
  const SeenDirections common(0.5 * (of_difference + of_difference.transpose()));
  const Eigen::VectorXd nowhere = Eigen::VectorXd::Zero(a.weighted_mean.size());
  const Eigen::VectorXd here = MeanOf(a, nowhere), there = MeanOf(b, nowhere), off = here - there;
  Disagreement d;
  d.freedom = static_cast<int>(common.precision.size());
  d.chi2 = off.dot(of_difference * off);
  if (d.freedom == 0) return d;
  Eigen::Index most = 0;
  (of_difference.diagonal().cwiseSqrt().cwiseProduct(off)).cwiseAbs().maxCoeff(&most);
  d.name = a.names[static_cast<size_t>(most)];
  d.here = here[most];
  d.there = there[most];
  return d;
}

double UnlikelyChi2(int freedom, double by_chance) {
  return boost::math::quantile(boost::math::complement(boost::math::chi_squared(std::max(1, freedom)), by_chance));
}

}  // namespace crownfit
