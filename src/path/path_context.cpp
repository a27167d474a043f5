#include "path/path_context.h"

#include <cmath>
#include <map>

#include "capture/capture.h"
#include "optics/media.h"

namespace crownfit {
namespace {

/// d ln HalfSpaceReflectance of the layer by ln scattering and ln absorption.
CutDerivatives HalfSpaceDerivatives(const Material::Layer& layer) {
  const auto slope = [&](Quantity q) {
    constexpr double kStep = 1e-4;
    Material::Layer up = layer, down = layer;
    up[q] *= std::exp(kStep), down[q] *= std::exp(-kStep);
    const Spectrum high = HalfSpaceReflectance(up), low = HalfSpaceReflectance(down);
    Spectrum d(high.size(), 0.0);
    for (int c = 0; c < d.size(); ++c)
      if (low[c] > 0) d[c] = std::log(high[c] / low[c]) / (2.0 * kStep);
    return d;
  };
  return {slope(Quantity::kReducedScattering), slope(Quantity::kAbsorption)};
}

/// The tile that touches the object, if there is one.
std::optional<size_t> ContactBackingOf(const Capture& capture, size_t photograph) {
  const std::optional<size_t> backing = capture.photographs[photograph].backing;
  return backing && capture.backings[*backing].in_contact ? backing : std::nullopt;
}

}  // namespace

Surroundings::Surroundings(const Capture& capture, const std::vector<TriangleMesh>& scenery,
                           const std::vector<size_t>& photographs) {
  std::map<std::pair<bool, size_t>, size_t> index;  // key: whether a backing or scenery, and its index
  const auto add = [&](bool is_backing, size_t i, size_t photograph, const auto& mesh, const Spectrum& rho) {
    const auto [at, is_new] = index.try_emplace({is_backing, i}, things.size());
    if (is_new) meshes.push_back(mesh()), things.push_back({rho, 0});
    things[at->second].photographs |= PhotographSet{1} << photograph;
  };
  for (size_t k = 0; k < photographs.size(); ++k) {
    const PhotographSpec& photo = capture.photographs[photographs[k]];
    for (const size_t i : photo.scenery)
      add(
          false, i, k, [&] { return scenery[i]; }, capture.scenery[i].reflectance);
    if (!photo.backing) continue;
    const BackingSpec& tile = capture.backings[*photo.backing];
    add(
        true, *photo.backing, k, [&] { return SquareTile(tile.point_mm, tile.normal, tile.size_mm); },
        tile.reflectance);
  }
}

ContactTile::ContactTile(const BackingSpec& tile)
    : centre(tile.point_mm), normal(tile.normal), half_size_mm(0.5 * tile.size_mm), reflectance(tile.reflectance) {
  std::tie(side_u, side_v) = Tangents(normal);
}

Media MediaOf(const Capture& capture, const Material& material, const LayeredBody& body) {
  std::vector<Medium> media(1);
  media[0].ior = capture.outside_ior;
  media[0].scattering = media[0].absorption = Spectrum(capture.channels(), 0.0);
  for (size_t l = 0; l < material.layers.size(); ++l) {
    const Material::Layer& layer = material.layers[l];
    Medium m;
    m.texture = body.absorption[l].get();
    m.ior = layer[Quantity::kIor][0];
    m.g = layer[Quantity::kAsymmetry][0];
    m.isotropic_fraction = layer[Quantity::kIsotropicFraction][0];
    m.scattering = layer[Quantity::kReducedScattering].Mapped(
        [&](double reduced) { return TrueScattering(reduced, m.g, m.isotropic_fraction); });
    m.absorption = layer[Quantity::kAbsorption];
    media.push_back(m);
  }
  return Media(std::move(media));
}

PathContext PathContextOf(const Capture& capture, const Material& material, const std::vector<size_t>& photographs,
                          const PathOptions& options, PathContext begun) {
  const PhotographSpec& first = capture.photographs[photographs[0]];
  for (const size_t i : photographs) begun.polarisers.push_back(capture.photographs[i].polarisers());
  begun.wants_derivatives = options.derivatives;
  for (size_t i = 0; i < begun.media.size(); ++i) {
    const OuterBoundary outer{material.surface[Quantity::kRoughness][0], material.surface[Quantity::kWetness][0],
                              begun.media[static_cast<int>(i)].ior, capture.outside_ior};
    begun.outer.push_back(outer);
  }
  begun.cut_is_opaque = capture.neck != Neck::kAir;
  if (capture.neck == Neck::kRoot) {
    const Material::Layer& root = material.layers.back();
    begun.cut_reflectance = Min(material.surface[Quantity::kNeckReturn][0] * HalfSpaceReflectance(root), Spectrum(1.0));
    const Spectrum unclamped = begun.cut_reflectance.Mapped([](double r) { return r < 1.0 ? 1.0 : 0.0; });
    const CutDerivatives derivatives = HalfSpaceDerivatives(root);
    begun.cut_derivatives = {unclamped * derivatives.scattering, unclamped * derivatives.absorption};
  }
  if (const auto contact = ContactBackingOf(capture, photographs[0])) begun.contact.emplace(capture.backings[*contact]);
  size_t sampled = 0;
  std::map<size_t, size_t> lamp_of_light;
  for (size_t k = 0; k < photographs.size(); ++k)
    for (const size_t i : capture.photographs[photographs[k]].lights) {
      const Light& light = capture.lights[i];
      if (const auto [at, is_new] = lamp_of_light.try_emplace(i, begun.lamps.size()); is_new) {
        const bool is_sampled =
            options.lamps_are_sampled && !std::holds_alternative<DomeLight>(light.shape) && sampled++ < kMaxLamps;
        begun.lamps.push_back(
            {light.in_camera_frame ? Transformed(light.shape, first.camera_from_object.Inverse()) : light.shape,
             light.intensity_scale, is_sampled, 0,
             is_sampled && options.estimator == Estimator::kCollisions && !IsAllAround(light.shape)});
      }
      begun.lamps[lamp_of_light[i]].photographs |= PhotographSet{1} << k;
    }
  return begun;
}

bool CanShareWalks(const Capture& capture, size_t a, size_t b) {
  const PhotographSpec &first = capture.photographs[a], &second = capture.photographs[b];
  return first.camera == second.camera && first.camera_from_object == second.camera_from_object &&
         ContactBackingOf(capture, a) == ContactBackingOf(capture, b);
}

}  // namespace crownfit
