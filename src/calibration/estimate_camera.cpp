#include "calibration/estimate_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/calib3d.hpp>

#include "base/linear_algebra.h"
#include "calibration/opencv_camera.h"

namespace crownfit {
namespace {

constexpr int kIntrinsics = 9;  // fx fy cx cy k1 k2 p1 p2 k3

int FlagsOf(Distortion distortion) {
  int flags = 0;
  if (distortion < Distortion::kFull) flags |= cv::CALIB_FIX_K3;
  if (distortion < Distortion::kRadial2Tangential) flags |= cv::CALIB_ZERO_TANGENT_DIST;
  if (distortion < Distortion::kRadial2) flags |= cv::CALIB_FIX_K2;
  if (distortion < Distortion::kRadial1) flags |= cv::CALIB_FIX_K1;
  return flags;
}

std::vector<int> EstimatedOf(Distortion distortion) {
  std::vector<int> indices{0, 1, 2, 3};
  if (distortion >= Distortion::kRadial1) indices.push_back(4);
  if (distortion >= Distortion::kRadial2) indices.push_back(5);
  if (distortion >= Distortion::kRadial2Tangential) indices.insert(indices.end(), {6, 7});
  if (distortion >= Distortion::kFull) indices.push_back(8);
  return indices;
}

struct Corners {
  std::vector<cv::Point3f> board;
  std::vector<cv::Point2f> pixel;  ///< in OpenCV's convention
};

Corners OpenCvCorners(const BoardView& view) {
  Corners corners;
  for (const auto& p : view.board_mm) corners.board.emplace_back(p.x, p.y, p.z);
  for (const auto& p : view.pixel) corners.pixel.emplace_back(p.x - 0.5, p.y - 0.5);
  return corners;
}

/// A camera fitted to some of the views.
struct Solution {
  Distortion distortion;
  cv::Mat matrix, coefficients;
  std::vector<cv::Mat> rotations, translations;
  std::vector<Eigen::MatrixXd> jacobians;  ///< 2 n x (9 + 6): with respect to the intrinsics, then to the view's pose
  std::vector<Eigen::VectorXd> residuals;
  double sum_of_squares = 0;
  Eigen::Index corners = 0;
  std::array<double, kIntrinsics> by_dropping{};  ///< change of the values by dropping distortion terms
};

void AddDerivatives(const std::vector<Corners>& views, Solution& solution) {
  for (size_t v = 0; v < views.size(); ++v) {
    std::vector<cv::Point2d> predicted;
    cv::Mat jacobian;
    const std::vector<cv::Point3d> board(views[v].board.begin(), views[v].board.end());
    cv::projectPoints(board, solution.rotations[v], solution.translations[v], solution.matrix, solution.coefficients,
                      predicted, jacobian);
    const auto n = static_cast<Eigen::Index>(predicted.size());
    Eigen::MatrixXd j(2 * n, kIntrinsics + 6);
    Eigen::VectorXd r(2 * n);
    // OpenCV's columns: rotation, translation, fx fy, cx cy, k1 k2 p1 p2 k3.
    for (Eigen::Index row = 0; row < 2 * n; ++row) {
      for (int c = 0; c < kIntrinsics; ++c) j(row, c) = jacobian.at<double>(static_cast<int>(row), 6 + c);
      for (int c = 0; c < 6; ++c) j(row, kIntrinsics + c) = jacobian.at<double>(static_cast<int>(row), c);
      const cv::Point2d miss = cv::Point2d(views[v].pixel[row / 2]) - predicted[row / 2];
      r(row) = row % 2 ? miss.y : miss.x;
    }
    solution.sum_of_squares += r.squaredNorm();
    solution.corners += n;
    solution.jacobians.push_back(std::move(j));
    solution.residuals.push_back(std::move(r));
  }
}

Solution Solve(const std::vector<Corners>& views, cv::Size size, Distortion distortion) {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> pixel;
  for (const Corners& view : views) {
    board.push_back(view.board);
    pixel.push_back(view.pixel);
  }
  Solution solution;
  solution.distortion = distortion;
  cv::calibrateCamera(board, pixel, size, solution.matrix, solution.coefficients, solution.rotations,
                      solution.translations, FlagsOf(distortion),
                      {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 200, 1e-12});
  AddDerivatives(views, solution);
  return solution;
}

double Rms(const Eigen::VectorXd& residuals) {
  return std::sqrt(residuals.squaredNorm() / (0.5 * static_cast<double>(residuals.size())));
}

std::array<double, kIntrinsics> StandardDeviations(const Solution& solution) {
  const std::vector<int> estimated = EstimatedOf(solution.distortion);
  const auto p = static_cast<Eigen::Index>(estimated.size());
  const size_t views = solution.jacobians.size();
  // Eliminates the poses: keeps the part of the intrinsics' derivatives that a view's pose can't explain.
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(p, p);
  std::vector<Eigen::MatrixXd> of_view(views);
  std::vector<Eigen::VectorXd> gradient(views);
  for (size_t v = 0; v < views; ++v) {
    const Eigen::MatrixXd& all = solution.jacobians[v];
    Eigen::MatrixXd intrinsic(all.rows(), p);
    for (Eigen::Index c = 0; c < p; ++c) intrinsic.col(c) = all.col(estimated[c]);
    const Eigen::MatrixXd pose = all.rightCols(6);
    const Eigen::MatrixXd left = intrinsic - pose * ShortestNearest(pose, intrinsic);
    of_view[v] = left.transpose() * left;
    gradient[v] = left.transpose() * solution.residuals[v];
    normal += of_view[v];
  }
  const double freedom =
      2.0 * static_cast<double>(solution.corners) - static_cast<double>(p) - 6.0 * static_cast<double>(views);
  const Eigen::MatrixXd classical = solution.sum_of_squares / std::max(1.0, freedom) * InverseOfSymmetric(normal);
  // (I - H)^(-1/2) of each view's leverage H, in the space of the intrinsics.
  const Eigen::MatrixXd root = InverseRoot(normal);
  Eigen::MatrixXd robust = Eigen::MatrixXd::Zero(p, p);
  for (size_t v = 0; v < views; ++v) {
    const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(p, p) - Congruent(root, of_view[v]);
    const Eigen::VectorXd moved = Congruent(root, InverseRoot(left)) * gradient[v];
    robust += moved * moved.transpose();
  }
  std::array<double, kIntrinsics> stddev{};
  for (Eigen::Index c = 0; c < p; ++c) {
    const int k = estimated[c];
    stddev[k] = std::hypot(std::sqrt(std::max(robust(c, c), classical(c, c))), solution.by_dropping[k]);
  }
  return stddev;
}

std::array<double, kIntrinsics> ValuesOf(const Solution& s) {
  std::array<double, kIntrinsics> values{s.matrix.at<double>(0, 0), s.matrix.at<double>(1, 1),
                                         s.matrix.at<double>(0, 2), s.matrix.at<double>(1, 2)};
  for (int k = 4; k < kIntrinsics; ++k) values[k] = s.coefficients.at<double>(k - 4);
  return values;
}

/// Uses `distortion`; if absent, drops the terms of the full model that differ from 0 by less than two standard
/// deviations. A dropped term need not be 0, so the change it causes in the others counts as their error.
Solution SolveFor(const std::vector<Corners>& views, cv::Size size, std::optional<Distortion> distortion) {
  if (distortion) return Solve(views, size, *distortion);
  Solution solution = Solve(views, size, Distortion::kFull);
  const std::array<double, kIntrinsics> full = ValuesOf(solution);
  const std::vector<std::pair<std::vector<int>, Distortion>> steps{{{4}, Distortion::kRadial2Tangential},
                                                                   {{2, 3}, Distortion::kRadial2},
                                                                   {{1}, Distortion::kRadial1},
                                                                   {{0}, Distortion::kNone}};
  for (const auto& [terms, without] : steps) {
    const auto stddev = StandardDeviations(solution);
    bool differ = false;
    for (int k : terms) differ |= std::abs(solution.coefficients.at<double>(k)) > 2.0 * stddev[4 + k];
    if (differ) break;
    solution = Solve(views, size, without);
  }
  const std::array<double, kIntrinsics> values = ValuesOf(solution);
  for (int k = 0; k < kIntrinsics; ++k) solution.by_dropping[k] = values[k] - full[k];
  return solution;
}

Camera OurCamera(const Solution& solution, cv::Size size) {
  Camera camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.fx = solution.matrix.at<double>(0, 0);
  camera.fy = solution.matrix.at<double>(1, 1);
  camera.cx = solution.matrix.at<double>(0, 2) + 0.5;
  camera.cy = solution.matrix.at<double>(1, 2) + 0.5;
  for (int k = 0; k < 5; ++k) camera.distortion[k] = solution.coefficients.at<double>(k);
  return camera;
}

/// Rms of a view under a camera it was not part of, at its best pose.
double RmsUnder(const Corners& view, const Solution& solution) {
  cv::Mat rotation, translation;
  if (!cv::solvePnP(view.board, view.pixel, solution.matrix, solution.coefficients, rotation, translation)) return 1e9;
  std::vector<cv::Point2f> predicted;
  cv::projectPoints(view.board, rotation, translation, solution.matrix, solution.coefficients, predicted);
  double sum = 0;
  for (size_t i = 0; i < predicted.size(); ++i)
    sum += cv::norm(predicted[i] - view.pixel[i]) * cv::norm(predicted[i] - view.pixel[i]);
  return std::sqrt(sum / static_cast<double>(predicted.size()));
}

double MedianOf(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

std::optional<CameraEstimate> EstimateCamera(const std::vector<CameraView>& views, int width, int height,
                                             std::optional<Distortion> distortion) {
  const cv::Size size(width, height);
  std::vector<size_t> used;
  for (size_t v = 0; v < views.size(); ++v)
    if (views[v].corners.pixel.size() >= 6) used.push_back(v);
  const auto corners_of = [&](const std::vector<size_t>& indices) {
    std::vector<Corners> corners;
    for (size_t v : indices) corners.push_back(OpenCvCorners(views[v].corners));
    return corners;
  };
  // One wrong view spoils the camera and with it the residuals of the good views. So the view that fits worst is judged
  // by a camera fitted to the others, and dropped if it does not belong.
  Solution solution;
  while (used.size() >= 3) {
    solution = SolveFor(corners_of(used), size, distortion);
    std::vector<double> rms;
    for (const auto& r : solution.residuals) rms.push_back(Rms(r));
    const size_t worst = std::max_element(rms.begin(), rms.end()) - rms.begin();
    if (used.size() == 3 || rms[worst] < 0.5 || rms[worst] < 1.5 * MedianOf(rms)) break;
    std::vector<size_t> others = used;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(worst));
    const Solution without = SolveFor(corners_of(others), size, distortion);
    std::vector<double> left;
    for (const auto& r : without.residuals) left.push_back(Rms(r));
    const double alone = RmsUnder(OpenCvCorners(views[used[worst]].corners), without);
    if (alone < std::max(0.5, 3.0 * MedianOf(left))) break;
    used.erase(used.begin() + static_cast<std::ptrdiff_t>(worst));
  }
  if (used.size() < 3) return std::nullopt;

  CameraEstimate estimate;
  estimate.camera = OurCamera(solution, size);
  estimate.distortion = solution.distortion;
  estimate.stddev = StandardDeviations(solution);
  estimate.rms_px = std::sqrt(solution.sum_of_squares / static_cast<double>(solution.corners));
  estimate.used = used;
  estimate.view_rms_px.assign(views.size(), 0.0);
  for (size_t v = 0; v < views.size(); ++v)
    if (views[v].corners.pixel.size() >= 6)
      estimate.view_rms_px[v] = RmsUnder(OpenCvCorners(views[v].corners), solution);
  for (size_t i = 0; i < used.size(); ++i) {
    estimate.view_rms_px[used[i]] = Rms(solution.residuals[i]);
    estimate.camera_from_board.push_back(FromOpenCv(solution.rotations[i], solution.translations[i]));
  }
  for (const auto& a : estimate.camera_from_board)
    for (const auto& b : estimate.camera_from_board) {
      const double cosine = std::clamp(glm::dot(a.rotation[2], b.rotation[2]), -1.0, 1.0);
      estimate.tilt_range_deg = std::max(estimate.tilt_range_deg, std::acos(cosine) * 180.0 / std::numbers::pi);
    }
  return estimate;
}

}  // namespace crownfit
