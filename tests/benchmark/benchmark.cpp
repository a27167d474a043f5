// What a fit spends its time on. ./dev bench; docs/validation.md has the figures.

#include <benchmark/benchmark.h>
#include <ceres/jet.h>

#include "forward/predict.h"
#include "geometry/signed_distance.h"
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
  const std::array<double, kShaderSlots> at{0.3, 0.02, 1.0, 1.63, 2.0, 0.07, 1.0, 1.54, 0.9, 0.25};
  std::array<T, kShaderSlots> slots;
  for (int i = 0; i < kShaderSlots; ++i) slots[i] = T(at[i]);
  const auto optics = OpticsFromSlots(scene.capture, slots);
  const std::vector<double> lights = StatedLightScales(scene.capture);
  for (auto _ : state) {
    const DiffuserTable<T> table(optics.diffuser(), cast.kernel.outer_radius_mm);
    const ShaderPrediction<T> model(*crown, cast, optics, table, 1, lights, 1);
    for (const auto& pixel : cast.pixels) benchmark::DoNotOptimize(model.Pixel(pixel, 1.0));
  }
  state.counters["pixels/s"] =
      benchmark::Counter(static_cast<double>(cast.pixels.size() * state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(PredictOneChannel<double>)->Unit(benchmark::kMillisecond);
BENCHMARK(PredictOneChannel<ceres::Jet<double, kShaderSlots>>)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace crownfit

BENCHMARK_MAIN();
