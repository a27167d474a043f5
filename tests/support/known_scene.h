#pragma once
// Captures in memory, for tests that know the answer.

#include <optional>

#include "capture/capture.h"
#include "scene/cast_samples.h"
#include "scene/crown_source.h"

namespace crownfit {

/// One camera 250 mm above the origin on +z, looking down (x right, y up in the object's frame), and one photograph.
struct KnownScene {
  Capture capture;
  CrownSource source;
  std::vector<TriangleMesh> scenery;

  /// `outer` is the object; with two layers the second is its inward offset by `thickness_mm`.
  explicit KnownScene(TriangleMesh outer, int layers = 1, double thickness_mm = 0.5, int pixels = 8,
                      double view_mm = 4.0);
  void Light(const LightShape& shape);
  std::shared_ptr<const Crown> Build() const;
  PhotographCast Cast(const Crown& crown, const CastOptions& options = {}) const;
};

/// A crown (without one: the incisor) under 0.9 mm of enamel (6.6 / mm, g 0.68) over dentine (28 / mm, g 0.93), smooth:
/// about 140 collisions and 6 boundaries a path. Lit by a softbox of 20 degrees half angle beside the camera with a
/// little light from everywhere, or from everywhere alone.
KnownScene SmoothIncisor(int pixels, bool has_softbox = true, std::optional<TriangleMesh> crown = {});

}  // namespace crownfit
