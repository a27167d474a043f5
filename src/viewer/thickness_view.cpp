#include "viewer/thickness_view.h"

#include <algorithm>
#include <cmath>

#include "viewer/projection.h"

namespace crownfit {

ThicknessView::ThicknessView(std::shared_ptr<const Crown> crown)
    : crown_(std::move(crown)),
      program_(Program::Of({"viewer/camera.glsl", "viewer/thickness.vert"}, {"viewer/thickness.frag"})) {
  std::vector<glm::vec4> positions, thickness;
  std::vector<int> indices;
  std::vector<double> sorted;
  for (size_t v = 0; v < crown_->columns.size(); ++v) {
    const Column& c = crown_->columns[v];
    const OuterLength shown = crown_->has_outer_layer() ? c.straight.front : OuterLength{c.straight.total_mm, 0};
    positions.emplace_back(glm::vec3(crown_->fine.vertices[v]), 0.0f);
    thickness.emplace_back(shown.fixed_mm, shown.scaled_mm, 0.0, 0.0);
    if (shown.total_mm() > 0) sorted.push_back(shown.total_mm());
  }
  for (const glm::ivec3& t : crown_->fine.triangles) indices.insert(indices.end(), {t.x, t.y, t.z});
  sorted.push_back(0.1);  // so that it is not empty
  std::sort(sorted.begin(), sorted.end());
  // Not the maximum: at a sharp edge, where the inner layer ends, a ray inward can run along the whole crown.
  most_mm_ = 0.5 * std::ceil(2.5 * sorted[sorted.size() * 8 / 10]);
  positions_.Upload(positions);
  thickness_.Upload(thickness);
  indices_.Upload(indices);
  vertices_.SetAttribute(0, positions_, 3);
  vertices_.SetAttribute(1, thickness_, 2);
  vertices_.SetIndices(indices_);
}

void ThicknessView::Draw(const PhotographSpec& photo, const Canvas& canvas, double scale) {
  vertices_.Bind();
  canvas.Clear();
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
  program_.Use();
  SetCamera(program_, photo, Bounds(crown_->fine));
  program_.Set("thickness_scale", scale);
  program_.Set("most_mm", most_mm_);
  std::vector<glm::vec3> colours;
  for (const auto& c : kThicknessColours) colours.emplace_back(c[0], c[1], c[2]);
  program_.Set("colours", std::span<const glm::vec3>(colours));
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * crown_->fine.triangles.size()), GL_UNSIGNED_INT, nullptr);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
}

}  // namespace crownfit
