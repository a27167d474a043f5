#include "viewer/crown_renderer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "geometry/light_samples.h"
#include "viewer/projection.h"

namespace crownfit {
namespace {

constexpr int kLampStrata = 6;
constexpr int kGlossNodes = 64;

glm::vec4 Vec4(const glm::dvec3& v, double w = 0) { return {glm::vec3(v), static_cast<float>(w)}; }

/// A small area of a lamp: near ones have a place and an outward normal, far ones a direction.
struct LampPoint {
  glm::dvec3 place_or_direction, normal;
  bool is_far;
  glm::dvec3 weight;  ///< radiance x area, or x solid angle
};

std::vector<glm::dvec2> Strata(int n) {
  std::vector<glm::dvec2> strata;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) strata.emplace_back((i + 0.5) / n, (j + 0.5) / n);
  return strata;
}

/// Points of a lamp whose place does not depend on who looks; none for light from all around.
std::vector<LampPoint> PointsOf(const LightShape& shape, const glm::dvec3& towards) {
  std::vector<LampPoint> points;
  if (IsAllAround(shape)) return points;
  LightShape flat = shape;
  if (const auto* point = std::get_if<PointLight>(&shape)) {  // a disk that faces the crown, of the same radiance
    const double area = std::numbers::pi * point->radius_mm * point->radius_mm;
    flat = DiskLight{point->position_mm, glm::normalize(towards - point->position_mm), point->radiant_intensity / area,
                     0.0, point->radius_mm};
  }
  const bool is_far = std::holds_alternative<DirectionalLight>(flat);
  glm::dvec3 normal(0.0);
  if (const auto* disk = std::get_if<DiskLight>(&flat)) normal = disk->normal;
  if (const auto* box = std::get_if<RectangleLight>(&flat))
    normal = glm::normalize(glm::cross(box->half_axis_u_mm, box->half_axis_v_mm));
  const double count = kLampStrata * kLampStrata;
  // From in front of the lamp every point of it is seen.
  const glm::dvec3 from = is_far ? towards : [&] {
    if (const auto* disk = std::get_if<DiskLight>(&flat)) return disk->centre_mm + normal;
    return std::get<RectangleLight>(flat).centre_mm + normal;
  }();
  for (const auto& uniform : Strata(kLampStrata)) {
    const auto p = SampleLightPoint(flat, from, uniform);
    if (!p) continue;
    if (is_far) {
      points.push_back({p->direction, {}, true, p->radiance / (p->density * count)});
    } else {
      const double cosine = -glm::dot(p->direction, normal), d2 = p->distance_mm * p->distance_mm;
      points.push_back(
          {from + p->distance_mm * p->direction, normal, false, p->radiance * (d2 / (cosine * p->density * count))});
    }
  }
  return points;
}

}  // namespace

CrownRenderer::CrownRenderer(std::shared_ptr<const Crown> crown)
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
                            {"viewer/material.glsl", "viewer/crown.frag"})),
      draw_wet_(Program::Of({"viewer/material.glsl", "viewer/vertices.glsl", "viewer/camera.glsl", "viewer/crown.vert"},
                            {"viewer/material.glsl", "viewer/wet.glsl", "viewer/crown.frag"})),
      rings_(crown_->kernel.rings()) {
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
    columns.emplace_back(c.total_mm, c.outer_absorption.x, c.outer_absorption.y, c.outer_absorption.z);
    frames.push_back(Vec4(mesh.vertices[v]));
    frames.push_back(Vec4(crown_->fine_vertex_normals[v]));
  }
  // One corner for every normal that a vertex has: one where the surface is smooth, several at a rim.
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
  if (photo.lights.size() > kMaxLamps)
    throw InputError(capture.file, photo.key + ".lights",
                     "the viewer shows at most " + std::to_string(kMaxLamps) + " lamps at once",
                     "Choose another photograph, or merge lamps.");
  for (size_t l : photo.lights)
    if (std::holds_alternative<EnvironmentLight>(capture.lights[l].shape) && photo.polarisation != Polarisation::kCross)
      throw InputError(capture.file, photo.key + ".lights",
                       "the viewer of this version draws no highlights of an environment map, and '" +
                           capture.lights[l].name + "' is one",
                       "Choose a photograph with crossed polarisers or other lamps, or use `crownfit render`.");
  lamps_.clear();
  light_scale_.clear();
  std::vector<int> number(capture.lights.size(), 0);
  const RigidTransform object_from_camera = photo.camera_from_object.Inverse();
  for (size_t l : photo.lights) {
    const Light& light = capture.lights[l];
    number[l] = static_cast<int>(lamps_.size());
    lamps_.push_back(light.in_camera_frame ? Transformed(light.shape, object_from_camera) : light.shape);
    light_scale_.push_back(static_cast<float>(light.intensity_scale));
  }
  std::vector<glm::vec4> shares, backing, visibility;
  std::vector<int> share_light;
  for (const LightShare& s : cast.vertex_shares) {
    shares.push_back(Vec4(s.irradiance, s.cos_incidence));
    share_light.push_back(number[s.light]);
  }
  for (const BackingShare& b : cast.backing) backing.push_back(Vec4(b.reflectance));
  const size_t lamps = lamps_.size();
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
  UploadLampPoints();
  scenery_.Set(cast.scenery);
  bounds_ = Bounds(crown_->fine);
  for (const ShadedMesh& thing : cast.scenery) {
    const auto [low, high] = Bounds(thing.mesh);
    bounds_ = {glm::min(bounds_.first, low), glm::max(bounds_.second, high)};
  }
  vertices_are_stale_ = true;
}

