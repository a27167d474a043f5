#pragma once
// What programs that know of fewer numbers are given in place of layers: albedos, slabs, one medium. docs/exchange.md
// derives and measures them.

#include "exchange/export_scene.h"
#include "optics/slab.h"

namespace crownfit {

/// The layers as a flat sample of one channel; a layer without a thickness as 1000 mm of it.
Slab SlabOf(const ExportScene& scene, int channel);

/// The layers' reflectance and transmittance for light at normal incidence (without the first surface's mirror), and
/// the transmittance that they would have without absorption.
struct Translucency {
  glm::dvec3 reflectance{0.0}, transmittance{0.0}, transmittance_without_absorption{0.0};
  double specular = 0;                 ///< mirrored by the first surface at normal incidence
  std::optional<double> thickness_mm;  ///< of all layers; nothing where one is not known
};
Translucency TranslucencyOf(const ExportScene& scene);

/// One medium in place of the layers: scattering and g as the mean over the known thicknesses (where a layer's is not
/// known, that layer's alone), and the absorption with which a sample of the same thickness returns the same light.
/// Scattering of one layer stays as it is.
ExportedLayer OneMediumFor(const ExportScene& scene);

/// Per channel: share of diffuse light that a half space returns without a change of index (HalfSpaceReflectance).
glm::dvec3 MultipleScatteringAlbedo(const ExportedLayer& layer);

/// The same of light that came through the surface and what of it comes out again, the surface's reflection from inside
/// included: what programs ask for whose walk in the medium meets no surface from inside. By adding-doubling.
glm::dvec3 AlbedoBehindSurface(const ExportedLayer& layer, double outside_ior);

/// Per channel: 1 / (scattering + absorption), mm; at most 1e6.
glm::dvec3 MeanFreePath_mm(const ExportedLayer& layer);

/// The same with the reduced scattering.
glm::dvec3 TransportMeanFreePath_mm(const ExportedLayer& layer);

/// Henyey-Greenstein alone with the same reduced scattering and the same scattering: the mean cosine.
inline double MeanCosine(const ExportedLayer& layer) { return (1.0 - layer.isotropic_fraction) * layer.asymmetry; }

}  // namespace crownfit
