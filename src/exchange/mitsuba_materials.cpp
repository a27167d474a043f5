#include "exchange/mitsuba_materials.h"

#include <map>

namespace crownfit {
namespace {

/// Henyey-Greenstein's mean cosine, and the share of isotropic scattering beside it.
struct Phase {
  double asymmetry = 0, isotropic = 0;
};

Phase SimplePhaseOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type == "isotropic") return MitsubaPlugin(document, node, {}), Phase{0, 1};
  if (node.type != "hg")
    node.Fail("a phase function of this kind has no equivalent in a capture", "Known: hg, isotropic, and their blend.");
  return {MitsubaPlugin(document, node, {"g"}).Number("g", -0.99, 0.999).value_or(0.8), 0};
}

Phase PhaseOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type == "isotropic") return SimplePhaseOf(document, node), Phase{};
  if (node.type != "blendphase") return SimplePhaseOf(document, node);
  const MitsubaPlugin blend(document, node, {"weight", "<phase>"});
  const auto parts = blend.Nested("phase");
  const auto weight = blend.Number("weight", 0.0, 1.0);  // of the second one
  if (parts.size() != 2 || !weight) node.Fail("expected a weight and two phase functions");
  const Phase first = SimplePhaseOf(document, *parts[0]), second = SimplePhaseOf(document, *parts[1]);
  if (first.isotropic == second.isotropic)
    node.Fail("has no equivalent in a capture", "Blend one hg with one isotropic phase function.");
  return {first.asymmetry + second.asymmetry, second.isotropic == 1 ? *weight : 1 - *weight};
}

double IndexOf(const MitsubaPlugin& bsdf, const char* name, double otherwise) {
  // The names of ior.h of Mitsuba 3.
  static const std::map<std::string, double> known{
      {"vacuum", 1.0},      {"helium", 1.000036},        {"hydrogen", 1.000132},
      {"air", 1.000277},    {"carbon dioxide", 1.00045}, {"water", 1.3330},
      {"acetone", 1.36},    {"ethanol", 1.361},          {"carbon tetrachloride", 1.461},
      {"glycerol", 1.4729}, {"benzene", 1.501},          {"silicone oil", 1.52045},
      {"bromine", 1.661},   {"water ice", 1.31},         {"fused quartz", 1.458},
      {"pyrex", 1.470},     {"acrylic glass", 1.49},     {"polypropylene", 1.49},
      {"bk7", 1.5046},      {"sodium chloride", 1.544},  {"amber", 1.55},
      {"pet", 1.5750},      {"diamond", 2.419}};
  const MitsubaNode* node = bsdf.Find(name);
  if (!node) return otherwise;
  if (node->tag != "string") return *bsdf.Number(name, 1.0, 3.0);
  const auto found = known.find(*bsdf.Text(name));
  if (found == known.end()) node->Fail("is not known", "State the index as a <float>.");
  return found->second;
}

glm::dvec3 ReflectanceOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type != "diffuse")
    node.Fail("a BSDF of this kind has no equivalent in a capture",
              "Known: diffuse (also within twosided); dielectric, roughdielectric and null where a shape has an "
              "interior medium.");
  return MitsubaPlugin(document, node, {"reflectance"}).Rgb("reflectance", 1.0).value_or(glm::dvec3(0.5));
}

}  // namespace

ImportedLayer LayerOf(const MitsubaDocument& document, const MitsubaNode& node, const MitsubaUnit& unit) {
  if (node.type != "homogeneous")
    node.Fail("a medium of this kind has no equivalent in a capture", "Use a homogeneous one for every layer.");
  const MitsubaPlugin medium(document, node,
                             {"sigma_t", "albedo", "scale", "sample_emitters", "has_spectral_extinction", "<phase>"});
  const auto extinction = medium.Rgb("sigma_t", 1e9), albedo = medium.Rgb("albedo", 1.0);
  if (!extinction || !albedo) node.Fail("has no sigma_t or no albedo", "State both, each as an <rgb>.");
  const MitsubaNode* phase_node = medium.OnlyNested("phase");
  const Phase phase = phase_node ? PhaseOf(document, *phase_node) : Phase{};
  const glm::dvec3 per_mm = medium.Number("scale", 0.0, 1e9).value_or(1.0) / unit.mm * *extinction;
  ImportedLayer layer;
  layer.name = NameOfPart(medium, "medium_", "layer");
  layer.asymmetry = phase.asymmetry;
  layer.isotropic_fraction = phase.isotropic;
  layer.reduced_scattering_per_mm = per_mm * *albedo * (1.0 - (1.0 - phase.isotropic) * phase.asymmetry);
  layer.absorption_per_mm = per_mm * (1.0 - *albedo);
  return layer;
}

std::optional<Boundary> BoundaryOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type == "null") return MitsubaPlugin(document, node, {}), Boundary{true};
  if (node.type != "dielectric" && node.type != "roughdielectric") return std::nullopt;
  const bool is_rough = node.type == "roughdielectric";
  std::vector<std::string> keys{"int_ior", "ext_ior", "specular_reflectance", "specular_transmittance"};
  if (is_rough) keys.insert(keys.end(), {"distribution", "alpha", "alpha_u", "alpha_v", "sample_visible"});
  const MitsubaPlugin bsdf(document, node, keys);
  for (const char* name : {"specular_reflectance", "specular_transmittance"})
    if (bsdf.Rgb(name, 1e9).value_or(glm::dvec3(1.0)) != glm::dvec3(1.0))
      bsdf.Find(name)->Fail("has no equivalent in a capture", "Leave it at 1.");
  Boundary boundary{false, IndexOf(bsdf, "int_ior", 1.5046), IndexOf(bsdf, "ext_ior", 1.000277), 0};
  if (!is_rough) return boundary;
  if (bsdf.Text("distribution").value_or("beckmann") != "ggx")
    node.Fail("has Beckmann's distribution, and a capture GGX's",
              "State <string name=\"distribution\" value=\"ggx\"/> and the alpha that looks alike.");
  const double alpha = bsdf.Number("alpha", 0.0, 1.0).value_or(0.1);
  const double along = bsdf.Number("alpha_u", 0.0, 1.0).value_or(alpha),
               across = bsdf.Number("alpha_v", 0.0, 1.0).value_or(alpha);
  if (along != across) node.Fail("alpha_u and alpha_v differ, and a capture has one roughness", "State alpha.");
  boundary.roughness = along;
  return boundary;
}

std::array<glm::dvec3, 2> ReflectancesOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type != "twosided") {
    const glm::dvec3 both = ReflectanceOf(document, node);
    return {both, both};
  }
  const auto sides = MitsubaPlugin(document, node, {"<bsdf>"}).Nested("bsdf");
  if (sides.empty() || sides.size() > 2) node.Fail("expected one or two BSDFs");
  return {ReflectanceOf(document, *sides.front()), ReflectanceOf(document, *sides.back())};
}

}  // namespace crownfit
