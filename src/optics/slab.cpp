#include "optics/slab.h"

#include "base/json_file.h"
#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"

namespace crownfit {

Slab ReadSlab(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root = file.RootOfFormat(
      "crownfit-slab/1", {"layers", "ior_above", "ior_below", "backing_reflectance", "backing_contact", "radii_mm"});
  Slab slab;
  const JsonNode layers = root.Require("layers");
  for (const auto& item : layers.Items(100)) {
    const JsonObject o(item,
                       {"ior", "g", "isotropic_fraction", "scattering_per_mm", "absorption_per_mm", "thickness_mm"});
    SlabLayer layer;
    layer.ior = o.Require("ior").Number(1.0, 3.0);
    if (const auto g = o.Find("g")) layer.g = g->Number(-0.99, 0.999);
    if (const auto share = o.Find("isotropic_fraction")) layer.isotropic_fraction = share->Number(0.0, 1.0);
    layer.scattering_per_mm = o.Require("scattering_per_mm").Number(0.0, 1e5);
    layer.absorption_per_mm = o.Require("absorption_per_mm").Number(0.0, 1e4);
    layer.thickness_mm = o.Require("thickness_mm").Number(0.0, 1e4);
    slab.layers.push_back(layer);
  }
  if (slab.layers.empty()) layers.Fail("at least one layer is needed", "List the topmost layer first.");
  if (const auto n = root.Find("ior_above")) slab.ior_above = n->Number(1.0, 3.0);
  if (const auto n = root.Find("ior_below")) slab.ior_below = n->Number(1.0, 3.0);
  if (const auto rho = root.Find("backing_reflectance")) slab.backing_reflectance = rho->Number(0.0, 1.0);
  if (const auto contact = root.Find("backing_contact")) slab.backing_contact = contact->Bool();
  if (const auto radii = root.Find("radii_mm")) {
    slab.radii_mm = radii->Numbers();
    for (size_t i = 0; i < slab.radii_mm.size(); ++i)
      if (slab.radii_mm[i] < 0 || (i > 0 && slab.radii_mm[i] <= slab.radii_mm[i - 1]))
        radii->Fail("ring edges must ascend and not be negative", "Write them as in [0, 0.1, 0.2, 0.5].");
    if (slab.radii_mm.size() == 1) radii->Fail("a ring needs two edges", "Give at least two edges.");
  }
  return slab;
}

void SetSpecular(const Slab& slab, SlabAnswer& answer) {
  const double n = slab.layers[0].ior / slab.ior_above;
  answer.specular = Terms<double>::FresnelReflectance(1.0, n);
  answer.specular_diffuse = n >= 1.0 ? MomentsOf(n).diffuse_outside : MomentsOf(1.0 / n).diffuse_inside;
}

std::string SlabAnswerJson(const SlabAnswer& a) {
  const auto totals = [](const SlabTotals& t) {
    return JsonValue::Object{{"reflectance_collimated", t.reflectance_collimated},
                             {"transmittance_collimated", t.transmittance_collimated},
                             {"reflectance_diffuse", t.reflectance_diffuse},
                             {"transmittance_diffuse", t.transmittance_diffuse}};
  };
  JsonValue::Object answer{
      {"model", Word(a.model)}, {"specular", a.specular}, {"specular_diffuse", a.specular_diffuse}};
  for (const auto& member : totals(a.value)) answer.push_back(member);
  JsonValue::Object stddev{{"specular", 0.0}, {"specular_diffuse", 0.0}};
  for (const auto& member : totals(a.stddev)) stddev.push_back(member);
  if (!a.radial_reflectance_per_mm2.empty()) {
    answer.emplace_back("radial_reflectance_per_mm2", a.radial_reflectance_per_mm2);
    answer.emplace_back("radial_transmittance_per_mm2", a.radial_transmittance_per_mm2);
    stddev.emplace_back("radial_reflectance_per_mm2", a.radial_reflectance_stddev);
    stddev.emplace_back("radial_transmittance_per_mm2", a.radial_transmittance_stddev);
  }
  answer.emplace_back("stddev", stddev);
  answer.emplace_back("photons", a.photons);
  answer.emplace_back("wall_s", a.wall_s);
  return ToJsonText(answer);
}

}  // namespace crownfit
