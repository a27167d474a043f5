#include "calibration/estimate_pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "base/error.h"
#include "base/linear_algebra.h"
#include "calibration/draw.h"
#include "calibration/opencv_camera.h"
#include "photo/photograph.h"

namespace crownfit {

BoardView FindJig(const ImageFile& photo, const Jig& jig) {
  BoardView view;
  for (const Marker& marker : FindMarkers(photo, jig.dictionary))
    for (size_t m = 0; m < jig.ids.size(); ++m) {
      if (jig.ids[m] != marker.id) continue;
      for (int k = 0; k < 4; ++k) {
        view.board_mm.push_back(jig.corners_mm[m][k]);
        view.pixel.push_back(marker.corner[k]);
      }
    }
  return view;
}

std::optional<MarkerPose> EstimatePose(const BoardView& view, const Camera& camera) {
  if (view.pixel.size() < 4) return std::nullopt;
  const auto [matrix, distortion] = OpenCvCamera(camera);
  std::vector<cv::Point3d> board;
  std::vector<cv::Point2d> pixels;
  for (size_t i = 0; i < view.pixel.size(); ++i) {
    board.emplace_back(view.board_mm[i].x, view.board_mm[i].y, view.board_mm[i].z);
    pixels.emplace_back(view.pixel[i].x - 0.5, view.pixel[i].y - 0.5);
  }
  cv::Mat rotation, translation;
  std::vector<double> off;
  size_t left_out = 0;
  for (int round = 0; round < 3; ++round) {
    if (!cv::solvePnP(board, pixels, matrix, distortion, rotation, translation, false, cv::SOLVEPNP_SQPNP))
      return std::nullopt;
    cv::solvePnPRefineLM(board, pixels, matrix, distortion, rotation, translation);
    std::vector<cv::Point2d> predicted;
    cv::projectPoints(board, rotation, translation, matrix, distortion, predicted);
    off.clear();
    for (size_t i = 0; i < pixels.size(); ++i) off.push_back(cv::norm(predicted[i] - pixels[i]));
    std::vector<double> sorted = off;
    std::sort(sorted.begin(), sorted.end());
    const double limit = std::max(3.0, 6.0 * sorted[sorted.size() / 2]);
    if (sorted.back() <= limit || pixels.size() < 8) break;
    for (size_t i = off.size(); i-- > 0;)
      if (off[i] > limit) {
        board.erase(board.begin() + static_cast<std::ptrdiff_t>(i));
        pixels.erase(pixels.begin() + static_cast<std::ptrdiff_t>(i));
        ++left_out;
      }
    if (pixels.size() < 4) return std::nullopt;
  }
  MarkerPose pose{};
  pose.camera_from_board = FromOpenCv(rotation, translation);
  pose.corners = pixels.size();
  pose.left_out = left_out;
  double squares = 0;
  for (double d : off) squares += d * d;
  pose.rms_px = std::sqrt(squares / static_cast<double>(off.size()));
  // Derivatives with respect to a small rotation and shift in the camera frame, after the pose.
  Eigen::MatrixXd jacobian(2 * pixels.size(), 6);
  for (size_t i = 0; i < pixels.size(); ++i) {
    const glm::dvec3 p = pose.camera_from_board.Point({board[i].x, board[i].y, board[i].z});
    for (int k = 0; k < 6; ++k) {
      constexpr double kStep = 1e-5;
      glm::dvec3 axis(0.0);
      axis[k % 3] = kStep;
      const auto moved = [&](double sign) { return k < 3 ? p + sign * glm::cross(axis, p) : p + sign * axis; };
      const glm::dvec2 d = (PixelFromPoint(camera, moved(1)).value_or(glm::dvec2(0)) -
                            PixelFromPoint(camera, moved(-1)).value_or(glm::dvec2(0))) /
                           (2 * kStep);
      jacobian(static_cast<Eigen::Index>(2 * i), k) = d.x;
      jacobian(static_cast<Eigen::Index>(2 * i + 1), k) = d.y;
    }
  }
  const double freedom = std::max(1.0, 2.0 * static_cast<double>(pixels.size()) - 6.0);
  const double variance = std::max(0.05 * 0.05, squares / freedom);
  const Eigen::MatrixXd covariance = variance * PseudoInverse(jacobian.transpose() * jacobian);
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) pose.covariance[6 * r + c] = covariance(r, c);
  return pose;
}

