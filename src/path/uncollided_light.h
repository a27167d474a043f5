#pragma once
// Light from the lamps that is inside the object and has not collided yet. Camera walks find it at every collision.
//
// Rays of each lamp (uncollided_rays.h) leave fluence in small cells (power x length / volume, the track-length
// estimator), the fluence's first moments of place, and directions drawn from it. Inside a cell the fluence is linear:
// the function whose integral and first moments over the part of the cell that one layer fills are those of the rays.
//
// The rays are 16 independent groups. Of each group a cell keeps one direction, drawn in proportion to the light along
// it, so the mean over cells and seeds has every spherical harmonic of the light's directions. Mean directions do not
// suffice: with moments up to the second degree a plate under a lamp of 43 degrees was 1.7 % too dark at g = -0.4. What
// walks find of each group tells the noise of the light, which all walks have in common.
//
// A camera walk that collides at x, flying along w, adds sum over lamps of fluence(x) p(w . direction) / n^2.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "path/layer_cells.h"
#include "path/path_context.h"
#include "path/score_derivatives.h"
#include "path/uncollided_rays.h"

namespace crownfit {

class UncollidedLight {
 public:
  static constexpr int kGroups = 16;  ///< of rays
  using OfGroups = std::array<float, kGroups>;

  /// Follows the lamps with Lamp::is_followed, in `media` in place of the context's. Both must outlive the light.
  UncollidedLight(const PathContext& context, const Media& media, const LayeredBody& body,
                  const UncollidedOptions& options, uint64_t seed, int threads);

  struct Scattering;  ///< the light around a collision (uncollided_light.cpp)
  using Source = UncollidedRays::Source;
  const std::vector<Source>& sources() const { return sources_; }
  double cell_mm() const { return cells_ ? cells_->cell_mm() : 0.0; }
  /// False where cells that fit in memory hold too many free paths. There is no light then: walks must look for the
  /// lamps themselves.
  bool is_resolved() const { return cells_.has_value(); }
  size_t bytes() const;

  /// The light around a point of one layer.
  struct Here {
    const int32_t* blocks = nullptr;  ///< of all sources
    glm::vec3 at{0.0f};               ///< in cells
  };
  /// Where the light around many points is kept, found in two steps with a prefetch each, so that the memory of all is
  /// read at once. `layer`: -1 where it is not wanted. Writes the places in cells and the numbers of the cells' parts.
  void Locate(int count, const double* x, const double* y, const double* z, const int* layer, float* at_x, float* at_y,
              float* at_z, int* part) const;
  /// False where it is dark.
  bool Open(int part, const int32_t*& blocks) const {
    const int32_t home = part_of_[static_cast<size_t>(part)];
    if (home < 0) return false;
    blocks = &block_of_[static_cast<size_t>(home) * sources_.size()];
    for (size_t source = 0; source < sources_.size(); ++source) Prefetch(blocks[source]);
    return true;
  }
  bool IsDark(const Here& here, size_t source) const { return here.blocks[source] < 0; }

  /// What a collision scatters of one source's light, which is not dark there, back along the direction in which the
  /// walk arrived: adds radiance over n^2 times weights[c] to sums[c], per channel and group of rays.
  void AddScattered(const Here& here, size_t source, const glm::dvec3& direction, const Medium& medium,
                    const float* weights, OfGroups* sums) const;

  /// The same summed over groups, and its derivatives by the light and the phase function, per layer. Of a light with
  /// derivatives (PathContext::wants_derivatives) only. `medium`: number of the medium.
  struct Scattered {
    Spectrum value;
    std::vector<LayerDerivatives> by;
    std::vector<float> sums;  ///< work space
  };
  void Differentiate(const Here& here, size_t source, const glm::dvec3& direction, int medium, const float* weights,
                     Scattered& found) const;

 private:
  // A block holds one source's light in one part of a cell.
  struct alignas(64) Lobe {
    std::array<std::array<int16_t, kGroups>, 3> directions{};  ///< x, y and z, of 32767
    std::array<uint16_t, kGroups> shares{};                    ///< of the light, of whatever the fluence is scaled by
  };
  struct alignas(64) Line {
    std::array<float, 16> v{};
  };
  static constexpr size_t kFluence = 3;  ///< in a block's lines: the cell's middle; then channel by channel, over n^2,
                                         ///< the fluence there and its gradient, in cells; then for every kind of
                                         ///< length the fluence times the length that its light has gone
  Scattering ScatteringOf(const Here& here, size_t source, const glm::dvec3& direction, const Medium& medium) const;
  void Prefetch(int32_t block) const {
    if (block < 0) return;
    const auto b = static_cast<size_t>(block);
    const auto* lobe = reinterpret_cast<const char*>(&lobes_[b]);
    __builtin_prefetch(lobe);
    __builtin_prefetch(lobe + 64);
    for (size_t k = 0; k < lines_of_block_; ++k) __builtin_prefetch(&lines_[b * lines_of_block_ + k]);
  }
  void SetBlock(size_t block, size_t home, const double* sums, const LayerCells::Moments& filled, float* shares,
                const double* drawn_lengths);

  void SetOwnLengths(float* own, const double* sums, int channels, const glm::dmat3& inverse_spread,
                     const glm::dvec3& centroid, const double* drawn) const;

  const Media* media_;
  int channels_;
  std::vector<Source> sources_;
  bool own_shares_;        ///< channels scatter differently, so their light keeps to other directions
  size_t lengths_;         ///< kinds of length: per layer the light's way there; then with textures times the texture
  bool is_by_true_media_;  ///< their scattering follows g at constant reduced scattering
  size_t lines_of_block_;
  std::optional<LayerCells> cells_;
  std::vector<int32_t> part_of_;   ///< per part of a cell: that of its home; -1: dark. The last is outside all cells
  std::vector<int32_t> block_of_;  ///< per part and source; -1: dark
  std::vector<Lobe> lobes_;        ///< per block
  std::vector<std::array<uint16_t, kGroups>> shares_;  ///< per block and channel, with own_shares_
  std::vector<float> own_lengths_;  ///< per block, channel with own_shares_, kind and group: beyond the mean
  std::vector<Line> lines_;         ///< per block, lines_of_block_
};

}  // namespace crownfit
