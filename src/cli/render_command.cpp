#include <cmath>
#include <cstdio>
#include <optional>

#include "base/error.h"
#include "base/random.h"
#include "cli/common_options.h"
#include "cli/named_photograph.h"
#include "optics/material_file.h"
#include "photo/figures.h"
#include "photo/image_io.h"
#include "render_photographs.h"

namespace crownfit {
namespace {

struct RenderCommand {
  std::filesystem::path capture, material, output;
  Model model = Model::kShader;
  int collisions = 10;
  Estimator estimator = Estimator::kCollisions;
  int paths = 256;         ///< per pixel
  std::string photograph;  ///< empty: all
  double noise = 0;        ///< relative
  double scale = 1;        ///< of the pictures' width and height
  bool derivatives = false, half_float = false, twelve_taps = false, fine = false;
  uint64_t seed = 1;
  CommonOptions common;
};

int RunRender(const RenderCommand& asked) {
  constexpr int kFewestForDerivatives = 16;
  if (asked.derivatives && (asked.model == Model::kShader || asked.paths < kFewestForDerivatives))
    throw InputError(
        "", "--derivatives",
        "derivatives need --model path or diffusion, and at least 16 --paths: their errors come from groups of paths");
  if (asked.half_float && asked.model != Model::kShader)
    throw InputError("", "--half",
                     "is for model shader alone: the variances of other models are too small for 16-bit floats");
  Progress progress(asked.common.progress);
  const Capture capture = ReadCapture(asked.capture);
  const Material material =
      asked.material.empty() ? StatedMaterial(capture) : ReadMaterialFile(asked.material, capture);
  RenderOptions options;
  options.model = asked.model;
  options.paths_per_pixel = asked.paths;
  options.collisions = asked.collisions;
  options.estimator = asked.estimator;
  options.twelve_taps = asked.twelve_taps;
  options.fine = asked.fine;
  options.seed = asked.seed;
  options.threads = asked.common.threads;
  options.derivatives = asked.derivatives;
  options.scale = asked.scale;
  options.photograph = NamedPhotograph(capture, asked.photograph);
  const auto messages = RenderPhotographs(capture, material, options, progress, [&](const RenderedPhotograph& r) {
    const PhotographSpec& photo = capture.photographs[r.photograph];
    Image picture = r.picture;
    const size_t channels = capture.channel_names.size();
    const std::vector<std::string> names = ChannelsInFile(capture);
    for (size_t k = 0; k < picture.values.size(); ++k) {
      const uint64_t key = Key(asked.seed, 0x6e6f697365ull, r.photograph, k / channels);
      picture.values[k] = static_cast<float>(picture.values[k] * (1.0 + asked.noise * Gaussian(key, k % channels)));
    }
    const auto file = asked.output / (photo.name + ".exr");
    if (r.variance) {
      Image variance = *r.variance;
      for (size_t k = 0; k < variance.values.size(); ++k)
        variance.values[k] += static_cast<float>(std::pow(asked.noise * r.picture.values[k], 2));
      WriteImageLayers(file, {{"", picture}, {"variance", variance}}, names);
    } else {
      WriteImageFile(file, picture, asked.half_float, names);
    }
    WriteImageFile(
        asked.output / (photo.name + ".png"),
        DisplayPicture(picture, ComparisonScale(picture, r.on_object, photo.rgb_from_sensor), photo.rgb_from_sensor));
    progress.Clear();
    std::printf("%s\n", file.c_str());
    if (r.derivatives.empty()) return;
    const auto beside = asked.output / (photo.name + "_derivatives.exr");
    WriteImageLayers(beside, r.derivatives, names);
    std::printf("%s\n", beside.c_str());
  });
  progress.Clear();
  PrintNotes(messages);
  return 0;
}

}  // namespace

void AddRender(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<RenderCommand>();
  auto* render = app.add_subcommand(
      "render", "Renders the photographs of a capture as a material predicts them (EXR, and PNG to look at).");
  render->footer(
      "Example:\n"
      "  crownfit render crown --material result/material.json --model path --photograph front -o pictures\n"
      "Writes pictures/front.exr (linear) and pictures/front.png.");
  render
      ->add_option("CAPTURE", asked->capture,
                   "Folder that holds capture.json, or that file. Its photographs need not exist.")
      ->required();
  render->add_option("--material", asked->material,
                     "material.json of a fit, or truth.json (default: the values that the capture states).");
  render->add_option("-o,--output", asked->output, "Folder for the pictures; it is created if missing.")->required();
  AddModel(render, asked->model, {Model::kShader, Model::kPath, Model::kDiffusion},
           "shader (default): the formulas of the viewer; seconds. path: path tracing, the reference, with a\n"
           "variance layer. diffusion: --collisions of random walks, then diffusion in the crown's\n"
           "volume: less noise.");
  AddCollisions(render, asked->collisions);
  render->add_option("--paths", asked->paths, "Paths per pixel of models path and diffusion (default 256).")
      ->check(CLI::Range(1, 100000000));
  render
      ->add_option("--estimator", asked->estimator,
                   "How paths of models path and diffusion find the lamps. collisions (default): at every collision,\n"
                   "from light that has not collided before; several times less noise, most of all from small lamps.\n"
                   "exits: where they leave the object, an independent check.")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, Estimator>{{"collisions", Estimator::kCollisions}, {"exits", Estimator::kExits}}));
  render->add_option("--photograph", asked->photograph, "Render only this photograph.");
  render
      ->add_option("--noise", asked->noise,
                   "Add relative noise of this standard deviation (0.01: 1 %), drawn with --seed.")
      ->check(CLI::Range(0.0, 1.0));
  render->add_flag("--derivatives", asked->derivatives,
                   "Models path and diffusion: also write PHOTOGRAPH_derivatives.exr, with derivatives with\n"
                   "respect to scattering, absorption, g, index and so on.");
  render->add_flag("--half", asked->half_float, "Write 16-bit EXR.");
  render->add_flag("--twelve-taps", asked->twelve_taps,
                   "Model shader: blur with the thesis's 1 + 12 taps instead of 49.");
  render->add_flag("--fine", asked->fine, "Model shader: four times as many light samples.");
  render
      ->add_option("--scale", asked->scale,
                   "Scale of the pictures relative to the camera's width and height (default 1).")
      ->check(CLI::Range(0.01, 1.0));
  render->add_option("--seed", asked->seed, "Seed of the noise and of the random walks (default 1).");
  AddCommonOptions(render, asked->common);
  RunWith(render, command, asked, RunRender);
}

}  // namespace crownfit
