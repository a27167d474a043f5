#include "viewer/crown_renderer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "viewer/projection.h"

namespace crownfit {
namespace {}  // namespace

CrownRenderer::CrownRenderer(std::shared_ptr<const Crown> crown, const ShownChannels& shown)
    : crown_(std::move(crown)),
      entering_(Program::Capturing(
          {"viewer/material.glsl", "viewer/vertices.glsl", "viewer/table.glsl", "viewer/entering.vert"}, "entering")),
      returned_(Program::Capturing(
          {"viewer/material.glsl", "viewer/vertices.glsl", "viewer/table.glsl", "viewer/returned.vert"}, "entering")),
      exitance_(Program::Capturing(
          {"viewer/material.glsl", "viewer/vertices.glsl", "viewer/table.glsl", "viewer/exitance.vert"}, "exitance")),
      first_order_(Program::Capturing({"viewer/material.glsl", "viewer/vertices.glsl", "viewer/first_order.vert"},
                                      "first_order")),
      draw_dry_(Program::Of({"viewer/material.glsl", "viewer/vertices.glsl", "viewer/camera.glsl", "viewer/crown.vert"},
                            {"viewer/material.glsl", "viewer/lamps.glsl", "viewer/crown.frag"})),
      draw_wet_(Program::Of({"viewer/material.glsl", "viewer/vertices.glsl", "viewer/camera.glsl", "viewer/crown.vert"},
                            {"viewer/material.glsl", "viewer/wet.glsl", "viewer/lamps.glsl", "viewer/crown.frag"})),
      rings_(crown_->kernel.rings()),
      shown_(shown) {
  for (int count : TapsPerRing(crown_->kernel)) share_of_ring_.push_back(1.0f / static_cast<float>(count));
  UploadGeometry();
  UploadTaps();
  const size_t vertices = crown_->fine.vertices.size();
  for (Buffer* b : {&entering_direct_, &entering_all_, &leaving_, &scattered_}) b->Allocate(vertices);
}

void CrownRenderer::UploadGeometry() {
  const TriangleMesh& mesh = crown_->fine;
  std::vector<glm::vec4> columns, frames, positions, normals;
  std::vector<int> vertices;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Column& c = crown_->columns[v];
    columns.emplace_back(c.front.fixed_mm, c.front.scaled_mm, c.back.fixed_mm, c.back.scaled_mm);
    const auto absorption = [&](size_t k) { return static_cast<float>(crown_->OuterAbsorption(v, shown_[k])); };
    columns.emplace_back(static_cast<float>(c.total_mm), absorption(0), absorption(1), absorption(2));
    frames.push_back(Vec4(mesh.vertices[v]));
    frames.push_back(Vec4(crown_->fine_vertex_normals[v]));
  }
  // One corner per distinct normal of a vertex: one where the surface is smooth, several at an edge.
  std::vector<std::vector<int>> corners_of(mesh.vertices.size());
  std::vector<int> indices;
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.triangles[t][k];
      const glm::vec4 normal = Vec4(crown_->fine_corner_normals[t][k]);
      const auto same = std::find_if(corners_of[v].begin(), corners_of[v].end(),
                                     [&](int corner) { return normals[corner] == normal; });
      if (same != corners_of[v].end()) {
        indices.push_back(*same);
        continue;
      }
      corners_of[v].push_back(static_cast<int>(vertices.size()));
      indices.push_back(corners_of[v].back());
      positions.push_back(Vec4(mesh.vertices[v]));
      normals.push_back(normal);
      vertices.push_back(v);
    }
  columns_.Upload(columns);
  frames_.Upload(frames);
  corner_positions_.Upload(positions);
  corner_normals_.Upload(normals);
  corner_vertices_.Upload(vertices);
  indices_.Upload(indices);
  corners_.SetAttribute(0, corner_positions_, 3);
  corners_.SetAttribute(1, corner_normals_, 3);
  corners_.SetIntegerAttribute(2, corner_vertices_);
  corners_.SetIndices(indices_);
}

