#pragma once
// Gaussian quadrature.

#include <vector>

namespace crownfit {

struct Quadrature {
  std::vector<double> node, weight;  ///< ascending nodes
};

/// n nodes inside (low, high), exact for polynomials up to degree 2 n - 1.
Quadrature GaussLegendre(int n, double low, double high);

/// n nodes of which the last is `high`, exact up to degree 2 n - 2.
Quadrature GaussRadau(int n, double low, double high);

}  // namespace crownfit
