#pragma once
// Thickness of the outer layer (or of the whole crown, if it has one material), in false colours.

#include <array>

#include "capture/capture.h"
#include "scene/crown.h"
#include "viewer/gl.h"

namespace crownfit {

/// Matplotlib's viridis at six positions: its lightness grows evenly, so it is readable in grey too.
inline constexpr std::array<std::array<float, 3>, 6> kThicknessColours{{{0.267f, 0.005f, 0.329f},
                                                                        {0.254f, 0.265f, 0.530f},
                                                                        {0.164f, 0.471f, 0.558f},
                                                                        {0.135f, 0.659f, 0.518f},
                                                                        {0.478f, 0.821f, 0.318f},
                                                                        {0.993f, 0.906f, 0.144f}}};

class ThicknessView {
 public:
  explicit ThicknessView(std::shared_ptr<const Crown> crown);

  double most_mm() const { return most_mm_; }  ///< value of the last colour
  /// `scale`: factor on the thickness of the outer layer since the crown was built.
  void Draw(const PhotographSpec& photo, const Canvas& canvas, double scale);

 private:
  std::shared_ptr<const Crown> crown_;
  Program program_;
  Buffer positions_, thickness_, indices_;
  VertexArray vertices_;
  double most_mm_ = 1;
};

}  // namespace crownfit
