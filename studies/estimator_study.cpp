// Noise against time of both estimators of model path, over patches of captures' photographs: with their lamps as they
// are, a fifth as wide and of no width, on surfaces of several roughnesses. Writes CSV.
//
// usage: estimator_study [--few | --handed-over] CAPTURE...     --few: as the capture is, only
//     --handed-over: pictures of model diffusion, by the scatter of eight

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <string>

#include "capture/capture.h"
#include "optics/material_file.h"
#include "path/path_derivatives.h"
#include "path/path_photograph.h"
#include "scene/crown_input.h"

namespace {

using namespace crownfit;

constexpr int kPatch = 8, kEvery = 1;  // pixels along a patch's side; of so many patches along a line, one is rendered
constexpr int kChannel = 1;

/// A lamp of the same power, by this much narrower; 0: a point.
LightShape Narrowed(const LightShape& shape, double by) {
  if (const auto* r = std::get_if<RectangleLight>(&shape)) {
    if (by > 0)
      return RectangleLight{r->centre_mm, by * r->half_axis_u_mm, by * r->half_axis_v_mm,
                            (1.0 / (by * by)) * r->radiance};
    const glm::dvec3 across = glm::cross(r->half_axis_u_mm, r->half_axis_v_mm);
    return PointLight{r->centre_mm, 4.0 * glm::length(across) * r->radiance, 0.0};
  }
  if (const auto* d = std::get_if<DiskLight>(&shape)) {
    const double area =
        std::numbers::pi * (d->outer_radius_mm * d->outer_radius_mm - d->inner_radius_mm * d->inner_radius_mm);
    if (by > 0)
      return DiskLight{d->centre_mm, d->normal, (1.0 / (by * by)) * d->radiance, by * d->inner_radius_mm,
                       by * d->outer_radius_mm};
    return PointLight{d->centre_mm, area * d->radiance, 0.0};
  }
  return shape;
}

double CpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// What one estimator says of a photograph's patches.
struct Patches {
  std::vector<double> mean, variance;  ///< sums over a patch's pixels on the object
  double total = 0, total_variance = 0, seconds = 0;
};

Patches PatchesBy(Estimator estimator, const CrownInput& input, const LayeredBody& body, const Material& material,
                  size_t photograph, PathOptions options) {
  options.estimator = estimator;
  options.keeps_groups = true;
  const Camera& camera = input.capture.photographs[photograph].camera;
  options.wanted.assign(static_cast<size_t>(camera.width) * camera.height, 0);
  const auto is_wanted = [](int block) { return block % kEvery == kEvery / 2; };
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      options.wanted[static_cast<size_t>(y) * camera.width + x] = is_wanted(x / kPatch) && is_wanted(y / kPatch);
  const double begin = CpuSeconds();
  const PathPhotograph photo =
      RenderByPaths(input.capture, body, input.scenery, material, photograph, options, [](double) {});
  Patches found;
  found.seconds = CpuSeconds() - begin;
  const int across = camera.width / kPatch + 1;
  std::vector<std::vector<double>> groups(static_cast<size_t>(across) * (camera.height / kPatch + 1),
                                          std::vector<double>(photo.groups, 0.0));
  std::vector<int> pixels(groups.size(), 0);
  std::vector<double> all(photo.groups, 0.0);
  for (size_t rank = 0; rank < photo.rendered.size(); ++rank) {
    const size_t p = photo.rendered[rank];
    if (!photo.pixels[rank].on_object) continue;
    const size_t patch = p / camera.width / kPatch * across + p % camera.width / kPatch;
    ++pixels[patch];
    for (size_t g = 0; g < photo.groups; ++g) {
      const double value = photo.group_values.at(rank * photo.groups + g, kChannel);
      groups[patch][g] += value;
      all[g] += value;
    }
  }
  const auto moments = [&](const std::vector<double>& of_groups) {
    double sum = 0, squares = 0;
    const auto n = static_cast<double>(of_groups.size());
    for (const double v : of_groups) sum += v / n;
    for (const double v : of_groups) squares += (v - sum) * (v - sum) / (n - 1.0);
    return std::pair(sum, squares / n);
  };
  for (size_t k = 0; k < groups.size(); ++k) {
    if (pixels[k] < kPatch * kPatch / 2) continue;
    const auto [mean, variance] = moments(groups[k]);
    found.mean.push_back(mean);
    found.variance.push_back(variance);
  }
  std::tie(found.total, found.total_variance) = moments(all);
  return found;
}

/// Pooled relative variance of patches; those darker than a tenth of the mean count as that bright.
double PooledVariance(const Patches& p, const std::vector<double>& means) {
  double mean = 0, sum = 0;
  for (const double m : means) mean += m / static_cast<double>(means.size());
  for (size_t k = 0; k < means.size(); ++k) {
    const double of = std::max(0.1 * mean, means[k]);
    sum += p.variance[k] / (of * of) / static_cast<double>(means.size());
  }
  return sum;
}

void Print(const std::string& capture, const std::string& photograph, const char* lamps, double roughness,
           const Patches& exits, const Patches& collisions) {
  const double of_exits = PooledVariance(exits, collisions.mean),
               of_collisions = PooledVariance(collisions, collisions.mean);
  std::printf("%s,%s,%s,%g,%.4g,%.4g,%.3f,%.3f,%.2f,%.4f,%.4f\n", capture.c_str(), photograph.c_str(), lamps, roughness,
              std::sqrt(of_exits), std::sqrt(of_collisions), exits.seconds, collisions.seconds,
              of_exits * exits.seconds / (of_collisions * collisions.seconds), collisions.total / exits.total,
              std::hypot(std::sqrt(exits.total_variance) / exits.total,
                         std::sqrt(collisions.total_variance) / collisions.total));
  std::fflush(stdout);
}

void Compare(const std::string& name, const CrownInput& input, Bodies& bodies, const Material& material,
             const char* lamps, double roughness, int paths) {
  const LayeredBody& body = bodies.Of(material);
  for (size_t i = 0; i < input.capture.photographs.size(); ++i) {
    const Patches exits = PatchesBy(Estimator::kExits, input, body, material, i, {.paths_per_pixel = paths, .seed = 1}),
                  collisions = PatchesBy(Estimator::kCollisions, input, body, material, i,
                                         {.paths_per_pixel = paths, .seed = 2});
    Print(name, input.capture.photographs[i].name, lamps, roughness, exits, collisions);
  }
}

/// The same for pictures that are handed over after ten collisions: by the scatter of several, each with a field of
/// diffuse light of its own.
void CompareHandedOver(const std::string& name, const CrownInput& input, Bodies& bodies, const Material& material,
                       const char* lamps, int paths) {
  constexpr int kSeeds = 8;
  for (size_t i = 0; i < input.capture.photographs.size(); ++i) {
    const auto of_seeds = [&](Estimator estimator) {
      Patches all;
      std::vector<double> squares;
      for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
        PathOptions options{.paths_per_pixel = paths, .seed = seed};
        options.lattice = &bodies.LatticeOf(material);
        const Patches one = PatchesBy(estimator, input, bodies.Of(material), material, i, options);
        all.mean.resize(one.mean.size(), 0.0);
        squares.resize(one.mean.size(), 0.0);
        for (size_t k = 0; k < one.mean.size(); ++k)
          all.mean[k] += one.mean[k] / kSeeds, squares[k] += one.mean[k] * one.mean[k] / kSeeds;
        all.total += one.total / kSeeds, all.total_variance += one.total * one.total / kSeeds;
        all.seconds += one.seconds / kSeeds;
      }
      for (size_t k = 0; k < squares.size(); ++k)
        all.variance.push_back((squares[k] - all.mean[k] * all.mean[k]) * kSeeds / (kSeeds - 1.0));
      all.total_variance = (all.total_variance - all.total * all.total) / (kSeeds - 1.0);
      return all;
    };
    Print(name, input.capture.photographs[i].name, lamps, material.surface[Quantity::kRoughness][0],
          of_seeds(Estimator::kExits), of_seeds(Estimator::kCollisions));
  }
}

}  // namespace

