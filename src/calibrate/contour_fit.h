#pragma once
// The pose at which a mesh's contours lie on the edges of photographs.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "calibrate/align_scan.h"
#include "calibrate/contours.h"
#include "calibrate/object_colours.h"

namespace crownfit {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A turn about `centre` by a rotation vector and a shift in mm, in the object's frame.
RigidTransform MotionOf(const Vector6& x, const glm::dvec3& centre);

/// All photographs at once, moved by one motion of the object.
struct ContourFit {
  const RayCaster& caster;
  const std::vector<int>& parts;
  const std::vector<ScanPhotograph>& photographs;
  glm::dvec3 centre;
  int threads;
  std::vector<Level> levels;
  std::vector<Image> odds;
  std::vector<double> blur_px = {};  ///< of each photograph's edges, once they are known: edges are then placed exactly

  /// What is left after a fit.
  struct State {
    Vector6 motion;
    double sigma = 1;  ///< of distances, over what is stated of each
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Identity();
    Eigen::Matrix<double, 6, 6> side_scatter =
        Eigen::Matrix<double, 6, 6>::Zero();  ///< J' C J of errors of whole sides
    std::vector<double> rms_px, matched;
    double support = 0;  ///< share of contour points on an edge, each less by the square of its distance over 6 px
  };

  RigidTransform PoseOf(size_t k, const Vector6& x) const { return photographs[k].start * MotionOf(x, centre); }

  /// Contours are found again after every step, and edges are looked for in an ever smaller reach.
  State Fit(const Vector6& start, const std::vector<double>& reaches, int step_px,
            const std::function<void(double)>& tell) const;

  /// Of the motion: independent errors of the size that is left, and errors that a whole side of an outline shares.
  static Eigen::Matrix<double, 6, 6> Covariance(const State& state);

  /// Finds `blur_px`. False where a photograph has too few clear edges.
  bool MeasureBlur(const Vector6& at);

 private:
  struct Match {
    size_t photograph;
    glm::dvec3 on_object_mm;
    glm::dvec2 edge, normal;
    double stddev_px;
  };
  std::optional<Match> EdgeOf(size_t photograph, const ContourPoint& point, double reach_px) const;
  double Residual(const Match& match, const RigidTransform& motion) const;
  void Step(const std::vector<Match>& matches, State& state) const;
  void Measure(const std::vector<Match>& matches, const std::vector<double>& points, double reach_px,
               State& state) const;
};

}  // namespace crownfit
