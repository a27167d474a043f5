#include "calibration/opencv_camera.h"

#include <opencv2/calib3d.hpp>

namespace crownfit {

std::pair<cv::Mat, cv::Mat> OpenCvCamera(const Camera& camera) {
  const cv::Mat matrix =
      (cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx - 0.5, 0, camera.fy, camera.cy - 0.5, 0, 0, 1);
  cv::Mat distortion(1, 8, CV_64F);
  for (int k = 0; k < 8; ++k) distortion.at<double>(k) = camera.distortion[k];
  return {matrix, distortion};
}

RigidTransform FromOpenCv(const cv::Mat& rotation_vector, const cv::Mat& translation) {
  cv::Mat matrix;
  cv::Rodrigues(rotation_vector, matrix);
  RigidTransform t;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) t.rotation[c][r] = matrix.at<double>(r, c);
    t.translation_mm[r] = translation.at<double>(r);
  }
  return t;
}

}  // namespace crownfit
