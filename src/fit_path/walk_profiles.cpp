#include "fit_path/walk_profiles.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>

#include "capture/capture.h"
#include "fit_path/gather_walks.h"
#include "fit_path/walk_schedule.h"

namespace crownfit {
namespace {

class WalkProfiler {
 public:
  WalkProfiler(const FitProblem& problem, CrownInput& input, FitState& at, Progress& progress, int places)
      : problem_(problem), unknowns_(problem, at), gatherer_(problem, input, at, unknowns_, progress), places_(places) {
    if (problem.options.model == Model::kDiffusion) gatherer_.GoBy(WalkGatherer::Walks::kHandedOver);
    gatherer_.TakePixels(std::min(kSearch.pixels, problem.options.max_pixels_per_photograph));
    solution_ = unknowns_.Here();
    here_ = SolveAt(solution_);
  }

  LikelihoodProfile Of(int entry, double stddev, double inflation, int points_a_side) {
    const FreeEntry& e = problem_.free.entries[entry];
    const double variance = here_.covariance(entry, entry), scale = 2.0 / inflation,
                 reach = kProfileReach * std::min(stddev, std::sqrt(inflation * variance));
    const Eigen::VectorXd along = here_.covariance.col(entry) / variance;
    std::vector<SlopeAt> derivatives;
    double last = HUGE_VAL;
    for (int i = -points_a_side; i <= points_a_side; ++i) {
      const double off = std::clamp(reach * i / points_a_side, e.low - solution_[entry], e.high - solution_[entry]);
      if (off == last) continue;  // beyond the range
      last = off;
      const WalkedStep::Solution there = i == 0 ? here_ : SolveAt(Bounded(solution_ + off * along));
      derivatives.push_back(
          {off, scale * (here_.step[entry] / variance - there.step[entry] / there.covariance(entry, entry)),
           scale / there.covariance(entry, entry)});
    }
    LikelihoodProfile profile = ProfileOfSlopes(derivatives);
    profile.entry = entry;
    for (double& value : profile.at) value += solution_[entry];
    return profile;
  }

 private:
  Eigen::VectorXd Bounded(Eigen::VectorXd there) const {
    for (int k = 0; k < unknowns_.material(); ++k)
      there[k] = std::clamp(there[k], problem_.free.entries[k].low, problem_.free.entries[k].high);
    return there;
  }

  WalkedStep::Solution SolveAt(const Eigen::VectorXd& place) {
    constexpr double kReach = 3.0;
    const double paths = kSearch.values;
    unknowns_.GoTo(place);
    gatherer_.RepeatRandomNumbers();
    const GatheredWalks g = gatherer_.Gather(
        paths, paths, "likelihood profiles, " + std::to_string(++made_) + " of " + std::to_string(places_));
    return g.step.Solve(unknowns_.Prior(kReach, WalkUnknowns::From::kAll), unknowns_.Untold());
  }

  const FitProblem& problem_;
  WalkUnknowns unknowns_;
  WalkGatherer gatherer_;
  int places_, made_ = 0;
  Eigen::VectorXd solution_;
  WalkedStep::Solution here_;
};

}  // namespace

std::vector<LikelihoodProfile> ProfilesByWalks(const FitProblem& problem, CrownInput& input, FitState& at,
                                               const std::vector<int>& entries, const Uncertainty& stated,
                                               int points_a_side, Progress& progress) {
  constexpr size_t kMost = 4;
  const Eigen::VectorXd solution = at.x;
  const auto stddev = [&](int k) { return std::sqrt(stated.covariance(k, k)); };
  const std::vector<int> untold = HeldByWalks(problem.capture, problem.free.entries);
  std::vector<int> walked;
  std::copy_if(entries.begin(), entries.end(), std::back_inserter(walked), [&](int k) {
    return problem.free.entries[k].quantity != Quantity::kRoughness && !std::count(untold.begin(), untold.end(), k);
  });
  std::stable_sort(walked.begin(), walked.end(), [&](int a, int b) { return stddev(a) > stddev(b); });
  walked.resize(std::min(walked.size(), kMost));
  std::optional<WalkProfiler> profiler;
  if (!walked.empty())
    profiler.emplace(problem, input, at, progress, 1 + 2 * points_a_side * static_cast<int>(walked.size()));
  std::vector<LikelihoodProfile> profiles;
  for (const int k : entries)
    profiles.push_back(std::count(walked.begin(), walked.end(), k)
                           ? profiler->Of(k, stddev(k), stated.inflation, points_a_side)
                           : QuadraticProfile(problem.free, solution, stated.covariance, k));
  return profiles;
}

}  // namespace crownfit
