#pragma once
// Equivalents of the layers for programs with simpler material models: albedos, slabs, one medium. docs/exchange.md
// derives and measures them.

#include "exchange/export_scene.h"
#include "optics/slab.h"

namespace crownfit {

/// The layers as a flat sample, for one channel; a layer without a thickness becomes 1000 mm thick.
Slab SlabOf(const ExportScene& scene, int channel);

/// The layers' reflectance and transmittance at normal incidence (without the first surface's specular reflection), and
/// their transmittance without absorption.
struct Translucency {
  Spectrum reflectance, transmittance, transmittance_without_absorption;
  double specular = 0;                 ///< reflected by the first surface at normal incidence
  std::optional<double> thickness_mm;  ///< of all layers; empty where one is not known
};
Translucency TranslucencyOf(const ExportScene& scene);

/// One medium in place of the layers. Scattering and g are means over the known thicknesses; a layer of unknown
/// thickness counts alone. The absorption is such that a sample of the same thickness returns the same light. A single
/// layer keeps its scattering.
ExportedLayer OneMediumFor(const ExportScene& scene);

/// Per channel: share of diffuse light that an index-matched half space returns (HalfSpaceReflectance).
Spectrum MultipleScatteringAlbedo(const ExportedLayer& layer);

/// The same share for light that has passed the surface, measured where it comes out again, internal reflection at the
/// surface included. For programs whose random walk in the medium has no internal reflection. By adding-doubling.
Spectrum AlbedoBehindSurface(const ExportedLayer& layer, double outside_ior);

/// Per channel: 1 / (scattering + absorption), mm; at most 1e6.
Spectrum MeanFreePath_mm(const ExportedLayer& layer);

/// Per channel: 1 / (reduced scattering + absorption), mm; at most 1e6.
Spectrum TransportMeanFreePath_mm(const ExportedLayer& layer);

/// Mean cosine of a Henyey-Greenstein function with the same scattering and the same reduced scattering.
inline double MeanCosine(const ExportedLayer& layer) { return (1.0 - layer.isotropic_fraction) * layer.asymmetry; }

}  // namespace crownfit
