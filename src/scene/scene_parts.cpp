#include "scene/scene_parts.h"

#include <algorithm>

namespace crownfit {

std::vector<ScenePart> PartsOf(const Capture& capture) {
  std::vector<ScenePart> parts;
  const auto add = [&](const std::string& kind, const std::string& name,
                       std::function<bool(PhotographSpec&)> leave_out) {
    parts.push_back({kind + " '" + name + "'", kind + ":" + name, std::move(leave_out)});
    parts.back().is_solid = kind != "light";
  };
  for (size_t l = 0; l < capture.lights.size(); ++l) {
    add("light", capture.lights[l].name,
        [l](PhotographSpec& p) { return p.lights.size() > 1 && std::count(p.lights.begin(), p.lights.end(), l) > 0; });
    parts.back().lights = {l};
  }
  for (size_t b = 0; b < capture.backings.size(); ++b)
    add("tile", capture.backings[b].name, [b](PhotographSpec& p) {
      const bool has = p.backing == b;
      if (has) p.backing.reset();
      return has;
    });
  for (size_t s = 0; s < capture.scenery.size(); ++s)
    add("scenery", capture.scenery[s].name, [s](PhotographSpec& p) { return std::erase(p.scenery, s) > 0; });
  parts.push_back({"the surface's reflection", "reflection", [](PhotographSpec& p) {
                     const bool has = p.polarisation != Polarisation::kCross;
                     if (has) p.polarisation = Polarisation::kCross, p.polarisation_memory_events = 0;
                     return has;
                   }});
  if (capture.surface[static_cast<size_t>(Quantity::kWetness)].value[0] > 0) {
    parts.push_back({"the film of water", "film", [](PhotographSpec&) { return true; }});
    parts.back().is_film = true;
  }
  return parts;
}

std::optional<ScenePart> StepBetweenLayers(const Capture& capture) {
  if (capture.layers.size() < 2) return std::nullopt;
  ScenePart step{"the step from '" + capture.layers[0].name + "' to '" + capture.layers[1].name + "'", "step",
                 [](PhotographSpec&) { return true; }};
  step.is_step = true;
  return step;
}

ScenePart AllOf(const std::vector<ScenePart>& parts) {
  ScenePart all{"", "", [parts](PhotographSpec& p) {
                  bool has = false;
                  for (const ScenePart& part : parts) has |= part.leave_out(p);
                  return has;
                }};
  for (const ScenePart& part : parts) {
    all.what += (all.what.empty() ? "" : ", ") + part.what;
    all.lights.insert(all.lights.end(), part.lights.begin(), part.lights.end());
    all.is_solid |= part.is_solid;
    all.is_film |= part.is_film;
  }
  return all;
}

Capture Without(const ScenePart& part, Capture capture) {
  for (PhotographSpec& p : capture.photographs) {
    if (p.is_holdout || !part.leave_out(p)) continue;
    std::erase_if(p.lights, [&](size_t l) { return std::count(part.lights.begin(), part.lights.end(), l) > 0; });
  }
  if (part.is_film) {
    ParameterSpec& wetness = capture.surface[static_cast<size_t>(Quantity::kWetness)];
    wetness.value.fill(0.0);
    wetness.fixed = true;
  }
  return capture;
}

const ScenePart* PartNamed(const std::string& name, const std::vector<ScenePart>& parts) {
  const auto part =
      std::find_if(parts.begin(), parts.end(), [&](const ScenePart& p) { return p.name == name || p.what == name; });
  return part == parts.end() ? nullptr : &*part;
}

}  // namespace crownfit
