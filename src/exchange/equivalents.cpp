#include "exchange/equivalents.h"

#include <algorithm>
#include <cmath>

#include "optics/adding_doubling.h"
#include "optics/media.h"

namespace crownfit {
namespace {

constexpr double kHalfSpace_mm = 1000.0;
constexpr double kClear_per_mm = 1e-6;  // keeps paths in clear layers finite

SlabLayer SlabLayerOf(const ExportedLayer& layer, int channel) {
  return {layer.ior,
          layer.asymmetry,
          layer.isotropic_fraction,
          layer.scattering_per_mm[channel],
          layer.absorption_per_mm[channel],
          layer.thickness_mm.value_or(kHalfSpace_mm)};
}

double ReflectanceOf(const Slab& slab) { return SolveByAddingDoubling(slab).value.reflectance_collimated; }

/// The absorption with which a slab of one layer returns `reflectance`, which falls with absorption.
double AbsorptionForReflectance(Slab slab, double reflectance) {
  double& absorption = slab.layers[0].absorption_per_mm;
  double low = 1e-6, high = 100.0;
  constexpr int kHalvings = 26;  // of ln absorption: to 3e-7
  for (int i = 0; i < kHalvings; ++i) {
    absorption = std::sqrt(low * high);
    (ReflectanceOf(slab) > reflectance ? low : high) = absorption;
  }
  return absorption;
}

}  // namespace

Slab SlabOf(const ExportScene& scene, int channel) {
  Slab slab;
  slab.ior_above = slab.ior_below = scene.outside_ior;
  for (const ExportedLayer& layer : scene.layers) slab.layers.push_back(SlabLayerOf(layer, channel));
  return slab;
}

Translucency TranslucencyOf(const ExportScene& scene) {
  Translucency t;
  t.reflectance = t.transmittance = t.transmittance_without_absorption = Spectrum(scene.channels(), 0.0);
  for (int c = 0; c < scene.channels(); ++c) {
    Slab slab = SlabOf(scene, c);
    const SlabAnswer answer = SolveByAddingDoubling(slab);
    t.specular = answer.specular;
    t.reflectance[c] = answer.value.reflectance_collimated;
    t.transmittance[c] = answer.value.transmittance_collimated;
    for (SlabLayer& layer : slab.layers) layer.absorption_per_mm = 0;
    t.transmittance_without_absorption[c] = SolveByAddingDoubling(slab).value.transmittance_collimated;
  }
  t.thickness_mm = 0;
  for (const ExportedLayer& layer : scene.layers)
    t.thickness_mm =
        t.thickness_mm && layer.thickness_mm ? std::optional(*t.thickness_mm + *layer.thickness_mm) : std::nullopt;
  return t;
}

ExportedLayer OneMediumFor(const ExportScene& scene) {
  if (scene.layers.size() == 1) return scene.layers[0];
  const auto unknown = std::find_if(scene.layers.begin(), scene.layers.end(),
                                    [](const ExportedLayer& layer) { return !layer.thickness_mm; });
  ExportedLayer one;
  if (unknown != scene.layers.end()) {
    one = *unknown;
  } else {
    double total = 0, scattering = 0, reduced = 0;
    for (const ExportedLayer& layer : scene.layers) {
      const double d = *layer.thickness_mm;
      total += d;
      one.scattering_per_mm += d * layer.scattering_per_mm;
      for (int c = 0; c < scene.channels(); ++c) {
        scattering += d * layer.scattering_per_mm[c];
        reduced += d * layer.reduced_scattering_per_mm()[c];
      }
    }
    one.scattering_per_mm /= total;
    one.asymmetry = scattering > 0 ? 1.0 - reduced / scattering : 0.0;
    one.isotropic_fraction = 0;
    one.thickness_mm = total;
  }
  one.name = "all_layers";
  one.ior = scene.layers[0].ior;
  one.absorption_per_mm = Spectrum(scene.channels(), 0.0);
  for (int c = 0; c < scene.channels(); ++c) {
    Slab slab = SlabOf(scene, c);
    const double reflectance = ReflectanceOf(slab);
    slab.layers = {SlabLayerOf(one, c)};
    one.absorption_per_mm[c] = AbsorptionForReflectance(slab, reflectance);
  }
  return one;
}

Spectrum MultipleScatteringAlbedo(const ExportedLayer& layer) {
  Spectrum albedo = layer.absorption_per_mm;
  for (int c = 0; c < albedo.size(); ++c)
    albedo[c] = HalfSpaceReflectance(layer.reduced_scattering_per_mm()[c], layer.absorption_per_mm[c]);
  return albedo;
}

Spectrum AlbedoBehindSurface(const ExportedLayer& layer, double outside_ior) {
  ExportedLayer half_space = layer;
  half_space.thickness_mm = kHalfSpace_mm;
  Spectrum albedo = layer.absorption_per_mm;
  for (int c = 0; c < albedo.size(); ++c) {
    Slab slab;
    slab.ior_above = slab.ior_below = outside_ior;
    slab.layers = {SlabLayerOf(half_space, c)};
    const SlabAnswer answer = SolveByAddingDoubling(slab);
    albedo[c] = answer.value.reflectance_collimated / (1.0 - answer.specular);
  }
  return albedo;
}

Spectrum TransportMeanFreePath_mm(const ExportedLayer& layer) {
  return 1.0 / Max(layer.reduced_scattering_per_mm() + layer.absorption_per_mm, Spectrum(kClear_per_mm));
}

Spectrum MeanFreePath_mm(const ExportedLayer& layer) {
  return 1.0 / Max(layer.scattering_per_mm + layer.absorption_per_mm, Spectrum(kClear_per_mm));
}

}  // namespace crownfit
