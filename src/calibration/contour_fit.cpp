#include "calibration/contour_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/linear_algebra.h"
#include "base/parallel.h"
#include "calibration/edge_profile.h"

namespace crownfit {
namespace {

/// Neighbouring points share edge errors: contour points lie three pixels apart, an error extends over eight.
constexpr double kShared_px = 8.0 / 3.0;

/// The edge that a contour point belongs to: the steepest change along its normal within reach, nearer ones preferred.
std::optional<glm::dvec2> EdgeNear(const Level& level, const Image& odds, const ContourPoint& point, double reach_px) {
  double best = 0, at = 0;
  const double scale = std::max(1.0, reach_px / 12.0), limit = 0.06;
  const int halves = static_cast<int>(2 * reach_px);
  for (int half = -halves; half <= halves; ++half) {
    const double d = 0.5 * half;
    const glm::dvec2 inner = point.pixel + (d - scale) * point.outward,
                     outer = point.pixel + (d + scale) * point.outward;
    if (inner.x < 1 || inner.y < 1 || outer.x < 1 || outer.y < 1 || inner.x > level.image.width - 1 ||
        inner.y > level.image.height - 1 || outer.x > level.image.width - 1 || outer.y > level.image.height - 1)
      continue;
    double change;
    if (point.is_outer) {
      change = (Bilinear(odds, inner, 0) - Bilinear(odds, outer, 0)) / 6.0;  // from object to surroundings
    } else {
      change = std::abs(Bilinear(level.image, inner, 1) - Bilinear(level.image, outer, 1)) / level.white;
    }
    change *= std::exp(-0.5 * d * d / (0.25 * reach_px * reach_px));
    if (change > best) best = change, at = d;
  }
  if (best < limit || std::abs(at) > reach_px - 0.75) return std::nullopt;
  return point.pixel + at * point.outward;
}

}  // namespace

/// A rotation about `centre` and a shift, in the object's frame.
RigidTransform MotionOf(const Vector6& x, const glm::dvec3& centre) {
  const glm::dmat3 r = RotationFromVector({x(0), x(1), x(2)});
  return {r, centre + glm::dvec3(x(3), x(4), x(5)) - r * centre};
}

std::optional<ContourFit::Match> ContourFit::EdgeOf(size_t k, const ContourPoint& point, double reach_px) const {
  if (!blur_px.empty()) {
    constexpr double kSlip_px = 0.1;  // error of a profile beyond its own estimate
    if (!point.is_outer) return std::nullopt;
    const auto place = StepAcross(levels[k].image, point.pixel, point.outward, blur_px[k], reach_px);
    if (!place) return std::nullopt;
    return Match{k, point.on_object_mm, point.pixel + place->offset_px * point.outward, point.outward,
                 std::hypot(place->stddev_px, kSlip_px)};
  }
  const auto edge = EdgeNear(levels[k], odds[k], point, reach_px);
  if (!edge) return std::nullopt;
  return Match{k, point.on_object_mm, *edge, point.outward, 1.0};
}

bool ContourFit::MeasureBlur(const Vector6& at) {
  constexpr double kReach_px = 3.0;
  constexpr size_t kFewest = 20;
  std::vector<double> of_photographs;
  for (size_t k = 0; k < photographs.size(); ++k) {
    std::vector<double> blurs;
    for (const ContourPoint& point : Contours(caster, parts, photographs[k].camera, PoseOf(k, at), 6))
      if (point.is_outer)
        if (const auto blur = BlurAcross(levels[k].image, point.pixel, point.outward, kReach_px))
          blurs.push_back(*blur);
    if (blurs.size() < kFewest) return false;
    std::nth_element(blurs.begin(), blurs.begin() + static_cast<std::ptrdiff_t>(blurs.size() / 2), blurs.end());
    of_photographs.push_back(blurs[blurs.size() / 2]);
  }
  blur_px = of_photographs;
  return true;
}

RigidTransform ContourFit::PoseOf(size_t k, const Vector6& x, double larger) const {
  // R (c + s (p - c)) + t is s times R p + (t + (1 - s) R c) / s, and a camera can't see the factor s.
  RigidTransform pose = photographs[k].start * MotionOf(x, centre);
  const double size = 1 + larger;
  pose.translation_mm = (pose.translation_mm + (1 - size) * (pose.rotation * centre)) / size;
  return pose;
}

ContourFit::Poses ContourFit::PosesAt(const Vector6& motion, double larger) const {
  Poses poses;
  for (size_t k = 0; k < photographs.size(); ++k) poses.push_back(PoseOf(k, motion, larger));
  return poses;
}

ContourFit::State ContourFit::Continued(State state, const std::vector<double>& reaches, int step_px, bool free_size,
                                        const std::function<void(double)>& tell) const {
  const double scale = std::max(1.0, photographs[0].linear->width / 1440.0);
  for (size_t step = 0; step < reaches.size(); ++step) {
    const double reach = reaches[step] * scale;
    std::vector<Match> matches;
    std::vector<double> points(photographs.size(), 0.0);
    for (size_t k = 0; k < photographs.size(); ++k) {
      const auto contours =
          Contours(caster, parts, photographs[k].camera, PoseOf(k, state.motion, state.larger), step_px);
      std::vector<std::optional<Match>> edges(contours.size());
      ParallelFor(contours.size(), threads, [&](size_t i) { edges[i] = EdgeOf(k, contours[i], reach); });
      for (size_t i = 0; i < contours.size(); ++i)
        if (edges[i]) matches.push_back(*edges[i]);
      points[k] = static_cast<double>(contours.size());
    }
    if (matches.size() < 30) return state;
    for (int inner = 0; inner < 4; ++inner) Step(matches, free_size, state);
    Measure(matches, points, 6.0 * scale, state);
    if (tell) tell(static_cast<double>(step + 1) / static_cast<double>(reaches.size()));
  }
  return state;
}

double ContourFit::Residual(const Match& m, const Poses& poses) const {
  const auto pixel = PixelFromPoint(photographs[m.photograph].camera, poses[m.photograph].Point(m.on_object_mm));
  return pixel ? glm::dot(*pixel - m.edge, m.normal) : 0.0;
}

/// One Gauss-Newton step with Tukey's biweight on distances along the normals.
void ContourFit::Step(const std::vector<Match>& matches, bool free_size, State& state) const {
  using Vector7 = Eigen::Matrix<double, 7, 1>;
  using Matrix7 = Eigen::Matrix<double, 7, 7>;
  Eigen::MatrixXd jacobian(matches.size(), 7);
  Eigen::VectorXd residual(matches.size());
  std::array<Poses, 7> moved;
  const auto step_of = [](int k) { return k < 3 ? 1e-5 : 1e-4; };
  for (int k = 0; k < 6; ++k) {
    Vector6 y = state.motion;
    y(k) += step_of(k);
    moved[k] = PosesAt(y, state.larger);
  }
  moved[6] = PosesAt(state.motion, state.larger + step_of(6));
  const Poses poses = PosesAt(state.motion, state.larger);
  std::vector<double> sizes;
  for (size_t i = 0; i < matches.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    residual(row) = Residual(matches[i], poses) / matches[i].stddev_px;
    sizes.push_back(std::abs(residual(row)));
    for (int k = 0; k < 7; ++k)
      jacobian(row, k) = (Residual(matches[i], moved[k]) / matches[i].stddev_px - residual(row)) / step_of(k);
  }
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  state.sigma = std::max(blur_px.empty() ? 0.3 : 1.0, 1.4826 * sizes[sizes.size() / 2]);
  Eigen::VectorXd weights(residual.size());
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    const double u = residual(i) / (3.5 * state.sigma);
    weights(i) = std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0.0;
  }
  const Matrix7 normal = jacobian.transpose() * weights.asDiagonal() * jacobian;
  const Vector7 gradient = jacobian.transpose() * (weights.asDiagonal() * residual);
  // An outline's rim is translucent and lit from one side: each side (an octant of normals) has a common error. So has
  // each photograph as a whole, because rims are darker or lighter than the interior.
  constexpr int kSides = 8;
  const double side_px = blur_px.empty() ? 0.7 : 0.3;
  std::vector<Vector7> pulls((kSides + 1) * photographs.size(), Vector7::Zero());  // per side, and per photograph
  for (size_t i = 0; i < matches.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double turn = std::atan2(matches[i].normal.y, matches[i].normal.x) / (2 * std::numbers::pi) + 1.0;
    const auto side = static_cast<size_t>(kSides * turn) % kSides;
    const Vector7 pull = weights(row) * side_px / matches[i].stddev_px * jacobian.row(row).transpose();
    pulls[(kSides + 1) * matches[i].photograph + side] += pull;
    pulls[(kSides + 1) * matches[i].photograph + kSides] += pull;
  }
  Matrix7 scatter = kShared_px * state.sigma * state.sigma * normal;
  for (const Vector7& pull : pulls) scatter += pull * pull.transpose();