void CrownRenderer::UploadTaps() {
  std::vector<glm::ivec4> taps;
  std::vector<glm::vec4> weights;
  const auto add = [&](const Interpolation& at, int last) {
    taps.push_back(at.exists() ? glm::ivec4(at.vertices[0], at.vertices[1], at.vertices[2], last) : glm::ivec4(0));
    weights.emplace_back(at.weights[0], at.weights[1], at.weights[2], 0.0f);
  };
  for (const Tap& tap : crown_->taps) {
    add(tap.front, tap.ring + (tap.beyond_neck ? 256 : 0));
    add(tap.opposite, 1);
  }
  taps_.Upload(taps);
  tap_weights_.Upload(weights);
  first_tap_.Upload(crown_->first_tap);
}

void CrownRenderer::SetLight(const Capture& capture, size_t photograph, const VertexCast& cast) {
  const PhotographSpec& photo = capture.photographs[photograph];
  if (photo.lights.size() > Lamps::kMost)
    throw InputError(capture.file, photo.key + ".lights",
                     "the viewer shows at most " + std::to_string(Lamps::kMost) + " lamps at once",
                     "Choose another photograph, or combine lamps.");
  std::vector<LightShape> shapes;
  light_scale_.clear();
  std::vector<int> number(capture.lights.size(), 0);
  const RigidTransform object_from_camera = photo.camera_from_object.Inverse();
  for (size_t l : photo.lights) {
    const Light& light = capture.lights[l];
    number[l] = static_cast<int>(shapes.size());
    shapes.push_back(light.in_camera_frame ? Transformed(light.shape, object_from_camera) : light.shape);
    light_scale_.push_back(static_cast<float>(light.intensity_scale));
  }
  std::vector<glm::vec4> shares, backing, visibility;
  std::vector<int> share_light;
  for (size_t s = 0; s < cast.vertex_shares.each.size(); ++s) {
    const LightShare& share = cast.vertex_shares.each[s];
    shares.push_back(Vec4(cast.vertex_shares.irradiance[s], shown_, share.cos_incidence));
    share_light.push_back(number[share.light]);
  }
  for (const BackingShare& b : cast.backing) backing.push_back(Vec4(b.reflectance, shown_));
  const size_t lamps = shapes.size();
  for (size_t v = 0; v < cast.backing.size(); ++v)
    for (size_t half = 0; half < 2; ++half) {
      glm::vec4 four(0.0f);
      for (size_t k = 0; k < 4; ++k)
        if (4 * half + k < lamps) four[static_cast<int>(k)] = cast.visibility[v * lamps + 4 * half + k];
      visibility.push_back(four);
    }
  shares_.Upload(shares);
  share_light_.Upload(share_light);
  first_share_.Upload(cast.first_share);
  backing_.Upload(backing);
  visibility_.Upload(visibility);
  has_backing_ = cast.has_backing;
  const auto [low, high] = Bounds(crown_->fine);
  lamps_.SetLamps(std::move(shapes), 0.5 * (low + high), shown_);
  scenery_.Set(cast.scenery, shown_);
  bounds_ = {low, high};
  for (const ShadedMesh& thing : cast.scenery) {
    const auto of_thing = Bounds(thing.mesh);
    bounds_ = {glm::min(bounds_.first, of_thing.first), glm::max(bounds_.second, of_thing.second)};
  }
  vertices_are_stale_ = true;
}

void CrownRenderer::SetMaterial(const Capture& capture, const Material& material,
                                const std::vector<double>& thickness_mm) {
  const CastState state{crown_, thickness_mm, {}};
  std::vector<DiffuserTable<double>> tables;
  for (size_t c = 0; c < 3; ++c) {
    optics_[c] = OpticsFromSlots(capture, SlotValues(capture, material, state, shown_[c]));
    tables.emplace_back(optics_[c].stack(), crown_->kernel.outer_radius_mm);
  }
  diffuse_fresnel_ = MomentsOf(optics_[0].surface()).diffuse_outside;
  std::vector<glm::vec4> table;
  for (size_t i = 0; i < tables[0].values().size(); ++i)
    table.push_back(Vec4(glm::dvec3(tables[0].values()[i], tables[1].values()[i], tables[2].values()[i])));
  table_.Upload(table);
  outer_nodes_ = tables[0].outer_nodes();
  lamps_.SetSurface(optics_[0]);
  has_material_ = vertices_are_stale_ = true;
}

