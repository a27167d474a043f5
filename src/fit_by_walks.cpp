#include "fit_by_walks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "base/linear_algebra.h"
#include "gather_walks.h"

namespace crownfit {
namespace {

class WalkFit {
 public:
  WalkFit(const FitProblem& problem, CrownInput& input, FitState& at, Progress& progress)
      : problem_(problem),
        at_(at),
        unknowns_(problem, at),
        gatherer_(problem, input, at, unknowns_, progress),
        last_(problem.options.model == "diffusion" ? WalkGatherer::Walks::kHandedOver
                                                   : WalkGatherer::Walks::kToTheirEnd) {}

  /// False when the search leaves patches further off than `to_beat`.
  bool Run(double to_beat) {
    at_.converged = false;
    unknowns_.ForgetCalibration();  // what shader moved made up for its own errors, by up to 23 stated ones
    if (!problem_.errors.empty()) gatherer_.TakePixels(problem_.options.max_pixels_per_photograph);
    ChooseStart();
    if (const Misfit left = ChooseValley(); left.of_patches > left.AsSeenByWalks(to_beat)) return false;
    gatherer_.GoBy(last_);
    gatherer_.TakePixels(problem_.options.max_pixels_by_walks());
    constexpr size_t kMostRuns = 8, kSeveral = 3;
    if (!problem_.errors.empty()) LongRun();  // lamps, which stood still so far, first come to where they may stay
    std::vector<Estimate> runs{LongRun()};
    bool has_strayed = false;
    for (size_t made = 1; made < kMostRuns && !(at_.converged && !WouldGainByWalks()); ++made) {
      runs.push_back(LongRun());
      // Those that were still on their way only led here; so did those whose derivatives were too noisy to tell what
      // later ones, which know those of several runs, do.
      // One that strays from several that had arrived has bad luck with its derivatives; a second one has not.
      if (runs.back().is_on_its_way && runs.size() > kSeveral && !has_strayed)
        runs.pop_back(), has_strayed = true;
      else if (runs.end()[-2].is_on_its_way || runs.back().is_on_its_way)
        runs.erase(runs.begin(), runs.end() - 1);
      if (runs.back().tells_all) std::erase_if(runs, [](const Estimate& e) { return !e.tells_all; });
      at_.converged = Conclude(runs) && runs.size() > 1;
    }
    if (last_ == WalkGatherer::Walks::kHandedOver) {
      model_offset_ = StepToTheirEnd();
      Conclude(runs);
    }
    return true;
  }

 private:
  static constexpr double kSettled = 3.0;                          // gain of chi2 over that of noise alone
  static constexpr double kSearchShare = 0.1, kMiddleShare = 0.4;  // of the paths that were asked for
  static constexpr double kSlopeShare = 0.3;  // in long runs; derivatives of several runs are averaged

  /// What is left in patches, over its noise.
  struct Misfit {
    double of_patches, share_of_walks, patches;  ///< of the walks in that noise; how many values
    /// Of the difference between two of the same photographs, each by walks of its own, where both are right.
    double StddevOfDifference() const {
      const double common = 1.0 - share_of_walks;
      return 2.0 * std::sqrt((1.0 - common * common) / patches);
    }
    /// What pictures without noise leave, over the photographs' own, in these units; and what may be told from it.
    double AsSeenByWalks(double of_photographs) const {
      constexpr double kClear = 0.3;
      return share_of_walks * (1.0 + kClear) + (1.0 - share_of_walks) * of_photographs;
    }
  };
  struct Estimate {
    Eigen::VectorXd unknowns;
    Eigen::VectorXd by_photographs;        ///< the material's entries, had nothing else been known
    Eigen::MatrixXd covariance, of_walks;  ///< of the material's entries
    Eigen::MatrixXd of_slopes;             ///< part of both; later runs' derivatives are means over earlier ones' too
    Eigen::MatrixXd of_model;  ///< by what photographs have in common of the model's own error; part of none
    double chi2 = 0;
    Misfit misfit;
    std::vector<std::vector<glm::dvec3>> values;
    bool is_on_its_way;  ///< the step was cut short, and led somewhere
    bool tells_all;      ///< its derivatives do, of every direction
  };

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

