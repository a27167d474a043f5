#pragma once
// The diffusing layer as the shader model sees it: which share of the light entering at a point leaves within each ring
// around it, on the same side (reflection) and on the opposite one (transmission), as a function of the layer's
// thickness.

#include <cmath>
#include <vector>

#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"

namespace crownfit {

template <class T>
struct DiffuserOptics {
  T reduced_scattering, absorption, g;
  WetSurface<T> boundary;  ///< between this layer and the medium outside the whole object
};

/// Shares per ring at one thickness.
template <class T>
struct RingShares {
  std::vector<T> reflected, transmitted;
  T total_reflected, total_transmitted;
};

/// Shares at one thickness. Source: exponential, as 4 points of equal flux (Gauss); boundaries: images (Donner and
/// Jensen 2005), rings in closed form; totals: the closed form of the infinite sum, the last ring takes what the others
/// leave.
template <class T>
RingShares<T> DiffuserShares(const DiffuserOptics<T>& o, double thickness_mm,
                             const std::vector<double>& outer_radius_mm) {
  using std::exp;
  using std::log;
  using std::sqrt;
  using Term = Terms<T>;
  constexpr int kImages = 3;  // to either side; rings end where the next image would change them by less than 1e-4
  constexpr double kNode[4] = {0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263};
  constexpr double kWeight[4] = {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269};

  const T extinction = o.reduced_scattering + o.absorption;
  const T diffusion = Term::DiffusionCoefficient(o.reduced_scattering, o.absorption, o.g);
  const T transport = sqrt(Term::TransportSquared(o.absorption, diffusion));
  const T zb = 2.0 * MomentsOf(o.boundary).boundary_A * diffusion;
  const T d(thickness_mm), length = d + 2.0 * zb;

  RingShares<T> shares;
  shares.total_reflected = Term::SlabReflectance(o.reduced_scattering, extinction, transport, d, zb, zb);
  shares.total_transmitted = Term::SlabTransmittance(o.reduced_scattering, extinction, transport, d, zb, zb);
  const T scattered = o.reduced_scattering / extinction * (1.0 - exp(-extinction * d));
  T reflected_before(0.0), transmitted_before(0.0);
  for (double radius : outer_radius_mm) {
    T reflected(0.0), transmitted = Term::Attenuation(extinction, d);
    for (int s = 0; s < 4; ++s) {
      // Depth below which the share 1 - kNode of the scattering happens.
      const T depth = -log(1.0 - kNode[s] * (1.0 - exp(-extinction * d))) / extinction;
      T up(0.0), down(0.0);
      for (int i = -kImages; i <= kImages; ++i) {
        const T real = 2.0 * static_cast<double>(i) * length + depth,
                image = 2.0 * static_cast<double>(i) * length - depth - 2.0 * zb;
        up += Term::PointSourceFlux(transport, real, T(radius)) - Term::PointSourceFlux(transport, image, T(radius));
        down += Term::PointSourceFlux(transport, d - real, T(radius)) -
                Term::PointSourceFlux(transport, d - image, T(radius));
      }
      reflected += kWeight[s] * scattered * up;
      transmitted += kWeight[s] * scattered * down;
    }
    shares.reflected.push_back(reflected - reflected_before);
    shares.transmitted.push_back(transmitted - transmitted_before);
    reflected_before = reflected;
    transmitted_before = transmitted;
  }
  shares.reflected.push_back(shares.total_reflected - reflected_before);
  shares.transmitted.push_back(shares.total_transmitted - transmitted_before);
  return shares;
}

/// DiffuserShares tabulated over thickness (TableThickness) and interpolated by cubics.
template <class T>
class DiffuserTable {
 public:
  DiffuserTable(const DiffuserOptics<T>& optics, const std::vector<double>& outer_radius_mm) {
    for (int i = 0; i < kNodes; ++i)
      nodes_.push_back(DiffuserShares(optics, Terms<double>::TableThickness(i), outer_radius_mm));
    nodes_.insert(nodes_.begin(), Continued(nodes_[0], nodes_[1]));
    nodes_.push_back(Continued(nodes_[kNodes], nodes_[kNodes - 1]));
  }

  /// The nodes, one beyond either end (straight continuations) included: node i stands at TableThickness(i - 1).
  const std::vector<RingShares<T>>& nodes() const { return nodes_; }

  /// Weights of the four nodes around a thickness; kept so that several rings share the work.
  struct Place {
    int first;
    T weight[4];
  };
  Place At(const T& thickness_mm) const {
    const T d = Terms<T>::clamp(thickness_mm, T(0.0), T(Terms<double>::TableThickness(kNodes - 1)));
    const T u = Terms<T>::TablePlace(d);
    Place p{0, {}};
    while (p.first + 2 < kNodes && u >= static_cast<double>(p.first + 1)) ++p.first;
    for (int k = 0; k < 4; ++k) p.weight[k] = Terms<T>::CubicWeight(k - 1, u - static_cast<double>(p.first));
    return p;
  }
  T Reflected(const Place& p, int ring) const {
    return Sum(p, [&](const RingShares<T>& node) -> const T& { return node.reflected[ring]; });
  }
  T Transmitted(const Place& p, int ring) const {
    return Sum(p, [&](const RingShares<T>& node) -> const T& { return node.transmitted[ring]; });
  }
  T TotalReflected(const Place& p) const {
    return Sum(p, [](const RingShares<T>& node) -> const T& { return node.total_reflected; });
  }
  T TotalTransmitted(const Place& p) const {
    return Sum(p, [](const RingShares<T>& node) -> const T& { return node.total_transmitted; });
  }

 private:
  static constexpr int kNodes = 22;  // 0 to 19 mm
  static RingShares<T> Continued(const RingShares<T>& end, const RingShares<T>& before) {
    RingShares<T> next = end;
    for (size_t k = 0; k < end.reflected.size(); ++k) {
      next.reflected[k] = 2.0 * end.reflected[k] - before.reflected[k];
      next.transmitted[k] = 2.0 * end.transmitted[k] - before.transmitted[k];
    }
    next.total_reflected = 2.0 * end.total_reflected - before.total_reflected;
    next.total_transmitted = 2.0 * end.total_transmitted - before.total_transmitted;
    return next;
  }
  template <class Value>
  T Sum(const Place& p, const Value& value) const {
    T sum(0.0);
    for (int k = 0; k < 4; ++k) sum += p.weight[k] * value(nodes_[p.first + k]);
    return sum;
  }
  std::vector<RingShares<T>> nodes_;
};

}  // namespace crownfit
