// Calibrations that OpenCV's own programs wrote: the corners of their boards land where OpenCV finds them.

#include "exchange/opencv_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "photo/image_io.h"
#include "support/real_data.h"
#include "support/refusal.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;

/// Corners that OpenCV finds, in its pixels, whose centres are whole numbers.
std::vector<cv::Point2f> CornersOf(const Path& photograph) {
  const Image image = ReadImageFile(photograph).image;
  cv::Mat grey(image.height, image.width, CV_8U);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      grey.at<uint8_t>(y, x) = static_cast<uint8_t>(std::lround(255 * image.at(x, y, 0)));
  std::vector<cv::Point2f> corners;
  EXPECT_TRUE(cv::findChessboardCorners(grey, {9, 6}, corners)) << photograph;
  cv::cornerSubPix(grey, corners, {5, 5}, {-1, -1}, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01});
  return corners;
}

TEST(OpenCvFileReal, CornersLandWhereOpenCvFindsThem) {
  REQUIRE_REAL_DATA("calib-opencv-chessboard");
  const OpenCvCalibration calibration = ReadOpenCvCalibration(real / "left_intrinsics.yml");
  EXPECT_EQ(calibration.camera.width, 640);
  EXPECT_EQ(calibration.camera.height, 480);
  ASSERT_EQ(calibration.camera_from_board.size(), 13u);
  // The file states 0.193, 0.173 and 0.193 px for these views: per_view_reprojection_errors of rows 1, 3 and 4. It was
  // made from other corners, so some more is allowed; half a pixel off, as of a wrong centre, would be 0.7 px.
  const std::pair<size_t, const char*> views[] = {{0, "left01.jpg"}, {2, "left03.jpg"}, {3, "left04.jpg"}};
  for (const auto& [row, photograph] : views) {
    const std::vector<cv::Point2f> corners = CornersOf(real / photograph);
    ASSERT_EQ(corners.size(), 54u);
    double sum = 0;
    for (size_t k = 0; k < corners.size(); ++k) {
      const glm::dvec3 on_board(0.025 * static_cast<double>(k % 9), 0.025 * static_cast<double>(k / 9), 0.0);
      const auto pixel = PixelFromPoint(calibration.camera, calibration.camera_from_board[row].Point(on_board));
      ASSERT_TRUE(pixel);
      const glm::dvec2 found(corners[k].x + 0.5, corners[k].y + 0.5);
      sum += glm::dot(*pixel - found, *pixel - found);
    }
    EXPECT_LT(std::sqrt(sum / static_cast<double>(corners.size())), 0.4) << photograph;
  }
}

std::string Yaml(const std::string& distortion, const std::string& more = "image_width: 640\nimage_height: 480\n") {
  return "%YAML:1.0\n---\n" + more +
         "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 800., 0., 319.5, 0., 810., "
         "239.5, 0., 0., 1. ]\n" +
         distortion;
}
std::string Distortion(int count, const std::string& data) {
  return "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: " + std::to_string(count) +
         "\n   dt: d\n   data: [ " + data + " ]\n";
}

/// `cv::projectPoints` in place of formulas of our own, with as many coefficients as OpenCV's programs write.
TEST(OpenCvFile, PlacesLandWhereOpenCvProjectsThem) {
  const TemporaryFolder folder;
  const cv::Matx33d matrix(800, 0, 319.5, 0, 810, 239.5, 0, 0, 1);
  const std::vector<double> all{0.1, -0.05, 0.001, 0.002, 0.03, 0.02, -0.01, 0.004};
  for (const int count : {0, 4, 5, 8}) {
    std::string data;
    for (int k = 0; k < count; ++k) data += (k ? ", " : "") + std::to_string(all[k]);
    std::ofstream(folder.path / "camera.yml") << Yaml(count ? Distortion(count, data) : "");
    const Camera camera = ReadCameraOrOpenCv(folder.path / "camera.yml");
    const std::vector<double> used(all.begin(), all.begin() + count);
    std::vector<cv::Point2d> expected;
    cv::projectPoints(std::vector<cv::Point3d>{{0.3, -0.2, 1.0}, {-0.35, 0.25, 1.1}}, cv::Vec3d(0, 0, 0),
                      cv::Vec3d(0, 0, 0), matrix, used, expected);
    const auto first = PixelFromPoint(camera, {0.3, -0.2, 1.0}), second = PixelFromPoint(camera, {-0.35, 0.25, 1.1});
    ASSERT_TRUE(first && second);
    EXPECT_NEAR(first->x, expected[0].x + 0.5, 1e-9) << count;
    EXPECT_NEAR(first->y, expected[0].y + 0.5, 1e-9) << count;
    EXPECT_NEAR(second->x, expected[1].x + 0.5, 1e-9) << count;
    EXPECT_NEAR(second->y, expected[1].y + 0.5, 1e-9) << count;
  }
}

TEST(OpenCvFile, XmlOfItsStorageAndNamesOfPhotographsAreRead) {
  const TemporaryFolder folder;
  const Path file = folder.path / "camera.xml";
  {
    cv::FileStorage out(file.string(), cv::FileStorage::WRITE);
    out << "image_width" << 640 << "image_height" << 480 << "camera_matrix"
        << cv::Mat(cv::Matx33d(800, 0, 320, 0, 810, 240, 0, 0, 1)) << "extrinsic_parameters"
        << cv::Mat(cv::Matx<double, 2, 6>(0, 0, 0, 1, 2, 3, 0, 0, 1.5707963267948966, 4, 5, 6)) << "image_names"
        << std::vector<std::string>{"b.png", "a.png"};
  }
  const OpenCvCalibration calibration = ReadOpenCvCalibration(file);
  EXPECT_EQ(calibration.photographs, (std::vector<std::string>{"b.png", "a.png"}));
  ASSERT_EQ(calibration.camera_from_board.size(), 2u);
  // A quarter of a turn about z takes x to y.
  EXPECT_LT(glm::distance(calibration.camera_from_board[1].Point({1, 0, 0}), glm::dvec3(4, 6, 6)), 1e-12);
}

TEST(OpenCvFile, WhatHasNoEquivalentIsRefusedByItsKey) {
  const TemporaryFolder folder;
  const Path file = folder.path / "camera.yml";
  const std::pair<std::string, const char*> cases[] = {
      {Yaml("", ""), "image_width"},
      {Yaml("fisheye_model: 1\n"), "fisheye_model"},
      {Yaml(Distortion(12, "0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0, 0, 0")), "thin prism"},
      {Yaml(Distortion(3, "0, 0, 0")), "found 3"},
      {Yaml(Distortion(5, "-9, 0, 0, 0, 0")), "folds back"},
      {Yaml(Distortion(5, "0, 0, 0, 0")), "rows x cols"},
      {Yaml("extrinsic_parameters: 5\n"), "extrinsic_parameters"},
      {"%YAML:1.0\n---\nimage_width: 640\n", "camera_matrix"},
      {"%YAML:1.0\n---\n: : :\n - [", "camera_matrix"},
  };
  for (const auto& [text, expected] : cases) {
    std::ofstream(file) << text;
    const std::string fault = FaultOf([&] { ReadOpenCvCalibration(file); });
    EXPECT_NE(fault.find(expected), std::string::npos) << text << "\n" << fault;
    EXPECT_NE(fault.find("camera.yml"), std::string::npos) << fault;
  }
}

}  // namespace
}  // namespace crownfit
