#include "fit/walk_comparison.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "fit/uncertainty.h"

namespace crownfit {
namespace {

constexpr double kShrink = 0.98;  // of correlations: paths that are grey make channels nearly one

Eigen::Matrix3d Shrunk(const Eigen::Matrix3d& correlation) {
  Eigen::Matrix3d shrunk = kShrink * correlation;
  shrunk.diagonal().setOnes();
  return shrunk;
}

/// How the channels' noise goes together, from differences of neighbouring residuals: walked photographs follow one
/// path in all channels, and cameras interpolate.
Eigen::Matrix3d NoiseCorrelation(const FitPixels& p, const PhotographCast& cast,
                                 const std::vector<Eigen::Vector3d>& residual,
                                 const std::vector<Eigen::Vector3d>& stddev) {
  constexpr double kClip = 4.0, kFew = 1e-3;
  constexpr int kNear = 4;  // pixels: where only every n-th is used
  Eigen::Matrix3d sum = kFew * Eigen::Matrix3d::Identity();
  for (size_t i = 1; i < residual.size(); ++i) {
    const PixelCast &a = cast.pixels[p.pixels[i - 1]], &b = cast.pixels[p.pixels[i]];
    if (a.y != b.y || std::abs(a.x - b.x) > kNear) continue;
    const Eigen::Vector3d off =
        ((residual[i] - residual[i - 1]).array() / (stddev[i].cwiseAbs2() + stddev[i - 1].cwiseAbs2()).array().sqrt())
            .cwiseMax(-kClip)
            .cwiseMin(kClip);
    sum += off * off.transpose();
  }
  const Eigen::Vector3d root = sum.diagonal().cwiseSqrt().cwiseInverse();
  return root.asDiagonal() * sum * root.asDiagonal();
}

/// Pixels of the fit, by number, in every patch.
using Patches = std::map<std::pair<int, int>, std::vector<size_t>>;
Patches PatchesOf(const FitPixels& p, const PhotographCast& cast) {
  Patches patches;
  for (size_t i = 0; i < p.pixels.size(); ++i)
    patches[{cast.pixels[p.pixels[i]].x / kPatch, cast.pixels[p.pixels[i]].y / kPatch}].push_back(i);
  return patches;
}

/// `sum`: whitened, of the patch's residuals.
void AddWithoutGroups(const std::vector<size_t>& members, const std::vector<Eigen::Vector3d>& stddev,
                      const Eigen::LLT<Eigen::Matrix3d>& root, const Eigen::Vector3d& sum, WalkComparison& c) {
  const Eigen::Index groups = c.off_by_group[members[0]].cols();
  if (groups < 2) return;
  Eigen::Matrix<double, kChannels, Eigen::Dynamic> off(kChannels, groups);
  off.setZero();
  for (const size_t i : members) off += stddev[i].cwiseInverse().asDiagonal() * c.off_by_group[i];
  off /= std::sqrt(static_cast<double>(members.size())) * static_cast<double>(groups - 1);
  root.matrixL().solveInPlace(off);
  c.block_chi2_without.resize(static_cast<size_t>(groups), 0.0);
  for (Eigen::Index g = 0; g < groups; ++g)
    c.block_chi2_without[static_cast<size_t>(g)] += (sum + off.col(g)).squaredNorm();
}

void WeighPatches(const Patches& patches, const std::vector<Eigen::Vector3d>& stddev, const Eigen::Matrix3d& noise,
                  WalkComparison& c) {
  constexpr double kWidth = 3.0, kUsualLargest = 1.0, kClip = 4.0;
  const Eigen::LLT<Eigen::Matrix3d> root(Shrunk(noise));
  std::vector<double> largest;
  for (const auto& [place, members] : patches) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const size_t i : members) {
      Eigen::Vector3d r = c.residual[i].cwiseQuotient(stddev[i]);
      sum += r;
      root.matrixL().solveInPlace(r);
      c.chi2 += r.cwiseAbs2().cwiseMin(kClip * kClip).sum();
    }
    sum /= std::sqrt(static_cast<double>(members.size()));
    root.matrixL().solveInPlace(sum);
    c.block_chi2 += sum.squaredNorm();
    AddWithoutGroups(members, stddev, root, sum, c);
    largest.push_back(sum.cwiseAbs().maxCoeff());
  }
  const double of_noise = root.solve(noise).trace() / kChannels;  // what noise alone makes of a square
  c.chi2 /= of_noise, c.block_chi2 /= of_noise;
  for (double& without : c.block_chi2_without) without /= of_noise;
  c.values = kChannels * stddev.size();
  c.block_values = kChannels * patches.size();
  std::vector<double> sorted = largest;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(sorted.size() / 2), sorted.end());
  const double width = kWidth * std::max(kUsualLargest, sorted[sorted.size() / 2]);
  c.weight.assign(stddev.size(), 1.0);
  size_t patch = 0;
  for (const auto& [place, members] : patches) {
    for (const size_t i : members) c.weight[i] = std::min(1.0, width / largest[patch]);
    ++patch;
  }
}

}  // namespace

