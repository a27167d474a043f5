// Extreme inputs of users: razor-thin edges, very deep chalk, triangles in any order; and totals that must be
// monotonic.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "optics/adding_doubling.h"
#include "support/shapes.h"
#include "support/walked.h"

namespace crownfit {
namespace {

KnownScene InAWhiteFurnace(TriangleMesh mesh, double reduced_scattering) {
  KnownScene scene(std::move(mesh), 1, 0.4, 6, 1.8);
  SetLayer(scene, 0, 1.54, 0.6, reduced_scattering, 0.0);
  SetSurface(scene, 0.0, 0.0);
  scene.Light(DomeLight{glm::dvec3(1.0 / std::numbers::pi)});
  return scene;
}

TEST(WhiteFurnace, ChalkOfOpticalDepth100000DisappearsAndTerminates) {
  const Mean mean = RenderedMean(InAWhiteFurnace(Sphere(1.5, 12), 1.33e4), 8);
  EXPECT_NEAR(mean.value(), 1.0, 4 * mean.stated + 1e-3);
}

TEST(WhiteFurnace, RazorThinEdgeDisappears) {
  // A wedge of 1 mm that ends a micrometre thick.
  TriangleMesh wedge = Box({-1, -1, -1}, {1, 1, 1});
  for (glm::dvec3& v : wedge.vertices) v.z *= 5e-4 + 0.25 * (1.0 + v.x);
  for (const double reduced_scattering : {0.1, 30.0}) {
    const Mean mean = RenderedMean(InAWhiteFurnace(wedge, reduced_scattering), 60);
    EXPECT_NEAR(mean.value(), 1.0, 4 * mean.stated + 1e-3) << reduced_scattering;
  }
}

TEST(Path, TriangleOrderDoesNotMatter) {
  KnownScene sorted = InAWhiteFurnace(Sphere(1.5, 12), 3.0);
  SetLayer(sorted, 0, 1.54, 0.6, 3.0, 0.1);
  SetSurface(sorted, 0.3, 0.0);
  KnownScene shuffled = sorted;
  TriangleMesh mesh = *sorted.source.meshes[0];
  for (size_t t = mesh.triangles.size(); t-- > 1;)
    std::swap(mesh.triangles[t], mesh.triangles[static_cast<size_t>(2654435761u * t) % (t + 1)]);
  for (glm::ivec3& t : mesh.triangles) t = {t.y, t.z, t.x};
  shuffled.source.meshes[0] = mesh;
  // The paths are the same, except those that pass within rounding of an edge.
  const Mean a = RenderedMean(sorted, 100), b = RenderedMean(shuffled, 100);
  EXPECT_NEAR(a.value(), b.value(), 0.2 * a.stated);
}

TEST(AddingDoubling, TotalsAreMonotonicInEveryCoefficient) {
  const auto totals = [](double scattering, double absorption, double mm) {
    Slab slab;
    slab.layers = {{1.54, 0.8, 0.0, scattering, absorption, mm}};
    return SolveByAddingDoubling(slab).value;
  };
  constexpr double kSame = 1e-9;
  for (const double scattering : {0.3, 3.0, 30.0, 300.0})
    for (const double absorption : {1e-4, 1e-2, 0.3, 10.0})
      for (const double mm : {0.02, 0.3, 3.0}) {
        const auto here = totals(scattering, absorption, mm), more_absorbing = totals(scattering, 1.5 * absorption, mm),
                   thicker = totals(scattering, absorption, 1.5 * mm),
                   more_scattering = totals(1.5 * scattering, absorption, mm);
        const std::string at =
            std::to_string(scattering) + ", " + std::to_string(absorption) + ", " + std::to_string(mm);
        EXPECT_LE(more_absorbing.reflectance_collimated, here.reflectance_collimated + kSame) << at;
        EXPECT_LE(more_absorbing.transmittance_collimated, here.transmittance_collimated + kSame) << at;
        EXPECT_LE(more_absorbing.reflectance_diffuse, here.reflectance_diffuse + kSame) << at;
        EXPECT_LE(thicker.transmittance_collimated, here.transmittance_collimated + kSame) << at;
        EXPECT_LE(thicker.transmittance_diffuse, here.transmittance_diffuse + kSame) << at;
        EXPECT_LE(more_scattering.transmittance_collimated, here.transmittance_collimated + kSame) << at;
        EXPECT_GE(here.reflectance_collimated, 0.0) << at;
        EXPECT_GE(here.transmittance_collimated, 0.0) << at;
        EXPECT_LE(here.reflectance_collimated + here.transmittance_collimated, 1.0) << at;
      }
}

}  // namespace
}  // namespace crownfit
