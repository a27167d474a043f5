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
  std::function<bool(PhotographSpec&)> leave_out;  ///< false: this photograph lacks it, or has nothing else
  std::vector<size_t> lights = {};                 ///< that are switched off
  bool is_solid = false;                           ///< tile or scenery: without it rays end elsewhere
  bool is_film = false;                            ///< of water, present everywhere
  bool is_step = false;                            ///< from the first layer to the second
};

/// Lights, tiles, scenery, the surface's reflection and its film of water, where there is one.
std::vector<ScenePart> PartsOf(const Capture& capture);

/// The step from the first layer to the second: without it, all would be made of the outer one. `shader` does not see
/// differences between deeper layers. A fit has the layers that the capture states, so PartsOf leaves this out. Absent
/// where there is one layer.
std::optional<ScenePart> StepBetweenLayers(const Capture& capture);

ScenePart AllOf(const std::vector<ScenePart>& parts);

/// Removes the part from the photographs that are fitted; held-out ones keep it.
Capture Without(const ScenePart& part, Capture capture);

/// Found by its name or its words; null where the scene has no such part.
const ScenePart* PartNamed(const std::string& name, const std::vector<ScenePart>& parts);

}  // namespace crownfit