double PatchMisfit::StddevByChance() const { return std::hypot(std::sqrt(2.0 / patches), stddev); }

double PatchMisfit::StddevOfDifference(const PatchMisfit& other) const { return std::hypot(stddev, other.stddev); }

double PatchMisfit::AsSeenByWalks(double of_photographs) const {
  constexpr double kClear = 0.3;
  return share_of_walks * (1.0 + kClear) + (1.0 - share_of_walks) * of_photographs;
}

PatchMisfit MeanOf(const std::vector<PatchMisfit>& runs) {
  const auto n = static_cast<double>(runs.size());
  PatchMisfit mean{0.0, 0.0, runs.front().patches, 0.0};
  for (const PatchMisfit& run : runs) {
    mean.of_patches += run.of_patches / n;
    mean.share_of_walks += run.share_of_walks / n;
    mean.stddev = std::hypot(mean.stddev, run.stddev / n);
  }
  return mean;
}

void WalkComparison::AddSums(const WalkComparison& other) {
  chi2 += other.chi2, block_chi2 += other.block_chi2, share_of_walks += other.share_of_walks;
  values += other.values, block_values += other.block_values;
  block_chi2_without.resize(other.block_chi2_without.size(), 0.0);
  for (size_t g = 0; g < block_chi2_without.size(); ++g) block_chi2_without[g] += other.block_chi2_without[g];
}

PatchMisfit WalkComparison::Left() const {
  const auto patches = static_cast<double>(block_values), groups = static_cast<double>(block_chi2_without.size());
  double mean = 0, scatter = 0;
  for (const double without : block_chi2_without) mean += without / groups;
  for (const double without : block_chi2_without) scatter += std::pow(without - mean, 2);
  return {block_chi2 / patches, share_of_walks / static_cast<double>(values), patches,
          groups > 1.0 ? std::sqrt((groups - 1.0) / groups * scatter) / patches : 0.0};
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
  const auto root = [](const glm::dvec3& v) { return Eigen::Vector3d(std::sqrt(v.x), std::sqrt(v.y), std::sqrt(v.z)); };
  WalkComparison c;
  std::vector<Eigen::Vector3d> stddev, of_walks;
  const Patches patches = PatchesOf(p, cast);
  std::vector<double> together(p.pixels.size());  // how many pixels the patch has
  for (const auto& [place, members] : patches)
    for (const size_t i : members) together[i] = static_cast<double>(members.size());
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    glm::dvec3 predicted = p.SceneryAt(i), variance(0.0);
    auto& off_by_group = c.off_by_group.emplace_back(kChannels, static_cast<Eigen::Index>(walked.groups));
    off_by_group.setZero();
    for (const auto& [source, share] : p.TermsOf(i)) {
      const size_t rank = ranks[source];
      const double weight = share;
      predicted += weight * walked.pixels[rank].mean;
      for (size_t g = 0; g < walked.groups; ++g) {
        const glm::dvec3 apart = glm::dvec3(walked.group_values[rank * walked.groups + g]) - walked.pixels[rank].mean;
        off_by_group.col(static_cast<Eigen::Index>(g)) +=
            exposure * weight * Eigen::Vector3d(apart.x, apart.y, apart.z);
      }
      // Noise that the lens spreads is shared between neighbours: as much as if each had all of it.
      variance += exposure * exposure * weight * glm::dvec3(smooth[rank][0], smooth[rank][3], smooth[rank][5]);
    }
    const glm::dvec3 off = p.values[i] - exposure * predicted;
    c.residual.emplace_back(off.x, off.y, off.z);
    of_walks.push_back(root(variance));
    const glm::dvec3 of_model = model_error * exposure * predicted;
    stddev.push_back(root(variance + p.stddev[i] * p.stddev[i] + together[i] * of_model * of_model));
  }
  const Eigen::Matrix3d noise = NoiseCorrelation(p, cast, c.residual, stddev), correlation = Shrunk(noise);
  for (size_t i = 0; i < stddev.size(); ++i) {
    c.covariance.push_back(stddev[i].asDiagonal() * correlation * stddev[i].asDiagonal());
    c.of_walks.push_back(of_walks[i].asDiagonal() * correlation * of_walks[i].asDiagonal());
    c.share_of_walks += of_walks[i].cwiseQuotient(stddev[i]).squaredNorm();
  }
  WeighPatches(patches, stddev, noise, c);
  return c;
}

}  // namespace crownfit
