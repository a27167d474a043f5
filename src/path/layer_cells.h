#pragma once
// Small cells over an object's layers: which part of a cell a layer fills.

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "path/walk_scene.h"

namespace crownfit {

/// A lattice of cubes over a layered object, askew to it, so that no flat face lies along the cells. Every cell has a
/// part for each layer. A part that its layer hardly fills belongs to that of a neighbour, its home.
class LayerCells {
 public:
  /// Of the part of space that belongs to one home, about its cell's middle, in cells: volume, first and second
  /// moments.
  struct Moments {
    double volume = 0;
    glm::dvec3 first{0.0};
    glm::dmat3 second{0.0};
    void Add(const Moments& m) { volume += m.volume, first += m.first, second += m.second; }
  };

  /// The shortest cells that fit in memory.
  static double Shortest_mm(const LayeredBody& body);
  LayerCells(const LayeredBody& body, const WalkScene& scene, double cell_mm, int threads);

  /// What loops over places need.
  struct Lattice {
    glm::dmat3 cells_from_place;
    glm::dvec3 low;
    glm::ivec3 count;
    int layers;
  };
  Lattice lattice() const { return {cells_from_place_, low_cells_, count_, static_cast<int>(layers_)}; }

  double cell_mm() const { return cell_mm_; }
  /// Number of cells' parts.
  size_t size() const { return home_of_.size(); }
  /// A place in cells, and a direction in cells per mm.
  glm::dvec3 Place(const glm::dvec3& p) const { return cells_from_place_ * p - low_cells_; }
  glm::dvec3 Way(const glm::dvec3& direction) const { return cells_from_place_ * direction; }
  bool Holds(const glm::ivec3& cell) const {
    return cell.x >= 0 && cell.y >= 0 && cell.z >= 0 && cell.x < count_.x && cell.y < count_.y && cell.z < count_.z;
  }
  bool Holds(const glm::dvec3& place) const {
    return place.x >= 0 && place.y >= 0 && place.z >= 0 && place.x < count_.x && place.y < count_.y &&
           place.z < count_.z;
  }
  size_t IndexOf(const glm::ivec3& cell, int medium) const {
    return ((static_cast<size_t>(cell.z) * count_.y + cell.y) * count_.x + cell.x) * layers_ + (medium - 1);
  }
  glm::ivec3 CellOf(size_t index) const {
    const auto cell = static_cast<int>(index / layers_);
    return {cell % count_.x, cell / count_.x % count_.y, cell / (count_.x * count_.y)};
  }
  int MediumOf(size_t index) const { return static_cast<int>(index % layers_) + 1; }
  size_t HomeOf(size_t index) const { return static_cast<size_t>(home_of_[index]); }

  /// Moments of homes; `number_of`: where to find a home's, or -1.
  std::vector<Moments> MomentsOf(const std::vector<int32_t>& number_of, size_t count) const;

 private:
  /// A piece of an upright line through the object, in one layer.
  struct Piece {
    int x, column, medium;
    float low, high;  ///< in cells
  };
  std::vector<Piece> PiecesOfRow(const WalkScene& scene, int row) const;
  /// Calls each(cell, column, from, to) for every cell that a piece passes, from and to about its middle.
  template <class Each>
  void ForCells(const Piece& piece, int row, const Each& each) const;
  void FindHomes(int threads);

  size_t layers_;
  double cell_mm_;
  glm::dmat3 cells_from_object_{1.0};  ///< a rotation
  glm::dvec3 low_{0.0};
  glm::dmat3 cells_from_place_{1.0};  ///< the same with the cells as unit of length
  glm::dvec3 low_cells_{0.0};
  glm::ivec3 count_{0};
  std::vector<std::vector<Piece>> pieces_;  ///< by row
  std::vector<int32_t> home_of_;
};

}  // namespace crownfit
