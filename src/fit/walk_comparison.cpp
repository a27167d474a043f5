#include "fit/walk_comparison.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <climits>
#include <cmath>
#include <map>

#include "fit/uncertainty.h"

namespace crownfit {
namespace {

constexpr double kShrink = 0.98;  // of correlations: with grey paths the channels are almost fully correlated

Eigen::VectorXd AsVector(const Spectrum& s) { return Eigen::Map<const Eigen::VectorXd>(s.begin(), s.size()); }

Eigen::MatrixXd Shrunk(const Eigen::MatrixXd& correlation) {
  Eigen::MatrixXd shrunk = kShrink * correlation;
  shrunk.diagonal().setOnes();
  return shrunk;
}

/// Correlation of the channels' noise, from differences of neighbouring residuals: path-traced photographs use one path
/// for all channels, and cameras interpolate.
Eigen::MatrixXd NoiseCorrelation(const FitPixels& p, const PhotographCast& cast,
                                 const std::vector<Eigen::VectorXd>& residual,
                                 const std::vector<Eigen::VectorXd>& stddev) {
  constexpr double kClip = 4.0, kFew = 1e-3;
  constexpr int kNear = 4;  // pixels: where only every n-th is used
  Eigen::MatrixXd sum = kFew * Eigen::MatrixXd::Identity(p.channels(), p.channels());
  for (size_t i = 1; i < residual.size(); ++i) {
    const PixelCast &a = cast.pixels[p.pixels[i - 1]], &b = cast.pixels[p.pixels[i]];
    if (a.y != b.y || std::abs(a.x - b.x) > kNear) continue;
    const Eigen::VectorXd off =
        ((residual[i] - residual[i - 1]).array() / (stddev[i].cwiseAbs2() + stddev[i - 1].cwiseAbs2()).array().sqrt())
            .cwiseMax(-kClip)
            .cwiseMin(kClip);
    sum += off * off.transpose();
  }
  const Eigen::VectorXd root = sum.diagonal().cwiseSqrt().cwiseInverse();
  return root.asDiagonal() * sum * root.asDiagonal();
}

/// Indices of the fitted pixels in every square of this width.
using Patches = std::map<std::pair<int, int>, std::vector<size_t>>;
Patches PatchesOf(const FitPixels& p, const PhotographCast& cast, int width) {
  Patches patches;
  for (size_t i = 0; i < p.pixels.size(); ++i)
    patches[{cast.pixels[p.pixels[i]].x / width, cast.pixels[p.pixels[i]].y / width}].push_back(i);
  return patches;
}

/// Width of squares of which the fitted pixels' bounding box holds 16; at least that of patches.
int WidthOfRegions(const FitPixels& p, const PhotographCast& cast) {
  constexpr double kRegions = 16.0;
  int left = INT_MAX, top = INT_MAX, right = 0, bottom = 0;
  for (const int k : p.pixels) {
    const PixelCast& pixel = cast.pixels[k];
    left = std::min(left, pixel.x), right = std::max(right, pixel.x);
    top = std::min(top, pixel.y), bottom = std::max(bottom, pixel.y);
  }
  return std::max(kPatch,
                  static_cast<int>(std::ceil(std::sqrt((right - left + 1.0) * (bottom - top + 1.0) / kRegions))));
}

/// How residuals and their noise are whitened.
struct Whitening {
  const std::vector<Eigen::VectorXd>& stddev;
  Eigen::LLT<Eigen::MatrixXd> root;  ///< of the channels' correlation
  double of_noise;                   ///< mean square of noise after whitening
  Eigen::Index channels() const { return root.rows(); }
};

/// Sum of a patch's residuals, whitened.
Eigen::VectorXd SumOf(const std::vector<size_t>& members, const Whitening& w, const WalkComparison& c) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(w.channels());
  for (const size_t i : members) sum += c.residual[i].cwiseQuotient(w.stddev[i]);
  sum /= std::sqrt(static_cast<double>(members.size()));
  w.root.matrixL().solveInPlace(sum);
  return sum;
}

/// Change of that sum when each group of paths is left out (a column each).
Eigen::MatrixXd OffWithoutGroups(const std::vector<size_t>& members, const Whitening& w, const WalkComparison& c) {
  const Eigen::Index groups = c.off_by_group[members[0]].cols();
  Eigen::MatrixXd off = Eigen::MatrixXd::Zero(w.channels(), groups);
  if (groups < 2) return off;
  for (const size_t i : members) off += w.stddev[i].cwiseInverse().asDiagonal() * c.off_by_group[i];
  off /= std::sqrt(static_cast<double>(members.size())) * static_cast<double>(groups - 1);
  w.root.matrixL().solveInPlace(off);
  return off;
}

/// By how much a patch's noise of walks, as groups of paths scatter (`off`), exceeds what its pixels' own would add up
/// to: squares of whitened sums.
double NoiseInCommon(const std::vector<size_t>& members, const Whitening& w, const WalkComparison& c,
                     const Eigen::MatrixXd& off) {
  const auto groups = static_cast<double>(off.cols());
  if (off.cols() < 2) return 0.0;
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(w.channels(), w.channels());
  for (const size_t i : members) {
    const auto per_stddev = w.stddev[i].cwiseInverse().asDiagonal();
    own += per_stddev * c.of_walks[i] * per_stddev;
  }
  return off.squaredNorm() * (groups - 1.0) / groups - w.root.solve(own).trace() / static_cast<double>(members.size());
}

/// `share_noise`: pixels have noise of walks in common.
SumsOfPatches SumsOf(const Patches& patches, const Whitening& w, const WalkComparison& c, bool share_noise) {
  SumsOfPatches sums;
  double in_common = 0;
  for (const auto& [place, members] : patches) {
    const Eigen::VectorXd sum = SumOf(members, w, c);
    sums.chi2 += sum.squaredNorm() / w.of_noise;
    const auto off = OffWithoutGroups(members, w, c);
    if (share_noise) in_common += NoiseInCommon(members, w, c, off) / w.of_noise;
    if (off.cols() < 2) continue;
    sums.chi2_without.resize(static_cast<size_t>(off.cols()), 0.0);
    for (Eigen::Index g = 0; g < off.cols(); ++g)
      sums.chi2_without[static_cast<size_t>(g)] += (sum + off.col(g)).squaredNorm() / w.of_noise;
  }
  sums.values = static_cast<size_t>(w.channels()) * patches.size();
  const double values = static_cast<double>(sums.values), scale = values / (values + std::max(0.0, in_common));
  sums.chi2 *= scale;
  for (double& without : sums.chi2_without) without *= scale;
  return sums;
}

void WeighPatches(const Patches& patches, const Whitening& w, WalkComparison& c) {
  constexpr double kWidth = 3.0, kUsualLargest = 1.0;
  std::vector<double> largest;
  for (const auto& [place, members] : patches) largest.push_back(SumOf(members, w, c).cwiseAbs().maxCoeff());
  std::vector<double> sorted = largest;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(sorted.size() / 2), sorted.end());
  const double width = kWidth * std::max(kUsualLargest, sorted[sorted.size() / 2]);
  c.weight.assign(w.stddev.size(), 1.0);
  size_t patch = 0;
  for (const auto& [place, members] : patches) {
    for (const size_t i : members) c.weight[i] = std::min(1.0, width / largest[patch]);
    ++patch;
  }
}

