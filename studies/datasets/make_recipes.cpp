// Writes the recipes of the bundled path-traced captures: make_recipes FOLDER [SHARE_OF_THE_PATHS]
//   disc     a ceramic disc over black, over white, with a shadow edge; one held out
//   incisor  a two-layer crown in front of black and white, lit from behind, with a shadow edge; one held out
//   sphere   a sphere with a core under one lamp and a dome; one held out
// Then: crownfit synthesize FOLDER/disc/recipe.json -o datasets_synthetic/disc, and so on (./dev datasets does it all).

#include <cstdio>
#include <cstdlib>

#include "base/files.h"
#include "base/json_file.h"
#include "geometry/mesh_file.h"
#include "support/shapes.h"

namespace {

using namespace crownfit;
using Object = JsonValue::Object;
using List = std::vector<double>;

JsonValue Fixed(JsonValue v) { return Object{{"fixed", std::move(v)}}; }

/// A square softbox of half width 60 mm, `distance` away in direction (x, y, z) and facing the origin.
JsonValue Softbox(const char* name, glm::dvec3 towards, double distance, double half_mm, double radiance) {
  const glm::dvec3 w = glm::normalize(towards), c = distance * w;
  const glm::dvec3 v = half_mm * glm::normalize(glm::cross(w, glm::dvec3(0, 1, 0))),
                   u = half_mm * glm::cross(glm::normalize(v), w);
  const glm::dvec3 shines = glm::cross(u, v), side = glm::dot(shines, w) < 0 ? v : -v;
  return Object{{"name", name},
                {"type", "rectangle"},
                {"frame", "object"},
                {"centre_mm", List{c.x, c.y, c.z}},
                {"half_axis_u_mm", List{u.x, u.y, u.z}},
                {"half_axis_v_mm", List{side.x, side.y, side.z}},
                {"radiance_rgb", List{radiance, radiance, radiance}}};
}

JsonValue Lights() {
  return JsonValue::Array{
      Softbox("left", {-1, 0, 1}, 160, 70, 1.2),
      Softbox("right", {1, 0, 1}, 160, 70, 1.2),
      Softbox("side", {1, 0.15, 0.25}, 150, 70, 1.8),
      Softbox("behind", {0, 0.001, -1}, 130, 110, 1.0),
      Softbox("lamp", {-1, 0, 1}, 230, 40, 11.0),
      Object{{"name", "dome"}, {"type", "dome"}, {"frame", "object"}, {"radiance_rgb", List{0.06, 0.06, 0.06}}}};
}

struct Shot {
  const char *name, *backing, *polarisation, *use;
  JsonValue::Array lights, scenery;
};

void WriteRecipe(const std::filesystem::path& folder, const JsonValue::Array& layers, double roughness,
                 const std::vector<Shot>& shots, double tile_z, const JsonValue::Array& free, int pixels,
                 double view_mm, int paths, int seed) {
  const double focal = pixels * 250.0 / view_mm;
  WriteTextFile(folder / "calib/camera.json", ToJsonText(Object{{"format", "crownfit-camera/1"},
                                                                {"width", pixels},
                                                                {"height", pixels},
                                                                {"fx", focal},
                                                                {"fy", focal},
                                                                {"cx", 0.5 * pixels},
                                                                {"cy", 0.5 * pixels},
                                                                {"distortion", List{0, 0, 0, 0, 0}}}));
  WriteTextFile(folder / "calib/light_rig.json",
                ToJsonText(Object{{"format", "crownfit-light-rig/1"}, {"lights", Lights()}}));
  const JsonValue pose = Object{{"rotation", JsonValue::Array{List{1, 0, 0}, List{0, -1, 0}, List{0, 0, -1}}},
                                {"translation_mm", List{0, 0, 250}}};
  JsonValue::Array photographs;
  for (const Shot& shot : shots)
    photographs.push_back(Object{{"name", shot.name},
                                 {"file", "photos/" + std::string(shot.name) + ".exr"},
                                 {"camera", "calib/camera.json"},
                                 {"camera_from_object", pose},
                                 {"lights", shot.lights},
                                 {"polarisation", shot.polarisation},
                                 {"backing", shot.backing},
                                 {"scenery", shot.scenery},
                                 {"exposure_scale", Fixed(1.0)},
                                 {"use", shot.use}});
  const auto tile = [&](double rho) {
    return Object{{"point_mm", List{0, 0, tile_z}},
                  {"normal", List{0, 0, 1}},
                  {"size_mm", 30},
                  {"reflectance_rgb", List{rho, rho, rho}}};
  };
  Object object{{"layers", layers},
                {"surface", Object{{"roughness", Fixed(roughness)}, {"wetness", Fixed(0.0)}}},
                {"backings", Object{{"black", tile(0.03)}, {"white", tile(0.9)}}},
                {"outside_ior", 1.0}};
  if (std::filesystem::exists(folder / "mesh/blade.ply"))
    object.emplace_back(
        "scenery", JsonValue::Array{Object{
                       {"name", "blade"}, {"mesh", "mesh/blade.ply"}, {"reflectance_rgb", List{0.02, 0.02, 0.02}}}});
  if (std::filesystem::exists(folder / "mesh/incisor.ply")) object.emplace_back("long_axis", List{0, 1, 0});
  WriteTextFile(folder / "recipe.json",
                ToJsonText(Object{{"format", "crownfit-recipe/1"},
                                  {"object", object},
                                  {"channels", JsonValue::Array{Object{{"name", "R"}, {"wavelength_nm", 600}},
                                                                Object{{"name", "G"}, {"wavelength_nm", 540}},
                                                                Object{{"name", "B"}, {"wavelength_nm", 450}}}},
                                  {"light_rig", "calib/light_rig.json"},
                                  {"photographs", photographs},
                                  {"synthesis", Object{{"paths_per_pixel", paths},
                                                       {"noise", Object{{"relative", 0.01}, {"floor", 0.0005}}},
                                                       {"seed", seed},
                                                       {"initial_factor", 1.5},
                                                       {"free", free}}}}));
}

JsonValue Layer(const char* name, const char* surface, double thickness_mm, double ior, double g, double scattering,
                List absorption) {
  Object layer{{"name", name}};
  if (surface) layer.emplace_back("surface", surface);
  if (thickness_mm > 0) layer.emplace_back("thickness_mm", Fixed(thickness_mm));
  const Object rest{{"ior", Fixed(ior)},
                    {"g", Fixed(g)},
                    {"reduced_scattering_per_mm", Fixed(scattering)},
                    {"absorption_per_mm", Fixed(std::move(absorption))}};
  layer.insert(layer.end(), rest.begin(), rest.end());
  return layer;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: make_recipes FOLDER [SHARE_OF_THE_PATHS]\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const double share = argc > 2 ? std::atof(argv[2]) : 1.0;
  const auto paths = [&](double n) { return std::max(2, static_cast<int>(n * share)); };

  WritePly(folder / "disc/mesh/disc.ply", Disc(1.0, 5.0, 96));
  WritePly(folder / "disc/mesh/blade.ply", Box({-30, -30, 2.0}, {-1.5, 30, 2.05}));
  WriteRecipe(folder / "disc", {Layer("ceramic", "mesh/disc.ply", 1.0, 1.54, 0.8, 3.0, {0.012, 0.025, 0.07})}, 0.2,
              {{"black", "black", "none", "fit", {"left", "right"}, {}},
               {"white", "white", "cross", "fit", {"left", "right"}, {}},
               {"edge", "none", "cross", "fit", {"lamp", "dome"}, {"blade"}},
               {"side", "none", "cross", "holdout", {"side", "dome"}, {}}},
              -1.2, {"ceramic.reduced_scattering_per_mm", "ceramic.absorption_per_mm", "surface.roughness"}, 96, 13.0,
              paths(4000), 11);

  WritePly(folder / "incisor/mesh/incisor.ply", Incisor());
  WritePly(folder / "incisor/mesh/blade.ply", Box({-30, -30, 5.8}, {-1.0, 30, 5.85}));
  WriteRecipe(folder / "incisor",
              {Layer("enamel", "mesh/incisor.ply", 0.7, 1.63, 0.68, 2.0, {0.01, 0.02, 0.05}),
               Layer("dentine", nullptr, 0, 1.54, 0.93, 2.0, {0.03, 0.07, 0.2})},
              0.2,
              {{"front_black", "black", "none", "fit", {"left", "right"}, {}},
               {"front_white", "white", "cross", "fit", {"left", "right"}, {}},
               {"back", "none", "cross", "fit", {"behind"}, {}},
               {"edge", "none", "cross", "fit", {"lamp", "dome"}, {"blade"}},
               {"side", "none", "none", "holdout", {"side", "dome"}, {}}},
              -4.0,
              {"enamel.reduced_scattering_per_mm", "enamel.absorption_per_mm", "dentine.reduced_scattering_per_mm",
               "dentine.absorption_per_mm", "surface.roughness"},
              96, 12.0, paths(4000), 12);

  WritePly(folder / "sphere/mesh/outer.ply", Sphere(4.0));
  WritePly(folder / "sphere/mesh/core.ply", Sphere(3.0));
  WriteRecipe(folder / "sphere",
              {Layer("shell", "mesh/outer.ply", 0, 1.62, 0.8, 0.24, {0.005, 0.02, 0.06}),
               Layer("core", "mesh/core.ply", 0, 1.54, 0.7, 1.96, {0.03, 0.1, 0.3})},
              0.2,
              {{"lamp", "none", "cross", "fit", {"side", "dome"}, {}},
               {"front", "none", "none", "fit", {"left", "right"}, {}},
               {"behind", "none", "cross", "holdout", {"behind"}, {}}},
              -6.0,
              {"shell.reduced_scattering_per_mm", "shell.absorption_per_mm", "core.reduced_scattering_per_mm",
               "core.absorption_per_mm", "surface.roughness"},
              96, 10.0, paths(4000), 13);
  std::printf("%s: disc, incisor, sphere\n", folder.c_str());
  return 0;
}
