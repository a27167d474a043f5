#pragma once
// Surroundings of the crown in a photograph: scenery and the tile behind it, matte, with the crown's shadow.

#include <span>
#include <utility>

#include "scene/cast_samples.h"
#include "viewer/gl.h"

namespace crownfit {

struct PhotographSpec;

class SceneryView {
 public:
  SceneryView();
  void Set(std::span<const ShadedMesh> things, const ShownChannels& shown);
  /// Draws on the current canvas, with depth test. A tile is invisible from behind.
  void Draw(const PhotographSpec& photo, const std::pair<glm::dvec3, glm::dvec3>& bounds);

 private:
  Program program_;
  Buffer positions_, front_, back_, indices_;
  VertexArray vertices_;
  size_t index_count_ = 0;
};

}  // namespace crownfit
