// Derivatives of walks that find the lamps at every collision are those of walks that meet the lamps when they leave,
// which score_derivatives_test holds against differences.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>

#include "support/channels.h"
#include "support/lit_plate.h"
#include "support/walked.h"

namespace crownfit {
namespace {

struct Case {
  const char* name;
  std::function<KnownScene()> scene;
  bool hands_over = false, tells_asymmetry = true;
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

KnownScene WithChannels() {
  KnownScene scene = Plate();
  scene.capture.layers[0][Quantity::kReducedScattering].value = {0.3, 1.0, 3.0};
  return scene;
}

KnownScene OverTile() {
  KnownScene scene = Plate();
  scene.capture.backings.push_back({"tile", {0, 0, -1.5}, {0, 0, 1}, 10.0, glm::dvec3(0.9)});
  scene.capture.photographs[0].backing = 0;
  return scene;
}

const Case kCases[] = {
    {"smooth", [] { return Plate(0.0); }},
    {"rough", [] { return Plate(0.3); }},
    {"forward", [] { return Plate(0.2, 0.96); }, false, false},
    {"backward", [] { return Plate(0.2, -0.4); }},
    {"channelsThatScatterDifferently", WithChannels},
    {"tileBehind", OverTile},
    {"texture", PlateWithTexture},
    {"handedOver", [] { return Plate(0.2); }, true},
    {"channelsThatScatterDifferentlyHandedOver", WithChannels, true},
};

class DerivativesOfBothEstimators : public ::testing::TestWithParam<Case> {};

/// Sums over the picture of every group of paths: of values, then layer by layer of derivatives by scattering,
/// absorption and g.
std::vector<std::array<Mean, kChannels>> TotalsOf(const PathPhotograph& photo) {
  std::vector<std::array<Mean, kChannels>> totals(1 + 3 * photo.layers);
  for (size_t g = 0; g < photo.groups; ++g) {
    std::vector<Spectrum> sums(totals.size(), Spectrum(kChannels, 0.0));
    for (size_t p = 0; p < photo.pixels.size(); ++p) {
      const size_t group = p * photo.groups + g;
      sums[0] += photo.group_values[group];
      for (size_t l = 0; l < photo.layers; ++l) {
        const GroupDerivatives& d = photo.derivatives;
        const size_t at = group * photo.layers + l;
        sums[1 + 3 * l] += d.scattering[at];
        sums[2 + 3 * l] += d.absorption[at];
        sums[3 + 3 * l] += d.asymmetry[at];
      }
    }
    for (size_t k = 0; k < sums.size(); ++k)
      for (int c = 0; c < kChannels; ++c) totals[k][static_cast<size_t>(c)].Add(sums[k][c]);
  }
  return totals;
}

/// Within 4.5 standard errors each and by chance together, at so many paths a pixel by exits and half of them by
/// collisions.
void ExpectSameDerivatives(const Case& of, int paths, int rays) {
  const KnownScene scene = of.scene();
  const LayeredBody body = BodyOf(scene);
  std::optional<VolumeLattice> lattice;
  if (of.hands_over) lattice.emplace(body.surfaces, body.is_exposed, body.absorption, 0.3, 0);
  const auto render = [&](Estimator estimator, int count) {
    PathOptions options;
    options.paths_per_pixel = count;
    options.stream = estimator == Estimator::kExits ? 1 : 2;
    options.lattice = lattice ? &*lattice : nullptr;
    options.collisions = 3;
    options.rays = options.uncollided.rays = rays;
    options.derivatives = true;
    options.estimator = estimator;
    return TotalsOf(
        RenderByPaths(scene.capture, body, scene.scenery, StatedMaterial(scene.capture), 0, options, [](double) {}));
  };
  const auto exits = render(Estimator::kExits, paths), collisions = render(Estimator::kCollisions, paths / 2);
  double squares = 0, count = 0;
  for (size_t k = 1; k < exits.size(); ++k) {
    if (k % 3 == 0 && !of.tells_asymmetry) continue;
    for (size_t c = 0; c < kChannels; ++c) {
      const Mean &a = exits[k][c], &b = collisions[k][c];
      const double error = std::hypot(a.error(), b.error()), z = (b.value() - a.value()) / error;
      EXPECT_LT(std::abs(z), 4.5) << "sum " << k << ", channel " << c << ": " << b.value() << " and " << a.value();
      EXPECT_LT(error, 0.3 * exits[0][c].value()) << "the comparison can tell: sum " << k;
      squares += z * z, ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 2.5);
}

TEST_P(DerivativesOfBothEstimators, AreTheSame) { ExpectSameDerivatives(GetParam(), 2500, 100000); }
TEST_P(DerivativesOfBothEstimators, AreTheSameWithinAPercentOfTheLight) {
  ExpectSameDerivatives(GetParam(), 60000, 800000);
}
INSTANTIATE_TEST_SUITE_P(Scenes, DerivativesOfBothEstimators, ::testing::ValuesIn(kCases),
                         [](const auto& of_case) { return of_case.param.name; });

}  // namespace
}  // namespace crownfit
