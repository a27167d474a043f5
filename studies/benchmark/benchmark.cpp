// Run times of the parts of a fit. ./dev bench; docs/validation.md has the figures.

#include <benchmark/benchmark.h>
#include <ceres/jet.h>

#include <cstdlib>
#include <filesystem>
#include <numeric>

#include "geometry/mesh_file.h"
#include "geometry/signed_distance.h"
#include "optics/adding_doubling.h"
#include "path/path_photograph.h"
#include "path/slab_walk.h"
#include "shader/predict.h"
#include "support/known_scene.h"
#include "support/shapes.h"

namespace crownfit {
namespace {

KnownScene Scene() {
  KnownScene scene(Incisor(), 2, 0.6, 64, 12.0);
  scene.Light(RectangleLight{{-120, 0, 130}, {0, 40, 0}, {29, 0, 27}, glm::dvec3(4.0)});
  scene.Light(DomeLight{glm::dvec3(0.03)});
  return scene;
}

void Rays(benchmark::State& state) {
  const TriangleMesh incisor = Incisor();
  const RayCaster caster({&incisor});
  uint64_t i = 0;
  for (auto _ : state) {
    const double x = -4.0 + 8.0 * (static_cast<double>(i % 89) / 89.0),
                 y = -5.0 + 10.0 * (static_cast<double>(i % 97) / 97.0);
    ++i;
    benchmark::DoNotOptimize(caster.Nearest({x, y, 250}, {0, 0, -1}));
  }
  state.SetItemsProcessed(static_cast<int64_t>(i));
}
BENCHMARK(Rays);

void DepthFieldOfAnIncisor(benchmark::State& state) {
  const TriangleMesh incisor = Incisor();
  for (auto _ : state) benchmark::DoNotOptimize(DepthField(incisor, static_cast<int>(state.range(0))).max_depth_mm());
}
BENCHMARK(DepthFieldOfAnIncisor)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

void CastOnePhotograph(benchmark::State& state) {
  const KnownScene scene = Scene();
  const auto crown = scene.Build();
  CastOptions options;
  options.threads = static_cast<int>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(scene.Cast(*crown, options).pixels.size());
}
BENCHMARK(CastOnePhotograph)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

template <class T>
void PredictOneChannel(benchmark::State& state) {
  const KnownScene scene = Scene();
  const auto crown = scene.Build();
  const PhotographCast cast = scene.Cast(*crown);
  constexpr std::array<double, kShaderSlots> at{0.3, 0.02, 1.0, 1.63, 2.0, 0.07, 1.0, 1.54, 0.9, 0.25, 0.0, 1.0, 0.68};
  static_assert(at.back() != 0, "every slot needs a value");
  std::array<T, kShaderSlots> slots;
  for (int i = 0; i < kShaderSlots; ++i) slots[i] = T(at[i]);
  const auto optics = OpticsFromSlots(scene.capture, slots);
  const std::vector<double> lights = StatedLightScales(scene.capture);
  std::vector<int> pixels(cast.pixels.size());
  std::iota(pixels.begin(), pixels.end(), 0);
  const std::vector<int> vertices = VerticesAround(*crown, cast, pixels);
  for (auto _ : state) {
    const DiffuserTable<T> table(optics.stack(), crown->kernel.outer_radius_mm);
    const ShaderPrediction<T> model(*crown, cast, optics, table, 1, lights, vertices, 1);
    for (const auto& pixel : cast.pixels) benchmark::DoNotOptimize(model.Pixel(pixel, {1.0, 0.0}));
  }
  state.counters["pixels/s"] =
      benchmark::Counter(static_cast<double>(cast.pixels.size() * state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(PredictOneChannel<double>)->Unit(benchmark::kMillisecond);
BENCHMARK(PredictOneChannel<ceres::Jet<double, kShaderSlots>>)->Unit(benchmark::kMillisecond);

/// One wavelength of a ceramic slab; the argument is the number of directions.
void SlabByAddingDoubling(benchmark::State& state) {
  Slab slab;
  slab.layers = {{1.54, 0.8, 0.0, 15.0, 0.03, 1.0}};
  const AddingDoublingOptions options{static_cast<int>(state.range(0))};
  for (auto _ : state) benchmark::DoNotOptimize(SolveByAddingDoubling(slab, options).value.reflectance_collimated);
}
BENCHMARK(SlabByAddingDoubling)->Arg(12)->Arg(16)->Arg(24)->Unit(benchmark::kMicrosecond);

/// The same for an instrument's reading and its derivatives by scattering, absorption, g, isotropic share and
/// thickness.
void ChangesOfASlab(benchmark::State& state) {
  Slab slab;
  slab.layers = {{1.54, 0.8, 0.1, 15.0, 0.03, 1.0}};
  std::vector<std::vector<SlabLayer>> changes;
  for (double SlabLayer::*number : {&SlabLayer::scattering_per_mm, &SlabLayer::absorption_per_mm, &SlabLayer::g,
                                    &SlabLayer::isotropic_fraction, &SlabLayer::thickness_mm}) {
    SlabLayer change{0, 0, 0, 0, 0, 0};
    change.*number = 1.0;
    changes.push_back({change});
  }
  const AddingDoublingOptions options{static_cast<int>(state.range(0))};
  for (auto _ : state) {
    benchmark::DoNotOptimize(ViewSlab(slab, {{1.0}}, MeasuredAt::k45_0, options)[0].reflectance);
    benchmark::DoNotOptimize(ViewSlabChanges(slab, {{1.0}}, MeasuredAt::k45_0, changes, options)[0][0].reflectance);
  }
}
BENCHMARK(ChangesOfASlab)->Arg(12)->Arg(16)->Arg(24)->Unit(benchmark::kMicrosecond);

void WalkTheToothSlab(benchmark::State& state) {
  // Peers' tooth case: 338 scatterings per photon; MCML traces 74,000 photons/s per core.
  Slab slab;
  slab.layers = {{1.63, 0.96, 0.0, 6.0, 0.03, 1.0}, {1.54, 0.93, 0.0, 28.0, 0.2, 2.0}};
  constexpr uint64_t kPhotons = 40000;
  for (auto _ : state)
    benchmark::DoNotOptimize(SolveByWalks(slab, {kPhotons, 1, 1}, [](double) {}).value.reflectance_collimated);
  state.counters["photons/s"] =
      benchmark::Counter(static_cast<double>(kPhotons * 5 / 4 * state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(WalkTheToothSlab)->Unit(benchmark::kMillisecond);

/// walks/s of one thread unless stated otherwise. `lanes` 0: one path after the other, one ray per flight.
void WalkACrown(benchmark::State& state, const TriangleMesh& crown, bool derivatives) {
  const KnownScene scene = SmoothIncisor(48, true, crown);
  const LayeredBody body(BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture)), 0);
  const Material material = StatedMaterial(scene.capture);
  PathOptions options{.paths_per_pixel = 90, .threads = static_cast<int>(state.range(1))};
  options.lanes = static_cast<int>(state.range(0));
  options.derivatives = derivatives;
  WalkCounters counters;
  for (auto _ : state)
    counters.Add(RenderByPaths(scene.capture, body, {}, material, 0, options, [](double) {}).counters);
  const double walks = static_cast<double>(counters.walks), flights = static_cast<double>(counters.flights);
  using Counter = benchmark::Counter;
  state.counters["walks/s"] = Counter(walks, Counter::kIsRate);
  state.counters["us/walk"] = Counter(1e-6 * walks, Counter::kIsRate | Counter::kInvert);
  state.counters["ns/flight"] = Counter(1e-9 * flights, Counter::kIsRate | Counter::kInvert);
  state.counters["flights/walk"] = flights / walks;
  state.counters["facet searches/flight"] = static_cast<double>(counters.searches) / flights;
}
void WalkTheIncisor(benchmark::State& state) { WalkACrown(state, Incisor(50), false); }
BENCHMARK(WalkTheIncisor)->Args({64, 1})->Args({64, 2})->Args({0, 1})->Unit(benchmark::kMillisecond)->UseRealTime();
void WalkTheIncisorWithDerivatives(benchmark::State& state) { WalkACrown(state, Incisor(50), true); }
BENCHMARK(WalkTheIncisorWithDerivatives)->Args({64, 1})->Unit(benchmark::kMillisecond)->UseRealTime();

void GridOfTheIncisor(benchmark::State& state) {
  const KnownScene scene = SmoothIncisor(48, true, Incisor(50));
  const auto surfaces = BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture));
  for (auto _ : state)
    benchmark::DoNotOptimize(LayeredBody(surfaces, static_cast<int>(state.range(0))).surfaces.size());
}
BENCHMARK(GridOfTheIncisor)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace crownfit

int main(int argc, char** argv) {
  using namespace crownfit;
  benchmark::Initialize(&argc, argv);
  const char* reference = std::getenv("CROWNFIT_REFERENCE");
  const std::filesystem::path crown = std::filesystem::path(reference ? reference : "../shared") /
                                      "data/real/teeth-photos-scan-smartee-case1/crowns-byFDI/FDI11.obj";
  if (std::filesystem::exists(crown)) {
    std::vector<std::string> messages;
    TriangleMesh mesh = ReadClosedSurface(crown, messages);
    const auto [low, high] = Bounds(mesh);
    for (glm::dvec3& v : mesh.vertices) v -= 0.5 * (low + high);
    benchmark::RegisterBenchmark("WalkScannedCrown11", [=](benchmark::State& state) { WalkACrown(state, mesh, false); })
        ->Args({64, 1})
        ->Args({0, 1})
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  } else {
    std::fprintf(stderr, "WalkScannedCrown11 left out: no %s\n", crown.c_str());
  }
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
