#pragma once
// A photograph compared with a path-traced prediction: residuals, their noise and their weights.

#include <Eigen/Core>
#include <vector>

#include "fit/nuisances.h"
#include "path/path_photograph.h"
#include "scene/cast_samples.h"

namespace crownfit {

/// Chi2 of patches: the mean of their squared residuals over that of their noise.
struct PatchChi2 {
  double chi2 = 0, share_of_walks = 0, values = 0;  ///< share of that noise from random walks; number of squares
  double stddev = 0;                                ///< of chi2, between independent random walks (jackknife)
  /// Standard deviation of chi2 by noise alone, of the photographs and of the walks.
  double StddevByChance() const;
  /// Above `limit`, and further above 1 than chance allows.
  bool IsMoreThan(double limit) const;
  /// Standard deviation of the difference from another chi2 of the same photographs, by independent walks.
  double StddevOfDifference(const PatchChi2& other) const;
  /// Converts `of_photographs`, the chi2 of a noise-free prediction over the photographs' noise alone, to this chi2
  /// with the walks' noise; adds a margin for what can be told apart.
  double AsSeenByWalks(double of_photographs) const;
};

/// For patches of neighbouring pixels (kPatch), and for 16 image regions: in patches the noise of walks hides errors
/// that extend over many. For model `diffusion` regions have no values: its own error would exceed their noise.
struct ResidualChi2 {
  PatchChi2 patches, regions;
  /// Either one is; regions only beyond chance.
  bool IsMoreThan(double limit) const { return patches.chi2 > limit || regions.IsMoreThan(limit); }
};

/// Mean over the same photographs, each time by independent walks.
ResidualChi2 MeanOf(const std::vector<ResidualChi2>& runs);

/// Sums of squared patch sums, over those of noise.
struct SumsOfPatches {
  double chi2 = 0;
  size_t values = 0;
  std::vector<double> chi2_without;  ///< without every group of the prediction's paths, where it keeps groups
  void Add(const SumsOfPatches& other);
  PatchChi2 Left(double share_of_walks) const;
};

struct WalkComparison {
  std::vector<Eigen::VectorXd> residual;  ///< measured minus predicted, per fitted pixel
  /// Covariance of the residual, and the part of it that comes from the prediction's walks.
  std::vector<Eigen::MatrixXd> covariance, of_walks;
  /// Means of groups of the prediction's paths minus the mean of all, where it keeps groups (a column each).
  std::vector<Eigen::MatrixXd> off_by_group;
  /// Huber's weight of the pixel's whole patch (kPatch): lower where neighbours are off together by more than noise. A
  /// single path-traced pixel has rare large values by nature, and is right only in the mean.
  std::vector<double> weight;
  double chi2 = 0;            ///< sum of squares of pixels (clipped at 4) over that of noise
  double share_of_walks = 0;  ///< in the variances of the residuals; sum over values
  size_t values = 0;
  SumsOfPatches patches, regions;

  /// Adds another photograph's sums; photographs that share walks have the same groups.
  void AddSums(const WalkComparison& other);
  ResidualChi2 Left() const;
};

/// Index into the picture of every sharp pixel (FitPixels::sources).
std::vector<size_t> PlacesOf(const FitPixels& p, const PhotographCast& cast, int width);

/// The same as ranks in a picture in which those pixels are rendered.
std::vector<size_t> RanksOf(const FitPixels& p, const PhotographCast& cast, const PathPhotograph& walked);

/// `model_error`: relative error of the prediction, common to a patch; it counts as noise of the patch's sum.
WalkComparison CompareWithWalks(const FitPixels& p, const PhotographCast& cast, const PathPhotograph& walked,
                                double exposure, double model_error = 0.0);

}  // namespace crownfit
