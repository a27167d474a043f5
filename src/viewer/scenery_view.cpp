#include "viewer/scenery_view.h"

#include "viewer/projection.h"

namespace crownfit {

SceneryView::SceneryView()
    : program_(Program::Of({"viewer/camera.glsl", "viewer/scenery.vert"}, {"viewer/scenery.frag"})) {}

void SceneryView::Set(std::span<const ShadedMesh> things, const ShownChannels& shown) {
  std::vector<glm::vec4> positions, front, back;
  std::vector<int> indices;
  for (const ShadedMesh& thing : things) {
    const int first = static_cast<int>(positions.size());
    for (size_t v = 0; v < thing.mesh.vertices.size(); ++v) {
      positions.emplace_back(glm::vec3(thing.mesh.vertices[v]), 0.0f);
      front.push_back(Vec4(thing.front[v], shown, 1.0));
      back.push_back(thing.back.empty() ? glm::vec4(0.0f) : Vec4(thing.back[v], shown, 1.0));
    }
    for (const glm::ivec3& t : thing.mesh.triangles)
      for (int k = 0; k < 3; ++k) indices.push_back(first + t[k]);
  }
  index_count_ = indices.size();
  if (index_count_ == 0) return;
  positions_.Upload(positions);
  front_.Upload(front);
  back_.Upload(back);
  indices_.Upload(indices);
  vertices_.SetAttribute(0, positions_, 3);
  vertices_.SetAttribute(1, front_, 3);
  vertices_.SetAttribute(2, back_, 4);
  vertices_.SetIndices(indices_);
}

void SceneryView::Draw(const PhotographSpec& photo, const std::pair<glm::dvec3, glm::dvec3>& bounds) {
  if (index_count_ == 0) return;
  vertices_.Bind();
  glDisable(GL_CULL_FACE);
  program_.Use();
  SetCamera(program_, photo, bounds);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(index_count_), GL_UNSIGNED_INT, nullptr);
}

}  // namespace crownfit
