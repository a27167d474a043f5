#pragma once
// Uncertainty of a fit. The information of the photographs stays separate from priors, so that directions they do not
// constrain get an infinite variance instead of none.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "fit/gaussian_information.h"
#include "fit/image_residuals.h"

namespace crownfit {

enum class Status { kFixed, kFitted, kPrior, kNotIdentified, kAtBound };  // of several values the last one counts
const char* Word(Status status);

/// One parameter as reported; one entry per channel, or one for all.
struct FittedParameter {
  std::string name;  ///< "dentine.absorption_per_mm"
  size_t layer;
  Quantity quantity;
  std::vector<double> value, stddev, low95, high95;  ///< stddev etc. are empty when fixed
  Status status = Status::kFixed;                    ///< of all its values together
  std::vector<Status> of_channels = {};              ///< of each value; empty: all have `status`
  Status Of(size_t channel) const { return of_channels.empty() ? status : of_channels[channel]; }
  /// The values with this status.
  std::vector<size_t> ChannelsThatAre(Status s) const;
};

/// A combination of free entries that the data hardly constrain.
struct WeakDirection {
  struct Part {
    std::string entry;
    Scale scale;
    double weight;  ///< in the unit direction, in the entry's own scale
  };
  std::vector<Part> parts;  ///< the largest first, and that one positive; at most four, none below 0.2
  double stddev;            ///< along the direction; infinite where it is not identified
};

struct Uncertainty {
  std::vector<FittedParameter> parameters;
  double reduced_chi2 = 0;       ///< of the pixels, residuals squared over degrees of freedom
  double block_chi2 = 0;         ///< of sums over patches of neighbouring pixels: larger when errors are correlated
  double inflation = 1;          ///< variances of the data were multiplied by max(1, reduced_chi2, block_chi2)
  double freedom = 0;            ///< degrees of freedom of reduced_chi2, if only readings were fitted; 0: many
  double condition = 0;          ///< of the data-only problem, in the fit's own scales
  std::vector<double> of_walks;  ///< per free entry: share of its variance that is Monte Carlo noise
  std::vector<WeakDirection> weak_directions;
  Eigen::MatrixXd covariance;  ///< of the free entries in their own scales, with the priors or else ranges
};

/// Information of the photographs alone on the free entries, around a solution.
struct DataEstimate {
  Eigen::MatrixXd covariance;      ///< within the identified directions
  Eigen::MatrixXd unseen;          ///< columns: unit directions that are not identified
  Eigen::VectorXd by_photographs;  ///< the optimum without other information
  Eigen::VectorXd of_walks;        ///< share of every entry's variance that is Monte Carlo noise; empty: no walks
  LinearScales scales_stddev;      ///< of exposures, lamps' intensities and stated errors; empty: only walks give them
  double condition = 0, reduced_chi2 = 0, block_chi2 = 0, inflation = 1;
  double freedom = 0;  ///< degrees of freedom; 0: path-traced
  /// Variance of a linear combination; infinite when it contains an unidentified direction.
  double Variance(const Eigen::RowVectorXd& g) const;
  /// The covariance's inverse; 0 along unseen directions.
  Eigen::MatrixXd Precision() const;
  GaussianInformation Of(const std::vector<FreeEntry>& entries) const;
  /// Adds the information of others on the same entries, in their order; empty: nothing.
  DataEstimate With(const GaussianInformation& others) const;
};

/// Information of a shader fit, including the model's own errors, which many pixels share (unless left out: as if it
/// were exact). `e`: evaluation with derivatives at the solution. `beside`: precision of what else constrained the
/// entries (priors, other captures), which leaves the residuals more degrees of freedom; empty: nothing.
DataEstimate KnowledgeByShader(const CastState& state, const FreeParameters& free, const Eigen::VectorXd& x,
                               const Evaluation& e, const std::vector<FitPixels>& pixels, bool with_model_errors = true,
                               const Eigen::MatrixXd& beside = {});

/// J' C J of the errors of model `shader` that are common to patches and photographs, which are independent of each
/// other; J, C: whitened.
Eigen::MatrixXd ModelScatter(const CastState& state, const Evaluation& e, const std::vector<FitPixels>& pixels);

/// Width of the patches of neighbouring pixels whose residuals are summed.
inline constexpr int kPatch = 8;

Uncertainty Quantify(const Capture& capture, const FreeParameters& free, const Eigen::VectorXd& x,
                     const DataEstimate& data, bool use_priors);

}  // namespace crownfit
