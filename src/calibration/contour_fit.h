#pragma once
// The pose that puts a mesh's contours on the edges of photographs.

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "calibration/contours.h"
#include "calibration/object_colours.h"
#include "calibration/scan_photograph.h"

namespace crownfit {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A rotation about `centre` by a rotation vector and a shift in mm, in the object's frame.
RigidTransform MotionOf(const Vector6& x, const glm::dvec3& centre);

/// Fits all photographs at once by one motion of the object.
struct ContourFit {
  const RayCaster& caster;
  const std::vector<int>& parts;
  const std::vector<ScanPhotograph>& photographs;
  glm::dvec3 centre;
  int threads;
  std::vector<Level> levels;
  std::vector<Image> odds;
  std::vector<double> blur_px = {};  ///< of each photograph's edges, once measured; edges are then located by profiles

  /// Result of a fit.
  struct State {
    Vector6 motion;
    double sigma = 1;  ///< of distances, over their stated standard deviations
    /// Of the motion: from independent errors of the residuals' size, and from errors common to a whole side of an
    /// outline.
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    double larger = 0, larger_stddev = HUGE_VAL;  ///< fraction by which the object appears larger than its mesh
    std::vector<double> rms_px, matched;
    double support = 0;  ///< fraction of contour points on an edge, each less by the square of its distance over 6 px
  };

  /// `larger`: the mesh then looks like one larger by this fraction about its centre.
  RigidTransform PoseOf(size_t k, const Vector6& x, double larger = 0) const;

  /// Contours are recomputed after every step, and edges are searched within an ever smaller reach.
  State Fit(const Vector6& start, const std::vector<double>& reaches, int step_px,
            const std::function<void(double)>& tell) const {
    State state;
    state.motion = start;
    return Continued(state, reaches, step_px, false, tell);
  }

  /// Continues a fit with the object's size free. Photographs from one place do not determine the size.
  State FitSize(const State& from) const { return Continued(from, {12, 10, 8, 8, 6, 6, 6}, 3, true, {}); }

  /// Measures `blur_px`. False where a photograph has too few clear edges.
  bool MeasureBlur(const Vector6& at);

 private:
  struct Match {
    size_t photograph;
    glm::dvec3 on_object_mm;
    glm::dvec2 edge, normal;
    double stddev_px;
  };
  std::optional<Match> EdgeOf(size_t photograph, const ContourPoint& point, double reach_px) const;
  State Continued(State state, const std::vector<double>& reaches, int step_px, bool free_size,
                  const std::function<void(double)>& tell) const;
  using Poses = std::vector<RigidTransform>;
  Poses PosesAt(const Vector6& motion, double larger) const;
  double Residual(const Match& match, const Poses& poses) const;
  void Step(const std::vector<Match>& matches, bool free_size, State& state) const;
  void Measure(const std::vector<Match>& matches, const std::vector<double>& points, double reach_px,
               State& state) const;
};

}  // namespace crownfit
