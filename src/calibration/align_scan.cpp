#include "calibration/align_scan.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/parallel.h"
#include "base/random.h"
#include "calibration/contour_fit.h"
#include "calibration/object_colours.h"

namespace crownfit {
namespace {

/// The region search, over all photographs at once.
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
  /// Sum of the log odds of the pixels that the object covers; higher is better.
  double Score(const Vector6& x) const {
    double score = 0;
    for (size_t k = 0; k < photographs.size(); ++k) {
      const auto mask = silhouettes[k].Mask(caster, photographs[k].start * MotionOf(x, centre));
      for (size_t p = 0; p < mask.size(); ++p) score += mask[p] ? odds[k].values[p] : 0.0;
    }
    return score;
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

  // Region stage: many starts, then a pattern search from the best few. Colours are learned again from the best.
  RegionSearch search(caster, photographs, centre);
  Vector6 best = Vector6::Zero();
  const double turn = options.search_deg * std::numbers::pi / 180;
  // Largest of the six displacements in standard deviations of the search; poses beyond three are rejected.
  constexpr double kFurthest = 3.0;
  const auto distance = [&](const Vector6& x) {
    double furthest = 0;
    for (int k = 0; k < 6; ++k)
      furthest = std::max(furthest, std::abs(x(k)) / std::max(1e-9, k < 3 ? turn : options.search_mm));
    return furthest;
  };
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
              if (distance(y) > kFurthest) continue;
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

  // Edge stage, from the best pose by colour and from others that are nearly as good. Colours alone mistake what the
  // scan lacks (a further molar) for the object. The pose whose contours lie on edges wins.
  search.Learn(best);
  ContourFit edges{caster, parts, photographs, centre, options.threads, {}, {}};
  for (size_t k = 0; k < photographs.size(); ++k) {
    edges.levels.emplace_back(*photographs[k].linear, photographs[k].camera, 1);
    const ColourOdds colours(search.levels[k].image, search.silhouettes[k].Mask(caster, edges.PoseOf(k, best)),
                             search.levels[k].white);
    edges.odds.push_back(BoxMean(OddsImage(edges.levels[k], colours), 1));
  }
  struct Place {
    double support;
    Vector6 motion;
  };
  std::vector<Place> places;  // the best distinct poses found so far, the best first
  const auto keep = [&](const Place& found) {
    constexpr double kApart = 0.3;
    constexpr size_t kKept = 3;
    if (distance(found.motion) >= kFurthest) return;
    places.push_back(found);
    std::stable_sort(places.begin(), places.end(),
                     [](const Place& a, const Place& b) { return a.support > b.support; });
    for (size_t k = 1; k < places.size();) {
      const bool is_known = std::any_of(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(k),
                                        [&](const Place& p) { return distance(p.motion - places[k].motion) < kApart; });
      if (is_known || k >= kKept)
        places.erase(places.begin() + static_cast<std::ptrdiff_t>(k));
      else
        ++k;
    }
  };
  constexpr double kSpreads[] = {0.0, 0.3, 0.2, 0.12, 0.06};
  constexpr size_t kPlaces = 12;
  for (size_t round = 0; round < std::size(kSpreads); ++round) {
    std::vector<Vector6> around;
    for (const Place& p : places) around.push_back(p.motion);
    if (round == 0) around = {best, Vector6::Zero()};  // or the stated start
    if (round == 1) around.push_back(Vector6::Zero());
    const size_t count = round ? kPlaces : around.size();
    for (size_t i = 0; i < count; ++i) {
      Vector6 x = around.empty() ? Vector6(Vector6::Zero()) : around[i % around.size()];
      for (int k = 0; k < 6; ++k)
        x(k) += kSpreads[round] * (k < 3 ? turn : options.search_mm) * Gaussian(Key(options.seed, 7, round, i), k);
      const auto fitted = edges.Fit(x, {30, 24, 18, 14, 10, 8, 6}, 8, {});
      keep({fitted.support, fitted.motion});
      tell(0.6 + 0.25 * (static_cast<double>(round) + static_cast<double>(i + 1) / static_cast<double>(count)) /
                     std::size(kSpreads));
    }
  }
  const Vector6 place = places.empty() ? best : places[0].motion;
  auto state = edges.Fit(place, {12, 10, 8, 8, 6, 6, 6}, 3, [&](double share) { tell(0.85 + 0.1 * share); });
  // When the outline is already within two pixels, profiles across it locate it exactly.
  if (state.sigma < 2.0 && edges.MeasureBlur(state.motion)) {
    const auto exact = edges.Fit(state.motion, {4, 4, 3, 3, 3}, 3, {});
    // Rejected where the outline misses by more than a profile's reach, as for a mesh of another size.
    const auto worst = [](const ContourFit::State& fit) {
      return *std::min_element(fit.matched.begin(), fit.matched.end());
    };
    if (worst(exact) > 0.75 * worst(state)) {
      state = exact;
    } else {
      edges.blur_px.clear();
    }
  }
  const auto sized = photographs.size() > 1 ? edges.FitSize(state) : state;
  tell(1.0);
  best = state.motion;
  AlignedScan result;
  result.contrast = search.contrast;
  result.rms_px = state.rms_px;
  result.from_start = distance(best) / kFurthest;
  result.larger = sized.larger;
  result.larger_stddev = sized.larger_stddev;
  result.matched = state.matched;
  const Eigen::Matrix<double, 6, 6> covariance = state.covariance;
  for (const auto& photo : photographs) {
    const RigidTransform pose = photo.start * MotionOf(best, centre);
    result.camera_from_object.push_back(pose);
    // Converts a rotation about the object's centre and a shift in its frame to a rotation about the camera and a shift
    // in its frame.
    Eigen::Matrix<double, 6, 6> change = Eigen::Matrix<double, 6, 6>::Zero();
    const glm::dvec3 c = pose.Point(centre);
    const glm::dmat3& r = photo.start.rotation;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        change(i, j) = r[j][i];
        change(3 + i, 3 + j) = r[j][i];
      }
    // A rotation w about c instead of the origin shifts by -w x c.
    for (int j = 0; j < 3; ++j) {
      const glm::dvec3 w(r[j][0], r[j][1], r[j][2]);
      const glm::dvec3 shift = -glm::cross(w, c);
      for (int i = 0; i < 3; ++i) change(3 + i, j) += shift[i];
    }
    Eigen::Matrix<double, 6, 6> of_pose = change * covariance * change.transpose();
    if (photographs.size() > 1 && photo.start_covariance)  // the common motion keeps each start's own error
      of_pose += Eigen::Map<const Eigen::Matrix<double, 6, 6>>(photo.start_covariance->data());
    std::array<double, 36> rows;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) rows[6 * i + j] = of_pose(i, j);
    result.covariance.push_back(rows);
  }
  return result;
}

}  // namespace crownfit
