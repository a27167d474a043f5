#pragma once
// Standard lights to compare models under, independent of the capture's own.

#include "capture/capture.h"

namespace crownfit {

/// The capture's object in new, synthetic photographs: `pixels` wide pictures from the position of photograph 0, behind
/// crossed polarisers (the surface's reflection is not compared). Four are to be matched: two softboxes before black
/// and before a white tile, one from above, a dome. Four are held out: a softbox from high above before a grey tile,
/// one beside the camera, one from the left, one behind. `low`, `high`: the object's bounds.
Capture StudioCapture(const Capture& capture, const glm::dvec3& low, const glm::dvec3& high, int pixels);

}  // namespace crownfit
