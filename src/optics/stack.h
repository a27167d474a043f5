#pragma once
// Flat layers as matrices between directions, which adding-doubling combines. In this module, only these headers and
// the files that include them use Eigen.

#include <Eigen/Core>
#include <vector>

#include "optics/quadrature.h"
#include "optics/slab.h"

namespace crownfit {

/// Directions of one medium: cosines and quadrature weights. A direction and its refraction have the same number on
/// both sides of a boundary; the densest medium has all of them, the others the first `size`.
struct Directions {
  Eigen::VectorXd cosine, weight;
  double ior;
  Eigen::Index size() const { return cosine.size(); }
  /// Share of a hemisphere's flux of basic radiance (L / n^2) that each direction carries.
  Eigen::VectorXd FluxWeights() const { return 2.0 * ior * ior * cosine.cwiseProduct(weight); }
};

/// Groups of directions by index, the rarest medium first. That one has Radau cosines, including normal incidence.
/// Every denser one adds the Gauss cosines that are totally reflected towards the next rarer. If the index step to the
/// next denser medium is small, their smallest cosines change there on a finer scale than their spacing. The group then
/// has as many more there. Indices that differ by less than kSameIndex are one.
class AllDirections {
 public:
  /// `views`: cosines of viewing directions in the rarest medium, which carry next to no light of their own.
  AllDirections(const std::vector<double>& indices, int nodes, const std::vector<double>& views = {});
  Directions In(double ior) const;
  Eigen::Index NormalIncidence() const { return normal_; }
  Eigen::Index View(size_t i) const { return normal_ + 1 + static_cast<Eigen::Index>(i); }

 private:
  std::vector<double> indices_;  ///< ascending, all different
  std::vector<Quadrature> groups_;
  Eigen::Index normal_;
};

/// Response of layers to basic radiance from above (`down`) and from below (`up`).
struct Stack {
  Eigen::MatrixXd reflect_down, transmit_down, reflect_up, transmit_up;
};

/// Fresnel boundary between media: diagonal in the directions.
struct Interface {
  Interface(const Directions& above, const Directions& below);
  Eigen::VectorXd reflect_down, reflect_up;  ///< of the directions above, below
  Eigen::VectorXd transmit;                  ///< of those that both media have
};

Stack AsStack(const Interface& interface);
Stack Add(const Interface& a, Stack b);
Stack Add(const Stack& a, const Interface& b);
Stack Add(const Stack& a, const Stack& b);

/// Lambertian surface below; what it does not return counts as transmitted.
Stack Backing(const Directions& d, double reflectance);

}  // namespace crownfit
