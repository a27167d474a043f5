#pragma once
// Flat layered samples: the input (slab.json) and the answer of every model.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "optics/model.h"

namespace crownfit {

struct SlabLayer {
  double ior = 1.5, g = 0.0, isotropic_fraction = 0.0;
  double scattering_per_mm = 0.0, absorption_per_mm = 0.0, thickness_mm = 1.0;
};

struct Slab {
  std::vector<SlabLayer> layers;  ///< from the top, where the light comes from
  double ior_above = 1.0, ior_below = 1.0;
  double backing_reflectance = 0.0;  ///< Lambertian
  bool backing_contact = false;      ///< true: no air gap, the backing touches the last layer
  std::vector<double> radii_mm;      ///< ring edges, ascending
};

/// Reads slab.json ("crownfit-slab/1"). Throws InputError.
Slab ReadSlab(const std::filesystem::path& file);

/// Fractions of the incident flux. Reflectances exclude the first surface's specular reflection; transmittances include
/// unscattered light. With a backing, transmittance is what the backing absorbs.
struct SlabTotals {
  double reflectance_collimated = 0, transmittance_collimated = 0;  ///< normal incidence
  double reflectance_diffuse = 0, transmittance_diffuse = 0;        ///< uniform radiance from above
};

struct SlabAnswer {
  Model model = Model::kLayered;
  double specular = 0, specular_diffuse = 0;                                     ///< reflected by the first surface
  SlabTotals value, stddev;                                                      ///< stddev 0: deterministic
  std::vector<double> radial_reflectance_per_mm2, radial_transmittance_per_mm2;  ///< ring means, normal incidence
  std::vector<double> radial_reflectance_stddev, radial_transmittance_stddev;
  double photons = 0, wall_s = 0;
};

/// Specular reflectance of the first surface for normal and for diffuse light.
void SetSpecular(const Slab& slab, SlabAnswer& answer);

std::string SlabAnswerJson(const SlabAnswer& answer);

}  // namespace crownfit