  const Eigen::MatrixXd of_motion = normal.topLeftCorner<6, 6>(), inverse = PseudoInverse(of_motion);
  state.covariance = Congruent(inverse, scatter.topLeftCorner<6, 6>());
  const Vector7 by_size = PseudoInverse(normal).col(6);
  state.larger_stddev = std::sqrt(by_size.dot(scatter * by_size));

  const auto solved = [](Eigen::MatrixXd damped, const Eigen::VectorXd& right) {
    damped.diagonal() *= 1 + 1e-6;
    return SolveSymmetric(damped, right);
  };
  if (free_size) {
    const Vector7 step = solved(normal, gradient);
    state.motion -= step.head<6>();
    state.larger -= step(6);
  } else {
    state.motion -= solved(of_motion, gradient.head<6>());
  }
}

void ContourFit::Measure(const std::vector<Match>& matches, const std::vector<double>& points, double reach_px,
                         State& state) const {
  const size_t count = photographs.size();
  std::vector<double> squares(count, 0.0), numbers(count, 0.0);
  double support = 0, all = 0;
  const Poses poses = PosesAt(state.motion, state.larger);
  for (const Match& m : matches) {
    const double off = std::abs(Residual(m, poses));
    squares[m.photograph] += std::pow(std::min(3.5 * state.sigma * m.stddev_px, off), 2.0);
    ++numbers[m.photograph];
    support += std::max(0.0, 1.0 - off * off / (reach_px * reach_px));
  }
  state.rms_px.assign(count, 0.0);
  state.matched.assign(count, 0.0);
  for (size_t k = 0; k < count; ++k) {
    state.rms_px[k] = std::sqrt(squares[k] / std::max(1.0, numbers[k]));
    state.matched[k] = numbers[k] / std::max(1.0, points[k]);
    all += points[k];
  }
  state.support = support / std::max(1.0, all);
}

}  // namespace crownfit
