// Noise against time for every way to sample lamps: by chance, by chance and by points on the lamps, in the lobe of
// diffuse light. Lit by a softbox, a flash, a back light and a dome; on smooth and rough surfaces. Writes CSV.

#include <cmath>
#include <cstdio>
#include <ctime>
#include <numbers>

#include "path/path_photograph.h"
#include "scene/crown_source.h"
#include "support/known_scene.h"

namespace {

using namespace crownfit;

struct Illumination {
  const char* name;
  LightShape shape;
};

struct Way {
  const char* name;
  bool lamps_are_sampled, diffuse_exits;
};

/// A disk of the half angle as seen from the crown, of radiance 1.
DiskLight Disk(const glm::dvec3& towards, double half_angle_deg) {
  constexpr double kDistance = 180;
  const glm::dvec3 d = glm::normalize(towards);
  return {kDistance * d, -d, glm::dvec3(1.0), 0.0, kDistance * std::tan(half_angle_deg * std::numbers::pi / 180)};
}

double CpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

int main() {
  const Illumination lights[] = {{"softbox 20 deg", Disk({1, 0, 1}, 20)},
                                 {"flash 2 deg", Disk({1, 0, 1}, 2)},
                                 {"back light 20 deg", Disk({0.3, 0, -1}, 20)},
                                 {"dome", DomeLight{glm::dvec3(1.0)}}};
  const Way ways[] = {
      {"chance", false, false}, {"chance and points on lamps", true, false}, {"diffuse exits", true, true}};
  std::printf("light,roughness,estimator,mean,error,noise_per_path,us_per_path,cpu_s_for_1_percent\n");
  for (const Illumination& light : lights)
    for (const double roughness : {0.0, 0.05, 0.15, 0.3})
      for (const Way& way : ways) {
        const bool is_smooth = roughness == 0;
        // Redundant ways are skipped: on a smooth surface points on lamps are of no use, and domes are found by chance.
        if (is_smooth ? way.lamps_are_sampled && !way.diffuse_exits : way.diffuse_exits) continue;
        if (std::holds_alternative<DomeLight>(light.shape) && way.lamps_are_sampled) continue;
        KnownScene scene = SmoothIncisor(24);
        scene.capture.lights.clear();
        scene.capture.photographs[0].lights.clear();
        scene.capture.surface[static_cast<size_t>(Quantity::kRoughness)].value.fill(roughness);
        scene.capture.photographs[0].polarisation = Polarisation::kCross;  // excludes pure surface reflection
        scene.Light(light.shape);
        const LayeredBody body(BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture)), 0);
        PathOptions options{.paths_per_pixel = 1500};
        options.lamps_are_sampled = way.lamps_are_sampled;
        options.diffuse_exits = way.diffuse_exits;
        const double begin = CpuSeconds();
        const PathPhotograph photo =
            RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
        const double cpu_s = CpuSeconds() - begin;
        double sum = 0, variance = 0, n = 0;
        for (const PixelEstimate& p : photo.pixels)
          if (p.on_object) sum += p.mean[1], variance += p.variance()[1], ++n;
        const double paths = n * options.paths_per_pixel, mean = sum / n, error = std::sqrt(variance) / n;
        // Standard deviation of one path, pixel by pixel, over the mean pixel.
        const double noise = error * std::sqrt(paths) / mean;
        std::printf("%s,%g,%s,%.5f,%.5f,%.2f,%.2f,%.4g\n", light.name, roughness, way.name, mean, error, noise,
                    1e6 * cpu_s / paths, std::pow(noise / 0.01, 2) * n * cpu_s / paths);
        std::fflush(stdout);
      }
  return 0;
}
