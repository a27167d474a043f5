#include "scene/cast_capture.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "capture/capture.h"

namespace crownfit {

CastState CastAll(const CrownInput& input, const std::vector<double>& thickness_mm, const CastOptions& options,
                  Progress& progress, std::optional<size_t> only) {
  const Capture& capture = input.capture;
  CastState state;
  progress.Show("building the layers", 0.0);
  state.crown = BuildCrown(capture, input.source, thickness_mm, options.threads, options.crown);
  state.thickness_mm = CastThicknesses(capture, *state.crown, thickness_mm);
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    state.photographs.emplace_back();
    if (only && *only != i) continue;
    progress.Show("casting rays", static_cast<double>(i) / static_cast<double>(capture.photographs.size()),
                  capture.photographs[i].name);
    state.photographs.back() = CastPhotograph(capture, *state.crown, input.scenery, i, options);
  }
  return state;
}

std::string DepthNote(const Capture& capture, const Crown& crown) {
  constexpr double kApart = 0.05;
  const ParameterSpec& stated = capture.layers.back()[Quantity::kThickness];
  if (capture.layers.size() > 1 || !stated.stated || !stated.fixed) return "";
  const double depth = crown.thickness_mm.back();
  if (std::abs(stated.value[0] - depth) <= kApart * depth) return "";
  return Printed(
      "%s.thickness_mm is fixed at %.3g mm, but its mesh is %.3g mm deep. Photographs are predicted with the depth of "
      "the mesh; thickness_mm scales it only where it is free",
      capture.layers.back().name.c_str(), stated.value[0], depth);
}

std::vector<double> CastThicknesses(const Capture& capture, const Crown& crown, std::vector<double> built_mm) {
  if (!capture.layers.back()[Quantity::kThickness].fixed) built_mm.back() = crown.thickness_mm.back();
  return built_mm;
}

bool AnyBlurred(const Capture& capture) {
  return std::any_of(capture.photographs.begin(), capture.photographs.end(),
                     [](const auto& p) { return p.blur.has_value(); });
}

}  // namespace crownfit
