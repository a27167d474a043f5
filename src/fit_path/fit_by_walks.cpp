#include "fit_path/fit_by_walks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "base/linear_algebra.h"
#include "capture/capture.h"
#include "fit/scattering_laws.h"
#include "fit_path/gather_walks.h"
#include "fit_path/walk_runs.h"
#include "fit_path/walk_schedule.h"

namespace crownfit {
namespace {

class WalkFit {
 public:
  WalkFit(const FitProblem& problem, CrownInput& input, FitState& at, Progress& progress)
      : problem_(problem),
        at_(at),
        unknowns_(problem, at),
        gatherer_(problem, input, at, unknowns_, progress),
        runs_(unknowns_, at),
        last_(problem.options.model == Model::kDiffusion ? WalkGatherer::Walks::kHandedOver
                                                         : WalkGatherer::Walks::kToTheirEnd) {}

  /// False when it leaves patches further off than `to_beat`, which the model that `at` comes from left.
  bool Run(double to_beat) {
    at_.converged = false;
    const bool may_move = unknowns_.HaveStatedErrors();
    const double moved_before = unknowns_.CalibrationCost();
    const auto explains_less = [&](const PatchChi2& left, double moved) {
      return left.chi2 + moved / left.values > left.AsSeenByWalks(to_beat + moved_before / left.values);
    };
    unknowns_.ForgetCalibration();  // what shader moved made up for its own errors, by up to 23 stated ones
    gatherer_.TakePixels(std::min(kSearch.pixels, problem_.options.max_pixels_per_photograph));
    gatherer_.GoBy(last_);
    ChooseStart();
    if (const PatchChi2 left = Search(); !may_move && explains_less(left, 0.0)) return false;
    gatherer_.ResolveFields();
    gatherer_.TakePixels(problem_.options.max_pixels_by_walks());
    LeadOn();
    double paths = kRun.values;
    for (int made = 0; made < kRun.most; ++made) {
      const double moved = unknowns_.CalibrationCost();
      RunEstimate run = WalkRun(paths);
      if (may_move && made == 1 && explains_less(run.misfit.patches, moved)) return false;
      const bool is_hopeless = made > 1 && run.misfit.IsMoreThan(kChi2Limit);  // more runs would be refused too
      runs_.Add(std::move(run));
      at_.converged = runs_.Conclude();
      const double wanted = std::min(runs_.PathsWanted(), Capped(HUGE_VAL) - runs_.Paths());
      if (is_hopeless || (at_.converged && wanted <= 0)) break;
      paths = std::max(kRun.values, wanted);
    }
    if (last_ == WalkGatherer::Walks::kHandedOver) {
      runs_.SetModelOffset(StepToTheirEnd());
      runs_.Conclude();
    }
    return true;
  }

  /// How scattering departs from the laws that the capture states, were every channel free: by the last run's walks.
  std::vector<LawDeparture> DeparturesFromStatedLaws() {
    if (!at_.converged || walked_at_.size() == 0 || !KeepsALaw(problem_.capture)) return {};
    const Eigen::VectorXd solution = unknowns_.Here();
    unknowns_.GoTo(walked_at_);
    const Capture freed = WithoutLaws(problem_.capture, MaterialAt(problem_.free, at_.x));
    const FreeParameters free = FreeParametersOf(freed);
    const FitProblem problem{freed, free, problem_.errors, problem_.options};
    FitState there = at_;
    there.x = StartVector(free);
    const WalkUnknowns unknowns(problem, there);
    const WalkedStep::Solution s =
        gatherer_.Compare(problem, unknowns).step.Solve(unknowns.RangesAlone(), unknowns.Untold());
    unknowns_.GoTo(solution);
    const int n = free.count();
    return DeparturesFromLaws(problem_.capture, free, s.step.head(n),
                              std::max(1.0, at_.knowledge.inflation) * s.covariance.topLeftCorner(n, n));
  }

 private:
  static constexpr double kExplained = 1.5;    // of the square of patches' noise
  static constexpr double kLess = 0.97;        // of what is left: more than chance takes off
  static constexpr double kSettled = 3.0;      // gain of chi2 over that of noise alone
  static constexpr double kSlopesOfRun = 0.3;  // of the paths for values

