#include "geometry/signed_distance.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace crownfit {
namespace {

constexpr double kFilm_mm = 0.05;  // between an inner layer and the cut, so that the two surfaces never cross

}  // namespace

bool IsInside(const RayCaster& surface, const TriangleMesh& mesh, const glm::dvec3& point) {
  // Directions without symmetry, so that axis-aligned edges are not hit end on.
  static const glm::dvec3 kDirections[3] = {glm::normalize(glm::dvec3(0.8123, 0.3571, 0.4614)),
                                            glm::normalize(glm::dvec3(-0.2917, 0.9012, 0.3205)),
                                            glm::normalize(glm::dvec3(0.1379, -0.4243, -0.8950))};
  int votes = 0;
  for (const auto& d : kDirections) {
    const auto hit = surface.Nearest(point, d);
    votes += hit && glm::dot(FaceNormal(mesh, hit->point.triangle), d) > 0;
  }
  return votes >= 2;
}

DepthField::DepthField(const TriangleMesh& mesh, int threads)
    : scanned_(ScannedPart(mesh)),
      cut_(CutPart(mesh)),
      scanned_caster_({&scanned_}),
      cut_caster_({&cut_}),
      threads_(threads) {
  const RayCaster closed({&mesh});
  const auto [low, high] = Bounds(mesh);
  step_mm_ = std::max(0.06, glm::length(high - low) / 150.0);
  origin_ = low - 1.5 * step_mm_;
  size_ = glm::ivec3(glm::ceil((high - low) / step_mm_)) + 4;
  depth_mm_.resize(static_cast<size_t>(size_.x) * size_.y * size_.z);
  if (!cut_.triangles.empty()) above_cut_mm_.resize(depth_mm_.size());
  ParallelFor(static_cast<size_t>(size_.z) * size_.y, threads, [&](size_t row) {
    const int j = static_cast<int>(row % size_.y), k = static_cast<int>(row / size_.y);
    for (int i = 0; i < size_.x; ++i) {
      const glm::dvec3 p = origin_ + step_mm_ * glm::dvec3(i, j, k);
      const bool inside = IsInside(closed, mesh, p);
      const double from_scan = scanned_caster_.DistanceToSurface(p), from_cut = cut_caster_.DistanceToSurface(p);
      // Beyond the cut the layers continue: only the cut itself ends them there.
      depth_mm_[IndexOf(i, j, k)] = static_cast<float>(inside || from_cut < from_scan ? from_scan : -from_scan);
      if (!above_cut_mm_.empty()) above_cut_mm_[IndexOf(i, j, k)] = static_cast<float>(inside ? from_cut : -from_cut);
    }
  });
  max_depth_mm_ = *std::max_element(depth_mm_.begin(), depth_mm_.end());
}

