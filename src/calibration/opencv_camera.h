#pragma once
// Conversion of cameras and poses from and to OpenCV.

#include <opencv2/core.hpp>
#include <utility>

#include "capture/camera.h"
#include "capture/rigid_transform.h"

namespace crownfit {

/// Matrix and distortion; OpenCV's pixels have their centres at whole numbers.
std::pair<cv::Mat, cv::Mat> OpenCvCamera(const Camera& camera);

/// From a rotation vector and a translation.
RigidTransform FromOpenCv(const cv::Mat& rotation_vector, const cv::Mat& translation);

}  // namespace crownfit
