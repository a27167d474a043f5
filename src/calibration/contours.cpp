#include "calibration/contours.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/parallel.h"

namespace crownfit {

std::vector<int> ConnectedParts(const TriangleMesh& mesh) {
  std::vector<int> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) {
    root[find(t.y)] = find(t.x);
    root[find(t.z)] = find(t.x);
  }
  std::vector<int> parts;
  for (const auto& t : mesh.triangles) parts.push_back(find(t.x));
  return parts;
}

std::vector<ContourPoint> Contours(const RayCaster& caster, const std::vector<int>& parts, const Camera& camera,
                                   const RigidTransform& camera_from_object, int step_px) {
  const RigidTransform back = camera_from_object.Inverse();
  struct Seen {
    int part = -1;
    double distance = 0;
    glm::dvec3 at{0.0};
  };
  const auto look = [&](const glm::dvec2& pixel) {
    const glm::dvec3 d = back.Direction(DirectionFromPixel(camera, pixel));
    const auto hit = caster.Nearest(back.translation_mm, d);
    return hit ? Seen{parts[hit->point.triangle], hit->distance_mm, back.translation_mm + hit->distance_mm * d}
               : Seen{};
  };
  const auto differ = [](const Seen& a, const Seen& b) {
    return a.part != b.part || (a.part >= 0 && std::abs(a.distance - b.distance) > 0.8);
  };
  const int columns = camera.width / step_px, rows = camera.height / step_px;
  std::vector<Seen> grid(static_cast<size_t>(columns) * rows);
  const auto centre = [&](int x, int y) { return glm::dvec2((x + 0.5) * step_px, (y + 0.5) * step_px); };
  ParallelFor(rows, 0, [&](size_t y) {
    for (int x = 0; x < columns; ++x) grid[y * columns + x] = look(centre(x, static_cast<int>(y)));
  });
  std::vector<std::vector<ContourPoint>> of_row(rows);
  ParallelFor(rows, 0, [&](size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < columns; ++x)
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
        if (x + dx >= columns || y + dy >= rows) continue;
        Seen a = grid[y * columns + x], b = grid[(y + dy) * columns + x + dx];
        if (!differ(a, b)) continue;
        glm::dvec2 pa = centre(x, y), pb = centre(x + dx, y + dy);
        for (int k = 0; k < 4; ++k) {
          const glm::dvec2 middle = 0.5 * (pa + pb);
          const Seen m = look(middle);
          if (differ(a, m)) {
            pb = middle, b = m;
          } else {
            pa = middle, a = m;
          }
        }
        const bool a_is_nearer = b.part < 0 || (a.part >= 0 && a.distance < b.distance);
        ContourPoint point{a_is_nearer ? a.at : b.at, 0.5 * (pa + pb), glm::dvec2(dx, dy) * (a_is_nearer ? 1.0 : -1.0),
                           a.part < 0 || b.part < 0};
        of_row[row].push_back(point);
      }
  });
  std::vector<ContourPoint> contours;
  for (const auto& points : of_row) contours.insert(contours.end(), points.begin(), points.end());
  // Normals: perpendicular to the line through the neighbours, on the side that the grid's step pointed to.
  std::vector<glm::dvec2> normals(contours.size());
  ParallelFor(contours.size(), 0, [&](size_t i) {
    glm::dvec2 mean(0.0);
    double n = 0;
    double xx = 0, xy = 0, yy = 0;
    const double reach = 3.5 * step_px;
    for (int pass = 0; pass < 2; ++pass)
      for (size_t j = i > 400 ? i - 400 : 0; j < std::min(contours.size(), i + 400); ++j) {
        const glm::dvec2 d = contours[j].pixel - contours[i].pixel;
        if (glm::dot(d, d) > reach * reach || contours[j].is_outer != contours[i].is_outer) continue;
        if (pass == 0) {
          mean += d;
          ++n;
        } else {
          const glm::dvec2 e = d - mean / n;
          xx += e.x * e.x, xy += e.x * e.y, yy += e.y * e.y;
        }
      }
    const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
    glm::dvec2 normal(-std::sin(angle), std::cos(angle));
    if (n < 3) normal = contours[i].outward;
    normals[i] = glm::dot(normal, contours[i].outward) < 0 ? -normal : normal;
  });
  for (size_t i = 0; i < contours.size(); ++i) contours[i].outward = normals[i];
  return contours;
}

}  // namespace crownfit
