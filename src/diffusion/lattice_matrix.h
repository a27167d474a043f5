#pragma once
// Symmetric positive matrices that couple a lattice's nodes with their 26 neighbours, and their solution: conjugate
// gradients, preconditioned by geometric multigrid (Galerkin products with trilinear interpolation, one symmetric sweep
// of Gauss and Seidel; Briggs, Henson and McCormick 2000).

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

namespace crownfit {

/// The nodes in use of a regular lattice, and their neighbours.
struct LatticeNodes {
  static constexpr int kBeside = 27, kSelf = 13;
  glm::ivec3 size{0};             ///< of the whole lattice
  std::vector<int> number;        ///< node number per lattice site, row by row; -1: not in use
  std::vector<glm::ivec3> place;  ///< lattice site of every node
  /// Index 27 node + (dx + 1) + 3 (dy + 1) + 9 (dz + 1). Missing neighbours hold the node itself; their matrix entries
  /// are 0.
  std::vector<int> beside;

  LatticeNodes() = default;
  LatticeNodes(const glm::ivec3& size, std::vector<uint8_t> is_used);
  int count() const { return static_cast<int>(place.size()); }
  size_t IndexOf(const glm::ivec3& p) const { return (static_cast<size_t>(p.z) * size.y + p.y) * size.x + p.x; }
  int At(const glm::ivec3& p) const {
    const bool is_in = p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < size.x && p.y < size.y && p.z < size.z;
    return is_in ? number[IndexOf(p)] : -1;
  }
};

/// Matrix entries that couple nodes with their neighbours: index as LatticeNodes::beside.
using LatticeMatrix = std::vector<double>;

/// y = m x.
void Multiply(const LatticeNodes& nodes, const LatticeMatrix& m, std::span<const double> x, std::span<double> y);

/// Solver for one matrix, set up once for many right-hand sides.
class LatticeSolver {
 public:
  /// `nodes` must outlive it.
  LatticeSolver(const LatticeNodes& nodes, LatticeMatrix matrix);
  ~LatticeSolver();
  LatticeSolver(LatticeSolver&&) noexcept;

  /// Solves for every b, starting from the x passed in, until each residual norm is `tolerance` times that of its b.
  /// Returns the number of iterations. Several right-hand sides take little longer than one, as the matrix is read once
  /// for all.
  int Solve(std::span<const std::vector<double>> b, std::span<std::vector<double>> x, double tolerance) const;

 private:
  struct Level;
  template <size_t N>
  int SolveTogether(std::span<const std::vector<double>> b, std::span<std::vector<double>> x, double tolerance) const;
  std::vector<Level> levels_;  ///< finest first
};

}  // namespace crownfit
