#include "calibrate/align_scan.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/parallel.h"
#include "base/random.h"
#include "calibrate/contours.h"
#include "calibrate/object_colours.h"

namespace crownfit {
namespace {

constexpr double kCorrelation_px = 8.0;

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A turn about `centre` and a shift, in the object's frame.
RigidTransform MotionOf(const Vector6& x, const glm::dvec3& centre) {
  const glm::dmat3 r = RotationFromVector({x(0), x(1), x(2)});
  return {r, centre + glm::dvec3(x(3), x(4), x(5)) - r * centre};
}

double Bilinear(const Image& image, const glm::dvec2& pixel, int c) {
  const double px = pixel.x - 0.5, py = pixel.y - 0.5;
  const int x = std::clamp(static_cast<int>(std::floor(px)), 0, image.width - 2),
            y = std::clamp(static_cast<int>(std::floor(py)), 0, image.height - 2);
  const double u = std::clamp(px - x, 0.0, 1.0), v = std::clamp(py - y, 0.0, 1.0);
  return (1 - v) * ((1 - u) * image.at(x, y, c) + u * image.at(x + 1, y, c)) +
         v * ((1 - u) * image.at(x, y + 1, c) + u * image.at(x + 1, y + 1, c));
}

/// The search by regions, all photographs at once.
struct RegionSearch {
  const RayCaster& caster;
  const std::vector<ScanPhotograph>& photographs;
  glm::dvec3 centre;
  std::vector<Level> levels;
  std::vector<Silhouette> silhouettes;
  std::vector<Image> odds;
  std::vector<double> contrast;

  RegionSearch(const RayCaster& c, const std::vector<ScanPhotograph>& p, const glm::dvec3& middle)
      : caster(c), photographs(p), centre(middle) {
    for (const auto& photo : photographs) {
      levels.emplace_back(*photo.linear, photo.camera, std::max(1, photo.linear->width / 180));
      silhouettes.emplace_back(levels.back().camera);
    }
    contrast.assign(photographs.size(), 0.0);
  }
  void Learn(const Vector6& x) {
    odds.clear();
    for (size_t k = 0; k < photographs.size(); ++k) {
      const ColourOdds colours(levels[k].image, silhouettes[k].Mask(caster, photographs[k].start * MotionOf(x, centre)),
                               levels[k].white);
      contrast[k] = colours.contrast;
      odds.push_back(OddsImage(levels[k], colours));
    }
  }
  /// Sum of log odds under the object, less what lies outside it in its surroundings; more is better.
  double Score(const Vector6& x) const {
    double score = 0;
    for (size_t k = 0; k < photographs.size(); ++k) {
      const auto mask = silhouettes[k].Mask(caster, photographs[k].start * MotionOf(x, centre));
      for (size_t p = 0; p < mask.size(); ++p) score += mask[p] ? odds[k].values[p] : 0.0;
    }
    return score;
  }
};

struct Match {
  size_t photograph;
  glm::dvec3 on_object_mm;
  glm::dvec2 edge, normal;
};

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

/// The fit to edges, all photographs at once.
struct ContourFit {
  const RayCaster& caster;
  const std::vector<int>& parts;
  const std::vector<ScanPhotograph>& photographs;
  glm::dvec3 centre;
  int threads;
  std::vector<Level> levels;
  std::vector<Image> odds;

  /// What is left after a fit.
  struct State {
    Vector6 motion;
    double sigma = 1;
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Identity();
    std::vector<double> rms_px, matched;
    double support =
        0;  ///< share of contour points that lie on an edge, each less by the square of its distance over 6 px
  };

  RigidTransform PoseOf(size_t k, const Vector6& x) const { return photographs[k].start * MotionOf(x, centre); }

  /// Contours are found again after every step, and edges are looked for in an ever smaller reach.
  State Fit(const Vector6& start, const std::vector<double>& reaches, int step_px,
            const std::function<void(double)>& tell) const {
    State state;
    state.motion = start;
    const double scale = std::max(1.0, photographs[0].linear->width / 1440.0);
    for (size_t step = 0; step < reaches.size(); ++step) {
      const double reach = reaches[step] * scale;
      std::vector<Match> matches;
      std::vector<double> points(photographs.size(), 0.0);
      for (size_t k = 0; k < photographs.size(); ++k) {
        const auto contours = Contours(caster, parts, photographs[k].camera, PoseOf(k, state.motion), step_px);
        std::vector<std::optional<glm::dvec2>> edges(contours.size());
        ParallelFor(contours.size(), threads,
                    [&](size_t i) { edges[i] = EdgeNear(levels[k], odds[k], contours[i], reach); });
        for (size_t i = 0; i < contours.size(); ++i)
          if (edges[i]) matches.push_back({k, contours[i].on_object_mm, *edges[i], contours[i].outward});
        points[k] = static_cast<double>(contours.size());
      }
      if (matches.size() < 30) return state;
      for (int inner = 0; inner < 4; ++inner) Step(matches, state);
      Measure(matches, points, 6.0 * scale, state);
      if (tell) tell(static_cast<double>(step + 1) / static_cast<double>(reaches.size()));
    }
    return state;
  }

