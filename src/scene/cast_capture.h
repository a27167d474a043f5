#pragma once
// Casts of all photographs of a capture.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "scene/build_crown.h"
#include "scene/cast_photograph.h"
#include "scene/crown_input.h"

namespace crownfit {

/// The thicknesses (or scales) of the cast geometry; the model scales lengths by value / cast value.
struct CastState {
  std::shared_ptr<const Crown> crown;
  std::vector<double> thickness_mm;  ///< per layer, as given to BuildCrown
  std::vector<PhotographCast> photographs;
};

/// Casts every photograph (or only number `only`) on the crown built with these thicknesses.
CastState CastAll(const CrownInput& input, const std::vector<double>& thickness_mm, const CastOptions& options,
                  Progress& progress, std::optional<size_t> only = {});

/// Thicknesses at which the lengths of a crown built with `built_mm` were cast: a free thickness of the last layer
/// scales the depth of its mesh.
std::vector<double> CastThicknesses(const Capture& capture, const Crown& crown, std::vector<double> built_mm);

/// A note for the user where a fixed thickness of the last layer differs from its mesh's depth; else empty.
std::string DepthNote(const Capture& capture, const Crown& crown);

/// Whether a photograph states its blur.
bool AnyBlurred(const Capture& capture);

}  // namespace crownfit