int main(int count, char** words) {
  bool few = false, handed_over = false;
  int paths = 64;
  std::printf(
      "capture,photograph,lamps,roughness,error_exits,error_collisions,s_exits,s_collisions,gain,ratio,ratio_error\n");
  for (int k = 1; k < count; ++k) {
    if (std::strcmp(words[k], "--few") == 0) {
      few = true;
      continue;
    }
    if (std::strcmp(words[k], "--handed-over") == 0) {
      handed_over = true;
      continue;
    }
    const std::filesystem::path folder = words[k];
    const Capture capture = ReadCapture(folder);
    const std::string name = folder.filename().string();
    CrownInput input = ReadInput(capture, 0, false);
    Material material = ReadMaterialFile(folder / "truth.json", capture);
    Bodies bodies(input, 0);
    if (handed_over) {
      CompareHandedOver(name, input, bodies, material, "as they are", paths);
      for (Light& light : input.capture.lights) light.shape = Narrowed(light.shape, 0.0);
      CompareHandedOver(name, input, bodies, material, "points", paths);
      continue;
    }
    Compare(name, input, bodies, material, "as they are", material.surface[Quantity::kRoughness][0], paths);
    if (few) continue;
    for (const double width : {1.0, 0.2, 0.0})
      for (const double roughness : {0.0, 0.1, 0.2, 0.3}) {
        if (width == 1.0 && roughness == 0.2) continue;
        CrownInput changed = input;
        for (Light& light : changed.capture.lights)
          if (width < 1.0) light.shape = Narrowed(light.shape, width);
        material.surface[Quantity::kRoughness].fill(roughness);
        // Without what the surface alone reflects: a mirror's highlights are found as before.
        for (PhotographSpec& photo : changed.capture.photographs)
          if (roughness == 0) photo.polarisation = Polarisation::kCross;
        Compare(name, changed, bodies, material,
                width == 1.0 ? "as they are"
                : width > 0  ? "a fifth as wide"
                             : "points",
                roughness, paths);
      }
  }
  return 0;
}
