#pragma once
// What runs by walks say together: each is one step from where the last one led, and their mean, weighted by their
// paths, is what the fit finds.

#include <vector>

#include "fit/walk_comparison.h"
#include "fit_path/walk_unknowns.h"

namespace crownfit {

/// Where one run ended, and what it knows.
struct RunEstimate {
  double paths;  ///< for values, of a photograph
  Eigen::VectorXd unknowns;
  Eigen::VectorXd by_photographs;        ///< the material's entries, had nothing else been known
  Eigen::MatrixXd covariance, of_walks;  ///< of all unknowns
  Eigen::MatrixXd of_slopes;             ///< part of both; later runs' derivatives are means over earlier ones' too
  Eigen::MatrixXd of_model;              ///< by what photographs have in common of the model's own error; part of none
  double chi2 = 0;
  ResidualChi2 misfit;
  std::vector<ResidualChi2> misfit_of;  ///< per photograph of the fit
  std::vector<std::vector<Spectrum>> values;
  bool is_on_its_way;  ///< the step was cut short, and led somewhere
  bool tells_all;      ///< its derivatives do, of every direction
};

class WalkRuns {
 public:
  /// Both must outlive it; it writes where the fit stands.
  WalkRuns(WalkUnknowns& unknowns, FitState& at) : unknowns_(unknowns), at_(at) {}

  /// Drops those that only led here.
  void Add(RunEstimate run);
  /// Another optimum that explains the photographs as well: how far it is off this one, by the material's entries.
  void AddRival(const Eigen::VectorXd& off) { rivals_.push_back(off); }
  /// By how much the model of the runs misleads, by the material's entries.
  void SetModelOffset(const Eigen::VectorXd& off) { model_offset_ = off; }

  /// Goes to the runs' mean and says what is known there (FitState::knowledge, walked); true when they agree: two at
  /// once, or several that scatter by somewhat more than their walks, which then widens the intervals. Where the
  /// photographs tell little, runs may differ by a share of what is not known.
  bool Conclude();
  /// After Conclude: how many more paths a photograph would have walks make no more than a third of any value's
  /// variance, where photographs alone tell it within a factor 4 and it is not known within 1 %.
  double PathsWanted() const;
  /// Paths a photograph of the runs that count.
  double Paths() const;

 private:
  void ForgetRanges(const Eigen::MatrixXd& known, DataEstimate& knowledge) const;

  WalkUnknowns& unknowns_;
  FitState& at_;
  std::vector<RunEstimate> runs_;
  bool has_strayed_ = false;
  std::vector<Eigen::VectorXd> rivals_;
  Eigen::VectorXd model_offset_;  ///< empty: runs are by the model that is right, or it is not known yet
};

}  // namespace crownfit
