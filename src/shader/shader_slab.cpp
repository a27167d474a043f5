#include "shader/shader_slab.h"

#include <algorithm>
#include <numbers>

#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"
#include "shader/layered_diffusion.h"

namespace crownfit {
namespace {

using Term = Terms<double>;

/// Reflectance of the boundary for diffuse light that goes from one index towards another.
double DiffuseReflectance(double from, double into) {
  return into >= from ? MomentsOf(into / from).diffuse_outside : MomentsOf(from / into).diffuse_inside;
}

/// Light from above that leaves a slab on either side, without the first surface's specular reflection.
struct Passed {
  double reflected, transmitted;
};

/// `cosine`: of the light outside; `entered`: the share that the first surface transmits.
Passed Of(const Slab& slab, double below, double cosine, double entered) {
  const std::vector<SlabLayer>& layers = slab.layers;
  std::vector<LayerResponse<double>> response;
  std::vector<double> beam{1.0};  // beam on top of each layer, and below the last
  for (const SlabLayer& l : layers) {
    const double reduced = l.scattering_per_mm * (1.0 - (1.0 - l.isotropic_fraction) * l.g),
                 inside = std::max(1e-3, Term::RefractedCosine(cosine, l.ior / slab.ior_above));
    response.emplace_back(DiffusingLayer<double>{reduced, l.absorption_per_mm, l.g, l.ior}, inside, l.thickness_mm,
                          0.0);
    beam.push_back(beam.back() * response.back().beam);
  }
  const auto face = [](double inside, double outside) {
    const double r = DiffuseReflectance(inside, outside);
    return 2.0 * (1.0 + r) / (1.0 - r);
  };
  const double top = face(layers.front().ior, slab.ior_above), bottom = face(layers.back().ior, below);
  Impedance<double> under{bottom, 0.0}, over{top, 0.0};
  for (size_t i = layers.size(); i-- > 0;) {
    under.Cross(response[i], beam[i], true);
    if (i > 0) under.Cross(IndexStep<double>(layers[i].ior, layers[i - 1].ior));
  }
  for (size_t i = 0; i < layers.size(); ++i) {
    over.Cross(response[i], beam[i], false);
    if (i + 1 < layers.size()) over.Cross(IndexStep<double>(layers[i].ior, layers[i + 1].ior));
  }
  const double last = Term::RefractedCosine(cosine, layers.back().ior / slab.ior_above),
               mirrored = Term::FresnelReflectance(last, below / layers.back().ior);
  return {entered * under.source / (top + under.impedance),
          entered * (over.source / (bottom + over.impedance) + beam.back() * (1.0 - mirrored))};
}

}  // namespace

SlabAnswer SolveByShader(const Slab& slab) {
  SlabAnswer answer;
  answer.model = Model::kShader;
  SetSpecular(slab, answer);
  const double below = slab.backing_contact ? slab.layers.back().ior : slab.ior_below, rho = slab.backing_reflectance,
               diagonal = std::numbers::sqrt2 / 2;
  Passed collimated = Of(slab, below, 1.0, 1.0 - answer.specular),
         diffuse = Of(slab, below, diagonal, 1.0 - answer.specular_diffuse);
  if (rho > 0) {
    // The backing reflects a share rho diffusely, repeatedly.
    Slab turned = slab;
    std::reverse(turned.layers.begin(), turned.layers.end());
    turned.ior_above = below;
    const double mirrored = DiffuseReflectance(below, slab.layers.back().ior);
    const Passed back = Of(turned, slab.ior_above, diagonal, 1.0 - mirrored);
    for (Passed* p : {&collimated, &diffuse}) {
      const double met = p->transmitted / std::max(1.0 - rho * (mirrored + back.reflected), 1e-12);
      *p = {p->reflected + rho * met * back.transmitted, (1.0 - rho) * met};
    }
  }
  answer.value = {collimated.reflected, collimated.transmitted, diffuse.reflected, diffuse.transmitted};
  return answer;
}

}  // namespace crownfit
