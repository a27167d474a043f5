#pragma once
// The crown on the graphics processor: the shader model's formulas on the vertices' ray casts, in four passes.
//   light or material changed:  entering light -> light that leaves (-> entering with what a tile returns of it ->
//                               light that leaves), per vertex
//   camera moved:               first order per vertex -> pixels with the surface's reflection
// Highlights of light from all around differ from ShaderPrediction: they come from tables (viewer/lamps.h).

#include <memory>

#include "shader/predict.h"
#include "viewer/gl.h"
#include "viewer/lamps.h"
#include "viewer/scenery_view.h"

namespace crownfit {

struct ShownTerms {
  bool diffuse = true, first_order = true, gloss = true, scenery = true;
  bool operator==(const ShownTerms&) const = default;
};

/// kMoving uses a quarter of the lamps' points for highlights; kStill uses all, as the CPU does.
enum class Quality { kMoving, kStill };

class CrownRenderer {
 public:
  /// Needs a current context.
  CrownRenderer(std::shared_ptr<const Crown> crown, const ShownChannels& shown);

  /// The lamps of one photograph. Throws InputError when there are more than Lamps::kMost.
  void SetLight(const Capture& capture, size_t photograph, const VertexCast& cast);
  /// `thickness_mm`: the thicknesses that the crown was built with.
  void SetMaterial(const Capture& capture, const Material& material, const std::vector<double>& thickness_mm);
  /// Draws the crown as `photo`'s camera sees it, in linear pixel values at exposure 1; polarisers included.
  void Draw(const PhotographSpec& photo, const ShownTerms& terms, const Canvas& canvas,
            Quality quality = Quality::kStill);

  const Crown& crown() const { return *crown_; }

 private:
  void UploadGeometry();
  void UploadTaps();
  void SetMaterialOf(Program& program) const;
  void RunVertexPasses();

  std::shared_ptr<const Crown> crown_;
  std::vector<float> share_of_ring_;
  Program entering_, returned_, exitance_, first_order_, draw_dry_, draw_wet_;
  Buffer columns_, frames_, taps_, tap_weights_, first_tap_;
  Buffer shares_, share_light_, first_share_, backing_, visibility_, table_;
  Buffer entering_direct_, entering_all_, leaving_, scattered_;
  VertexArray corners_;
  Buffer corner_positions_, corner_normals_, corner_vertices_, indices_;
  SceneryView scenery_;
  std::pair<glm::dvec3, glm::dvec3> bounds_;  ///< of crown and scenery
  Lamps lamps_;
  std::vector<float> light_scale_;
  int rings_ = 0, outer_nodes_ = 0;
  bool has_backing_ = false, has_material_ = false, vertices_are_stale_ = true;
  std::array<ShaderOptics<double>, 3> optics_;  ///< of the shown channels
  ShownChannels shown_;
  double diffuse_fresnel_ = 0;
};

}  // namespace crownfit
