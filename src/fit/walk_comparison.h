#pragma once
// A photograph compared with a walked prediction: what is left, how large its noise is, and how much it counts.

#include <Eigen/Core>
#include <vector>

#include "fit/nuisances.h"
#include "geometry/cast_samples.h"
#include "walk/path_photograph.h"

namespace crownfit {

/// What is left in patches, over its noise.
struct PatchMisfit {
  double of_patches, share_of_walks, patches;  ///< of the walks in that noise; how many values
  double stddev;                               ///< of `of_patches`, as other walks would scatter it (jackknife)
  /// By how much noise alone scatters it, that of the photographs and of the walks.
  double StddevByChance() const;
  /// Of the difference between two of the same photographs, each by walks of its own.
  double StddevOfDifference(const PatchMisfit& other) const;
  /// What pictures without noise leave, over the photographs' own, in these units; and what may be told from it.
  double AsSeenByWalks(double of_photographs) const;
};

/// Of the same photographs, each by walks of its own.
PatchMisfit MeanOf(const std::vector<PatchMisfit>& runs);

struct WalkComparison {
  std::vector<Eigen::Vector3d> residual;  ///< observed less predicted, per fitted pixel
  /// Of the residual, and the share of it that the prediction's walks make.
  std::vector<Eigen::Matrix3d> covariance, of_walks;
  /// Of the prediction: means of groups of its paths less the mean of all, where it keeps groups (a column each).
  std::vector<Eigen::Matrix<double, kChannels, Eigen::Dynamic>> off_by_group;
  /// Huber's, of the pixel's whole patch (kPatch): less where neighbours are off together by more than noise. A single
  /// walked pixel has rare large values by nature, and is right only in the mean.
  std::vector<double> weight;
  double chi2 = 0, block_chi2 = 0;  ///< sums of squares of pixels (clipped at 4), of patches, over noise's own
  double share_of_walks = 0;        ///< in the variances of the residuals; sum over values
  size_t values = 0, block_values = 0;
  std::vector<double> block_chi2_without;  ///< every group of the prediction's paths, where it keeps groups

  /// Several photographs' sums; those that share walks have the same groups.
  void AddSums(const WalkComparison& other);
  PatchMisfit Left() const;
};

/// Index into the picture of every sharp pixel (FitPixels::sources).
std::vector<size_t> PlacesOf(const FitPixels& p, const PhotographCast& cast, int width);

/// The same in a picture that has at least those.
std::vector<size_t> RanksOf(const FitPixels& p, const PhotographCast& cast, const PathPhotograph& walked);

/// `model_error`: of the prediction, relative, common to a patch; it counts as noise of the patch's sum.
WalkComparison CompareWithWalks(const FitPixels& p, const PhotographCast& cast, const PathPhotograph& walked,
                                double exposure, double model_error = 0.0);

}  // namespace crownfit