  /// Whether walks make more than half of the variance of what they could tell and have not told precisely yet:
  /// photographs alone would tell it within a factor 4.
  bool WouldGainByWalks() const {
    constexpr double kShareOfWalks = 0.5, kTold = 0.35, kPrecise = 0.02;  // in ln
    double share = 0;
    int told = 0;
    for (int k = 0; k < unknowns_.material(); ++k) {
      const double of_walks = at_.knowledge.of_walks[k], variance = at_.knowledge.covariance(k, k);
      if (variance < kPrecise * kPrecise || (1.0 - of_walks) * variance > kTold * kTold) continue;
      share += of_walks;
      ++told;
    }
    return share > kShareOfWalks * told;
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
  void ChooseStart() {
    stage_ = "walking from the start";
    gatherer_.GoBy(WalkGatherer::Walks::kHandedOver);
    const auto misfit = [&] { return gatherer_.Misfit(SearchPaths(), stage_); };
    Eigen::VectorXd from = unknowns_.Here();
    for (int k = 0; k < unknowns_.material(); ++k)
      if (!IsTold(k)) from[k] = unknowns_.Stated()[k];
    unknowns_.GoTo(from);
    const double misfit_from = misfit();
    unknowns_.GoTo(unknowns_.Stated());
    if (misfit() > misfit_from) unknowns_.GoTo(from);
  }

  /// Searches. A free roughness may have several optima (a lobe that reaches the camera and one that does not make the
  /// same level): it is searched for from small, middle and large ones too, and the best is kept; how far off the
  /// others are that leave no more, but for noise, is not known either. What is left there.
  Misfit ChooseValley() {
    const double same_valley = std::log(1.6);
    std::vector<std::pair<Misfit, Eigen::VectorXd>> found;  // and where
    const int roughness = unknowns_.EntryOf(RoughnessOf(problem_.capture));
    const auto was_found = [&](const Eigen::VectorXd& here) {
      return std::any_of(found.begin(), found.end(),
                         [&](const auto& f) { return std::abs(f.second[roughness] - here[roughness]) < same_valley; });
    };
    Misfit left{HUGE_VAL, 1.0, 1.0};
    const auto search = [&] {
      for (const bool to_their_end : {false, true}) {
        if (to_their_end && last_ == WalkGatherer::Walks::kHandedOver) continue;
        gatherer_.GoBy(to_their_end ? WalkGatherer::Walks::kToTheirEnd : WalkGatherer::Walks::kHandedOver);
        if (const auto ended = Search((to_their_end ? kMiddleShare * Paths() : SearchPaths()), was_found))
          left = *ended;
      }
    };
    if (roughness < 0) {
      search();
      return left;
    }
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
      search();
      if (was_found(unknowns_.Here())) continue;
      const Estimate e = LongRun();
      found.emplace_back(e.misfit, e.unknowns);
    }
    const auto [best, where] = *std::min_element(found.begin(), found.end(), [](const auto& a, const auto& b) {
      return a.first.of_patches < b.first.of_patches;
    });
    constexpr double kAsGood = 3.0;  // standard deviations
    for (const auto& [misfit, there] : found)
      if (there != where && misfit.of_patches - best.of_patches < kAsGood * best.StddevOfDifference()) {
        rivals_.push_back((there - where).head(unknowns_.material()));
        at_.rival_roughness.push_back(std::exp(there[roughness]));
      }
    unknowns_.GoTo(where);
    return best;
  }

  /// Steps until they gain no more than noise does, or lead to where a search was before. Where one made things worse
  /// it is taken back, and derivatives get twice the paths. What was left before the last one, if there was one.
  std::optional<Misfit> Search(double paths, const std::function<bool(const Eigen::VectorXd&)>& was_found) {
    constexpr double kReach = 0.4, kLongest = 0.7, kWorse = 1.5;
    constexpr int kMostSteps = 20;
    double slope_paths = paths, best = HUGE_VAL;
    Eigen::VectorXd best_at = unknowns_.Here();
    std::optional<Misfit> left;
    for (int i = 0; i < kMostSteps && !was_found(unknowns_.Here()); ++i) {
      stage_ = "walking, step " + std::to_string(at_.steps.size() + 1);
      GatheredWalks g = gatherer_.Gather(paths, slope_paths, stage_);
      if (g.block_chi2 > kWorse * best && slope_paths < Paths()) {
        slope_paths *= 2.0;
        unknowns_.GoTo(best_at);
        g = gatherer_.Gather(paths, slope_paths, stage_);
      }
      best = g.block_chi2;
      left = {g.block_chi2, g.share_of_walks, g.block_values};
      best_at = unknowns_.Here();
      WalkedStep::Solution s;
      const Eigen::VectorXd whole =
          unknowns_.Bounded(g.step, unknowns_.Prior(kReach, WalkUnknowns::From::kAll), WalkedStep::Noise::kLeft, s);
      const WalkUnknowns::ShortStep made = unknowns_.Shortened(whole, s.covariance, kLongest);
      const Eigen::VectorXd& step = made.step;
      Record("search", paths, g, step, s);
      unknowns_.GoTo(best_at + step);
      if (s.gain <= kSettled * s.noise_gain) break;
    }
    return left;
  }

