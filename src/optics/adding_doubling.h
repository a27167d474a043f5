#pragma once
// The `layered` model: flat, uniformly lit layers by adding (van de Hulst 1980). Each layer is solved for any thickness
// at once, with an index step at every boundary. Exact but for the number of directions; no lateral transport. Eigen is
// named in stack.h, layer_modes.h and the .cpp files only.

#include <vector>

#include "capture/measurement.h"
#include "optics/slab.h"

namespace crownfit {

struct AddingDoublingOptions {
  int nodes = 24;  ///< directions per group of refractive indices, in a hemisphere: 12 reach 1e-4, 24 reach 3e-5; at g
                   ///< 0.96 2 % and 0.1 %
};

/// Totals of a slab, without the first surface's specular reflection. Any Slab has an answer; rings have none.
SlabAnswer SolveByAddingDoubling(const Slab& slab, const AddingDoublingOptions& options = {});

/// Instrument readings of a slab over any Lambertian backing: radiance factors (1 is a white Lambertian surface), or
/// fractions of the light where a sphere collects all. The first surface's specular reflection is separate.
struct ViewedSlab {
  double reflectance = 0;        ///< over a black backing
  double mirrored = 0;           ///< specular reflection of the first surface; 0 at 45/0
  double transmittance = 0;      ///< fraction of the light that reaches the backing's plane the first time
  double emergence = 0;          ///< how much of a unit flux from the backing is seen
  double reflectance_below = 0;  ///< for diffuse light from the backing
  double Over(double backing_reflectance) const {
    return reflectance +
           transmittance * backing_reflectance * emergence / (1.0 - backing_reflectance * reflectance_below);
  }
  /// Change of Over for the changes `change` of these values.
  double ChangeOver(double backing_reflectance, const ViewedSlab& change) const {
    const double back = backing_reflectance / (1.0 - backing_reflectance * reflectance_below);
    return change.reflectance + back * (change.transmittance * emergence + transmittance * change.emergence +
                                        back * transmittance * emergence * change.reflectance_below);
  }
};

/// Readings of the slab with other thicknesses (mm, one per layer) in place of its own, one for each. The slab's own
/// backing reflectance is not used. `backing_contact`: the backing lies in the last layer's medium, else in
/// `ior_below`.
std::vector<ViewedSlab> ViewSlab(const Slab& slab, const std::vector<std::vector<double>>& thicknesses_mm,
                                 MeasuredAt geometry, const AddingDoublingOptions& options = {16});

/// First-order changes of the readings, one for each thickness and each change. `changes`: by how much every number of
/// each layer changes (thickness too); a layer that changes scatters or absorbs. Exact except for indices, which use
/// finite differences at the cost of two more solutions.
std::vector<std::vector<ViewedSlab>> ViewSlabChanges(const Slab& slab,
                                                     const std::vector<std::vector<double>>& thicknesses_mm,
                                                     MeasuredAt geometry,
                                                     const std::vector<std::vector<SlabLayer>>& changes,
                                                     const AddingDoublingOptions& options = {16});

}  // namespace crownfit