void CrownRenderer::UploadLampPoints() {
  const auto [low, high] = Bounds(crown_->fine);
  std::vector<glm::vec4> points;
  first_point_.assign(kMaxLamps + 1, 0);
  for (size_t l = 0; l < kMaxLamps; ++l) {
    if (l < lamps_.size())
      for (const LampPoint& p : PointsOf(lamps_[l], 0.5 * (low + high))) {
        points.push_back(Vec4(p.place_or_direction));
        points.push_back(Vec4(p.normal, p.is_far ? 1.0 : 0.0));
        points.push_back(Vec4(p.weight));
      }
    first_point_[l + 1] = static_cast<int>(points.size() / 3);
  }
  points.resize(3 * kMaxLamps * kLampStrata * kLampStrata);  // the block's size
  lamp_points_.Upload(points);
}

/// What the rough surface reflects of a uniform sky of radiance 1, over the view's cosine.
void CrownRenderer::UploadGloss() {
  using Term = Terms<double>;
  const ShaderOptics<double>& o = optics_[0];
  std::vector<float> table;
  for (int i = 0; i < kGlossNodes; ++i) {
    const double cos_view = std::max(1e-3, static_cast<double>(i) / (kGlossNodes - 1));
    const glm::dvec3 normal(0, 0, 1), view(std::sqrt(1 - cos_view * cos_view), 0, cos_view);
    std::vector<LightSample> samples;
    SampleAllAroundForGloss(DomeLight{glm::dvec3(1.0)}, normal, view, o.roughness, 24, samples);
    double sum = 0;
    for (const LightSample& s : samples) {
      const glm::dvec3 half = glm::normalize(s.direction + view);
      const double light = s.direction.z, lh = glm::dot(s.direction, half);
      double f = Term::SurfaceReflection(light, cos_view, half.z, lh, o.roughness, o.entry_ior());
      if (o.may_be_wet)
        f += o.wetness * (Term::SurfaceReflectionUnderFilm(light, cos_view, half.z, lh, o.roughness, o.entry_ior(),
                                                           o.surface().film_ior()) -
                          f);
      sum += s.weight.x * light * f;
    }
    if (o.may_be_wet) sum += o.wetness * Term::FresnelReflectance(cos_view, o.surface().film_ior());
    table.push_back(static_cast<float>(sum));
  }
  gloss_table_.Upload(table);
}

void CrownRenderer::SetMaterial(const Capture& capture, const Material& material,
                                const std::vector<double>& thickness_mm) {
  const CastState state{crown_, thickness_mm, {}};
  std::vector<DiffuserTable<double>> tables;
  for (int c = 0; c < kChannels; ++c) {
    optics_[c] = OpticsFromSlots(capture, SlotValues(capture, material, state, c));
    tables.emplace_back(optics_[c].stack(), crown_->kernel.outer_radius_mm);
  }
  diffuse_fresnel_ = MomentsOf(optics_[0].surface()).diffuse_outside;
  std::vector<glm::vec4> table;
  for (size_t i = 0; i < tables[0].values().size(); ++i)
    table.push_back(Vec4({tables[0].values()[i], tables[1].values()[i], tables[2].values()[i]}));
  table_.Upload(table);
  outer_nodes_ = tables[0].outer_nodes();
  UploadGloss();
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
  Check(has_material_ && !lamps_.empty(), "light and material stand before anything is drawn");
  if (optics_[0].wetness > 0 && photo.polarisation != Polarisation::kCross &&
      !std::all_of(lamps_.begin(), lamps_.end(), IsAllAround))
    throw InputError("", "surface.wetness",
                     "the viewer of this version does not draw lamps mirrored by a film of water",
                     "Choose a photograph with crossed polarisers, or use `crownfit render`.");
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
  glEnable(GL_CULL_FACE);  // the crown is closed: what looks away is never seen
  Program& draw = optics_[0].may_be_wet ? draw_wet_ : draw_dry_;
  draw.Use();
  SetMaterialOf(draw);
  draw.Set("exitance", leaving_);
  draw.Set("first_order", scattered_);
  draw.Set("visibility", visibility_);
  SetCamera(draw, photo, bounds_);
  draw.Set("camera_position", camera);
  draw.Set("specular_factor", SpecularFactor(photo.polarisation));
  draw.SetBlock("LampPoints", lamp_points_);
  draw.Set("lamps", static_cast<int>(lamps_.size()));
  draw.Set("first_point", first_point_);
  draw.Set("every", quality == Quality::kMoving ? 4 : 1);
  draw.Set("gloss_table", gloss_table_);
  draw.Set("gloss_nodes", kGlossNodes);
  std::array<glm::vec3, kMaxLamps> sky{};
  for (size_t l = 0; l < lamps_.size(); ++l)
    if (const auto* dome = std::get_if<DomeLight>(&lamps_[l])) sky[l] = glm::vec3(dome->radiance);
  draw.Set("sky", std::span<const glm::vec3>(sky));
  draw.Set("show_diffuse", terms.diffuse);
  draw.Set("show_first", terms.first_order);
  draw.Set("show_gloss", terms.gloss);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * crown_->fine.triangles.size()), GL_UNSIGNED_INT, nullptr);
  if (terms.scenery) scenery_.Draw(photo, bounds_);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
}

}  // namespace crownfit