/// Sum of squares of pixels, clipped.
double PixelChi2(const Whitening& w, const WalkComparison& c) {
  constexpr double kClip = 4.0;
  double chi2 = 0;
  for (size_t i = 0; i < c.residual.size(); ++i) {
    Eigen::VectorXd r = c.residual[i].cwiseQuotient(w.stddev[i]);
    w.root.matrixL().solveInPlace(r);
    chi2 += r.cwiseAbs2().cwiseMin(kClip * kClip).sum() / w.of_noise;
  }
  return chi2;
}

}  // namespace

double PatchChi2::StddevByChance() const {
  // A misfit's product with noise adds scatter: a square of mean 1 + m has 1 + 2 m times the variance.
  const double beside_misfit = std::sqrt(std::max(1.0, 2.0 * chi2 - 1.0));
  return std::hypot(std::sqrt(2.0 / values), stddev / beside_misfit);
}

bool PatchChi2::IsMoreThan(double limit) const {
  constexpr double kNotByChance = 4.0;  // standard deviations
  return chi2 > std::max(limit, 1.0 + kNotByChance * StddevByChance());
}

double PatchChi2::StddevOfDifference(const PatchChi2& other) const { return std::hypot(stddev, other.stddev); }

double PatchChi2::AsSeenByWalks(double of_photographs) const {
  constexpr double kClear = 0.3;
  return share_of_walks * (1.0 + kClear) + (1.0 - share_of_walks) * of_photographs;
}

static PatchChi2 MeanOf(const std::vector<PatchChi2>& runs) {
  const auto n = static_cast<double>(runs.size());
  PatchChi2 mean{0.0, 0.0, runs.front().values, 0.0};
  for (const PatchChi2& run : runs) {
    mean.chi2 += run.chi2 / n;
    mean.share_of_walks += run.share_of_walks / n;
    mean.stddev = std::hypot(mean.stddev, run.stddev / n);
  }
  return mean;
}

ResidualChi2 MeanOf(const std::vector<ResidualChi2>& runs) {
  std::vector<PatchChi2> patches, regions;
  for (const ResidualChi2& run : runs) patches.push_back(run.patches), regions.push_back(run.regions);
  return {MeanOf(patches), MeanOf(regions)};
}

