#pragma once
// A layer's absorption that varies over the crown, as with stains and characterisations: a factor per channel, from a
// picture or from numbers at the vertices.

#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <vector>

#include "geometry/triangle_mesh.h"
#include "photo/spectrum.h"

namespace crownfit {

struct Capture;

/// Inside the layer every point takes the factor of the nearest point of the surface. Held on a grid of 0.1 mm or 1/96
/// of the longest side, whichever is larger, and linear in between: finer detail is lost.
class AbsorptionTexture {
 public:
  /// Texture of `layer`, on `mesh_file`: the layer's own mesh, or the one it is an offset of, unmodified from its file
  /// (repairs drop UV). Throws InputError: no such property, no UV, a picture that can't be read, factors outside
  /// [0, 1000].
  AbsorptionTexture(const Capture& capture, size_t layer, const std::filesystem::path& mesh_file, int threads);

  int channels() const { return factor_.channels(); }
  /// Factor on the layer's absorption, per channel.
  Spectrum At(const glm::dvec3& p) const;
  double At(const glm::dvec3& p, int channel) const;
  /// Its integral along a segment, mm. `direction`: unit.
  Spectrum Along(const glm::dvec3& from, const glm::dvec3& direction, double length_mm) const;

 private:
  glm::dvec3 low_;
  glm::ivec3 count_;
  double step_mm_;
  SpectrumArray<> factor_;
  struct Corners {
    std::array<size_t, 8> node;
    std::array<double, 8> weight;
  };
  Corners Around(const glm::dvec3& p) const;
};

}  // namespace crownfit
