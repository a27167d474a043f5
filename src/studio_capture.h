#pragma once
// Light to compare models under, whatever a capture's own is.

#include "capture/capture.h"

namespace crownfit {

/// The capture's object, photographed anew by nobody yet: `pixels` wide pictures from where photograph 0 stands, behind
/// crossed polarisers (the surface's reflection is not compared). Four are to be matched: two softboxes before black
/// and before a white tile, one from above, a dome. Four are held out: a softbox from high above before a grey tile,
/// one beside the camera, one from the left, one behind. `low`, `high`: the object's bounds.
Capture StudioCapture(const Capture& capture, const glm::dvec3& low, const glm::dvec3& high, int pixels);

}  // namespace crownfit
