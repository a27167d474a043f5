#include <algorithm>
#include <chrono>
#include <cstdio>
#include <set>

#include "base/error.h"
#include "cli/common_options.h"
#include "optics/adding_doubling.h"
#include "path/slab_diffusion.h"
#include "path/slab_walk.h"
#include "shader/shader_slab.h"

namespace crownfit {
namespace {

struct SlabCommand {
  std::filesystem::path slab;
  Model model = Model::kLayered;
  uint64_t photons = 1000000;  ///< models path and diffusion
  uint64_t seed = 1;
  int collisions = 10;
  CommonOptions common;
};

/// Refuses what would take hours. For adding-doubling that is many indices, as each adds its own directions. For random
/// walks it is light that nothing absorbs. The mean path length through a layer is 2 d n^2, whatever scatters (Blanco
/// and Fournier 2003), or a few absorption lengths.
void CheckSlabCanBeSolved(const std::filesystem::path& file, const Slab& slab, Model model) {
  constexpr size_t kMostIndices = 8;
  constexpr double kMostCollisions = 1e6;  // of a photon: 20 ms
  std::set<double> indices{slab.ior_above, slab.backing_contact ? slab.ior_above : slab.ior_below};
  double collisions = 0;
  for (const SlabLayer& l : slab.layers) {
    indices.insert(l.ior);
    const double way_mm = 2 * l.thickness_mm * l.ior * l.ior, absorption = l.absorption_per_mm;
    collisions += l.scattering_per_mm * (absorption > 0 ? std::min(way_mm, 10 / absorption) : way_mm);
  }
  if (model == Model::kLayered && indices.size() > kMostIndices)
    throw InputError(file, "layers", "they have " + std::to_string(indices.size()) + " different indices, more than 8",
                     "Use --model path, or round ior: every index adds its own directions to the computation.");
  if (model == Model::kPath && collisions > kMostCollisions)
    throw InputError(file, "layers", "a photon would scatter about " + std::to_string(collisions) + " times on its way",
                     "Use --model layered: its time does not depend on the scattering.");
}

int RunSlab(const SlabCommand& asked) {
  const auto begin = std::chrono::steady_clock::now();
  const Slab slab = ReadSlab(asked.slab);
  CheckSlabCanBeSolved(asked.slab, slab, asked.model);
  Progress progress(asked.common.progress);
  const Model model = asked.model;
  const auto show = [&](double share) { progress.Show("walking", share); };
  if (!slab.radii_mm.empty() && model != Model::kPath)
    throw InputError(asked.slab, "radii_mm", "model " + std::string(Word(model)) + " computes totals only, no rings",
                     "Remove the key, or use --model path.");
  SlabAnswer answer;
  if (model == Model::kLayered) answer = SolveByAddingDoubling(slab);
  if (model == Model::kShader) answer = SolveByShader(slab);
  if (model == Model::kDiffusion)
    answer = SolveByDiffusion(slab, {asked.photons, asked.seed, asked.common.threads, asked.collisions}, show);
  if (model == Model::kPath) answer = SolveByWalks(slab, {asked.photons, asked.seed, asked.common.threads}, show);
  progress.Clear();
  answer.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::fputs(SlabAnswerJson(answer).c_str(), stdout);
  return 0;
}

}  // namespace

void AddSlab(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<SlabCommand>();
  auto* slab = app.add_subcommand("slab", "Computes reflectance and transmittance of a flat layered sample, as JSON.");
  slab->footer(
      "Example:\n"
      "  crownfit slab slab.json\n"
      "where slab.json is\n"
      "  {\"format\": \"crownfit-slab/1\", \"layers\": [{\"ior\": 1.54, \"g\": 0.8, \"scattering_per_mm\": 10,\n"
      "   \"absorption_per_mm\": 0.1, \"thickness_mm\": 1}]}\n"
      "The answer holds shares of the incident light, such as \"reflectance_collimated\".");
  slab->add_option("SLAB", asked->slab, "slab.json (docs/file_formats.md).")->required();
  AddModel(slab, asked->model, {Model::kLayered, Model::kPath, Model::kShader, Model::kDiffusion},
           "layered (default): adding-doubling, exact; milliseconds. path: random walks, with standard\n"
           "errors and rings. shader, diffusion: what these crown models predict for the sample.");
  slab->add_option("--photons", asked->photons,
                   "Models path and diffusion: photons at normal incidence (default 1000000). A quarter as many\n"
                   "arrive diffusely.")
      ->check(CLI::Range(uint64_t{2}, uint64_t{1000000000000}));
  slab->add_option("--seed", asked->seed, "Models path and diffusion: seed of the random numbers (default 1).");
  AddCollisions(slab, asked->collisions);
  AddCommonOptions(slab, asked->common);
  RunWith(slab, command, asked, RunSlab);
}

}  // namespace crownfit
