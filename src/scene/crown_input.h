#pragma once
// The files of a capture, read and checked against each other.

#include <optional>
#include <vector>

#include "capture/capture.h"
#include "photo/photograph.h"
#include "scene/crown_source.h"

namespace crownfit {

/// A capture with everything it names read and found consistent.
struct CrownInput {
  Capture capture;
  std::vector<Photograph> photographs;
  CrownSource source;
  std::vector<TriangleMesh> scenery;
};

/// Position of a lamp at finite distance in the object's frame. A ring may surround the object, and has none.
std::optional<glm::dvec3> PlaceOf(const Light& light, const RigidTransform& object_from_camera);

/// Averages a photograph over squares of whole pixels, so that the crown has about `most_pixels` of them, and its
/// camera and blur with it. `noise_is_known` as in Averaged. Returns the squares' side; 1: unchanged.
int AverageCrown(const TriangleMesh& outer, double most_pixels, bool noise_is_known, PhotographSpec& spec,
                 Photograph& photo, double least_usable = 1.0);

/// Reads images and meshes and checks them against each other. Bounds thicknesses by the crown's depth. Throws
/// InputError. `with_images` false: for rendering, where the photographs need not exist.
CrownInput ReadInput(const Capture& capture, int threads, bool with_images = true);

}  // namespace crownfit
