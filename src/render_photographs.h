#pragma once
// Predicted photographs of a capture, with any model.

#include <functional>
#include <optional>
#include <string>

#include "base/progress.h"
#include "capture/capture.h"
#include "optics/material.h"
#include "path/path_options.h"
#include "photo/image_io.h"

namespace crownfit {

struct RenderOptions {
  Model model = Model::kShader;
  std::optional<size_t> photograph;  ///< only this one
  int paths_per_pixel = 256;         ///< models path and diffusion
  int collisions = 10;               ///< model diffusion: of a walk before the switch to diffusion
  bool twelve_taps = false;          ///< model shader: 13 blur taps in place of 49
  bool fine = false;                 ///< model shader: four times the light samples
  uint64_t seed = 1;
  int threads = 0;
  bool derivatives = false;                      ///< models path and diffusion
  Estimator estimator = Estimator::kCollisions;  ///< models path and diffusion
  double scale = 1;                              ///< factor on the pictures' width and height
};

/// What the camera would record, the photograph's exposure_scale included.
struct RenderedPhotograph {
  size_t photograph;
  Image picture;
  std::optional<Image> variance;  ///< model path: of the picture's noise
  /// The picture's derivative by each parameter, "enamel.absorption_per_mm", and its standard deviation,
  /// "enamel.absorption_per_mm.stddev".
  std::vector<ImageLayer> derivatives;
  std::vector<uint8_t> on_object;  ///< 1: the ray through the pixel's centre hits the object
};

/// Renders the photographs and passes them on one by one. Returns notes for the user.
std::vector<std::string> RenderPhotographs(const Capture& capture, const Material& material,
                                           const RenderOptions& options, Progress& progress,
                                           const std::function<void(const RenderedPhotograph&)>& done);

}  // namespace crownfit
