#include "path/layer_cells.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace crownfit {
namespace {

constexpr int kColumns = 6;  // lines that measure volumes, along a side of a cell

glm::dmat3 AskewFromObject() {
  const glm::dvec3 axis = glm::normalize(glm::dvec3(0.48, 0.31, 0.82)),
                   about = glm::normalize(glm::dvec3(0.9, -0.5, 0.2));
  const glm::dvec3 side = glm::normalize(about - glm::dot(about, axis) * axis);
  return glm::transpose(glm::dmat3(axis, side, glm::cross(axis, side)));
}

std::pair<glm::dvec3, glm::dvec3> BoundsOf(const LayeredBody& body, const glm::dmat3& turn) {
  glm::dvec3 low(kFar), high(-kFar);
  for (const TriangleMesh& mesh : body.surfaces)
    for (const glm::dvec3& v : mesh.vertices) low = glm::min(low, turn * v), high = glm::max(high, turn * v);
  return {low, high};
}

/// Of a cell's middle, in cells.
glm::dvec2 OffsetOf(int column) {
  return (glm::dvec2(column % kColumns, column / kColumns) + 0.5) / static_cast<double>(kColumns) - 0.5;
}

}  // namespace

double LayerCells::Shortest_mm(const LayeredBody& body) {
  constexpr double kMostCells = 3e6;
  const auto [low, high] = BoundsOf(body, AskewFromObject());
  const glm::dvec3 size = high - low;
  return std::cbrt(size.x * size.y * size.z / kMostCells);
}

LayerCells::LayerCells(const LayeredBody& body, const WalkScene& scene, double cell_mm, int threads)
    : layers_(body.surfaces.size()), cell_mm_(cell_mm), cells_from_object_(AskewFromObject()) {
  const auto [low, high] = BoundsOf(body, cells_from_object_);
  count_ = glm::ivec3(glm::ceil((high - low) / cell_mm_ + 0.5));
  low_ = 0.5 * (low + high) - 0.5 * cell_mm_ * glm::dvec3(count_);
  cells_from_place_ = cells_from_object_ / cell_mm_;
  low_cells_ = low_ / cell_mm_;
  pieces_.resize(static_cast<size_t>(count_.y));
  ParallelFor(pieces_.size(), threads, [&](size_t row) { pieces_[row] = PiecesOfRow(scene, static_cast<int>(row)); });
  FindHomes(threads);
}

std::vector<LayerCells::Piece> LayerCells::PiecesOfRow(const WalkScene& scene, int row) const {
  const glm::dmat3 object_from_cells = glm::transpose(cells_from_object_);
  const glm::dvec3 up = object_from_cells * glm::dvec3(0, 0, 1);
  std::vector<Piece> pieces;
  for (int x = 0; x < count_.x; ++x)
    for (int column = 0; column < kColumns * kColumns; ++column) {
      const glm::dvec2 at = glm::dvec2(x + 0.5, row + 0.5) + OffsetOf(column);
      glm::dvec3 place = object_from_cells * (low_ + cell_mm_ * glm::dvec3(at, -1.0));
      double from = -1.0;
      for (int medium = kOutside;;) {
        const auto b = scene.NextByRay(place, up, medium, kFar, nullptr, [](int) { return false; });
        if (!b) break;
        const double to = from + b->distance_mm / cell_mm_;
        if (medium != kOutside) pieces.push_back({x, column, medium, static_cast<float>(from), static_cast<float>(to)});
        from = to;
        place = b->position;
        medium = b->behind(medium);
      }
    }
  return pieces;
}

template <class Each>
void LayerCells::ForCells(const Piece& piece, int row, const Each& each) const {
  const double low = piece.low, high = piece.high;
  for (int z = std::max(0, static_cast<int>(low)); z < count_.z && z < high; ++z)
    each(glm::ivec3(piece.x, row, z), std::max(low - z, 0.0) - 0.5, std::min(high - z, 1.0) - 0.5);
}

void LayerCells::FindHomes(int threads) {
  constexpr double kFew = 0.2;  // of a cell's volume
  std::vector<float> volume(static_cast<size_t>(count_.x) * count_.y * count_.z * layers_, 0.0f);
  for (int row = 0; row < count_.y; ++row)
    for (const Piece& piece : pieces_[static_cast<size_t>(row)])
      ForCells(piece, row, [&](const glm::ivec3& cell, double low, double high) {
        volume[IndexOf(cell, piece.medium)] += static_cast<float>((high - low) / (kColumns * kColumns));
      });
  home_of_.resize(volume.size());
  ParallelFor(static_cast<size_t>(count_.z), threads, [&](size_t z) {
    for (int y = 0; y < count_.y; ++y)
      for (int x = 0; x < count_.x; ++x)
        for (int medium = 1; medium <= static_cast<int>(layers_); ++medium) {
          const glm::ivec3 cell(x, y, z);
          const size_t at = IndexOf(cell, medium);
          size_t home = at;
          for (int k = 0; k < 27 && volume[at] < kFew; ++k) {
            const glm::ivec3 near = cell + glm::ivec3(k % 3, k / 3 % 3, k / 9) - 1;
            if (Holds(near) && volume[IndexOf(near, medium)] > volume[home]) home = IndexOf(near, medium);
          }
          // A neighbour that has itself joined another is no home.
          home_of_[at] = static_cast<int32_t>(volume[home] < kFew ? at : home);
        }
  });
}

std::vector<LayerCells::Moments> LayerCells::MomentsOf(const std::vector<int32_t>& number_of, size_t count) const {
  constexpr double kOwn = 1.0 / (12.0 * kColumns * kColumns), kShare = 1.0 / (kColumns * kColumns);
  std::vector<Moments> moments(count);
  for (int row = 0; row < count_.y; ++row)
    for (const Piece& piece : pieces_[static_cast<size_t>(row)])
      ForCells(piece, row, [&](const glm::ivec3& cell, double low, double high) {
        const size_t home = HomeOf(IndexOf(cell, piece.medium));
        const int32_t number = number_of[home];
        if (number < 0) return;
        const glm::ivec3 off = cell - CellOf(home);
        const glm::dvec2 at = OffsetOf(piece.column);
        const double u = at.x + off.x, v = at.y + off.y;
        low += off.z, high += off.z;
        const double length = kShare * (high - low), first = 0.5 * kShare * (high * high - low * low);
        Moments& m = moments[static_cast<size_t>(number)];
        m.volume += length;
        m.first += glm::dvec3(u * length, v * length, first);
        m.second[0] += glm::dvec3(length * (u * u + kOwn), length * u * v, u * first);
        m.second[1] += glm::dvec3(length * u * v, length * (v * v + kOwn), v * first);
        m.second[2] += glm::dvec3(u * first, v * first, kShare * (high * high * high - low * low * low) / 3.0);
      });
  return moments;
}

}  // namespace crownfit
