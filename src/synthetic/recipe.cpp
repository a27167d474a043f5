#include "synthetic/recipe.h"

#include <algorithm>

#include "base/error.h"
#include "base/json_file.h"

namespace crownfit {

Recipe ReadRecipe(const std::filesystem::path& path) {
  Recipe recipe;
  recipe.capture = ReadRecipeCapture(path);
  const JsonFile file(path);
  const JsonObject root =
      file.RootOfFormat("crownfit-recipe/1", {"object", "channels", "light_rig", "photographs", "synthesis"});
  const JsonObject o(root.Require("synthesis"),
                     {"paths_per_pixel", "noise", "seed", "initial_factor", "free", "calibration_error"});
  if (const auto n = o.Find("paths_per_pixel")) recipe.paths_per_pixel = n->Integer(2, 100000000);
  if (const auto n = o.Find("seed")) recipe.seed = static_cast<uint64_t>(n->Integer(0, 2000000000));
  if (const auto n = o.Find("initial_factor")) recipe.initial_factor = n->Number(0.01, 100.0);
  if (const auto noise = o.Find("noise")) {
    const JsonObject n(*noise, {"relative", "floor"});
    if (const auto v = n.Find("relative")) recipe.noise_relative = v->Number(0.0, 1.0);
    if (const auto v = n.Find("floor")) recipe.noise_floor = v->Number(0.0, 1.0);
  }
  if (const auto error = o.Find("calibration_error")) {
    const JsonObject e(*error, {"exposure", "pose_deg", "pose_mm", "light_mm"});
    if (const auto v = e.Find("exposure")) recipe.error.exposure = v->Number(0.0, 0.3);
    if (const auto v = e.Find("pose_deg")) recipe.error.pose_deg = v->Number(0.0, 30.0);
    if (const auto v = e.Find("pose_mm")) recipe.error.pose_mm = v->Number(0.0, 1000.0);
    if (const auto v = e.Find("light_mm")) recipe.error.light_mm = v->Number(0.0, 1000.0);
  }
  const auto require_fixed = [&](const ParameterSpec& spec, const std::string& name) {
    if (!spec.fixed)
      throw InputError(path, name, "a recipe states the truth, so every parameter must be fixed",
                       "Write {\"fixed\": v}, and list the parameter in synthesis.free.");
  };
  std::vector<std::string> names;
  for (const auto& row : kParameters) {
    if (row.owner == Owner::kSurface) {
      require_fixed(recipe.capture.surface[static_cast<size_t>(row.quantity)],
                    std::string("object.surface.") + row.key);
      if (recipe.capture.surface[static_cast<size_t>(row.quantity)].stated)
        names.push_back(std::string("surface.") + row.key);
      continue;
    }
    for (const auto& layer : recipe.capture.layers) {
      require_fixed(layer[row.quantity], layer.name + "." + row.key);
      if (layer[row.quantity].stated) names.push_back(layer.name + "." + row.key);
    }
  }
  if (const auto free = o.Find("free"))
    for (const auto& item : free->Items()) {
      if (std::find(recipe.free.begin(), recipe.free.end(), item.String()) != recipe.free.end())
        item.Fail("'" + item.String() + "' is listed twice", "List it once.");
      recipe.free.push_back(item.String());
      if (std::find(names.begin(), names.end(), recipe.free.back()) == names.end())
        item.Fail("the object states no parameter '" + recipe.free.back() + "'",
                  "Name it as layer.key or surface.key, such as enamel.absorption_per_mm, and give it a value.");
    }
  return recipe;
}

}  // namespace crownfit
