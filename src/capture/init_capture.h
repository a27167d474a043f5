#pragma once
// A capture made of calibration products, meshes and photographs.

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/camera.h"
#include "capture/rigid_transform.h"

namespace crownfit {

/// Camera and pose of a photograph, known without a file.
struct StatedView {
  std::string photograph;  ///< its name in the capture
  Camera camera;
  RigidTransform camera_from_object;
};

/// A thing beside the object, in the photographs that show it.
struct StatedThing {
  std::string name;
  std::filesystem::path mesh;
  JsonValue reflectance;
  std::vector<std::string> photographs;
};

using NamedFiles = std::vector<std::pair<std::string, std::filesystem::path>>;

struct CaptureParts {
  NamedFiles meshes;                     ///< layers with a surface of their own, outermost first
  std::vector<std::string> more_layers;  ///< inside them, defined by thickness
  double thickness_mm = 0.8;             ///< of every layer whose next layer has no mesh
  NamedFiles photographs, masks, variances;
  /// Names of the channels and their wavelengths in nm, in the order of the pictures' planes; empty: R, G and B.
  std::vector<std::pair<std::string, double>> channels;
  std::filesystem::path camera, poses, lights;
  std::optional<Camera> known_camera;  ///< in place of the file `camera`
  std::vector<StatedView> views;       ///< where it is not empty, in place of `camera` and `poses`
  std::optional<std::filesystem::path> noise, colour, blur;
  /// Per photograph: lights that were on (default: all), filters, and whether it is held out.
  std::vector<std::pair<std::string, std::vector<std::string>>> lit;
  std::vector<std::pair<std::string, std::string>> polarisation;
  std::vector<std::string> holdouts;
  bool exposure_is_free = false;
  std::vector<StatedThing> scenery;
  /// What capture.json states of layers, by their names, and of the object, in place of textbook values.
  std::vector<std::pair<std::string, JsonValue::Object>> layer_keys;
  JsonValue::Object object_keys;
};

/// Copies everything into `folder` (mesh/, photos/, calib/) and writes capture.json: scattering, absorption and
/// roughness free, the rest fixed to textbook values for layers called enamel and dentine, or as the parts state them.
/// Throws InputError naming what is missing or unknown.
void InitCapture(const CaptureParts& parts, const std::filesystem::path& folder);

}  // namespace crownfit
