#include "calibration/mirror_ball.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "base/linear_algebra.h"
#include "calibration/opencv_image.h"

namespace crownfit {
namespace {

/// Least-squares circle (Kasa 1976) through points.
BallOutline CircleThrough(const std::vector<glm::dvec2>& points) {
  Eigen::MatrixXd left(points.size(), 3);
  Eigen::VectorXd right(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    left.row(static_cast<Eigen::Index>(i)) << 2 * points[i].x, 2 * points[i].y, 1.0;
    right(static_cast<Eigen::Index>(i)) = glm::dot(points[i], points[i]);
  }
  const Eigen::VectorXd x = ShortestNearest(left, right);
  BallOutline circle{{x(0), x(1)}, std::sqrt(std::max(1e-9, x(2) + x(0) * x(0) + x(1) * x(1))), 0};
  double sum = 0;
  for (const auto& p : points) sum += std::pow(glm::length(p - circle.centre_px) - circle.radius_px, 2.0);
  circle.rms_px = std::sqrt(sum / static_cast<double>(points.size()));
  return circle;
}

/// The strongest change of brightness along each of many radii, and a circle through those that agree.
BallOutline Refined(const cv::Mat& grey, const BallOutline& start) {
  BallOutline ball = start;
  for (const double reach : {0.12, 0.05, 0.02}) {
    std::vector<glm::dvec2> points;
    for (int i = 0; i < 360; ++i) {
      const double angle = i * std::numbers::pi / 180;
      const glm::dvec2 out(std::cos(angle), std::sin(angle));
      double strongest = 3.0;  // of 255
      glm::dvec2 at(0.0);
      const int quarters = static_cast<int>(4 * ball.radius_px * reach);
      for (int quarter = -quarters; quarter < quarters; ++quarter) {
        const double r = ball.radius_px + 0.25 * quarter;
        const auto value = [&](double radius) {
          const glm::dvec2 p = ball.centre_px + radius * out - 0.5;
          const int x = static_cast<int>(std::floor(p.x)), y = static_cast<int>(std::floor(p.y));
          if (x < 0 || y < 0 || x + 1 >= grey.cols || y + 1 >= grey.rows) return -1.0;
          const double u = p.x - x, v = p.y - y;
          return (1 - v) * ((1 - u) * grey.at<uchar>(y, x) + u * grey.at<uchar>(y, x + 1)) +
                 v * ((1 - u) * grey.at<uchar>(y + 1, x) + u * grey.at<uchar>(y + 1, x + 1));
        };
        const double inside = value(r - 1), outside = value(r + 1);
        if (inside < 0 || outside < 0) continue;
        if (std::abs(outside - inside) > strongest) {
          strongest = std::abs(outside - inside);
          at = ball.centre_px + r * out;
        }
      }
      if (strongest > 3.0) points.push_back(at);
    }
    if (points.size() < 60) return ball;
    for (int round = 0; round < 4; ++round) {
      const BallOutline fitted = CircleThrough(points);
      std::erase_if(points, [&](const glm::dvec2& p) {
        return std::abs(glm::length(p - fitted.centre_px) - fitted.radius_px) > std::max(0.5, 2.0 * fitted.rms_px);
      });
      if (points.size() < 40) return ball;
    }
    ball = CircleThrough(points);
  }
  return ball;
}

}  // namespace

std::vector<BallOutline> FindBalls(const ImageFile& photo, int count, double least_px) {
  const cv::Mat full = StoredGrey8(photo);
  const double scale = std::min(1.0, 800.0 / std::max(full.cols, full.rows));
  cv::Mat small;
  cv::resize(full, small, {}, scale, scale, cv::INTER_AREA);
  // For dark balls on dark grounds the ratio across the outline matters. Highlights would hide it.
  cv::Mat lifted(1, 256, CV_8U);
  for (int v = 0; v < 256; ++v) lifted.at<uchar>(v) = cv::saturate_cast<uchar>(255.0 * std::log1p(v) / std::log(256.0));
  cv::LUT(small, lifted, small);
  cv::GaussianBlur(small, small, {0, 0}, 1.5);
  std::vector<cv::Vec3f> circles;
  const double votes = 40, edge = 120, resolution = 1.5, apart = std::max(20.0, 1.5 * least_px * scale);
  cv::HoughCircles(small, circles, cv::HOUGH_GRADIENT, resolution, apart, edge, votes,
                   static_cast<int>(least_px * scale), 0);
  std::vector<BallOutline> balls;
  for (const auto& c : circles) {
    if (static_cast<int>(balls.size()) == count) break;
    balls.push_back(Refined(full, {{(c[0] + 0.5) / scale, (c[1] + 0.5) / scale}, c[2] / scale, 0}));
  }
  return balls;
}

std::optional<Highlight2d> FindHighlight(const Image& linear, const BallOutline& ball) {
  const auto value = [&](int x, int y) {
    double sum = 0;
    for (int c = 0; c < linear.channels; ++c) sum += linear.at(x, y, c);
    return sum / linear.channels;
  };
  std::vector<double> inside;
  const auto each = [&](auto use) {
    const double r = ball.radius_px;
    for (int y = std::max(0, static_cast<int>(ball.centre_px.y - r));
         y < std::min<double>(linear.height, ball.centre_px.y + r); ++y)
      for (int x = std::max(0, static_cast<int>(ball.centre_px.x - r));
           x < std::min<double>(linear.width, ball.centre_px.x + r); ++x)
        if (glm::length(glm::dvec2(x + 0.5, y + 0.5) - ball.centre_px) < 0.98 * r) use(x, y);
  };
  each([&](int x, int y) { inside.push_back(value(x, y)); });
  if (inside.size() < 100) return std::nullopt;
  const double brightest = *std::max_element(inside.begin(), inside.end());
  std::nth_element(inside.begin(), inside.begin() + static_cast<std::ptrdiff_t>(inside.size() / 2), inside.end());
  if (brightest < 5.0 * inside[inside.size() / 2]) return std::nullopt;
  std::vector<double> xs, ys;
  each([&](int x, int y) {
    if (value(x, y) < 0.97 * brightest) return;
    xs.push_back(x + 0.5);
    ys.push_back(y + 0.5);
  });
  const auto median = [](std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return 0.5 * (v[(v.size() - 1) / 2] + v[v.size() / 2]);
  };
  const double radius = std::sqrt(static_cast<double>(xs.size()) / std::numbers::pi);
  return Highlight2d{{median(xs), median(ys)}, std::max(0.5, 0.2 * radius)};
}

std::optional<LampRay> RayTowardsLamp(const BallOutline& ball, const Highlight2d& highlight, const Camera* camera,
                                      double radius_mm) {
  glm::dvec3 at, normal, view;  // view: towards the camera
  if (!camera) {
    const glm::dvec2 off = (highlight.pixel - ball.centre_px) / ball.radius_px;
    const double z2 = 1.0 - glm::dot(off, off);
    if (z2 <= 0) return std::nullopt;
    view = {0, 0, -1};
    normal = glm::dvec3(off, -std::sqrt(z2));
    at = normal;
  } else {
    // Directions to the outline lie on a cone: d . m = 1 with m along its axis, 1 / |m| the cosine of its half angle.
    Eigen::MatrixXd left(64, 3);
    for (int i = 0; i < 64; ++i) {
      const double angle = 2 * std::numbers::pi * i / 64;
      const glm::dvec3 d =
          DirectionFromPixel(*camera, ball.centre_px + ball.radius_px * glm::dvec2(std::cos(angle), std::sin(angle)));
      left.row(i) << d.x, d.y, d.z;
    }
    const Eigen::Vector3d m = ShortestNearest(left, Eigen::VectorXd::Ones(64));
    const double cosine = 1.0 / m.norm();
    if (cosine >= 1.0) return std::nullopt;
    const glm::dvec3 axis = glm::normalize(glm::dvec3(m(0), m(1), m(2)));
    const glm::dvec3 centre = axis * (radius_mm / std::sqrt(1.0 - cosine * cosine));
    const glm::dvec3 d = DirectionFromPixel(*camera, highlight.pixel);
    const double along = glm::dot(centre, d),
                 discriminant = along * along - glm::dot(centre, centre) + radius_mm * radius_mm;
    if (discriminant <= 0) return std::nullopt;
    at = (along - std::sqrt(discriminant)) * d;
    normal = (at - centre) / radius_mm;
    view = -d;
  }
  const double cosine = glm::dot(view, normal);
  if (cosine <= 0.02) return std::nullopt;
  const double outline_px = std::max(0.3, ball.rms_px / 5.0);  // error of the outline's centre
  return LampRay{at, 2.0 * cosine * normal - view,
                 2.0 * std::hypot(highlight.stddev_px, outline_px) / (ball.radius_px * cosine)};
}

std::optional<LampPosition> Triangulate(const std::vector<LampRay>& rays) {
  if (rays.size() < 2) return std::nullopt;
  // Linear start: the point nearest to all rays; then angles, weighted by their standard deviations.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const auto add = [&](const LampRay& ray, double weight) {
    const Eigen::Vector3d d(ray.direction.x, ray.direction.y, ray.direction.z),
        o(ray.from_mm.x, ray.from_mm.y, ray.from_mm.z);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    normal += weight * across;
    right += weight * across * o;
  };
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double moved_mm = 0;
  for (int round = 0; round < 20; ++round) {
    normal.setZero();
    right.setZero();
    for (const LampRay& ray : rays) {
      const double distance =
          round ? (p - Eigen::Vector3d(ray.from_mm.x, ray.from_mm.y, ray.from_mm.z)).norm() : 1.0 / ray.stddev_rad;
      add(ray, 1.0 / std::pow(std::max(1e-9, distance * ray.stddev_rad), 2.0));
    }
    const Eigen::VectorXd spectrum = EigenOfSymmetric(normal).values;
    if (spectrum(0) < 1e-9 * spectrum(2)) return std::nullopt;
    const Eigen::Vector3d last = std::exchange(p, SolveSymmetric(normal, right));
    moved_mm = (p - last).norm();
  }
  constexpr double kSettled = 1e-6;
  if (!(moved_mm < kSettled * (1.0 + p.norm()))) return std::nullopt;
  const Eigen::Matrix3d covariance = InverseOfSymmetric(normal);
  LampPosition lamp{{p(0), p(1), p(2)}, glm::dmat3(1.0), 0};
  double sum = 0;
  for (const LampRay& ray : rays) {
    const glm::dvec3 to = lamp.position_mm - ray.from_mm;
    if (glm::dot(to, ray.direction) <= 0) return std::nullopt;  // the rays meet behind
    sum += std::pow(glm::length(glm::cross(glm::normalize(to), ray.direction)) / ray.stddev_rad, 2.0);
  }
  lamp.rms_sigma = std::sqrt(sum / std::max(1.0, 2.0 * static_cast<double>(rays.size()) - 3.0));
  const double inflate = std::max(1.0, lamp.rms_sigma * lamp.rms_sigma);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) lamp.covariance_mm2[c][r] = inflate * covariance(r, c);
  return lamp;
}

}  // namespace crownfit
