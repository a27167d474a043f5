#include "optics/quadrature.h"

#include <cmath>
#include <numbers>

namespace crownfit {
namespace {

double Legendre(int order, double x) {
  double before = 1.0, now = x;
  if (order == 0) return before;
  for (int k = 2; k <= order; ++k) {
    const double next = ((2 * k - 1) * x * now - (k - 1) * before) / k;
    before = now;
    now = next;
  }
  return now;
}

}  // namespace

Quadrature GaussLegendre(int n, double low, double high) {
  Quadrature q;
  q.node.resize(n);
  q.weight.resize(n);
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1.0;
    for (int step = 0; step < 100; ++step) {
      const double p = Legendre(n, x);
      slope = n * (x * p - Legendre(n - 1, x)) / (x * x - 1.0);
      const double dx = p / slope;
      x -= dx;
      if (std::abs(dx) < 1e-15) break;
    }
    q.node[n - 1 - i] = low + (high - low) * 0.5 * (1.0 + x);
    q.weight[n - 1 - i] = (high - low) / ((1.0 - x * x) * slope * slope);
  }
  return q;
}

Quadrature GaussRadau(int n, double low, double high) {
  // On [-1, 1] with the fixed node at -1: roots of (P_{n-1} + P_n) / (1 + x); mirrored afterwards. Newton with the
  // roots already found divided out.
  Quadrature q;
  const auto value = [&](double x) { return (Legendre(n - 1, x) + Legendre(n, x)) / (1.0 + x); };
  std::vector<double> roots;
  // The n - 1 roots lie apart by more than 1/n^2: bracket them on a fine grid in the angle and bisect.
  const int grid = 400 * n;
  double x0 = std::cos(std::numbers::pi * (1.0 - 1e-9)), f0 = value(x0);
  for (int i = 1; i <= grid; ++i) {
    const double x1 = std::cos(std::numbers::pi * (1.0 - static_cast<double>(i) / grid)), f1 = value(x1);
    if (f0 * f1 < 0) {
      double a = x0, b = x1, fa = f0;
      for (int step = 0; step < 200 && b - a > 1e-16; ++step) {
        const double middle = 0.5 * (a + b), f = value(middle);
        (fa * f <= 0 ? b : a) = middle;
        if (a == middle) fa = f;
      }
      roots.push_back(0.5 * (a + b));
    }
    x0 = x1;
    f0 = f1;
  }
  const double half = 0.5 * (high - low);
  for (auto it = roots.rbegin(); it != roots.rend(); ++it) {
    const double p = Legendre(n - 1, *it);
    q.node.push_back(low + half * (1.0 - *it));
    q.weight.push_back(half * (1.0 - *it) / (n * n * p * p));
  }
  q.node.push_back(high);
  q.weight.push_back(half * 2.0 / (n * n));
  return q;
}

}  // namespace crownfit