void CrownRenderer::SetMaterialOf(Program& program) const {
  const ShaderOptics<double>& o = optics_[0];
  const auto channels = [&](auto member) {
    return glm::vec3(optics_[0].*member, optics_[1].*member, optics_[2].*member);
  };
  program.Set("has_outer", o.has_outer);
  program.Set("may_be_wet", o.may_be_wet);
  program.Set("outer_scattering", channels(&ShaderOptics<double>::outer_scattering));
  program.Set("outer_absorption", channels(&ShaderOptics<double>::outer_absorption));
  program.Set("outer_thickness_scale", o.outer_thickness_scale);
  program.Set("diffuser_thickness_scale", o.diffuser_thickness_scale);
  program.Set("entry_ior", o.entry_ior());
  program.Set("film_ior", o.surface().film_ior());
  program.Set("wetness", o.wetness);
  program.Set("roughness", o.roughness);
  program.Set("neck_return", o.neck_return);
  program.Set("diffuse_fresnel", diffuse_fresnel_);
  program.Set("light_scale", light_scale_);
  program.Set("rings", rings_);
  program.Set("outer_nodes", outer_nodes_);
  program.Set("inner_nodes", DiffuserTable<double>::kInnerNodes);
  program.Set("table", table_);
  program.Set("columns", columns_);
  program.Set("shares", shares_);
  program.Set("share_light", share_light_);
  program.Set("first_share", first_share_);
}

void CrownRenderer::RunVertexPasses() {
  const size_t count = crown_->fine.vertices.size();
  entering_.Use();
  SetMaterialOf(entering_);
  entering_.CaptureInto(entering_direct_, count);
  const auto leave = [&](const Buffer& entering) {
    exitance_.Use();
    SetMaterialOf(exitance_);
    exitance_.Set("entering", entering);
    exitance_.Set("taps", taps_);
    exitance_.Set("tap_weights", tap_weights_);
    exitance_.Set("first_tap", first_tap_);
    exitance_.Set("share_of_ring", share_of_ring_);
    exitance_.CaptureInto(leaving_, count);
  };
  leave(entering_direct_);
  if (has_backing_) {
    returned_.Use();
    SetMaterialOf(returned_);
    returned_.Set("direct", entering_direct_);
    returned_.Set("leaving", leaving_);
    returned_.Set("backing", backing_);
    returned_.CaptureInto(entering_all_, count);
    leave(entering_all_);
  }
  vertices_are_stale_ = false;
}

void CrownRenderer::Draw(const PhotographSpec& photo, const ShownTerms& terms, const Canvas& canvas, Quality quality) {
  Check(has_material_ && lamps_.count() > 0, "light and material stand before anything is drawn");
  corners_.Bind();
  if (vertices_are_stale_) RunVertexPasses();
  const glm::vec3 camera(photo.camera_from_object.Inverse().translation_mm);
  first_order_.Use();
  SetMaterialOf(first_order_);
  first_order_.Set("frames", frames_);
  first_order_.Set("camera_position", camera);
  first_order_.CaptureInto(scattered_, crown_->fine.vertices.size());

  canvas.Clear();
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);  // the crown is closed: faces that look away are never visible
  Program& draw = optics_[0].may_be_wet ? draw_wet_ : draw_dry_;
  draw.Use();
  SetMaterialOf(draw);
  draw.Set("exitance", leaving_);
  draw.Set("first_order", scattered_);
  draw.Set("visibility", visibility_);
  SetCamera(draw, photo, bounds_);
  draw.Set("camera_position", camera);
  draw.Set("first_factor", optics_[0].FirstOrderFactor(photo.polarisers()));
  draw.Set("specular_factor", photo.polarisers().of_kept);
  draw.Set("every", quality == Quality::kMoving ? 4 : 1);
  lamps_.SetUniforms(draw);
  draw.Set("show_diffuse", terms.diffuse);
  draw.Set("show_first", terms.first_order);
  draw.Set("show_gloss", terms.gloss);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * crown_->fine.triangles.size()), GL_UNSIGNED_INT, nullptr);
  if (terms.scenery) scenery_.Draw(photo, bounds_);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
}

}  // namespace crownfit
