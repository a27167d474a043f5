#pragma once
// The published case "teeth-photos-scan-smartee-case1": scans in millimetres, five photographs, cameras by its authors.

#include <cmath>
#include <string>

#include "base/json_file.h"
#include "capture/camera.h"
#include "capture/rigid_transform.h"

namespace crownfit {

/// X_model = scale * rotation * X_scan + translation.
struct Similarity {
  double scale = 1.0;
  glm::dmat3 rotation{1.0};
  glm::dvec3 translation{0.0};
  glm::dvec3 Point(const glm::dvec3& p) const { return scale * (rotation * p) + translation; }
  glm::dvec3 InversePoint(const glm::dvec3& p) const { return glm::transpose(rotation) * (p - translation) / scale; }
};

inline glm::dmat3 ReadRows(const JsonNode& node) {
  glm::dmat3 m(1.0);
  const auto rows = node.Items();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) m[c][r] = rows[r].Numbers(3)[c];
  return m;
}

/// The case: crowns of both jaws, and the cameras its authors found.
struct ScannedMouth {
  explicit ScannedMouth(const std::filesystem::path& folder)
      : folder_(folder),
        similarities(folder / "derived_scan_to_camera_frame.json"),
        cameras(folder / "published_cameras.json") {
    const JsonObject s(similarities.root(), {"note", "upper", "lower"});
    upper = ReadSimilarity(s.Require("upper"));
    lower = ReadSimilarity(s.Require("lower"));
    const JsonObject c = CameraKeys();
    lower_to_upper = ReadRows(c.Require("relative_R_lower_to_upper"));
    lower_to_upper_shift = ReadVector(c.Require("relative_t_lower_to_upper"));
  }
  static Similarity ReadSimilarity(const JsonNode& node) {
    const JsonObject o(node, {"s", "R", "T", "rms_model_units"});
    return {o.Require("s").Positive(), ReadRows(o.Require("R")), ReadVector(o.Require("T"))};
  }
  JsonObject CameraKeys() const {
    return JsonObject(cameras.root(), {"source", "image_width_px_of_these_parameters", "note", "model", "views",
                                       "relative_R_lower_to_upper", "relative_t_lower_to_upper"});
  }
  /// Upper crown's scan frame from a crown of either jaw.
  glm::dvec3 InUpperScan(const glm::dvec3& p, bool is_lower) const {
    if (!is_lower) return p;
    // The published transform multiplies row vectors from the right.
    return upper.InversePoint(glm::transpose(lower_to_upper) * lower.Point(p) + lower_to_upper_shift);
  }
  /// Lower_occlusal: camera_from_scan of the lower jaw; all others: of the upper one.
  Camera ReadView(const std::string& name, RigidTransform& camera_from_scan) const {
    const JsonObject views(CameraKeys().Require("views"),
                           {"upper_occlusal", "lower_occlusal", "left", "right", "frontal"});
    const JsonObject v(views.Require(name), {"rotvec", "t", "focal_length_mm", "pixel_pitch_mm", "fx_px", "u0", "v0"});
    const glm::dmat3 rotation = RotationFromVector(ReadVector(v.Require("rotvec")));
    const Similarity& jaw = name == "lower_occlusal" ? lower : upper;
    camera_from_scan.rotation = rotation * jaw.rotation;
    camera_from_scan.translation_mm = (rotation * jaw.translation + ReadVector(v.Require("t"))) / jaw.scale;
    Camera camera;
    camera.width = 1440;
    camera.height = 1080;
    camera.fx = camera.fy = 1.8 * v.Require("fx_px").Number();
    camera.cx = 1.8 * v.Require("u0").Number();
    camera.cy = 1.8 * v.Require("v0").Number();
    return camera;
  }
  std::filesystem::path folder_;
  JsonFile similarities, cameras;
  Similarity upper, lower;
  glm::dmat3 lower_to_upper{1.0};
  glm::dvec3 lower_to_upper_shift{0.0};
};

}  // namespace crownfit
