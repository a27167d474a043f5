#pragma once
// The pose at which a mesh's contours lie on the edges of photographs.

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
    /// Of the motion: independent errors of the size that is left, and errors that a whole side of an outline shares.
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    double larger = 0, larger_stddev = HUGE_VAL;  ///< by which share the object looks larger than its mesh
    std::vector<double> rms_px, matched;
    double support = 0;  ///< share of contour points on an edge, each less by the square of its distance over 6 px
  };

  /// `larger`: where the mesh as it is looks like one larger by this share about its centre.
  RigidTransform PoseOf(size_t k, const Vector6& x, double larger = 0) const;

  /// Contours are found again after every step, and edges are looked for in an ever smaller reach.
  State Fit(const Vector6& start, const std::vector<double>& reaches, int step_px,
            const std::function<void(double)>& tell) const {
    State state;
    state.motion = start;
    return Continued(state, reaches, step_px, false, tell);
  }

  /// From a fit, with the object's size free too. Photographs from one place tell it not at all.
  State FitSize(const State& from) const { return Continued(from, {12, 10, 8, 8, 6, 6, 6}, 3, true, {}); }

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
