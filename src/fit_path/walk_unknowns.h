#pragma once
// What a step by walks solves for: the free entries, then the nuisances (exposures, lamps' intensities, and how far the
// calibration is off by its own account).

#include "fit/fit_state.h"
#include "fit_path/walked_step.h"

namespace crownfit {

class WalkUnknowns {
 public:
  /// Both must outlive it; it reads and writes where the fit stands.
  WalkUnknowns(const FitProblem& problem, FitState& at);

  int count() const { return error(errors_); }
  int material() const { return material_; }
  int nuisances() const { return count() - material_; }
  bool IsFree(const DerivativeParameter& p) const { return EntryOf(p) >= 0; }
  /// The first free entry of a parameter; -1: none.
  int EntryOf(const DerivativeParameter& p) const;
  /// Entries that stay where they are: walks have no derivatives by them, and no reading tells them either.
  const std::vector<int>& Untold() const { return untold_; }
  /// A value in the scale of an entry, within its bounds.
  double InItsScale(int entry, double value) const;

  Eigen::VectorXd Here() const;
  Eigen::VectorXd Stated() const;  ///< where the capture starts
  /// What some unknowns' values, or their standard deviations, say of exposures, lamps and stated errors; 0 where an
  /// intensity is exact.
  LinearScales ScalesOf(const Eigen::VectorXd& unknowns) const;
  void GoTo(const Eigen::VectorXd& there);
  /// Nuisances with a stated error go back to what is stated.
  void ForgetCalibration();
  bool HaveStatedErrors() const { return !statements_.empty(); }
  /// The squares of how many stated errors nuisances have been moved, summed.
  double CalibrationCost() const;
  /// Where nuisances of one kind are further off what is stated than chance would have them once in a thousand,
  /// errors of that kind are from now on taken to be as large as they show (Birge 1932, Phys. Rev. 40, 207: his ratio).
  /// True when that changed something. `covariance`, `of_walks`: of the unknowns, and the walks' part of it.
  bool WidenStatedErrors(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& of_walks);
  double ExposureOf(const FitPixels& p) const;

  /// Stated errors of the nuisances; from all that is known, also the material's priors and what others know of it.
  /// `reach`: how far a step may be trusted, in ln or in prior standard deviations.
  enum class From { kPhotographs, kAll };
  WalkedStep::Prior Prior(double reach, From from) const;
  /// What is known of the material before any photograph: within a factor e^3, or less by the range.
  WalkedStep::Prior RangesAlone() const;
  /// The step that stays within the bounds: what would cross one stops there, and the others are solved without it.
  /// With noise left in, derivatives by the entries are too flat; exposures and lamps that are known within an error
  /// stay then: theirs have none, and they would take what is the entries'.
  Eigen::VectorXd Bounded(const WalkedStep& step, const WalkedStep::Prior& prior, WalkedStep::Noise noise,
                          WalkedStep::Solution& solution) const;
  struct ShortStep {
    Eigen::VectorXd step;
    std::vector<int> cut;  ///< entries that wanted to go further
  };
  /// No entry's logarithm moved further than `longest`; the others go where the photographs want them with that.
  /// More absorption may be twice as far: its effect goes with itself, not with its logarithm. `covariance`: of
  /// the whole step.
  ShortStep Shortened(const Eigen::VectorXd& whole, const Eigen::MatrixXd& covariance, double longest) const;
  /// Of what the logarithms of free entries move by.
  double LongestLogarithm(const Eigen::VectorXd& step) const;

  /// By the free entries.
  SlopeChain Chain() const;

  /// Derivatives of one photograph's pixels by the nuisances. Those of lamps and of the calibration are as shader sees
  /// them, scaled to the walks' brightness.
  class Slopes {
   public:
    /// `number`: of the photograph in FitState::pixels; `moved`: the capture where the fit has moved it.
    Slopes(const WalkUnknowns& unknowns, size_t number, const Capture& moved, const Material& material);
    /// `sharp`: values of FitPixels::sources by walks, whose noise must not be that of the pixel's residual.
    void AddTo(WalkedRows::Rows& by_nuisances, size_t pixel, const std::vector<Spectrum>& sharp) const;

   private:
    const WalkUnknowns& u_;
    const FitPixels& p_;
    const CalibrationDerivatives* calibration_ = nullptr;
    double exposure_;
    /// Per pixel of the cast, by shader: with all lamps, and with each whose intensity is fitted alone at 1.
    std::vector<std::vector<Spectrum>> shader_;
  };

 private:
  /// What the capture says of a nuisance, and how well it says to know it.
  struct Statement {
    CalibrationKind kind;
    int unknown;
    double value, stddev;
  };
  /// How far nuisances of a kind are off what is stated.
  struct Contradiction {
    double chi2_over_unlikely = 0;  ///< above 1: further than by chance
    double shown = 1;               ///< how many times as large as they are taken their errors show
  };
  Contradiction ContradictionOf(CalibrationKind kind, const Eigen::MatrixXd& covariance,
                                const Eigen::MatrixXd& of_walks) const;
  double StddevOf(const Statement& s) const { return at_.inflation[static_cast<size_t>(s.kind)] * s.stddev; }

  int exposure(int e) const { return material_ + e; }
  int light(size_t l) const { return material_ + exposures_ + static_cast<int>(l); }
  int error(int e) const { return material_ + exposures_ + static_cast<int>(lights_.size()) + e; }

  const FitProblem& problem_;
  FitState& at_;
  LinearScales stated_;
  int material_, exposures_, errors_;
  std::vector<int> untold_;
  std::vector<Statement> statements_;
  std::vector<int> lights_;               ///< of the capture, whose intensity is fitted
  std::vector<size_t> first_photograph_;  ///< per exposure
};

}  // namespace crownfit