  Estimate LongRun() {
    constexpr double kReach = 1.0, kLongest = 0.5;
    stage_ = "walking, long run, step " + std::to_string(at_.steps.size() + 1);
    GatheredWalks g = gatherer_.Gather(Paths(), kSlopeShare * Paths(), stage_);
    WalkedStep::Solution s;
    const Eigen::VectorXd whole =
        unknowns_.Bounded(g.step, unknowns_.Prior(kReach, WalkUnknowns::From::kAll), WalkedStep::Noise::kTakenOff, s);
    const WalkUnknowns::ShortStep made = unknowns_.Shortened(whole, s.covariance, kLongest);
    const Eigen::VectorXd& step = made.step;
    Record("run", Paths(), g, step, s);
    const WalkedStep::Solution data = g.step.Solve(RangesAlone(), unknowns_.Untold());
    const int n = unknowns_.material();
    const Eigen::MatrixXd of_model = data.covariance * g.model_scatter * data.covariance;
    Estimate e{unknowns_.Here() + step,
               at_.x + data.step.head(n),
               data.covariance.topLeftCorner(n, n),
               data.walk_covariance.topLeftCorner(n, n),
               data.slope_covariance.topLeftCorner(n, n),
               of_model.topLeftCorner(n, n),
               g.chi2,
               {g.block_chi2, g.share_of_walks, g.block_values},
               std::move(g.values),
               IsOnItsWay(whole, made, s.covariance),
               data.seen};
    unknowns_.GoTo(e.unknowns);
    return e;
  }

  /// Where walks to their end would go from here in one step: as far as handing them over misleads.
  Eigen::VectorXd StepToTheirEnd() {
    constexpr double kReach = 1.0;
    stage_ = "walking to the end, once";
    gatherer_.GoBy(WalkGatherer::Walks::kToTheirEnd);
    const GatheredWalks g = gatherer_.Gather(Paths(), kSlopeShare * Paths(), stage_);
    WalkedStep::Solution s;
    const Eigen::VectorXd step =
        unknowns_.Bounded(g.step, unknowns_.Prior(kReach, WalkUnknowns::From::kAll), WalkedStep::Noise::kTakenOff, s);
    Record("to the end", Paths(), g, step, s);
    return step.head(unknowns_.material());
  }

  /// What is known of the material before any photograph: within a factor e^3, or less by the range or the prior.
  WalkedStep::Prior RangesAlone() const {
    constexpr double kNothingKnown = 3.0;
    return unknowns_.Prior(kNothingKnown, WalkUnknowns::From::kPhotographs);
  }