std::optional<TriangleMesh> DepthField::LevelSurface(const std::function<double(const glm::dvec3&)>& depth_mm) const {
  // How far each node lies beyond the wanted depth; nodes well outside need no value.
  std::vector<float> beyond_mm(depth_mm_.size());
  ParallelFor(static_cast<size_t>(size_.z) * size_.y, threads_, [&](size_t row) {
    const int j = static_cast<int>(row % size_.y), k = static_cast<int>(row / size_.y);
    for (int i = 0; i < size_.x; ++i) {
      const size_t n = IndexOf(i, j, k);
      double beyond = depth_mm_[n];
      if (beyond > -2 * step_mm_) beyond -= depth_mm(origin_ + step_mm_ * glm::dvec3(i, j, k));
      if (!above_cut_mm_.empty()) beyond = std::min(beyond, above_cut_mm_[n] - kFilm_mm);
      beyond_mm[n] = static_cast<float>(beyond);
    }
  });
  if (*std::max_element(beyond_mm.begin(), beyond_mm.end()) < 0.5 * step_mm_) return std::nullopt;
  TriangleMesh mesh;
  const auto cell_index = [&](int i, int j, int k) { return IndexOf(i, j, k); };
  std::vector<int> vertex_of_cell(depth_mm_.size(), -1);
  const auto beyond = [&](int i, int j, int k) -> double { return beyond_mm[IndexOf(i, j, k)]; };

  // One vertex per cell that the surface crosses, at the mean of the crossings on its edges.
  for (int k = 0; k + 1 < size_.z; ++k) {
    for (int j = 0; j + 1 < size_.y; ++j) {
      for (int i = 0; i + 1 < size_.x; ++i) {
        glm::dvec3 sum(0.0);
        int count = 0;
        for (int edge = 0; edge < 12; ++edge) {
          const int axis = edge / 4;
          glm::ivec3 a(i, j, k);
          a[(axis + 1) % 3] += edge & 1;
          a[(axis + 2) % 3] += (edge >> 1) & 1;
          glm::ivec3 b = a;
          b[axis] += 1;
          const double da = beyond(a.x, a.y, a.z), db = beyond(b.x, b.y, b.z);
          if ((da > 0) == (db > 0)) continue;
          sum += glm::dvec3(a) + da / (da - db) * glm::dvec3(b - a);
          ++count;
        }
        if (count == 0) continue;
        vertex_of_cell[cell_index(i, j, k)] = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(origin_ + step_mm_ * sum / static_cast<double>(count));
      }
    }
  }

  // One quadrilateral per grid edge that the surface crosses, between the four cells around the edge.
  for (int k = 1; k + 1 < size_.z; ++k) {
    for (int j = 1; j + 1 < size_.y; ++j) {
      for (int i = 1; i + 1 < size_.x; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
          glm::ivec3 next(i, j, k);
          next[axis] += 1;
          const bool inside = beyond(i, j, k) > 0, next_inside = beyond(next.x, next.y, next.z) > 0;
          if (inside == next_inside) continue;
          glm::ivec3 du(0), dv(0);
          du[(axis + 1) % 3] = 1;
          dv[(axis + 2) % 3] = 1;
          const glm::ivec3 c(i, j, k);
          const auto vertex = [&](const glm::ivec3& cell) {
            return vertex_of_cell[cell_index(cell.x, cell.y, cell.z)];
          };
          int q[4] = {vertex(c - du - dv), vertex(c - dv), vertex(c), vertex(c - du)};
          if (!inside) std::swap(q[1], q[3]);
          mesh.triangles.emplace_back(q[0], q[1], q[2]);
          mesh.triangles.emplace_back(q[0], q[2], q[3]);
        }
      }
    }
  }

  // Newton steps on the true distance; the field's gradient points to greater depth. Steps are capped at a grid step,
  // so a vertex on a ridge, where the gradient jumps, stays put.
  const auto depth_at = [&](const glm::dvec3& p) {
    const glm::dvec3 g = (p - origin_) / step_mm_;
    const glm::ivec3 c = glm::clamp(glm::ivec3(glm::floor(g)), glm::ivec3(0), size_ - 2);
    const glm::dvec3 f = g - glm::dvec3(c);
    double sum = 0;
    for (int n = 0; n < 8; ++n) {
      const glm::ivec3 o(n & 1, (n >> 1) & 1, n >> 2);
      sum +=
          (o.x ? f.x : 1 - f.x) * (o.y ? f.y : 1 - f.y) * (o.z ? f.z : 1 - f.z) * at(c.x + o.x, c.y + o.y, c.z + o.z);
    }
    return sum;
  };
  for (auto& v : mesh.vertices) {
    if (!cut_.triangles.empty() && cut_caster_.DistanceToSurface(v) < 2 * step_mm_) continue;  // at the cut
    for (int step = 0; step < 3; ++step) {
      const double h = 0.5 * step_mm_;
      const glm::dvec3 gradient(depth_at(v + glm::dvec3(h, 0, 0)) - depth_at(v - glm::dvec3(h, 0, 0)),
                                depth_at(v + glm::dvec3(0, h, 0)) - depth_at(v - glm::dvec3(0, h, 0)),
                                depth_at(v + glm::dvec3(0, 0, h)) - depth_at(v - glm::dvec3(0, 0, h)));
      const double length = glm::length(gradient);
      if (length < 0.5 * step_mm_) break;  // on a ridge
      const double miss = depth_mm(v) - scanned_caster_.DistanceToSurface(v);
      v += std::clamp(miss, -step_mm_, step_mm_) / length * gradient;
    }
  }
  return mesh;
}

}  // namespace crownfit
