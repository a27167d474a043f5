#pragma once
// A photograph compared with a walked prediction: what is left, how large its noise is, and how much it counts.

#include <Eigen/Core>
#include <vector>

#include "fit/nuisances.h"
#include "path/path_photograph.h"
#include "scene/cast_samples.h"

namespace crownfit {

/// What is left in patches: the mean of their squares over that of their noise.
struct PatchChi2 {
  double chi2 = 0, share_of_walks = 0, values = 0;  ///< of the walks in that noise; how many squares
  double stddev = 0;                                ///< of chi2, as other walks would scatter it (jackknife)
  /// By how much noise alone scatters it, that of the photographs and of the walks.
  double StddevByChance() const;
  /// Over `limit`, and further from noise than chance makes it.
  bool IsMoreThan(double limit) const;
  /// Of the difference between two of the same photographs, each by walks of its own.
  double StddevOfDifference(const PatchChi2& other) const;
  /// What pictures without noise leave, over the photographs' own, in these units; and what may be told from it.
  double AsSeenByWalks(double of_photographs) const;
};

/// Of neighbouring pixels (kPatch), and of sixteenths of the picture: walks' noise hides in patches what goes on over
/// many. Of regions no values: the model's own error would be larger than their noise.
struct ResidualChi2 {
  PatchChi2 patches, regions;
  /// Either is; regions not by chance.
  bool IsMoreThan(double limit) const { return patches.chi2 > limit || regions.IsMoreThan(limit); }
};

/// Of the same photographs, each by walks of its own.
ResidualChi2 MeanOf(const std::vector<ResidualChi2>& runs);

/// Sums of squares of sums over patches, over noise's own.
struct SumsOfPatches {
  double chi2 = 0;
  size_t values = 0;
  std::vector<double> chi2_without;  ///< every group of the prediction's paths, where it keeps groups
  void Add(const SumsOfPatches& other);
  PatchChi2 Left(double share_of_walks) const;
};

struct WalkComparison {
  std::vector<Eigen::Vector3d> residual;  ///< observed less predicted, per fitted pixel
  /// Of the residual, and the share of it that the prediction's walks make.
  std::vector<Eigen::Matrix3d> covariance, of_walks;
  /// Of the prediction: means of groups of its paths less the mean of all, where it keeps groups (a column each).
  std::vector<Eigen::Matrix<double, kChannels, Eigen::Dynamic>> off_by_group;
  /// Huber's, of the pixel's whole patch (kPatch): less where neighbours are off together by more than noise. A single
  /// walked pixel has rare large values by nature, and is right only in the mean.
  std::vector<double> weight;
  double chi2 = 0;            ///< sum of squares of pixels (clipped at 4) over noise's own
  double share_of_walks = 0;  ///< in the variances of the residuals; sum over values
  size_t values = 0;
  SumsOfPatches patches, regions;

  /// Several photographs' sums; those that share walks have the same groups.
  void AddSums(const WalkComparison& other);
  ResidualChi2 Left() const;
};

/// Index into the picture of every sharp pixel (FitPixels::sources).
std::vector<size_t> PlacesOf(const FitPixels& p, const PhotographCast& cast, int width);

/// The same in a picture that has at least those.
std::vector<size_t> RanksOf(const FitPixels& p, const PhotographCast& cast, const PathPhotograph& walked);

/// `model_error`: of the prediction, relative, common to a patch; it counts as noise of the patch's sum.
WalkComparison CompareWithWalks(const FitPixels& p, const PhotographCast& cast, const PathPhotograph& walked,
                                double exposure, double model_error = 0.0);

}  // namespace crownfit