  /// Goes to the runs' mean and says what is known there; true when they agree: two at once, or several that scatter
  /// by somewhat more than their walks, which then widens the intervals. Where the photographs tell little, runs may
  /// differ by a share of what is not known.
  bool Conclude(const std::vector<Estimate>& runs) {
    constexpr double kAgreeAtOnce = 2.0, kAgree = 5.0;  // mean square of scatter in standard deviations of the walks
    constexpr size_t kSeveral = 4;
    constexpr double kOfUnknown = 0.1;  // of the variance
    const double n = static_cast<double>(runs.size());
    const int m = unknowns_.material();
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(unknowns_.count());
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(m, m), of_walks = covariance;
    DataKnowledge k;
    k.by_photographs = Eigen::VectorXd::Zero(m);
    at_.walked.clear();
    for (const auto& values : runs[0].values) at_.walked.emplace_back(values.size(), glm::dvec3(0.0));
    for (const Estimate& e : runs) {
      mean += e.unknowns / n;
      k.by_photographs += e.by_photographs / n;
      covariance += e.covariance / n;
      of_walks += e.of_walks / n;
      k.reduced_chi2 += e.chi2 / n;
      k.block_chi2 += e.misfit.of_patches / n;
      for (size_t g = 0; g < at_.walked.size(); ++g)
        for (size_t i = 0; i < at_.walked[g].size(); ++i) at_.walked[g][i] += e.values[g][i] / n;
    }
    double off = 0;
    const Eigen::VectorXd allowed = of_walks.diagonal().cwiseMax(kOfUnknown * covariance.diagonal()).cwiseMax(1e-12);
    for (const Estimate& e : runs) off += (e.unknowns - mean).head(m).cwiseAbs2().cwiseQuotient(allowed).sum();
    const Eigen::MatrixXd of_a_run = of_walks, &of_slopes = runs.back().of_slopes;
    const double moving = static_cast<double>(m) - static_cast<double>(unknowns_.Untold().size());
    const double scatter = runs.size() > 1 && moving > 0 ? off / (moving * (n - 1.0)) : 0.0;
    // Values are walked anew in every run; derivatives, in the last one, are the mean of all runs'.
    of_walks = std::max(1.0, scatter) * ((of_a_run - of_slopes) / n + of_slopes);
    unknowns_.GoTo(mean);
    // What is left beyond noise is common to all runs: no number of walks averages it out. It is measured against the
    // noise of one run, photographs and walks.
    k.inflation = std::max(1.0, k.block_chi2);
    const auto [variances, directions] = EigenOfSymmetric(covariance - of_a_run);
    const Eigen::MatrixXd of_photographs = directions * variances.cwiseMax(0.0).asDiagonal() * directions.transpose();
    k.covariance = of_photographs + (k.inflation - 1.0) * (of_photographs + of_a_run) + of_walks + runs.back().of_model;
    for (const Eigen::VectorXd& rival : rivals_)
      k.covariance += rival * rival.transpose() / static_cast<double>(rivals_.size());
    if (model_offset_.size() > 0) k.covariance += model_offset_ * model_offset_.transpose();
    ForgetRanges(of_photographs + of_walks, k);
    k.of_walks = of_walks.diagonal().cwiseQuotient(k.covariance.diagonal().cwiseMax(1e-300)).cwiseMin(1.0);
    for (Eigen::Index u = 0; u < k.unseen.cols(); ++u) k.of_walks -= k.of_walks.cwiseProduct(k.unseen.col(u));
    const Eigen::VectorXd all = EigenOfSymmetric(k.covariance).values;  // 0 where nothing is seen
    if (const auto unseen = k.unseen.cols(); unseen < m) k.condition = std::sqrt(all[m - 1] / all[unseen]);
    at_.knowledge = k;
    return scatter <= (runs.size() < kSeveral ? kAgreeAtOnce : kAgree);
  }

  /// Entries of which pictures know no more than their range does were not seen, nor were those without derivatives.
  /// What the others owe to the range of such a one stays in their variances.
  void ForgetRanges(const Eigen::MatrixXd& known, DataKnowledge& k) const {
    constexpr double kNoMore = 0.5;  // of the range's variance
    const int m = unknowns_.material();
    const Eigen::VectorXd of_range = RangesAlone().precision.diagonal().head(m).cwiseInverse();
    std::vector<int> unseen = unknowns_.Untold();
    for (int i = 0; i < m; ++i)
      if (known(i, i) > kNoMore * of_range[i] && !std::count(unseen.begin(), unseen.end(), i)) unseen.push_back(i);
    k.unseen = Eigen::MatrixXd::Zero(m, static_cast<Eigen::Index>(unseen.size()));
    for (size_t u = 0; u < unseen.size(); ++u) {
      k.unseen(unseen[u], static_cast<Eigen::Index>(u)) = 1.0;
      k.covariance.row(unseen[u]).setZero();
      k.covariance.col(unseen[u]).setZero();
    }
  }

  void Record(const std::string& stage, double paths, const GatheredWalks& g, const Eigen::VectorXd& step,
              const WalkedStep::Solution& s) {
    const int n = unknowns_.material();
    at_.steps.push_back({stage, paths, g.chi2, g.block_chi2, at_.x, step.head(n),
                         s.covariance.diagonal().head(n).cwiseSqrt(),
                         s.walk_covariance.diagonal().head(n).cwiseSqrt()});
  }

  const FitProblem& problem_;
  FitState& at_;
  WalkUnknowns unknowns_;
  WalkGatherer gatherer_;
  const WalkGatherer::Walks last_;       ///< of the pictures that the fit ends at
  std::vector<Eigen::VectorXd> rivals_;  ///< other optima as good, from the best one
  Eigen::VectorXd model_offset_;         ///< of walks that are handed over; empty: none are, or not known yet
  std::string stage_;
};

}  // namespace

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
