#pragma once
// The crown's volume on a regular lattice, as trilinear finite cells (Parvizian, Duester and Rank 2007). Elements that
// the surface cuts are integrated over the part inside, by 4 x 4 x 4 points. The outside conducts a little, so that its
// nodes stay determined. No tetrahedral mesh is needed. The lattice is rotated: otherwise a flat face of the object
// would cut a whole layer of elements between the same quadrature points.

#include <functional>
#include <optional>
#include <vector>

#include "diffusion/lattice_matrix.h"
#include "geometry/triangle_mesh.h"
#include "scene/absorption_texture.h"

namespace crownfit {

/// An element and a point in it, each coordinate in [0, 1].
struct LatticePlace {
  int element;
  glm::vec3 at;
};

/// The eight nodes around a point, and their trilinear weights.
struct LatticeStencil {
  std::array<int, 8> node;
  std::array<double, 8> weight;
};

/// A piece of the object's outer boundary, small compared with an element.
struct BoundaryPiece {
  glm::dvec3 position{0.0}, normal{0.0};  ///< unit, outward
  double area_mm2;
  int layer;    ///< the layer just inside
  bool is_cut;  ///< belongs to the cut that closes the neck of an open scan
  LatticeStencil stencil;
};

class VolumeLattice {
 public:
  /// `surfaces`: closed, outermost layer first; a point belongs to the innermost surface that holds it. `is_exposed`:
  /// per surface and triangle, whether a deeper layer may reach the outside there. `textures`: factors on each layer's
  /// absorption.
  VolumeLattice(const std::vector<TriangleMesh>& surfaces, const std::vector<std::vector<uint8_t>>& is_exposed,
                const std::vector<std::shared_ptr<const AbsorptionTexture>>& textures, double element_mm, int threads);

  double element_mm() const { return element_mm_; }
  int layers() const { return layers_; }
  const LatticeNodes& nodes() const { return nodes_; }
  const std::vector<BoundaryPiece>& pieces() const { return pieces_; }
  /// Volume of the object assigned to a node, mm^3.
  double volume_mm3(int node) const { return volume_mm3_[node]; }
  /// Empty where no element is in use.
  std::optional<LatticePlace> PlaceOf(const glm::dvec3& p) const;
  LatticeStencil StencilOf(const LatticePlace& place) const;
  glm::dvec3 PositionOf(const LatticePlace& place) const;

  /// Sum over layers of conduction x products of gradients + sink x products of values, and over boundary pieces of
  /// leak x products of values. `conduction` and `sink` are per layer; sinks follow the layers' textures of `channel`.
  /// `leak` is per boundary piece and is multiplied by its area here.
  LatticeMatrix Matrix(std::span<const double> conduction, std::span<const double> sink, std::span<const double> leak,
                       int channel) const;
  /// The matrix of one layer alone, applied to x: for derivatives.
  void AddConduction(int layer, double factor, std::span<const double> x, std::span<double> y) const;
  void AddSink(int layer, int channel, double factor, std::span<const double> x, std::span<double> y) const;

  /// The longest element that resolves the object and the shortest transport mean free path `shortest_mm`. It is one of
  /// a few sizes, so that small changes of a material keep it.
  static double ElementFor(const std::vector<TriangleMesh>& surfaces, double shortest_mm);
  /// About as many nodes as a lattice of such elements has, without building it: volume and surface of the object,
  /// grown by an element's mean width (Steiner 1840, without its terms of edges and corners).
  static double NodesFor(const TriangleMesh& outer, double element_mm);

 private:
  struct ElementSum;
  void Integrate(const std::vector<TriangleMesh>& surfaces,
                 const std::vector<std::shared_ptr<const AbsorptionTexture>>& textures, int threads);
  void FindPieces(const std::vector<TriangleMesh>& surfaces, const std::vector<std::vector<uint8_t>>& is_exposed,
                  int threads);
  glm::dvec3 Stood(const glm::dvec3& p) const { return lattice_from_object_ * p; }
  glm::dvec3 Back(const glm::dvec3& p) const { return glm::transpose(lattice_from_object_) * p; }
  glm::dmat3 lattice_from_object_;  ///< a rotation
  glm::dvec3 low_;
  double element_mm_;
  glm::ivec3 elements_;
  int layers_;
  LatticeNodes nodes_;
  std::vector<std::array<int, 8>> corners_;           ///< per element of the lattice; -1: not in use
  std::vector<LatticeMatrix> gradients_;              ///< stiffness matrices, per layer
  std::vector<std::vector<LatticeMatrix>> products_;  ///< mass matrices, likewise; one without texture
  std::vector<double> volume_mm3_;
  LatticeMatrix outside_;  ///< stiffness matrix of the outside
  std::vector<BoundaryPiece> pieces_;
};

}  // namespace crownfit
