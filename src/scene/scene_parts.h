#pragma once
// Parts of a scene, and the scene without them.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "capture/capture.h"

namespace crownfit {

struct ScenePart {
  std::string what, name;                          ///< "light 'dome'" in words, "light:dome" on a command line
  std::function<bool(PhotographSpec&)> leave_out;  ///< false: this photograph does not have it, or nothing beside it
  std::vector<size_t> lights = {};                 ///< that are left out: as if they were off
  bool is_solid = false;                           ///< tile or scenery: rays end elsewhere without it
  bool is_film = false;                            ///< of water, which is everywhere
  bool is_step = false;                            ///< from the first layer to the second
};

/// Lights, tiles, scenery, the surface's reflection and its film of water, where there is one.
std::vector<ScenePart> PartsOf(const Capture& capture);

/// Two layers in place of one, of which the outer would be made; that deeper ones differ `shader` does not see. A fit
/// has the layers that the capture states, so that it is not among the others. Nothing where there is one layer.
std::optional<ScenePart> StepBetweenLayers(const Capture& capture);

ScenePart AllOf(const std::vector<ScenePart>& parts);

/// Out of the photographs that are fitted; others show what there is.
Capture Without(const ScenePart& part, Capture capture);

/// By its name or in words; nothing where the scene has none such.
const ScenePart* PartNamed(const std::string& name, const std::vector<ScenePart>& parts);

}  // namespace crownfit
