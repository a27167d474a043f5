#pragma once
// The view of the crown and its lighting. The mouse turns the crown before the camera, or the lamps about the crown.
// Zoom and pan move the picture but not the camera, so that a photograph can follow them.

#include "capture/capture.h"
#include "geometry/triangle_mesh.h"

namespace crownfit {

struct ViewPose {
  RigidTransform camera_from_object;
  glm::dmat3 light_turn{1.0};  ///< of the photograph's lamps about the crown's middle, in the object's frame
  glm::dvec2 centre_px{0.0};   ///< the photograph's pixel in the middle of a pane
  double zoom = 1;             ///< 1: the photograph fits into the pane
};
bool operator==(const ViewPose& a, const ViewPose& b);

/// The photograph's own camera and lamps, the crown filling most of the picture.
ViewPose HomePose(const PhotographSpec& photo, const TriangleMesh& crown);

/// Rotation of the object before the camera: its near side follows the drag. In the camera's frame.
glm::dmat3 TurnByDrag(const glm::dvec2& drag_px, double pixels_per_turn);
/// Turns the crown about its middle.
void TurnCrown(ViewPose& pose, const glm::dvec3& middle, const glm::dmat3& turn_in_camera);
void TurnLamps(ViewPose& pose, const glm::dmat3& turn_in_camera);

/// Pane pixels per photograph pixel.
double ScaleOf(const ViewPose& pose, const Camera& camera, const glm::dvec2& pane_px);
void Pan(ViewPose& pose, const Camera& camera, const glm::dvec2& pane_px, const glm::dvec2& drag_px);
/// `factor` > 1 zooms in; the point at `at_px` of the pane stays there.
void Zoom(ViewPose& pose, const Camera& camera, const glm::dvec2& pane_px, const glm::dvec2& at_px, double factor);

/// The camera that fills a pane.
Camera PaneCamera(const ViewPose& pose, const Camera& camera, glm::ivec2 pane_px);

/// True when camera and lamps are as in the photograph; zoom and pan do not count.
bool IsAtHome(const ViewPose& pose, const PhotographSpec& photo);

/// The capture with one photograph's lamps fixed to the object and turned about `middle`.
Capture WithLampsTurned(Capture capture, size_t photograph, const glm::dvec3& middle, const glm::dmat3& turn);

}  // namespace crownfit