  static double ChiSquare(const Eigen::VectorXd& off, const Eigen::MatrixXd& covariance) {
    return off.dot(SolveSymmetric(covariance, off).col(0));
  }

  /// Whether a step that was cut short leads somewhere: what was cut is more than is not known anyway, and the whole of
  /// what was cut more than noise would make of nothing.
  static bool IsOnItsWay(const Eigen::VectorXd& whole, const WalkUnknowns::ShortStep& made,
                         const Eigen::MatrixXd& covariance) {
    constexpr double kKnown = 1.0, kUnlikely = 3.0;  // of chi2; standard deviations of chi2
    if (made.cut.empty()) return false;
    const auto freedom = static_cast<double>(made.cut.size());
    const Eigen::VectorXd wanted = whole(made.cut);
    const Eigen::MatrixXd of_those = covariance(made.cut, made.cut);
    return ChiSquare(wanted - made.step(made.cut), of_those) > kKnown &&
           ChiSquare(wanted, of_those) > freedom + kUnlikely * std::sqrt(2.0 * freedom);
  }

  double Capped(double paths) const {
    return std::min(paths, static_cast<double>(problem_.options.paths_per_photograph));
  }

  /// Whether the fit by shader tells an entry: within a factor 4, and not at the end of its range.
  bool IsTold(int k) const {
    constexpr double kTold = 0.35, kEnd = 0.02;  // in ln; share of the range
    const FreeEntry& e = problem_.free.entries[k];
    const double end = kEnd * (e.high - e.low), of_unknown = e.scale == Scale::kLog ? kTold : e.prior_stddev;
    const double variance = at_.knowledge.Variance(Eigen::RowVectorXd::Unit(unknowns_.material(), k));
    return variance < of_unknown * of_unknown && at_.x[k] > e.low + end && at_.x[k] < e.high - end;
  }

  /// Takes the better one of where the fit stands and the capture's own start values. What the fit by shader does not
  /// tell begins there in any case: walks may not tell it either, and would leave it where shader's errors drove it.
  /// The worse one is kept.
  void ChooseStart() {
    constexpr double kToCompare = 20e3;  // paths
    const auto misfit = [&] { return gatherer_.MisfitOfPatches(Capped(kToCompare), "start"); };
    Eigen::VectorXd from = unknowns_.Here();
    for (int k = 0; k < unknowns_.material(); ++k)
      if (!IsTold(k)) from[k] = unknowns_.Stated()[k];
    unknowns_.GoTo(from);
    const double misfit_from = misfit();
    other_start_ = unknowns_.Stated();
    unknowns_.GoTo(other_start_);
    if (misfit() <= misfit_from) return other_start_.swap(from);
    unknowns_.GoTo(from);
  }

  /// A place where steps end, and what is left of the photographs there.
  struct Valley {
    Eigen::VectorXd where;
    PatchChi2 left;
  };

