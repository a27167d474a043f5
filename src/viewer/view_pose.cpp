#include "viewer/view_pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crownfit {
namespace {

constexpr double kFilled = 0.85;  // share of a pane that the crown fills

glm::dmat3 About(int axis, double angle) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  glm::dmat3 turn(1.0);
  turn[u][u] = turn[v][v] = std::cos(angle);
  turn[u][v] = std::sin(angle);
  turn[v][u] = -std::sin(angle);
  return turn;
}

}  // namespace

bool operator==(const ViewPose& a, const ViewPose& b) {
  return a.camera_from_object.rotation == b.camera_from_object.rotation &&
         a.camera_from_object.translation_mm == b.camera_from_object.translation_mm && a.light_turn == b.light_turn &&
         a.centre_px == b.centre_px && a.zoom == b.zoom;
}

ViewPose HomePose(const PhotographSpec& photo, const TriangleMesh& crown) {
  ViewPose pose;
  pose.camera_from_object = photo.camera_from_object;
  glm::dvec2 low(HUGE_VAL), high(-HUGE_VAL);
  for (const glm::dvec3& vertex : crown.vertices)
    if (const auto pixel = PixelFromPoint(photo.camera, pose.camera_from_object.Point(vertex))) {
      low = glm::min(low, *pixel);
      high = glm::max(high, *pixel);
    }
  const glm::dvec2 size(photo.camera.width, photo.camera.height), seen = (high - low) / size;
  pose.centre_px = 0.5 * (low + high);
  pose.zoom = std::clamp(kFilled / std::max(seen.x, seen.y), 0.1, 50.0);
  return pose;
}

glm::dmat3 TurnByDrag(const glm::dvec2& drag_px, double pixels_per_turn) {
  const double angle = 2 * std::numbers::pi / pixels_per_turn;
  // The camera looks along +z and y points down: near parts move right when z turns away from x.
  return About(0, angle * drag_px.y) * About(1, -angle * drag_px.x);
}

void TurnCrown(ViewPose& pose, const glm::dvec3& middle, const glm::dmat3& turn_in_camera) {
  const glm::dvec3 centre = pose.camera_from_object.Point(middle);
  pose.camera_from_object.rotation = turn_in_camera * pose.camera_from_object.rotation;
  pose.camera_from_object.translation_mm = centre - pose.camera_from_object.rotation * middle;
}

void TurnLamps(ViewPose& pose, const glm::dmat3& turn_in_camera) {
  const glm::dmat3& camera = pose.camera_from_object.rotation;
  pose.light_turn = glm::transpose(camera) * turn_in_camera * camera * pose.light_turn;
}

double ScaleOf(const ViewPose& pose, const Camera& camera, const glm::dvec2& pane_px) {
  return pose.zoom * std::min(pane_px.x / camera.width, pane_px.y / camera.height);
}

void Pan(ViewPose& pose, const Camera& camera, const glm::dvec2& pane_px, const glm::dvec2& drag_px) {
  pose.centre_px -= drag_px / ScaleOf(pose, camera, pane_px);
}

void Zoom(ViewPose& pose, const Camera& camera, const glm::dvec2& pane_px, const glm::dvec2& at_px, double factor) {
  const double before = ScaleOf(pose, camera, pane_px);
  pose.zoom = std::clamp(pose.zoom * factor, 0.1, 200.0);
  const double after = ScaleOf(pose, camera, pane_px);
  pose.centre_px += (at_px - 0.5 * pane_px) * (1 / before - 1 / after);
}

Camera PaneCamera(const ViewPose& pose, const Camera& camera, glm::ivec2 pane_px) {
  const double scale = ScaleOf(pose, camera, pane_px);
  Camera pane = camera;
  pane.fx *= scale;
  pane.fy *= scale;
  pane.cx = 0.5 * pane_px.x + scale * (camera.cx - pose.centre_px.x);
  pane.cy = 0.5 * pane_px.y + scale * (camera.cy - pose.centre_px.y);
  pane.width = pane_px.x;
  pane.height = pane_px.y;
  return pane;
}

bool IsAtHome(const ViewPose& pose, const PhotographSpec& photo) {
  return pose.light_turn == glm::dmat3(1.0) && pose.camera_from_object.rotation == photo.camera_from_object.rotation &&
         pose.camera_from_object.translation_mm == photo.camera_from_object.translation_mm;
}

Capture WithLampsTurned(Capture capture, size_t photograph, const glm::dvec3& middle, const glm::dmat3& turn) {
  if (turn == glm::dmat3(1.0)) return capture;
  const PhotographSpec& photo = capture.photographs[photograph];
  const RigidTransform object_from_camera = photo.camera_from_object.Inverse(), about{turn, middle - turn * middle};
  for (size_t l : photo.lights) {
    Light& light = capture.lights[l];
    if (light.in_camera_frame) light.shape = Transformed(light.shape, object_from_camera);
    light.in_camera_frame = false;
    light.shape = Transformed(light.shape, about);
  }
  return capture;
}

}  // namespace crownfit
