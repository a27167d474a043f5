#pragma once
// The state that a user sets or reads in the window's panel, as plain structs.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "viewer/crown_renderer.h"

namespace crownfit {

enum class ViewMode : int { kViewer, kPhotograph, kDifference, kSideBySide, kWipe, kThickness };
inline constexpr std::array<const char*, 6> kViewModes{"viewer",       "photograph", "difference",
                                                       "side by side", "wipe",       "thickness map"};

struct SliderNumber {
  double value = 0, fitted = 0;
  std::optional<std::array<double, 2>> interval95;
};

/// One parameter of the material: a number, or one per channel.
struct SliderParameter {
  size_t layer;  ///< or kSurfaceOwner
  Quantity quantity;
  std::string status;  ///< as the material file words it
  std::string idle;    ///< why it has no effect; empty: it has one
  std::vector<SliderNumber> numbers;
};

struct SliderGroup {
  std::string name;
  std::vector<SliderParameter> parameters;
};

struct LegendStep {
  std::string label;
  glm::vec3 colour;
};

enum class Drag { kNone, kOrbit, kPan, kLamps, kDivider };

struct PanelState {
  // set by the user
  ViewMode mode = ViewMode::kViewer;
  size_t photograph = 0;
  float exposure_stops = 0;
  bool true_colour = true;
  ShownTerms terms;
  float divider = 0.5f;  ///< position of the wipe, 0..1
  bool shows_help = false;
  std::vector<SliderGroup> material;
  Drag drag = Drag::kNone;

  // shown to the user
  std::vector<std::string> photographs;
  std::vector<std::string> channels;
  std::string no_photograph;  ///< why there is none to compare with
  std::string no_difference;  ///< why the difference is not shown
  std::string difference;     ///< its values
  std::string busy, message;
  bool message_is_error = false;
  std::string about;  ///< the graphics processor
  std::vector<LegendStep> difference_legend;
  double most_thickness_mm = 1;
  std::string thickness_of;
};

/// The user's requests in one frame.
struct PanelAnswer {
  bool material_moved = false, material_released = false;
  bool goes_home = false, saves_picture = false, saves_window = false, saves_material = false, closes = false;
};

}  // namespace crownfit
