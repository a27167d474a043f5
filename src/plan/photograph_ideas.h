#pragma once
// Photographs that could be taken with the rig at hand.

#include <optional>
#include <string>
#include <vector>

#include "capture/capture.h"

namespace crownfit {

/// One more photograph of a capture: a photograph it has, taken with one thing changed.
struct PhotographIdea {
  std::string words;           ///< "as 'front', through crossed polarisers"
  size_t base;                 ///< the photograph that it varies
  PhotographSpec spec;         ///< its files are the base's
  std::optional<Light> light;  ///< a lamp of the rig that was moved; `spec` has it as the one after the capture's last
};

/// From every place that the camera has stood at (the first `most_places` of them): each lamp alone; one lamp moved
/// beside the camera, above, to either side and behind the object; each tile; crossed polarisers; and the camera moved
/// to the side and to the back. What the capture has already is left out. `centre_mm`: of the object.
std::vector<PhotographIdea> PhotographIdeas(const Capture& capture, const glm::dvec3& centre_mm,
                                            size_t most_places = 2);

/// The capture with the idea as its last photograph.
Capture WithIdea(Capture capture, const PhotographIdea& idea);

}  // namespace crownfit