  /// Goes to the best place where searches end. A free roughness may have several optima (a lobe that reaches the
  /// camera and one that does not make the same level): it is searched for from small, middle and large ones too. Where
  /// more than noise is left everything is searched for from the other start too: a thickness and what lies below may
  /// explain photographs in two ways, one of them badly. How far off other places are that leave no more, but for
  /// noise, is not known either. What is left at the best one.
  PatchChi2 Search() {
    constexpr double kAsGood = 3.0;  // standard deviations
    const double same_valley = std::log(1.6);
    std::vector<Valley> found;
    const int roughness = unknowns_.EntryOf(RoughnessOf(problem_.capture));
    const auto was_found = [&](const Eigen::VectorXd& here) {
      return roughness >= 0 && std::any_of(found.begin(), found.end(), [&](const Valley& v) {
               return std::abs(v.where[roughness] - here[roughness]) < same_valley;
             });
    };
    const auto search_from = [&](const Eigen::VectorXd& start) {
      unknowns_.GoTo(start);
      const std::optional<PatchChi2> left = SearchSteps(was_found);
      if (left && !was_found(unknowns_.Here())) found.push_back({unknowns_.Here(), *left});
    };
    const auto best = [&]() -> const Valley& {
      return *std::min_element(found.begin(), found.end(),
                               [](const Valley& a, const Valley& b) { return a.left.chi2 < b.left.chi2; });
    };
    const Eigen::VectorXd from = unknowns_.Here();
    std::vector<Eigen::VectorXd> starts{from};
    for (const double r : {0.1, 0.25, 0.55}) {
      if (roughness < 0) break;
      Eigen::VectorXd start = from;
      start[roughness] = unknowns_.InItsScale(roughness, r);
      if (std::none_of(starts.begin(), starts.end(), [&](const Eigen::VectorXd& s) {
            return std::abs(s[roughness] - start[roughness]) < same_valley;
          }))
        starts.push_back(start);
    }
    for (const Eigen::VectorXd& start : starts) search_from(start);
    if (best().left.chi2 > kExplained) search_from(other_start_);
    for (const Valley& v : found)
      if (unknowns_.LongestLogarithm(v.where - best().where) >= same_valley &&
          v.left.chi2 - best().left.chi2 < kAsGood * best().left.StddevOfDifference(v.left)) {
        runs_.AddRival((v.where - best().where).head(unknowns_.material()));
        if (roughness >= 0) at_.rival_roughness.push_back(std::exp(v.where[roughness]));
      }
    unknowns_.GoTo(best().where);
    return best().left;
  }

  /// Steps of a search, until they gain no more than noise does, are short, or lead to where a search was before. One
  /// that made things worse is halved. Where more than noise is left and several steps took nothing off it, photographs
  /// contradict the model or each other, and no further one would: the best place is kept. What was left before the
  /// last step, if there was one.
  std::optional<PatchChi2> SearchSteps(const std::function<bool(const Eigen::VectorXd&)>& was_found) {
    constexpr double kWorse = 1.5, kShort = 0.1;
    constexpr int kSeveral = 3, kMostHalved = 3;
    Valley lowest{unknowns_.Here(), {HUGE_VAL, 1.0, 1.0, 0.0}};
    Eigen::VectorXd from, step;
    double left_before = HUGE_VAL;
    int in_vain = 0, halved = 0;
    std::optional<PatchChi2> left;
    for (int i = 0; i < kSearch.most && !was_found(unknowns_.Here()); ++i) {
      const GatheredWalks g = Gather(kSearch, kSearch.values, kSearch.slopes);
      if (g.left.patches.chi2 > kWorse * left_before && halved < kMostHalved) {
        ++halved;
        step *= 0.5;
        unknowns_.GoTo(from + step);
        continue;
      }
      halved = 0;
      left = g.left.patches;
      left_before = left->chi2;
      from = unknowns_.Here();
      WalkedStep::Solution s;
      step = StepIn(kSearch, g, s).step;
      Record(kSearch.name, Capped(kSearch.values), g, step, s);
      in_vain = left->chi2 < kLess * lowest.left.chi2 ? 0 : in_vain + 1;
      if (left->chi2 < lowest.left.chi2) lowest = {from, *left};
      if (in_vain >= kSeveral && (lowest.left.chi2 > kExplained || g.left.regions.IsMoreThan(kExplained))) {
        unknowns_.GoTo(lowest.where);
        return lowest.left;
      }
      unknowns_.GoTo(from + step);
      if (s.gain <= kSettled * s.noise_gain || unknowns_.LongestLogarithm(step) < kShort) break;
    }
    return left;
  }

  GatheredWalks Gather(const Stage& stage, double values, double slopes) {
    walked_at_ = unknowns_.Here();
    return gatherer_.Gather(Capped(values), Capped(slopes),
                            std::string(stage.name) + ", step " + std::to_string(at_.steps.size() + 1));
  }

  /// The step within the stage's trust region; `s` is that of the whole one.
  WalkUnknowns::ShortStep StepIn(const Stage& stage, const GatheredWalks& g, WalkedStep::Solution& s) {
    const Eigen::VectorXd whole =
        unknowns_.Bounded(g.step, unknowns_.Prior(stage.reach, WalkUnknowns::From::kAll), stage.noise, s);
    gatherer_.Know(s.covariance.diagonal().head(unknowns_.material()).cwiseSqrt());
    return unknowns_.Shortened(whole, s.covariance, stage.longest);
  }