void SumsOfPatches::Add(const SumsOfPatches& other) {
  chi2 += other.chi2, values += other.values;
  chi2_without.resize(other.chi2_without.size(), 0.0);
  for (size_t g = 0; g < chi2_without.size(); ++g) chi2_without[g] += other.chi2_without[g];
}

PatchChi2 SumsOfPatches::Left(double share_of_walks) const {
  const auto count = static_cast<double>(values), groups = static_cast<double>(chi2_without.size());
  double mean = 0, scatter = 0;
  for (const double without : chi2_without) mean += without / groups;
  for (const double without : chi2_without) scatter += std::pow(without - mean, 2);
  return {chi2 / count, share_of_walks, count,
          groups > 1.0 ? std::sqrt((groups - 1.0) / groups * scatter) / count : 0.0};
}

void WalkComparison::AddSums(const WalkComparison& other) {
  chi2 += other.chi2, share_of_walks += other.share_of_walks, values += other.values;
  patches.Add(other.patches);
  regions.Add(other.regions);
}

ResidualChi2 WalkComparison::Left() const {
  const double share = share_of_walks / static_cast<double>(values);
  return {patches.Left(share), regions.Left(share)};
}

std::vector<size_t> PlacesOf(const FitPixels& p, const PhotographCast& cast, int width) {
  std::vector<size_t> places;
  for (const int s : p.sources) places.push_back(static_cast<size_t>(cast.pixels[s].y) * width + cast.pixels[s].x);
  return places;
}

std::vector<size_t> RanksOf(const FitPixels& p, const PhotographCast& cast, const PathPhotograph& walked) {
  std::vector<size_t> ranks = PlacesOf(p, cast, walked.width);
  for (size_t& place : ranks) place = walked.RankOf(place);
  return ranks;
}

WalkComparison CompareWithWalks(const FitPixels& p, const PhotographCast& cast, const PathPhotograph& walked,
                                double exposure, double model_error) {
  const std::vector<size_t> ranks = RanksOf(p, cast, walked);
  const auto smooth = SmoothedCovariance(walked);
  WalkComparison c;
  std::vector<Eigen::VectorXd> stddev, of_walks;
  const Patches patches = PatchesOf(p, cast, kPatch);
  std::vector<double> together(p.pixels.size());  // number of pixels in the patch
  for (const auto& [place, members] : patches)
    for (const size_t i : members) together[i] = static_cast<double>(members.size());
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    Spectrum predicted = p.SceneryAt(i), variance(p.channels(), 0.0);
    Eigen::MatrixXd& off_by_group =
        c.off_by_group.emplace_back(Eigen::MatrixXd::Zero(p.channels(), static_cast<Eigen::Index>(walked.groups)));
    for (const auto& [source, share] : p.TermsOf(i)) {
      const size_t rank = ranks[source];
      const double weight = share;
      predicted += weight * walked.pixels[rank].mean;
      for (size_t g = 0; g < walked.groups; ++g) {
        const Spectrum apart = walked.group_values[rank * walked.groups + g] - walked.pixels[rank].mean;
        off_by_group.col(static_cast<Eigen::Index>(g)) += exposure * weight * AsVector(apart);
      }
      // Blur shares noise between neighbours: over a patch it adds up as if each pixel had all of it.
      for (int k = 0; k < p.channels(); ++k)
        variance[k] += exposure * exposure * weight * smooth[rank][PairOf(k, k, p.channels())];
    }
    const Spectrum off = p.values[i] - exposure * predicted;
    c.residual.push_back(AsVector(off));
    of_walks.push_back(AsVector(Sqrt(variance)));
    const Spectrum of_model = model_error * exposure * predicted;
    stddev.push_back(AsVector(Sqrt(variance + p.stddev[i] * p.stddev[i] + together[i] * of_model * of_model)));
  }
  const Eigen::MatrixXd noise = NoiseCorrelation(p, cast, c.residual, stddev), correlation = Shrunk(noise);
  for (size_t i = 0; i < stddev.size(); ++i) {
    c.covariance.push_back(stddev[i].asDiagonal() * correlation * stddev[i].asDiagonal());
    c.of_walks.push_back(of_walks[i].asDiagonal() * correlation * of_walks[i].asDiagonal());
    c.share_of_walks += of_walks[i].cwiseQuotient(stddev[i]).squaredNorm();
  }
  const Eigen::LLT<Eigen::MatrixXd> whitening(correlation);
  const Whitening w{stddev, whitening, whitening.solve(noise).trace() / p.channels()};
  c.chi2 = PixelChi2(w, c);
  c.values = static_cast<size_t>(p.channels()) * stddev.size();
  c.patches = SumsOf(patches, w, c, walked.estimator == Estimator::kCollisions);
  c.regions = SumsOf(PatchesOf(p, cast, WidthOfRegions(p, cast)), w, c, walked.estimator == Estimator::kCollisions);
  WeighPatches(patches, w, c);
  return c;
}

}  // namespace crownfit
