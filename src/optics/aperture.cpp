#include "optics/aperture.h"

#include <cmath>

#include "optics/quadrature.h"

namespace crownfit {
namespace {

// Reflectance is smooth in x / (x + kBend), x = wave number times radius: eight nodes there are within 3e-4 of 24.
constexpr int kWaves = 8;
constexpr double kBend = 2.0;

/// Quadrature weights of nodes in s = x / (x + kBend): the spectrum's integral of the Lagrange polynomial that is 1 at
/// one node and 0 at the others.
std::vector<double> Weights(const std::vector<double>& nodes) {
  constexpr int kSteps = 4000;
  std::vector<double> weights(nodes.size(), 0.0);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double s = (i + 0.5) / kSteps, x = kBend * s / (1.0 - s), bessel = std::cyl_bessel_j(1.0, x);
    const double spectrum = 2.0 * bessel * bessel / x * kBend / ((1.0 - s) * (1.0 - s)) / kSteps;
    sum += spectrum;
    for (size_t j = 0; j < nodes.size(); ++j) {
      double polynomial = 1.0;
      for (size_t k = 0; k < nodes.size(); ++k)
        if (k != j) polynomial *= (s - nodes[k]) / (nodes[j] - nodes[k]);
      weights[j] += spectrum * polynomial;
    }
  }
  for (double& w : weights) w /= sum;
  return weights;
}

}  // namespace

std::vector<ApertureWave> ApertureWaves(double diameter_mm) {
  static const std::vector<double> nodes = GaussLegendre(kWaves, 0.0, 1.0).node, weights = Weights(nodes);
  std::vector<ApertureWave> waves;
  for (size_t i = 0; i < nodes.size(); ++i)
    waves.push_back({kBend * nodes[i] / (1.0 - nodes[i]) / (0.5 * diameter_mm), weights[i]});
  return waves;
}

Slab UnderWave(Slab slab, double k) {
  for (SlabLayer& layer : slab.layers) {
    const double scattering = layer.scattering_per_mm * (1.0 - (1.0 - layer.isotropic_fraction) * layer.g);
    const double extinction = scattering + layer.absorption_per_mm;
    if (k > 1e-9 * extinction) layer.absorption_per_mm = k / std::atan2(k, extinction) - scattering;
  }
  return slab;
}

}  // namespace crownfit