  double Residual(const Match& m, const RigidTransform& motion) const {
    const auto pixel = PixelFromPoint(photographs[m.photograph].camera,
                                      (photographs[m.photograph].start * motion).Point(m.on_object_mm));
    return pixel ? glm::dot(*pixel - m.edge, m.normal) : 0.0;
  }

  /// One Gauss-Newton step with Tukey's biweight on distances along the normals.
  void Step(const std::vector<Match>& matches, State& state) const {
    Eigen::MatrixXd jacobian(matches.size(), 6);
    Eigen::VectorXd residual(matches.size());
    std::array<RigidTransform, 6> moved;
    const auto step_of = [](int k) { return k < 3 ? 1e-5 : 1e-4; };
    for (int k = 0; k < 6; ++k) {
      Vector6 y = state.motion;
      y(k) += step_of(k);
      moved[k] = MotionOf(y, centre);
    }
    const RigidTransform motion = MotionOf(state.motion, centre);
    std::vector<double> sizes;
    for (size_t i = 0; i < matches.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      residual(row) = Residual(matches[i], motion);
      sizes.push_back(std::abs(residual(row)));
      for (int k = 0; k < 6; ++k) jacobian(row, k) = (Residual(matches[i], moved[k]) - residual(row)) / step_of(k);
    }
    std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
    state.sigma = std::max(0.3, 1.4826 * sizes[sizes.size() / 2]);
    Eigen::VectorXd weights(residual.size());
    for (Eigen::Index i = 0; i < residual.size(); ++i) {
      const double u = residual(i) / (3.5 * state.sigma);
      weights(i) = std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0.0;
    }
    state.normal = jacobian.transpose() * weights.asDiagonal() * jacobian;
    const Eigen::Matrix<double, 6, 6> damped =
        state.normal + Eigen::Matrix<double, 6, 6>(1e-6 * state.normal.diagonal().asDiagonal());
    state.motion -= damped.ldlt().solve(jacobian.transpose() * (weights.asDiagonal() * residual));
  }