  RunEstimate WalkRun(double paths) {
    GatheredWalks g = Gather(kRun, paths, std::max(kRun.slopes, kSlopesOfRun * (runs_.Paths() + paths)));
    WalkedStep::Solution s;
    const auto [step, cut] = StepIn(kRun, g, s);
    Record(kRun.name, Capped(paths), g, step, s);
    const WalkedStep::Solution data = g.step.Solve(unknowns_.RangesAlone(), unknowns_.Untold());
    RunEstimate e{Capped(paths),
                  unknowns_.Here() + step,
                  at_.x + data.step.head(unknowns_.material()),
                  data.covariance,
                  data.walk_covariance,
                  data.slope_covariance,
                  data.covariance * g.model_scatter * data.covariance,
                  g.chi2,
                  g.left,
                  std::move(g.left_of),
                  std::move(g.values),
                  IsOnItsWay(s.step, {step, cut}, s.covariance),
                  data.seen};
    unknowns_.GoTo(e.unknowns);
    if (!e.is_on_its_way) e.is_on_its_way = unknowns_.WidenStatedErrors(e.covariance, e.of_walks);
    return e;
  }

  /// Steps that do not count, where the calibration states errors: lamps and exposures, which stood still so far, come
  /// to where they may stay. Derivatives by nuisances are not exact, so one such step may cover less than half of the
  /// way. More of them where photographs contradict what is stated, until it shows how far.
  void LeadOn() {
    constexpr int kSteps = 3, kMostSteps = 9;
    if (problem_.errors.empty()) return;
    InflatedErrors before = at_.inflation;
    for (int made = 0; made < kSteps || (made < kMostSteps && at_.inflation != before); ++made) {
      before = at_.inflation;
      WalkRun(kSearch.values);
    }
  }

  /// Where walks to their end would go from here in one step: as far as handing them over misleads.
  Eigen::VectorXd StepToTheirEnd() {
    gatherer_.GoBy(WalkGatherer::Walks::kToTheirEnd);
    const GatheredWalks g = Gather(kRun, kRun.values, kRun.slopes);
    WalkedStep::Solution s;
    const Eigen::VectorXd step =
        unknowns_.Bounded(g.step, unknowns_.Prior(kRun.reach, WalkUnknowns::From::kAll), kRun.noise, s);
    Record("to the end", Capped(kRun.values), g, step, s);
    return step.head(unknowns_.material());
  }

  void Record(const std::string& stage, double paths, const GatheredWalks& g, const Eigen::VectorXd& step,
              const WalkedStep::Solution& s) {
    const int n = unknowns_.material();
    at_.steps.push_back({stage, paths, g.chi2, g.left.patches.chi2, at_.x, step.head(n),
                         s.covariance.diagonal().head(n).cwiseSqrt(),
                         s.walk_covariance.diagonal().head(n).cwiseSqrt()});
  }

  const FitProblem& problem_;
  FitState& at_;
  WalkUnknowns unknowns_;
  WalkGatherer gatherer_;
  WalkRuns runs_;
  const WalkGatherer::Walks last_;  ///< of the pictures that the fit ends at
  Eigen::VectorXd other_start_, walked_at_;
};

}  // namespace

bool FitByWalks(const FitProblem& problem, CrownInput& input, FitState& at, bool must_explain_more,
                Progress& progress) {
  const double to_beat = must_explain_more ? at.knowledge.block_chi2 : HUGE_VAL;
  const FitState before = at;
  WalkFit fit(problem, input, at, progress);
  if (problem.free.count() == 0 || fit.Run(to_beat)) {
    at.departures = fit.DeparturesFromStatedLaws();
    MoveInput(problem, at, input);
    return true;
  }
  at = before;
  input.capture = Moved(problem.capture, problem.errors, at.calibration.amounts);
  return false;
}

}  // namespace crownfit
