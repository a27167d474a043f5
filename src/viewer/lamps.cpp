#include "viewer/lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "scene/light_samples.h"

namespace crownfit {
namespace {

constexpr int kLampStrata = 6;
constexpr int kSkyNodes = 64;
// Table sizes of an environment, as in shaders/viewer/lamps.glsl: blurred by the surface, sharp.
constexpr int kBlurredWidth = 64, kBlurredHeight = 32, kSharpWidth = 256, kSharpHeight = 128;

/// A small area of a lamp: near lamps have a position and an outward normal, distant ones a direction.
struct LampPoint {
  glm::dvec3 place_or_direction, normal;
  bool is_far;
  Spectrum weight;  ///< radiance x area, or radiance x solid angle
};

std::vector<glm::dvec2> Strata(int n) {
  std::vector<glm::dvec2> strata;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) strata.emplace_back((i + 0.5) / n, (j + 0.5) / n);
  return strata;
}

/// Sample points of a lamp that do not depend on the viewer; none for light from all around.
std::vector<LampPoint> PointsOf(const LightShape& shape, const glm::dvec3& towards) {
  std::vector<LampPoint> points;
  if (IsAllAround(shape)) return points;
  LightShape flat = shape;
  if (const auto* point = std::get_if<PointLight>(&shape)) {  // a disk of the same radiance that faces the crown
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
  // From in front of the lamp all its points are visible.
  const glm::dvec3 from = is_far ? towards : [&] {
    if (const auto* disk = std::get_if<DiskLight>(&flat)) return disk->centre_mm + normal;
    return std::get<RectangleLight>(flat).centre_mm + normal;
  }();
  for (const auto& uniform : Strata(kLampStrata)) {
    const auto p = SampleLightPoint(flat, from, uniform);
    if (!p) continue;
    if (is_far) {
      points.push_back({p->direction, glm::dvec3(0.0), true, p->radiance / (p->density * count)});
    } else {
      const double cosine = -glm::dot(p->direction, normal), d2 = p->distance_mm * p->distance_mm;
      points.push_back(
          {from + p->distance_mm * p->direction, normal, false, p->radiance * (d2 / (cosine * p->density * count))});
    }
  }
  return points;
}

/// Six vec4 per lamp for the mirror of lamps.glsl: kind and sizes; position or direction; normal; two axes along which
/// the lamp reaches from -1 to 1; radiance.
struct MirrorOf {
  using Rows = std::array<glm::vec4, 6>;
  const ShownChannels& shown;
  static glm::vec4 Kind(double kind, double a = 0, double b = 0) { return Vec4(glm::dvec3(kind, a, b)); }
  Rows operator()(const DiskLight& l) const {
    return {Kind(1, l.inner_radius_mm * l.inner_radius_mm, l.outer_radius_mm * l.outer_radius_mm),
            Vec4(l.centre_mm),
            Vec4(l.normal),
            {},
            {},
            Vec4(l.radiance, shown)};
  }
  Rows operator()(const RectangleLight& l) const {
    const glm::dvec3 cross = glm::cross(l.half_axis_u_mm, l.half_axis_v_mm);
    const double square = glm::dot(cross, cross);
    return {Kind(2),
            Vec4(l.centre_mm),
            Vec4(glm::normalize(cross)),
            Vec4(glm::cross(l.half_axis_v_mm, cross) / square),
            Vec4(glm::cross(cross, l.half_axis_u_mm) / square),
            Vec4(l.radiance, shown)};
  }
  Rows operator()(const DirectionalLight& l) const {
    const auto met = LightAlong(l, glm::dvec3(0.0), l.direction);
    return {
        Kind(3, std::cos(std::max(l.angular_radius, 1e-4))), Vec4(l.direction), {}, {}, {}, Vec4(met->radiance, shown)};
  }
  Rows operator()(const PointLight& l) const {
    return {Kind(4, l.radius_mm), Vec4(l.position_mm), {}, {}, {}, Vec4(l.radiant_intensity / std::numbers::pi, shown)};
  }
  Rows operator()(const DomeLight&) const { return {}; }  // in the tables
  Rows operator()(const EnvironmentLight&) const { return {}; }
};

/// The direction in the middle of a table's cell.
glm::dvec3 DirectionOf(int x, int y, int width, int height) {
  const double around = 2 * std::numbers::pi * (x + 0.5) / width, down = std::numbers::pi * (y + 0.5) / height;
  return {std::sin(down) * std::sin(around), std::cos(down), std::sin(down) * std::cos(around)};
}

/// Light from all around that a rough surface reflects towards `view`, without its film's mirror reflection.
Spectrum ReflectedByRoughness(const LightShape& light, const ShaderOptics<double>& o, const glm::dvec3& normal,
                              const glm::dvec3& view, int strata) {
  using Term = Terms<double>;
  const double cos_view = glm::dot(normal, view);
  std::vector<LightSample> samples;
  SampleAllAroundForGloss(light, normal, view, o.roughness, strata, samples);
  Spectrum sum;
  for (const LightSample& s : samples) {
    const glm::dvec3 half = glm::normalize(s.direction + view);
    const double cosine = glm::dot(s.direction, normal), lh = glm::dot(s.direction, half), nh = glm::dot(half, normal);
    double f = Term::SurfaceReflection(cosine, cos_view, nh, lh, o.roughness, o.entry_ior());
    if (o.may_be_wet)
      f += o.wetness * (Term::SurfaceReflectionUnderFilm(cosine, cos_view, nh, lh, o.roughness, o.entry_ior(),
                                                         o.surface().film_ior()) -
                        f);
    sum += s.weight * cosine * f;
  }
  return sum;
}

}  // namespace

void Lamps::SetLamps(std::vector<LightShape> shapes, const glm::dvec3& middle, const ShownChannels& shown) {
  shown_ = shown;
  shapes_ = std::move(shapes);
  UploadPoints(middle);
  UploadMirrors();
  if (has_surface_) UploadEnvironments();
}

void Lamps::SetSurface(const ShaderOptics<double>& optics) {
  const bool is_same = has_surface_ && optics.roughness == optics_.roughness && optics.wetness == optics_.wetness &&
                       optics.entry_ior() == optics_.entry_ior() && optics.may_be_wet == optics_.may_be_wet;
  optics_ = optics;
  has_surface_ = true;
  if (is_same) return;
  UploadReflectedSky();
  UploadEnvironments();
}

void Lamps::UploadPoints(const glm::dvec3& middle) {
  std::vector<glm::vec4> points;
  first_point_.assign(kMost + 1, 0);
  for (size_t l = 0; l < kMost; ++l) {
    if (l < shapes_.size())
      for (const LampPoint& p : PointsOf(shapes_[l], middle)) {
        points.push_back(Vec4(p.place_or_direction));
        points.push_back(Vec4(p.normal, p.is_far ? 1.0 : 0.0));
        points.push_back(Vec4(p.weight, shown_));
      }
    first_point_[l + 1] = static_cast<int>(points.size() / 3);
  }
  points.resize(3 * kMost * kLampStrata * kLampStrata);  // the uniform block's size
  points_.Upload(points);
}

void Lamps::UploadMirrors() {
  std::vector<glm::vec4> mirrors;
  for (const LightShape& shape : shapes_)
    for (const glm::vec4& row : std::visit(MirrorOf{shown_}, shape)) mirrors.push_back(row);
  mirrors_.Upload(mirrors);
}

/// Tables over the view's cosine: reflection by the rough surface, and by the film's mirror.
void Lamps::UploadReflectedSky() {
  const DomeLight sky{Spectrum(1.0)};
  std::vector<glm::vec4> table;
  for (int i = 0; i < kSkyNodes; ++i) {
    const double c = std::max(1e-3, static_cast<double>(i) / (kSkyNodes - 1));
    const glm::dvec3 view(std::sqrt(std::max(0.0, 1 - c * c)), 0, c);
    reflected_sky_ = ReflectedByRoughness(sky, optics_, {0, 0, 1}, view, 24)[0];  // the last value is along the normal
    const double mirrored =
        optics_.may_be_wet ? optics_.wetness * Terms<double>::FresnelReflectance(c, optics_.surface().film_ior()) : 0.0;
    table.emplace_back(reflected_sky_, mirrored, 0.0, 0.0);
  }
  reflected_skies_.Upload(table);
}

void Lamps::UploadEnvironments() {
  constexpr int kBlurred = kBlurredWidth * kBlurredHeight, kSharp = kSharpWidth * kSharpHeight;
  std::vector<glm::vec4> table;
  first_environment_.assign(kMost, -1);
  for (size_t l = 0; l < shapes_.size(); ++l) {
    if (!std::holds_alternative<EnvironmentLight>(shapes_[l])) continue;
    const int first = static_cast<int>(table.size());
    first_environment_[l] = first;
    table.resize(table.size() + kBlurred + kSharp);
    ParallelFor(kBlurred, 0, [&](size_t i) {
      const int at = static_cast<int>(i);
      const glm::dvec3 d = DirectionOf(at % kBlurredWidth, at / kBlurredWidth, kBlurredWidth, kBlurredHeight);
      table[first + i] = Vec4(ReflectedByRoughness(shapes_[l], optics_, d, d, 10) / reflected_sky_, shown_);
    });
    for (int i = 0; i < kSharp; ++i) {
      const glm::dvec3 d = DirectionOf(i % kSharpWidth, i / kSharpWidth, kSharpWidth, kSharpHeight);
      table[first + kBlurred + i] = Vec4(LightAlong(shapes_[l], glm::dvec3(0.0), d)->radiance, shown_);
    }
  }
  if (table.empty()) table.emplace_back(0.0f);
  environments_.Upload(table);
}

void Lamps::SetUniforms(Program& program) const {
  program.SetBlock("LampPoints", points_);
  program.Set("lamps", static_cast<int>(shapes_.size()));
  program.Set("first_point", first_point_);
  program.Set("reflected_skies", reflected_skies_);
  program.Set("sky_nodes", kSkyNodes);
  program.Set("mirrors", mirrors_);
  program.Set("environments", environments_);
  program.Set("first_environment", first_environment_);
  std::array<glm::vec3, kMost> sky{};
  for (size_t l = 0; l < shapes_.size(); ++l)
    if (const auto* dome = std::get_if<DomeLight>(&shapes_[l])) sky[l] = glm::vec3(Vec4(dome->radiance, shown_));
  program.Set("sky", std::span<const glm::vec3>(sky));
}

}  // namespace crownfit
