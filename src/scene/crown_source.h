#pragma once
// The layers of a crown as a capture states them: meshes read and repaired, thicknesses, textures; and the nested
// surfaces that they make.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "geometry/signed_distance.h"
#include "geometry/triangle_mesh.h"
#include "scene/absorption_texture.h"
#include "scene/thickness_map.h"

namespace crownfit {

struct Capture;

/// The parts of a crown that do not depend on a thickness: read once, reused when a fitted thickness moved.
struct CrownSource {
  std::vector<std::optional<TriangleMesh>> meshes;             ///< per layer, where the capture gives one
  std::vector<std::shared_ptr<const DepthField>> fields;       ///< depth below meshes[i], where the next layers need it
  std::vector<std::shared_ptr<const ThicknessMap>> thickness;  ///< per layer, where it varies
  std::vector<std::shared_ptr<const AbsorptionTexture>> absorption;  ///< per layer, where it varies
  std::vector<std::string> messages;                                 ///< what was repaired while reading
};

CrownSource ReadCrownSource(const Capture& capture, int threads);

/// Lowers the upper bounds of thicknesses to the crown's depth, and the starts of free ones with them; returns messages
/// about the starts.
std::vector<std::string> KeepBuildable(const CrownSource& source, Capture& capture);

/// The nested surfaces, outermost first. `thickness[i]` is the distance in mm between the surfaces i and i + 1 where
/// i + 1 is an offset, or the factor on it where a field defines it (ignored elsewhere). Throws InputError when a layer
/// is thicker than its room.
std::vector<TriangleMesh> BuildSurfaces(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness);

/// Thicknesses (or their scales) that the capture states (initial or fixed), one per layer.
std::vector<double> StatedThicknesses(const Capture& capture);

}  // namespace crownfit
