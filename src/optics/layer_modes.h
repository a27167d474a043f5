#pragma once
// One homogeneous layer between boundaries of its own index, for any thickness, and its derivatives.

#include "optics/stack.h"

namespace crownfit {

/// Eigenvectors of the layer's transfer equation in the given directions (Stamnes and Swanson 1981; symmetric form:
/// Nakajima and Tanaka 1986). Phase function by Legendre moments, its forward peak cut off by delta-M (Wiscombe 1977).
class LayerModes {
 public:
  LayerModes(const SlabLayer& layer, const Directions& directions, int moments);
  Stack OfThickness(double thickness_mm) const;

  /// First-order change of the layer's equations by a change of its numbers, in its modes' coordinates.
  struct Change {
    double extinction_per_mm = 0, thickness_mm = 0;
    Eigen::MatrixXd alike, unlike;  ///< of the losses F and E; empty: neither changes
    bool IsNone() const { return thickness_mm == 0 && alike.size() == 0; }
  };
  /// `change`: by how much each number changes. The index is ignored: directions depend on it. Coefficients of a
  /// perfectly clear layer must not change.
  Change ChangeBy(const SlabLayer& change) const;
  /// First-order changes of what is seen of the layer. Columns are light sources and views. Rows are the directions at
  /// its top, then those at its bottom: the radiance that arrives there, and the weight with which radiance that leaves
  /// there is finally seen. One matrix per change, with one row per view. The thickness must exceed 0.
  std::vector<Eigen::MatrixXd> SeenChanges(double thickness_mm, const std::vector<Change>& changes,
                                           const Eigen::MatrixXd& arriving, const Eigen::MatrixXd& sights) const;

 private:
  /// Coefficients without the forward peak.
  struct Cut {
    double extinction_per_mm = 0, albedo = 0, absorbed = 0;  ///< absorbed: 1 - albedo
    Eigen::VectorXd moments;                                 ///< Legendre, times 2 l + 1
  };
  static Cut CutPeak(const SlabLayer& layer, int moments);
  static Cut CutPeakChange(const SlabLayer& layer, const SlabLayer& change, int moments);
  /// Scattering into directions on the same side plus (alike), and minus (unlike), that into the other side.
  struct Turned {
    Eigen::MatrixXd alike, unlike;
  };
  Turned TurnedBy(const Eigen::VectorXd& moments) const;
  Eigen::MatrixXd Loss(const Eigen::MatrixXd& turned) const;

  SlabLayer layer_;
  Cut cut_;
  Eigen::MatrixXd legendre_even_, legendre_odd_;  ///< times sqrt(weight / cosine)
  Eigen::VectorXd per_cosine_, root_of_flux_;     ///< the root makes the matrices symmetric
  Turned turned_;
  Eigen::VectorXd decay_;  ///< per unit of optical depth
  Eigen::MatrixXd modes_;
};

}  // namespace crownfit
