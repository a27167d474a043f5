#include "scene/cast_photograph.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "geometry/mesh_file.h"
#include "scene/caster.h"

namespace crownfit {
namespace {

/// One pixel's casts before they are packed.
struct PixelResult {
  std::optional<PixelCast> pixel;
  std::optional<BackgroundPixel> background;
  Highlights highlights;
  std::vector<Mirrored> mirrored;
};

PixelResult CastPixel(const Caster& caster, const Crown& crown, const VertexCast& light, bool shade_scenery, int x,
                      int y) {
  PixelResult result;
  const glm::dvec3 direction = caster.PixelDirection(x + 0.5, y + 0.5);
  const auto hit = caster.Seen(direction);
  if (!hit) return result;
  if (hit->mesh != 0) {
    if (!shade_scenery) return result;
    result.background = BackgroundPixel{x, y, caster.SceneryShown(*hit, direction)};
    return result;
  }
  const glm::dvec3 view = -direction, position = Position(crown.fine, hit->point);
  glm::dvec3 normal = ShadingNormal(crown, hit->point);
  PixelCast pixel{};
  pixel.x = x;
  pixel.y = y;
  for (int corner = 0; corner < 4; ++corner) {
    const auto at_corner = caster.Seen(caster.PixelDirection(x + (corner & 1), y + (corner >> 1)));
    pixel.at_silhouette |= !at_corner || at_corner->mesh != 0 || crown.fine.cut(at_corner->point.triangle);
  }
  pixel.from_cut_mm = static_cast<float>(crown.cut_caster.DistanceToSurface(position));
  pixel.cos_view = std::max(1e-3, glm::dot(normal, view));
  pixel.at = InterpolationAt(crown.fine, hit->point);
  std::vector<float> visibility(caster.lights(), 0.0f);
  for (size_t l = 0; l < visibility.size(); ++l)
    for (int k = 0; k < 3; ++k)
      visibility[l] += pixel.at.weights[k] * light.visibility[pixel.at.vertices[k] * visibility.size() + l];
  caster.AddHighlights(position, normal, view, visibility, result.highlights);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const glm::dvec3 ray = caster.PixelDirection(x + 0.25 + 0.5 * (quarter & 1), y + 0.25 + 0.5 * (quarter >> 1));
    const auto seen = caster.Seen(ray);
    if (seen && seen->mesh == 0)
      caster.Mirror(Position(crown.fine, seen->point), ShadingNormal(crown, seen->point), ray, 0.25, result.mirrored);
  }
  result.pixel = pixel;
  return result;
}

}  // namespace

std::vector<TriangleMesh> ReadScenery(const Capture& capture) {
  std::vector<TriangleMesh> meshes;
  for (const auto& thing : capture.scenery) meshes.push_back(ReadMeshFile(thing.mesh));
  return meshes;
}

namespace {

VertexCast CastVerticesBy(const Caster& caster, const Capture& capture, const Crown& crown, size_t photograph,
                          const CastOptions& options) {
  VertexCast cast;
  const size_t vertices = crown.fine.vertices.size();
  std::vector<uint8_t> in_shade(vertices, 0);  // vertices of an opaque cut only
  if (capture.neck != Neck::kAir && !crown.fine.is_cut.empty()) {
    in_shade.assign(vertices, 1);
    for (const glm::ivec3& t : ScannedPart(crown.fine).triangles) in_shade[t.x] = in_shade[t.y] = in_shade[t.z] = 0;
  }
  std::vector<LightShares> at_vertex(vertices);
  cast.backing.resize(vertices);
  cast.visibility.assign(vertices * caster.lights(), 0.0f);
  ParallelFor(vertices, options.threads, [&](size_t v) {
    const glm::dvec3 &p = crown.fine.vertices[v], &n = crown.fine_vertex_normals[v];
    if (in_shade[v]) return;
    caster.Gather(p, n, options.strata, at_vertex[v], &cast.visibility[v * caster.lights()]);
    cast.backing[v] = caster.GatherScenery(p, n, at_vertex[v]);
  });
  cast.has_backing = capture.photographs[photograph].backing.has_value();
  LightShares& all = cast.vertex_shares;
  for (const LightShares& shares : at_vertex) {
    cast.first_share.push_back(static_cast<int>(all.each.size()));
    all.each.insert(all.each.end(), shares.each.begin(), shares.each.end());
    all.irradiance.Append(shares.irradiance);
  }
  cast.first_share.push_back(static_cast<int>(all.each.size()));
  return cast;
}

}  // namespace

VertexCast CastVertices(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery,
                        size_t photograph, const CastOptions& options) {
  const Caster caster(capture, crown, scenery, photograph, options);
  VertexCast cast = CastVerticesBy(caster, capture, crown, photograph, options);
  if (options.shade_scenery) cast.scenery = caster.ShadedScenery();
  return cast;
}

namespace {

PhotographCast CastPixelsBy(const Caster& caster, const PhotographSpec& photo, const Crown& crown,
                            const CastOptions& options, VertexCast light, const std::vector<uint8_t>& wanted) {
  PhotographCast cast;
  static_cast<VertexCast&>(cast) = std::move(light);
  cast.camera = photo.camera_from_object.Inverse().translation_mm;

  const size_t width = photo.camera.width, pixels = width * photo.camera.height;
  constexpr size_t kAtOnce = 1 << 15;  // bounds the memory of unpacked casts
  for (size_t begin = 0; begin < pixels; begin += kAtOnce) {
    std::vector<PixelResult> results(std::min(kAtOnce, pixels - begin));
    ParallelFor(results.size(), options.threads, [&](size_t i) {
      if (!wanted.empty() && !wanted[begin + i]) return;
      const int x = static_cast<int>((begin + i) % width), y = static_cast<int>((begin + i) / width);
      results[i] = CastPixel(caster, crown, cast, options.shade_scenery, x, y);
    });
    for (const PixelResult& r : results) {
      if (r.background) cast.background.push_back(*r.background);
      if (!r.pixel) continue;
      PixelCast pixel = *r.pixel;
      const auto pack = [](auto& all, const auto& some, int& first, int& count) {
        first = static_cast<int>(all.size());
        count = static_cast<int>(some.size());
        all.insert(all.end(), some.begin(), some.end());
      };
      pack(cast.highlights.each, r.highlights.each, pixel.first_highlight, pixel.highlight_count);
      cast.highlights.irradiance.Append(r.highlights.irradiance);
      pack(cast.mirrored, r.mirrored, pixel.first_mirrored, pixel.mirrored_count);
      cast.pixels.push_back(pixel);
    }
  }
  return cast;
}

}  // namespace

PhotographCast CastPhotograph(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery,
                              size_t photograph, const CastOptions& options) {
  const Caster caster(capture, crown, scenery, photograph, options);
  return CastPixelsBy(caster, capture.photographs[photograph], crown, options,
                      CastVerticesBy(caster, capture, crown, photograph, options), {});
}

PhotographCast CastPixels(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery,
                          size_t photograph, const CastOptions& options, const VertexCast& light,
                          const std::vector<uint8_t>& wanted) {
  const Caster caster(capture, crown, scenery, photograph, options);
  return CastPixelsBy(caster, capture.photographs[photograph], crown, options, light, wanted);
}

}  // namespace crownfit