namespace {

/// Detected corners (dots) and predicted ones (centres of circles, joined to them), over the photograph.
Image PosePicture(const PosedPhotograph& photo, const Camera& camera, const MarkerPose& pose) {
  const double zoom = std::min(1.0, 1000.0 / photo.picture->width);
  Image picture = DisplayCopy(*photo.picture, zoom);
  for (size_t i = 0; i < photo.view.pixel.size(); ++i) {
    const auto predicted = PixelFromPoint(camera, pose.camera_from_board.Point(photo.view.board_mm[i]));
    DrawDot(picture, zoom * photo.view.pixel[i], 2.5, {0.1, 0.9, 0.2});
    if (predicted)
      DrawLine(picture, zoom * photo.view.pixel[i],
               zoom * (photo.view.pixel[i] + 20.0 * (*predicted - photo.view.pixel[i])), {1, 0.2, 0.1});
  }
  const glm::dvec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const auto origin = PixelFromPoint(camera, pose.camera_from_board.Point(glm::dvec3(0.0)));
  for (const auto& axis : axes) {
    const auto end = PixelFromPoint(camera, pose.camera_from_board.Point(5.0 * axis));
    if (origin && end) DrawLine(picture, zoom * *origin, zoom * *end, axis);
  }
  return picture;
}

}  // namespace

Product MarkerPosesProduct(const std::vector<PosedPhotograph>& photographs, const Camera& camera) {
  constexpr double kLargestRms_px = 1.0;
  constexpr size_t kLeastCorners = 8;
  Product product;
  product.format = "crownfit-poses/1";
  std::vector<StatedPose> poses;
  for (const PosedPhotograph& photo : photographs) {
    const auto pose = EstimatePose(photo.view, camera);
    if (!pose || pose->corners < kLeastCorners) {
      product.refusals.push_back(photo.name + ": shows " + std::to_string(photo.view.pixel.size()) +
                                 " corners of markers, fewer than " + std::to_string(kLeastCorners) +
                                 ". Check that the jig or board is in the picture, sharp, not seen in a mirror, and "
                                 "the one that --jig or --board states.");
      continue;
    }
    const auto& c = pose->covariance;
    const double rotation = std::sqrt(std::max({c[0], c[7], c[14]})) * 180 / std::numbers::pi;
    glm::dvec3 middle(0.0);
    for (const auto& p : photo.view.board_mm) middle += p / static_cast<double>(photo.view.board_mm.size());
    const glm::dmat3 place = PlaceCovariance(c, pose->camera_from_board.Point(middle));
    product.figures.push_back({photo.name + "_rms", pose->rms_px, "px"});
    product.figures.push_back({photo.name + "_corners", static_cast<double>(pose->corners), ""});
    product.figures.push_back({photo.name + "_rotation_stddev", rotation, "deg"});
    product.figures.push_back({photo.name + "_across_stddev", std::sqrt(std::max(place[0][0], place[1][1])), "mm"});
    product.figures.push_back({photo.name + "_along_view_stddev", std::sqrt(place[2][2]), "mm"});
    if (pose->left_out)
      product.notes.push_back(photo.name + ": " + std::to_string(pose->left_out) +
                              " corners do not fit the others and were left out.");
    if (pose->rms_px > kLargestRms_px)
      product.refusals.push_back(photo.name + ": the corners are off by " + Text(pose->rms_px, "px") +
                                 ", above the limit of " + Text(kLargestRms_px, "px") +
                                 ". Check that the camera file is for this lens, focus and picture size, and that the "
                                 "jig is flat and printed at 100 %.");
    poses.push_back({photo.name, pose->camera_from_board, pose->covariance});
    if (product.picture.width == 0) product.picture = PosePicture(photo, camera, *pose);
  }
  product.content = {{"poses", PosesJson(poses)}};
  return product;
}

}  // namespace crownfit
