#pragma once
// Calibrations that OpenCV's programs wrote with cv::FileStorage, as YAML or XML.

#include <filesystem>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/rigid_transform.h"

namespace crownfit {

struct OpenCvCalibration {
  Camera camera;
  std::vector<RigidTransform> camera_from_board;  ///< of every view, in the board's unit; empty: the file has no poses
  std::vector<std::string> photographs;           ///< of every view; empty: the file does not name them
};

/// Whether a file is one of cv::FileStorage, by its first bytes.
bool IsOpenCvFile(const std::filesystem::path& file);

/// Reads camera matrix, distortion (k1 k2 p1 p2 k3 k4 k5 k6), size and, where there are, poses. Throws InputError, also
/// for fisheye lenses and for coefficients of thin prisms and tilted sensors.
OpenCvCalibration ReadOpenCvCalibration(const std::filesystem::path& file);

/// Reads camera.json, or the camera of a calibration by OpenCV.
Camera ReadCameraOrOpenCv(const std::filesystem::path& file);

}  // namespace crownfit
