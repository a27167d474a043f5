#pragma once
// Photographs of a synthetic capture by model `shader`.

#include "fit/compare_photographs.h"
#include "optics/material_file.h"
#include "photo/image_io.h"
#include "scene/cast_capture.h"

namespace crownfit {

inline Material TruthOf(const Capture& capture) { return ReadMaterialFile(capture.folder / "truth.json", capture); }

/// Renders the photographs of a capture as this material makes them, without noise.
inline void RenderTruth(const Capture& capture, const Material& truth) {
  const CrownInput input = ReadInput(capture, 0, false);
  CastOptions options;
  options.shade_scenery = true;
  Progress silent(ProgressMode::kNone);
  const CastState state = CastAll(input, ThicknessesOf(capture, truth), options, silent);
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    Image image(capture.photographs[i].camera.width, capture.photographs[i].camera.height, 3);
    const auto values = PredictPixels(capture, state, i, truth, StatedLightScales(capture), 0);
    for (size_t k = 0; k < values.size(); ++k)
      for (int c = 0; c < 3; ++c)
        image.at(state.photographs[i].pixels[k].x, state.photographs[i].pixels[k].y, c) =
            static_cast<float>(values[k][c]);
    WriteImageFile(capture.photographs[i].files.image, image);
  }
}

}  // namespace crownfit
