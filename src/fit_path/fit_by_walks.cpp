#include "fit_path/fit_by_walks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "base/linear_algebra.h"
#include "capture/capture.h"
#include "fit_path/gather_walks.h"
#include "fit_path/long_runs.h"
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
    gatherer_.TakePixels(std::min(kPixelsOfSearch, problem_.options.max_pixels_per_photograph));
    ChooseStart();
    if (const PatchChi2 left = ChooseValley(); !may_move && explains_less(left, 0.0)) return false;
    gatherer_.GoBy(last_);
    gatherer_.ResolveFields();
    gatherer_.TakePixels(problem_.options.max_pixels_by_walks());
    constexpr size_t kMostRuns = 8;
    LeadOn();
    runs_.Add(LongRun(Paths()));
    for (size_t made = 1; made < kMostRuns && !(at_.converged && !runs_.WouldGainByWalks()); ++made) {
      const double moved = unknowns_.CalibrationCost();
      RunEstimate run = LongRun(Paths());
      if (may_move && made == 1 && explains_less(run.misfit.patches, moved)) return false;
      const bool is_hopeless = made > 1 && run.misfit.IsMoreThan(kChi2Limit);  // more runs would be refused too
      runs_.Add(std::move(run));
      at_.converged = runs_.Conclude();
      if (is_hopeless) break;
    }
    if (last_ == WalkGatherer::Walks::kHandedOver) {
      runs_.SetModelOffset(StepToTheirEnd());
      runs_.Conclude();
    }
    return true;
  }

  /// By walks to their end, whatever the fit ended with: those have no error of a model.
  WalkedStep::Solution Ask() {
    const double paths = kMiddleShare * Paths();
    gatherer_.ResolveFields();
    gatherer_.TakePixels(problem_.options.max_pixels_by_walks());
    const GatheredWalks g = gatherer_.Gather(paths, SlopePaths(paths), "shared scattering");
    return g.step.Solve(unknowns_.RangesAlone(), unknowns_.Untold());
  }

 private:
  static constexpr double kExplained = 1.5;  // of the square of patches' noise
  static constexpr double kLess = 0.97;      // of what is left: more than chance takes off
  static constexpr double kSettled = 3.0;    // gain of chi2 over that of noise alone

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

  double Paths() const {
    return static_cast<double>(problem_.options.paths_per_photograph) *
           (last_ == WalkGatherer::Walks::kHandedOver ? kOfHandedOver : 1.0);
  }

  double SearchPaths() const { return kSearchShare * static_cast<double>(problem_.options.paths_per_photograph); }

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
    stage_ = "path tracing, start";
    gatherer_.GoBy(WalkGatherer::Walks::kHandedOver);
    const auto misfit = [&] { return gatherer_.MisfitOfPatches(SearchPaths(), stage_); };
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

  /// Searches; from the other start too where that leaves more than noise: a thickness and what lies below may explain
  /// photographs in two ways, one of them badly. What is left there.
  PatchChi2 ChooseValley() {
    const PatchChi2 left = ChooseRoughness();
    if (left.chi2 <= kExplained) return left;
    const Eigen::VectorXd where = unknowns_.Here();
    unknowns_.GoTo(other_start_);
    const PatchChi2 other = Search([](const Eigen::VectorXd&) { return false; });
    if (other.chi2 < left.chi2) return other;
    unknowns_.GoTo(where);
    return left;
  }

  /// Searches handed over; and from there to walks' end, unless that leaves more than noise, and no less than an
  /// earlier search did.
  PatchChi2 Search(const std::function<bool(const Eigen::VectorXd&)>& was_found) {
    constexpr PatchChi2 kNotSought{HUGE_VAL, 1.0, 1.0, 0.0};
    gatherer_.GoBy(WalkGatherer::Walks::kHandedOver);
    const PatchChi2 handed_over = StepsOf(SearchPaths(), was_found).value_or(kNotSought);
    if (last_ == WalkGatherer::Walks::kHandedOver) return handed_over;
    if (handed_over.chi2 > std::max(kExplained, kLess * least_handed_over_)) return kNotSought;
    least_handed_over_ = std::min(least_handed_over_, handed_over.chi2);
    gatherer_.GoBy(WalkGatherer::Walks::kToTheirEnd);
    return StepsOf(kMiddleShare * Paths(), was_found).value_or(handed_over);
  }

  struct Valley {
    Eigen::VectorXd where;
    PatchChi2 left;
  };

  /// Searches. A free roughness may have several optima (a lobe that reaches the camera and one that does not make the
  /// same level): it is searched for from small, middle and large ones too, and of several the best by long runs is
  /// kept; how far off the others are that leave no more, but for noise, is not known either. What is left there.
  PatchChi2 ChooseRoughness() {
    const double same_valley = std::log(1.6);
    std::vector<Valley> found;
    const int roughness = unknowns_.EntryOf(RoughnessOf(problem_.capture));
    const auto was_found = [&](const Eigen::VectorXd& here) {
      return std::any_of(found.begin(), found.end(),
                         [&](const Valley& v) { return std::abs(v.where[roughness] - here[roughness]) < same_valley; });
    };
    if (roughness < 0) return Search(was_found);
    const Eigen::VectorXd from = unknowns_.Here();
    std::vector<double> starts{from[roughness]};
    for (const double r : {0.1, 0.25, 0.55}) {
      const double start = unknowns_.InItsScale(roughness, r);
      if (std::none_of(starts.begin(), starts.end(), [&](double s) { return std::abs(s - start) < same_valley; }))
        starts.push_back(start);
    }
    for (const double start : starts) {
      Eigen::VectorXd there = from;
      there[roughness] = start;
      unknowns_.GoTo(there);
      const PatchChi2 left = Search(was_found);
      if (left.chi2 < HUGE_VAL && !was_found(unknowns_.Here())) found.push_back({unknowns_.Here(), left});
    }
    if (found.size() > 1)
      for (Valley& v : found) {
        unknowns_.GoTo(v.where);
        const RunEstimate e = LongRun(Paths());
        v = {e.unknowns, e.misfit.patches};
      }
    const Valley& best = *std::min_element(found.begin(), found.end(),
                                           [](const Valley& a, const Valley& b) { return a.left.chi2 < b.left.chi2; });
    constexpr double kAsGood = 3.0;  // standard deviations
    for (const Valley& v : found)
      if (&v != &best && v.left.chi2 - best.left.chi2 < kAsGood * best.left.StddevOfDifference(v.left)) {
        runs_.AddRival((v.where - best.where).head(unknowns_.material()));
        at_.rival_roughness.push_back(std::exp(v.where[roughness]));
      }
    unknowns_.GoTo(best.where);
    return best.left;
  }

  /// Steps until they gain no more than noise does, or lead to where a search was before. Where one made things worse
  /// it is taken back, and derivatives get twice the paths. Where more than noise is left and several steps took
  /// nothing off it, photographs contradict the model or each other, and no further one would: the best place is kept.
  /// What was left before the last one, if there was one.
  std::optional<PatchChi2> StepsOf(double paths, const std::function<bool(const Eigen::VectorXd&)>& was_found) {
    constexpr double kReach = 0.4, kLongest = 0.7, kWorse = 1.5;
    constexpr int kMostSteps = 20, kSeveral = 3;
    double slope_paths = paths, best = HUGE_VAL;
    Eigen::VectorXd best_at = unknowns_.Here();
    Valley lowest{best_at, {HUGE_VAL, 1.0, 1.0, 0.0}};
    int in_vain = 0;
    std::optional<PatchChi2> left;
    for (int i = 0; i < kMostSteps && !was_found(unknowns_.Here()); ++i) {
      stage_ = "path tracing, step " + std::to_string(at_.steps.size() + 1);
      GatheredWalks g = gatherer_.Gather(paths, slope_paths, stage_);
      if (g.left.patches.chi2 > kWorse * best && slope_paths < Paths()) {
        slope_paths *= 2.0;
        unknowns_.GoTo(best_at);
        g = gatherer_.Gather(paths, slope_paths, stage_);
      }
      best = g.left.patches.chi2;
      left = g.left.patches;
      best_at = unknowns_.Here();
      WalkedStep::Solution s;
      const Eigen::VectorXd whole =
          unknowns_.Bounded(g.step, unknowns_.Prior(kReach, WalkUnknowns::From::kAll), WalkedStep::Noise::kLeft, s);
      const WalkUnknowns::ShortStep made = unknowns_.Shortened(whole, s.covariance, kLongest);
      const Eigen::VectorXd& step = made.step;
      Record("search", paths, g, step, s);
      in_vain = g.left.patches.chi2 < kLess * lowest.left.chi2 ? 0 : in_vain + 1;
      if (g.left.patches.chi2 < lowest.left.chi2) lowest = {best_at, g.left.patches};
      if (in_vain >= kSeveral && (lowest.left.chi2 > kExplained || g.left.regions.IsMoreThan(kExplained))) {
        unknowns_.GoTo(lowest.where);
        return lowest.left;
      }
      unknowns_.GoTo(best_at + step);
      if (s.gain <= kSettled * s.noise_gain) break;
    }
    return left;
  }

  RunEstimate LongRun(double paths) {
    constexpr double kReach = 1.0, kLongest = 0.5;
    stage_ = "final run, step " + std::to_string(at_.steps.size() + 1);
    GatheredWalks g = gatherer_.Gather(paths, SlopePaths(paths), stage_);
    WalkedStep::Solution s;
    const Eigen::VectorXd whole =
        unknowns_.Bounded(g.step, unknowns_.Prior(kReach, WalkUnknowns::From::kAll), WalkedStep::Noise::kTakenOff, s);
    const WalkUnknowns::ShortStep made = unknowns_.Shortened(whole, s.covariance, kLongest);
    const Eigen::VectorXd& step = made.step;
    Record("run", paths, g, step, s);
    const WalkedStep::Solution data = g.step.Solve(unknowns_.RangesAlone(), unknowns_.Untold());
    RunEstimate e{unknowns_.Here() + step,
                  at_.x + data.step.head(unknowns_.material()),
                  data.covariance,
                  data.walk_covariance,
                  data.slope_covariance,
                  data.covariance * g.model_scatter * data.covariance,
                  g.chi2,
                  g.left,
                  std::move(g.left_of),
                  std::move(g.values),
                  IsOnItsWay(whole, made, s.covariance),
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
      LongRun(kMiddleShare * Paths());
    }
  }

  /// Where walks to their end would go from here in one step: as far as handing them over misleads.
  Eigen::VectorXd StepToTheirEnd() {
    constexpr double kReach = 1.0;
    stage_ = "path tracing, once";
    gatherer_.GoBy(WalkGatherer::Walks::kToTheirEnd);
    const GatheredWalks g = gatherer_.Gather(Paths(), SlopePaths(Paths()), stage_);
    WalkedStep::Solution s;
    const Eigen::VectorXd step =
        unknowns_.Bounded(g.step, unknowns_.Prior(kReach, WalkUnknowns::From::kAll), WalkedStep::Noise::kTakenOff, s);
    Record("to the end", Paths(), g, step, s);
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
  LongRuns runs_;
  const WalkGatherer::Walks last_;       ///< of the pictures that the fit ends at
  double least_handed_over_ = HUGE_VAL;  ///< what searches left in patches
  Eigen::VectorXd other_start_;
  std::string stage_;
};

}  // namespace

WalkedStep::Solution StepByWalks(const FitProblem& problem, CrownInput& input, FitState& at, Progress& progress) {
  return WalkFit(problem, input, at, progress).Ask();
}

bool FitByWalks(const FitProblem& problem, CrownInput& input, FitState& at, bool must_explain_more,
                Progress& progress) {
  const double to_beat = must_explain_more ? at.knowledge.block_chi2 : HUGE_VAL;
  const FitState before = at;
  if (problem.free.count() == 0 || WalkFit(problem, input, at, progress).Run(to_beat)) {
    MoveInput(problem, at, input);
    return true;
  }
  at = before;
  input.capture = Moved(problem.capture, problem.errors, at.calibration.amounts);
  return false;
}

}  // namespace crownfit
