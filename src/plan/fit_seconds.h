#pragma once
// How long a fit takes, from stored costs (docs/validation.md, "Fits planned for a target") of what it makes: casts,
// steps of shader, walks and fields of diffuse light.

#include <vector>

#include "fit/compare_photographs.h"
#include "fit/fit_state.h"
#include "plan/coarseness.h"

namespace crownfit {

/// Of one core: a cast of the photographs, and one of how they move with what of the calibration may be wrong.
struct CastSeconds {
  double values = 0, derivatives = 0;
};

/// Seconds of the two cores of docs/validation.md that nine of ten fits take at most, on whatever machine.
class FitSeconds {
 public:
  /// `at`: the start values, cast on an input as coarse as this.
  FitSeconds(const FitProblem& problem, const FitState& at, const Coarseness& coarse = {});
  /// The same fit of the same photographs, had they less in their scene.
  FitSeconds Of(const Capture& capture, const FitState& at) const;
  double ByShader() const;
  /// With so many walks a photograph in all runs; few are made more, as derivatives need.
  double ByWalks(double paths) const;

 private:
  /// Photographs that share walks.
  struct Shared {
    double photographs = 0, lamps = 0, pixels = 0;
  };
  /// A picture of one Shared and the field that its walks are handed over to.
  struct Picture {
    double paths, rays;
    int collisions;
    bool has_derivatives;
  };
  void Count(const Capture& capture, const FitState& at);
  double Handed(const Shared& s, double nodes, const Picture& picture) const;
  double Walked(const Shared& s, double paths) const;
  double Differentiated(const Shared& s, double nodes, double paths, double rays_of_a_path) const;

  Coarseness coarse_;
  double vertices_ = 0;     ///< on which a fit gathers light
  size_t most_pixels_ = 0;  ///< of a photograph, in a fit
  CastSeconds cast_;
  double steps_of_shader_ = 0;  ///< times vertices and photographs
  std::vector<Shared> shared_;
  double pictures_beside_ = 0;  ///< per derivatives: of thicknesses and indices that are free
  bool has_rough_ = false;
  double nodes_of_search_ = 0, nodes_ = 0;
  int fewest_ = 1, collisions_that_tell_ = 0;
};

}  // namespace crownfit
