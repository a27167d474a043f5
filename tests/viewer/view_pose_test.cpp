// Effects of the mouse on camera, image and lamps.

#include "viewer/view_pose.h"

#include <gtest/gtest.h>

namespace crownfit {
namespace {

PhotographSpec Photo() {
  PhotographSpec photo;
  photo.camera = {400, 300, 2000, 2000, 200, 150, {-0.1, 0.02, 0.001, -0.002}};
  photo.camera_from_object.rotation = glm::dmat3({1, 0, 0}, {0, -1, 0}, {0, 0, -1});
  photo.camera_from_object.translation_mm = {3, -2, 250};
  photo.lights = {0};
  return photo;
}

const glm::dvec3 kMiddle(3, 1, 2);

TriangleMesh Tooth() { return SquareTile(kMiddle, {0, 0, 1}, 10); }

glm::dvec2 PixelOf(const ViewPose& pose, const glm::dvec3& point, glm::ivec2 pane) {
  return *PixelFromPoint(PaneCamera(pose, Photo().camera, pane), pose.camera_from_object.Point(point));
}

TEST(ViewPose, DraggingMovesTheNearSideWithThePointer) {
  const glm::dvec3 near = kMiddle + glm::dvec3(0, 0, 5);  // the camera looks along -z
  const glm::ivec2 pane(800, 600);
  const ViewPose home = HomePose(Photo(), Tooth());
  const glm::dvec2 before = PixelOf(home, near, pane);
  for (const glm::dvec2& drag : {glm::dvec2(40, 0), glm::dvec2(-40, 0), glm::dvec2(0, 40), glm::dvec2(0, -40)}) {
    ViewPose pose = home;
    TurnCrown(pose, kMiddle, TurnByDrag(drag, 900));
    EXPECT_GT(glm::dot(PixelOf(pose, near, pane) - before, drag), 0);
    EXPECT_NEAR(glm::distance(PixelOf(pose, kMiddle, pane), PixelOf(home, kMiddle, pane)), 0, 1e-9);
    EXPECT_FALSE(IsAtHome(pose, Photo()));
  }
}

TEST(ViewPose, ZoomKeepsThePointUnderThePointer) {
  const glm::dvec2 pane(800, 500), at(123, 321);
  const Camera camera = Photo().camera;
  ViewPose pose = HomePose(Photo(), Tooth());
  const auto below = [&] { return pose.centre_px + (at - 0.5 * pane) / ScaleOf(pose, camera, pane); };
  const glm::dvec2 before = below();
  Zoom(pose, camera, pane, at, 1.7);
  EXPECT_NEAR(glm::distance(below(), before), 0, 1e-9);
  Pan(pose, camera, pane, {10, -4});
  EXPECT_NEAR(glm::distance(below(), before - glm::dvec2(10, -4) / ScaleOf(pose, camera, pane)), 0, 1e-9);
  EXPECT_TRUE(IsAtHome(pose, Photo())) << "a photograph can be zoomed too";
}

/// Photograph and viewer must coincide at any zoom, also with lens distortion.
TEST(ViewPose, PaneShowsThePhotographsPixels) {
  const glm::ivec2 pane(640, 700);
  ViewPose pose = HomePose(Photo(), Tooth());
  Zoom(pose, Photo().camera, pane, {100, 600}, 2.3);
  for (const glm::dvec3& vertex : Tooth().vertices) {
    const glm::dvec2 in_photograph = *PixelFromPoint(Photo().camera, Photo().camera_from_object.Point(vertex));
    const glm::dvec2 expected =
        0.5 * glm::dvec2(pane) + ScaleOf(pose, Photo().camera, pane) * (in_photograph - pose.centre_px);
    EXPECT_NEAR(glm::distance(PixelOf(pose, vertex, pane), expected), 0, 1e-9);
  }
}

TEST(ViewPose, LampsTurnAboutTheCrown) {
  for (const bool in_camera_frame : {false, true}) {
    Capture capture;
    capture.photographs = {Photo()};
    Light lamp;
    lamp.in_camera_frame = in_camera_frame;
    const glm::dvec3 place(0, 0, 100);  // in front of the crown, in the object's or the camera's frame
    lamp.shape = PointLight{in_camera_frame ? Photo().camera_from_object.Point(place) : place, glm::dvec3(1), 1};
    capture.lights = {lamp};
    ViewPose pose = HomePose(Photo(), Tooth());
    TurnLamps(pose, TurnByDrag({60, 0}, 900));
    const Capture turned = WithLampsTurned(capture, 0, kMiddle, pose.light_turn);
    EXPECT_FALSE(turned.lights[0].in_camera_frame);
    const glm::dvec3 now = std::get<PointLight>(turned.lights[0].shape).position_mm;
    EXPECT_GT(now.x, place.x + 20) << "dragged to the right, it goes to the right";
    EXPECT_NEAR(glm::distance(now, kMiddle), glm::distance(place, kMiddle), 1e-9);
    EXPECT_NEAR(now.y, place.y, 1e-9);
  }
}

}  // namespace
}  // namespace crownfit
