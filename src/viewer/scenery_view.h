#pragma once
// What stands around the crown in a photograph: scenery and the tile behind it, matte, with the crown's shadow.

#include <span>
#include <utility>

#include "scene/cast_samples.h"
#include "viewer/gl.h"

namespace crownfit {

struct PhotographSpec;

class SceneryView {
 public:
  SceneryView();
  void Set(std::span<const ShadedMesh> things);
  /// Onto the canvas that is being drawn, by depth. A tile is not seen from behind.
  void Draw(const PhotographSpec& photo, const std::pair<glm::dvec3, glm::dvec3>& bounds);

 private:
  Program program_;
  Buffer positions_, front_, back_, indices_;
  VertexArray vertices_;
  size_t index_count_ = 0;
};

}  // namespace crownfit
