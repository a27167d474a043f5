#pragma once
// Media and BSDFs of a scene of Mitsuba 3 as materials of a capture.

#include <array>
#include <glm/glm.hpp>
#include <optional>

#include "exchange/mitsuba_scene.h"

namespace crownfit {

/// The layer of a medium, as yet without surface and index.
ImportedLayer LayerOf(const MitsubaDocument& document, const MitsubaNode& node, const MitsubaUnit& unit);

/// A boundary between two media.
struct Boundary {
  bool is_matched = false;  ///< the indices on both sides are equal, and not stated
  double inside = 1, outside = 1, roughness = 0;
};

/// Nothing for a BSDF that is no boundary between media.
std::optional<Boundary> BoundaryOf(const MitsubaDocument& document, const MitsubaNode& node);

/// Diffuse reflectances of the outside and the inside.
std::array<glm::dvec3, 2> ReflectancesOf(const MitsubaDocument& document, const MitsubaNode& node);

}  // namespace crownfit
