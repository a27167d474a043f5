#include "support/synthetic_capture.h"

#include "base/files.h"
#include "capture/capture.h"
#include "geometry/mesh_file.h"
#include "support/shapes.h"

namespace crownfit {
namespace {

using Object = JsonValue::Object;
using List = std::vector<double>;

JsonValue Lights() {
  // Irradiance at the object is about 1 from each lamp; the lamp for shadow edges is small.
  return JsonValue::Array{
      Object{{"name", "left"},
             {"type", "rectangle"},
             {"frame", "object"},
             {"centre_mm", List{-120, 0, 130}},
             {"half_axis_u_mm", List{0, 40, 0}},
             {"half_axis_v_mm", List{29, 0, 27}},
             {"radiance_rgb", List{4, 4, 4}}},
      Object{{"name", "right"},
             {"type", "rectangle"},
             {"frame", "object"},
             {"centre_mm", List{120, 0, 130}},
             {"half_axis_u_mm", List{0, 40, 0}},
             {"half_axis_v_mm", List{29, 0, -27}},
             {"radiance_rgb", List{4, 4, 4}}},
      Object{{"name", "side"},
             {"type", "rectangle"},
             {"frame", "object"},
             {"centre_mm", List{165, 25, 35}},
             {"half_axis_u_mm", List{0, 40, 0}},
             {"half_axis_v_mm", List{8, 0, -39}},
             {"radiance_rgb", List{5, 5, 5}}},
      Object{{"name", "behind"},
             {"type", "disk"},
             {"frame", "object"},
             {"centre_mm", List{0, 0, -140}},
             {"normal", List{0, 0, 1}},
             {"radius_mm", 50},
             {"radiance_rgb", List{4, 4, 4}}},
      Object{{"name", "lamp"},
             {"type", "disk"},
             {"frame", "object"},
             {"centre_mm", List{-160, 0, 165}},
             {"normal", List{1, 0, -1}},
             {"radius_mm", 10},
             {"radiance_rgb", List{220, 220, 220}}},
      Object{{"name", "dome"}, {"type", "dome"}, {"frame", "object"}, {"radiance_rgb", List{0.03, 0.03, 0.03}}}};
}

JsonValue Fixed(JsonValue v) { return Object{{"fixed", std::move(v)}}; }

List Times(List v, double factor) {
  for (double& x : v) x *= factor;
  return v;
}

TriangleMesh Scaled(TriangleMesh mesh, double factor) {
  for (glm::dvec3& v : mesh.vertices) v *= factor;
  return mesh;
}

JsonValue Initial(List v, double factor) {
  v = Times(v, factor);
  return v.size() == 1 ? Object{{"initial", v[0]}} : Object{{"initial", v}};
}

}  // namespace

void WriteSyntheticCapture(const std::filesystem::path& folder, const SyntheticCapture& options) {
  const double size = options.size;
  WritePly(folder / "mesh/incisor.ply", Scaled(Incisor(options.levels), size));
  WritePly(folder / "mesh/blade.ply", Scaled(Box({-30, -30, 5.8}, {-1.5, 30, 5.85}), size));
  const double focal = options.pixels * 250.0 / (12.0 * size);
  WriteTextFile(folder / "calib/camera.json", ToJsonText(Object{{"format", "crownfit-camera/1"},
                                                                {"width", options.pixels},
                                                                {"height", options.pixels},
                                                                {"fx", focal},
                                                                {"fy", focal},
                                                                {"cx", 0.5 * options.pixels},
                                                                {"cy", 0.5 * options.pixels},
                                                                {"distortion", List{0, 0, 0, 0, 0}}}));
  WriteTextFile(folder / "calib/light_rig.json",
                ToJsonText(Object{{"format", "crownfit-light-rig/1"}, {"lights", Lights()}}));

  const List enamel_scattering = Times({0.21, 0.24, 0.3}, 1.0 / size),
             enamel_absorption = Times({0.012, 0.02, 0.045}, 1.0 / size),
             dentine_scattering = Times({1.9, 2.0, 2.1}, 1.0 / size),
             dentine_absorption = Times({0.03, 0.07, 0.22}, 1.0 / size);
  const double thickness = 0.6 * size, roughness = 0.22, f = options.initial_factor;
  const JsonValue g_enamel = Fixed(0.96), g_dentine = Fixed(0.93);
  const JsonValue::Array layers{
      Object{{"name", "enamel"},
             {"surface", "mesh/incisor.ply"},
             {"thickness_mm", options.free_thickness ? Initial({thickness}, 1.4) : Fixed(thickness)},
             {"ior", Fixed(1.63)},
             {"g", g_enamel},
             {"reduced_scattering_per_mm", Initial(enamel_scattering, f)},
             {"absorption_per_mm", Initial(enamel_absorption, 1.0 / f)}},
      Object{{"name", "dentine"},
             {"ior", Fixed(1.54)},
             {"g", g_dentine},
             {"reduced_scattering_per_mm", Initial(dentine_scattering, 1.0 / f)},
             {"absorption_per_mm", Initial(dentine_absorption, f)}}};
  // Seen from 250 mm in front: x right, y down, z forward.
  const JsonValue pose = Object{{"rotation", JsonValue::Array{List{1, 0, 0}, List{0, -1, 0}, List{0, 0, -1}}},
                                {"translation_mm", List{0, 0, 250}}};
  JsonValue::Array photographs;
  const auto shot = [&](const char* name, JsonValue::Array lights, const char* polarisation, const char* backing,
                        JsonValue::Array scenery, const char* use) {
    const bool is_free = options.free_exposures && !photographs.empty();
    photographs.push_back(Object{{"name", name},
                                 {"file", "photos/" + std::string(name) + ".exr"},
                                 {"camera", "calib/camera.json"},
                                 {"camera_from_object", pose},
                                 {"lights", lights},
                                 {"polarisation", polarisation},
                                 {"backing", backing},
                                 {"scenery", scenery},
                                 {"exposure_scale", is_free ? Object{{"initial", 1.3}} : Object{{"fixed", 1.0}}},
                                 {"use", use}});
  };
  shot("front", {"left", "right"}, "none", "black", {}, "fit");
  shot("front_black", {"left", "right"}, "cross", "black", {}, "fit");
  shot("front_white", {"left", "right"}, "cross", "white", {}, "fit");
  shot("back", {"behind"}, "cross", "none", {}, "fit");
  shot("edge", {"lamp", "dome"}, "cross", "none", {"blade"}, "fit");
  shot("side", {"side", "dome"}, "none", "none", {}, "holdout");
  const auto tile = [&](double rho) {
    return Object{{"point_mm", List{0, 0, -4 * size}},
                  {"normal", List{0, 0, 1}},
                  {"size_mm", 30 * size},
                  {"reflectance_rgb", List{rho, rho, rho}}};
  };
  WriteTextFile(
      folder / "capture.json",
      ToJsonText(
          Object{{"format", "crownfit-capture/1"},
                 {"object", Object{{"layers", layers},
                                   {"surface", Object{{"roughness", Initial({roughness}, f)}, {"wetness", Fixed(0.0)}}},
                                   {"scenery", JsonValue::Array{Object{{"name", "blade"},
                                                                       {"mesh", "mesh/blade.ply"},
                                                                       {"reflectance_rgb", List{0.02, 0.02, 0.02}}}}},
                                   {"backings", Object{{"black", tile(0.03)}, {"white", tile(0.9)}}},
                                   {"outside_ior", 1.0},
                                   {"long_axis", List{0, 1, 0}}}},
                 {"channels", JsonValue::Array{Object{{"name", "R"}, {"wavelength_nm", 600}},
                                               Object{{"name", "G"}, {"wavelength_nm", 540}},
                                               Object{{"name", "B"}, {"wavelength_nm", 450}}}},
                 {"light_rig", "calib/light_rig.json"},
                 {"photographs", photographs}}));
  WriteTextFile(folder / "truth.json",
                ToJsonText(Object{{"format", "crownfit-material/1"},
                                  {"model", "shader"},
                                  {"layers", JsonValue::Array{Object{{"name", "enamel"},
                                                                     {"ior", 1.63},
                                                                     {"g", 0.96},
                                                                     {"thickness_mm", thickness},
                                                                     {"reduced_scattering_per_mm", enamel_scattering},
                                                                     {"absorption_per_mm", enamel_absorption}},
                                                              Object{{"name", "dentine"},
                                                                     {"ior", 1.54},
                                                                     {"g", 0.93},
                                                                     {"reduced_scattering_per_mm", dentine_scattering},
                                                                     {"absorption_per_mm", dentine_absorption}}}},
                                  {"surface", Object{{"roughness", roughness}, {"wetness", 0.0}}}}));
}

}  // namespace crownfit