  void Measure(const std::vector<Match>& matches, const std::vector<double>& points, double reach_px,
               State& state) const {
    const size_t count = photographs.size();
    std::vector<double> squares(count, 0.0), numbers(count, 0.0);
    double support = 0, all = 0;
    const RigidTransform motion = MotionOf(state.motion, centre);
    for (const Match& m : matches) {
      const double off = std::abs(Residual(m, motion));
      squares[m.photograph] += std::pow(std::min(3.5 * state.sigma, off), 2.0);
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
};

}  // namespace

AlignedScan AlignScan(const TriangleMesh& mesh, const std::vector<ScanPhotograph>& photographs,
                      const AlignOptions& options, const std::function<void(double)>& progress) {
  const RayCaster caster({&mesh});
  const std::vector<int> parts = ConnectedParts(mesh);
  const auto [low, high] = Bounds(mesh);
  const glm::dvec3 centre = 0.5 * (low + high);
  const auto tell = [&](double share) {
    if (progress) progress(share);
  };

  // Region: many starts, the best few followed by a pattern search; colours are learned again from the best.
  RegionSearch search(caster, photographs, centre);
  Vector6 best = Vector6::Zero();
  const double turn = options.search_deg * std::numbers::pi / 180;
  for (int round = 0; round < 2; ++round) {
    search.Learn(best);
    std::vector<std::pair<double, Vector6>> tried(options.starts);
    const double spread = round == 0 ? 1.0 : 0.4;
    ParallelFor(tried.size(), options.threads, [&](size_t i) {
      Vector6 x = best;
      for (int k = 0; k < 6; ++k)
        x(k) += i == 0 ? 0.0 : spread * (k < 3 ? turn : options.search_mm) * Gaussian(Key(options.seed, round, i), k);
      tried[i] = {search.Score(x), x};
    });
    tell(0.1 + 0.3 * round);
    std::sort(tried.begin(), tried.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    tried.resize(std::min<size_t>(6, tried.size()));
    ParallelFor(tried.size(), options.threads, [&](size_t i) {
      auto& [score, x] = tried[i];
      double step = 0.5 * spread;
      while (step > 0.02) {
        for (bool better = true; better;) {
          better = false;
          for (int k = 0; k < 6; ++k)
            for (const double sign : {1.0, -1.0}) {
              Vector6 y = x;
              y(k) += sign * step * (k < 3 ? turn : options.search_mm);
              const double value = search.Score(y);
              if (value > score) score = value, x = y, better = true;
            }
        }
        step *= 0.6;
      }
    });
    best = std::max_element(tried.begin(), tried.end(), [](const auto& a, const auto& b) {
             return a.first < b.first;
           })->second;
    tell(0.3 + 0.3 * round);
  }

  // Edges, from the best place by colour and from others that are nearly as good: colours alone mistake what the scan
  // does not have (a further molar) for the object. The place whose contours lie on edges wins.
  search.Learn(best);
  ContourFit edges{caster, parts, photographs, centre, options.threads, {}, {}};
  for (size_t k = 0; k < photographs.size(); ++k) {
    edges.levels.emplace_back(*photographs[k].linear, photographs[k].camera, 1);
    const ColourOdds colours(search.levels[k].image, search.silhouettes[k].Mask(caster, edges.PoseOf(k, best)),
                             search.levels[k].white);
    edges.odds.push_back(BoxMean(OddsImage(edges.levels[k], colours), 1));
  }
  Vector6 place = best;
  double support = -1;
  constexpr double kSpreads[] = {0.0, 0.3, 0.2, 0.12, 0.06};
  constexpr int kPlaces = 12;
  for (size_t round = 0; round < std::size(kSpreads); ++round) {
    const Vector6 around = place;
    for (int i = 0; i < (round ? kPlaces : 1); ++i) {
      Vector6 x = around;
      for (int k = 0; k < 6; ++k)
        x(k) += kSpreads[round] * (k < 3 ? turn : options.search_mm) * Gaussian(Key(options.seed, 7, round, i), k);
      const auto state = edges.Fit(x, {30, 24, 18, 14, 10, 8, 6}, 8, {});
      if (state.support > support) support = state.support, place = state.motion;
      tell(0.6 + 0.25 * (static_cast<double>(round) + (i + 1.0) / kPlaces) / std::size(kSpreads));
    }
  }
  const auto state = edges.Fit(place, {12, 10, 8, 8, 6, 6, 6}, 3, [&](double share) { tell(0.85 + 0.15 * share); });
  best = state.motion;
  AlignedScan result;
  result.contrast = search.contrast;
  result.rms_px = state.rms_px;
  result.matched = state.matched;
  const double sigma = state.sigma;
  const Eigen::Matrix<double, 6, 6>& normal = state.normal;
  // Neighbouring points share their edge's error: contours stand three pixels apart, an error reaches over several.
  const Eigen::Matrix<double, 6, 6> covariance =
      kCorrelation_px / 3.0 * sigma * sigma * normal.completeOrthogonalDecomposition().pseudoInverse();
  for (const auto& photo : photographs) {
    const RigidTransform pose = photo.start * MotionOf(best, centre);
    result.camera_from_object.push_back(pose);
    // From a turn about the object's centre and a shift in its frame to a turn about the camera and a shift in its
    // frame.
    Eigen::Matrix<double, 6, 6> change = Eigen::Matrix<double, 6, 6>::Zero();
    const glm::dvec3 c = pose.Point(centre);
    const glm::dmat3& r = photo.start.rotation;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        change(i, j) = r[j][i];
        change(3 + i, 3 + j) = r[j][i];
      }
    // Turning about c instead of the origin shifts by -w x c.
    for (int j = 0; j < 3; ++j) {
      const glm::dvec3 w(r[j][0], r[j][1], r[j][2]);
      const glm::dvec3 shift = -glm::cross(w, c);
      for (int i = 0; i < 3; ++i) change(3 + i, j) += shift[i];
    }
    const Eigen::Matrix<double, 6, 6> of_pose = change * covariance * change.transpose();
    std::array<double, 36> rows;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) rows[6 * i + j] = of_pose(i, j);
    result.covariance.push_back(rows);
  }
  return result;
}

}  // namespace crownfit
