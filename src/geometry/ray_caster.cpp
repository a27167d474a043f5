#include "geometry/ray_caster.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "geometry/embree.h"

namespace crownfit {
namespace {

/// Closest point on a triangle (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
glm::dvec3 ClosestOnTriangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const glm::dvec3 bp = p - b;
  const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const glm::dvec3 cp = p - c;
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const double sum = 1.0 / (va + vb + vc);
  return a + vb * sum * ab + vc * sum * ac;
}

struct NearestSurface {
  const std::vector<const TriangleMesh*>* meshes;
  double distance = kFar;
  int triangle = -1;
  glm::dvec3 point{0.0};
};

bool VisitTriangle(RTCPointQueryFunctionArguments* args) {
  auto& best = *static_cast<NearestSurface*>(args->userPtr);
  const TriangleMesh& mesh = *(*best.meshes)[args->geomID];
  const glm::ivec3 t = mesh.triangles[args->primID];
  if (t.x == t.y || t.y == t.z || t.z == t.x) return false;  // collapsed: without weights
  const glm::dvec3 p(args->query->x, args->query->y, args->query->z);
  const glm::dvec3 point = ClosestOnTriangle(p, mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]);
  const double d = glm::distance(p, point);
  if (!(d < best.distance)) return false;  // also for a facet without area, whose distance is NaN
  best.distance = d;
  best.point = point;
  best.triangle = static_cast<int>(args->primID);
  args->query->radius = static_cast<float>(d) * (1.0f + 1e-6f);
  return true;
}

RTCRay MakeRay(const glm::dvec3& o, const glm::dvec3& d, double min_mm, double max_mm) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(o.x);
  ray.org_y = static_cast<float>(o.y);
  ray.org_z = static_cast<float>(o.z);
  ray.dir_x = static_cast<float>(d.x);
  ray.dir_y = static_cast<float>(d.y);
  ray.dir_z = static_cast<float>(d.z);
  ray.tnear = static_cast<float>(min_mm);
  ray.tfar = static_cast<float>(max_mm);
  ray.mask = ~0u;
  return ray;
}

std::optional<Hit> HitOf(const RTCRayHit& query) {
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  // Clamped to the triangle: rounding may put a hit on an edge beside it.
  const double u = std::max(0.0f, query.hit.u), v = std::max(0.0f, query.hit.v), w = std::max(0.0, 1.0 - u - v);
  return Hit{query.ray.tfar, static_cast<int>(query.hit.geomID),
             SurfacePoint{static_cast<int>(query.hit.primID), glm::dvec3(w, u, v) / (w + u + v)}};
}

}  // namespace

struct RayCaster::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<const TriangleMesh*> meshes;
  ~Impl() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

RayCaster::RayCaster(const std::vector<const TriangleMesh*>& meshes) : impl_(std::make_unique<Impl>()) {
  impl_->meshes = meshes;
  impl_->device = rtcNewDevice("threads=1");  // the same tree for any number of processors
  Check(impl_->device != nullptr, "Embree starts");
  impl_->scene = rtcNewScene(impl_->device);
  // Robust: no leaks between neighbouring triangles. Filters: NearestAccepted.
  rtcSetSceneFlags(impl_->scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | kSceneFilters));
  for (size_t m = 0; m < meshes.size(); ++m) {
    const RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                          3 * sizeof(float), meshes[m]->vertices.size()));
    for (const auto& p : meshes[m]->vertices)
      for (int k = 0; k < 3; ++k) *v++ = static_cast<float>(p[k]);
    auto* t = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                             3 * sizeof(unsigned), meshes[m]->triangles.size()));
    for (const auto& f : meshes[m]->triangles)
      for (int k = 0; k < 3; ++k) *t++ = static_cast<unsigned>(f[k]);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(impl_->scene, geometry, static_cast<unsigned>(m));
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(impl_->scene);
  Check(rtcGetDeviceError(impl_->device) == RTC_ERROR_NONE, "Embree builds the scene");
}

RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

std::optional<Hit> RayCaster::Nearest(const glm::dvec3& origin, const glm::dvec3& direction, double min_mm,
                                      double max_mm) const {
  RayContext context;
  RTCRayHit query{};
  query.ray = MakeRay(origin, direction, min_mm, max_mm);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  Intersect(impl_->scene, context, nullptr, query);
  return HitOf(query);
}

std::optional<Hit> RayCaster::NearestAccepted(const glm::dvec3& origin, const glm::dvec3& direction, double max_mm,
                                              Predicate predicate, const void* state) const {
  struct FilterContext {
    RayContext embree;  // first, so that the filter can cast back
    Predicate predicate;
    const void* state;
  } context{{}, predicate, state};
  const RTCFilterFunctionN filter = [](const RTCFilterFunctionNArguments* args) {
    const auto* c = reinterpret_cast<const FilterContext*>(args->context);
    const int mesh = static_cast<int>(RTCHitN_geomID(args->hit, args->N, 0));
    const int triangle = static_cast<int>(RTCHitN_primID(args->hit, args->N, 0));
    if (!c->predicate(c->state, mesh, triangle)) args->valid[0] = 0;
  };
  RTCRayHit query{};
  query.ray = MakeRay(origin, direction, 0.0, max_mm);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  Intersect(impl_->scene, context.embree, filter, query);
  return HitOf(query);
}

bool RayCaster::Occluded(const glm::dvec3& origin, const glm::dvec3& direction, double min_mm, double max_mm) const {
  RTCRay ray = MakeRay(origin, direction, min_mm, max_mm);
  Occlude(impl_->scene, ray);
  return ray.tfar < 0;
}

namespace {

NearestSurface NearestTo(const glm::dvec3& p, RTCScene scene, const std::vector<const TriangleMesh*>& meshes,
                         double within_mm = kFar) {
  NearestSurface best{&meshes, kFar, -1, glm::dvec3(0.0)};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  RTCPointQuery query{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0.0f,
                      static_cast<float>(within_mm) * (1.0f + 1e-5f)};
  rtcPointQuery(scene, &query, &context, VisitTriangle, &best);
  return best;
}

}  // namespace

double RayCaster::DistanceToSurface(const glm::dvec3& p, double within_mm) const {
  return NearestTo(p, impl_->scene, impl_->meshes, within_mm).distance;
}

SurfacePoint RayCaster::ClosestPoint(const glm::dvec3& p) const {
  const NearestSurface best = NearestTo(p, impl_->scene, impl_->meshes);
  const TriangleMesh& mesh = *impl_->meshes[0];
  const glm::ivec3 t = mesh.triangles[best.triangle];
  const glm::dvec3 &a = mesh.vertices[t.x], ab = mesh.vertices[t.y] - a, ac = mesh.vertices[t.z] - a;
  const glm::dvec3 normal = glm::cross(ab, ac), ap = best.point - a;
  const double area = glm::dot(normal, normal);
  const double v = glm::dot(glm::cross(ap, ac), normal) / area, w = glm::dot(glm::cross(ab, ap), normal) / area;
  return {best.triangle, {1.0 - v - w, v, w}};
}

}  // namespace crownfit
