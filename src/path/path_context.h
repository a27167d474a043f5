#pragma once
// What all paths of some photographs of one camera share: boundaries, media, lamps and the opaque objects around.

#include <bit>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

#include "capture/light_rig.h"
#include "capture/polarisation.h"
#include "optics/material.h"
#include "path/boundary.h"
#include "path/path_options.h"
#include "path/score_derivatives.h"

namespace crownfit {

struct BackingSpec;
struct Capture;

inline constexpr size_t kMaxLamps = 32;  // sampled at one point; further lamps are found only by paths that hit them

/// A set of a context's photographs, one bit each.
using PhotographSet = uint32_t;
static_assert(kMaxPhotographs <= 32);
template <class Do>
void ForEach(PhotographSet set, const Do& each) {
  for (; set != 0; set &= set - 1) each(static_cast<size_t>(std::countr_zero(set)));
}

struct Lamp {
  LightShape shape;
  double scale;
  bool is_sampled;            ///< false for a dome: it is so large that paths hit it anyway
  PhotographSet photographs;  ///< those that it lights
  bool is_followed = false;   ///< walks find it at their collisions
};

struct OpaqueThing {
  Spectrum reflectance;
  PhotographSet photographs;  ///< those that show it
};

/// A tile in optical contact: where the outer surface lies on it (within kContactMm), light inside meets the tile's
/// Lambertian surface in place of the boundary.
struct ContactTile {
  static constexpr double kContactMm = 0.05;
  glm::dvec3 centre, normal, side_u, side_v;
  double half_size_mm;
  Spectrum reflectance;

  explicit ContactTile(const BackingSpec& tile);
  bool Holds(const glm::dvec3& p) const {
    const glm::dvec3 d = p - centre;
    return std::abs(glm::dot(d, normal)) <= kContactMm && std::abs(glm::dot(d, side_u)) <= half_size_mm &&
           std::abs(glm::dot(d, side_v)) <= half_size_mm;
  }
};

class LightFields;
class UncollidedLight;

/// Walks end after this many collisions of the true random walk and one flight with the reduced coefficient. The light
/// arriving there is taken from the diffuse field (light_field.h).
struct HandOver {
  int collisions = 0;
  const LightFields* fields = nullptr;  ///< none: walks run to their end
};

/// Everything that all paths of some photographs share.
struct PathContext {
  const WalkScene& scene;
  const Media& media;
  const std::vector<OpaqueThing>& opaque;
  std::vector<OuterBoundary> outer{};  ///< between each medium and the outside
  bool cut_is_opaque = false;
  Spectrum cut_reflectance{};  ///< of an opaque cut, seen from inside
  std::optional<ContactTile> contact{};
  std::vector<Lamp> lamps{};
  std::vector<Polarisers> polarisers{};  ///< per photograph
  bool wants_derivatives = false;        ///< compute derivatives too
  CutDerivatives cut_derivatives{};
  HandOver hand_over{};
  const UncollidedLight* uncollided = nullptr;  ///< light of the lamps with is_followed
  /// The same as a walk sees it from its last collision before the flight with the reduced coefficient: light too goes
  /// that way.
  const UncollidedLight* uncollided_by_reduced = nullptr;

  /// True once the walk flies with the reduced coefficient.
  bool IsReduced(const WalkState& state) const { return hand_over.fields && state.collisions >= hand_over.collisions; }
};

/// The opaque objects of some photographs, each once: its mesh and its properties.
struct Surroundings {
  std::vector<TriangleMesh> meshes;
  std::vector<OpaqueThing> things;

  /// `scenery`: all meshes of the capture's scenery, in its order.
  Surroundings(const Capture& capture, const std::vector<TriangleMesh>& scenery,
               const std::vector<size_t>& photographs);
};

/// The layers' media in the order of WalkScene: outside first. `body` holds their textures.
Media MediaOf(const Capture& capture, const Material& material, const LayeredBody& body);

/// `begun` has scene, media and opaque objects. The result adds boundaries, cut, contact tile and lamps. `photographs`
/// must be able to share walks.
PathContext PathContextOf(const Capture& capture, const Material& material, const std::vector<size_t>& photographs,
                          const PathOptions& options, PathContext begun);

/// Whether the same paths serve both photographs: same camera, same pose, and the same contact tile, if any.
bool CanShareWalks(const Capture& capture, size_t a, size_t b);

}  // namespace crownfit
