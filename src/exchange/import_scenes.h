#pragma once
// Whole scenes of another program as parts of a capture.

#include <filesystem>
#include <string>
#include <vector>

#include "capture/init_capture.h"
#include "exchange/imported_views.h"

namespace crownfit {

/// A view, and what stands in its scene.
struct SceneView {
  ImportedView view;  ///< in mm
  std::vector<std::string> lights, things;
};

/// Takes object, lamps and scenery of Mitsuba's scenes into `capture`, where it does not have meshes or lights of its
/// own. What scenes share is taken once. Files are written to `folder`, which InitCapture copies them from. Throws
/// InputError where the scenes show different objects.
std::vector<SceneView> TakeMitsubaScenes(const std::vector<std::filesystem::path>& files, double mm_per_unit,
                                         const std::filesystem::path& folder, CaptureParts& capture);

}  // namespace crownfit
