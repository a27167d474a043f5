#include "commands.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/random.h"
#include "base/text.h"
#include "exchange/material_file.h"
#include "fit_plan.h"
#include "fit_steps.h"
#include "fit_together.h"
#include "forward/predict.h"
#include "match_view.h"
#include "mesh_capture.h"
#include "optics/adding_doubling.h"
#include "optics/shader_slab.h"
#include "photo/image_io.h"
#include "render_photographs.h"
#include "report/figures.h"
#include "report/result_files.h"
#include "report/sections.h"
#include "report/summary.h"
#include "synthetic/synthesize.h"
#include "view_crown.h"
#include "view_window.h"
#include "walk/slab_diffusion.h"
#include "walk/slab_walk.h"

namespace crownfit {
namespace {

/// `name value unit` lines for people, or one JSON object.
class Figures {
 public:
  void Add(const std::string& name, double value, const std::string& unit) {
    json_.emplace_back(name, value);
    lines_ += Printed("%s %.6g %s\n", name.c_str(), value, unit.c_str());
  }
  void Print(bool json) const { std::fputs(json ? ToJsonText(JsonValue(json_)).c_str() : lines_.c_str(), stdout); }

 private:
  JsonValue::Object json_;
  std::string lines_;
};

void PrintMessages(const std::vector<std::string>& messages) {
  for (const auto& message : messages) std::fprintf(stderr, "note: %s\n", message.c_str());
}

/// Nothing when the name is empty.
std::optional<size_t> NamedPhotograph(const Capture& capture, const std::string& name) {
  if (name.empty()) return std::nullopt;
  std::string known;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    if (capture.photographs[i].name == name) return i;
    known += (known.empty() ? "" : ", ") + capture.photographs[i].name;
  }
  throw InputError(capture.file, "photographs", "there is no photograph called '" + name + "'",
                   "Known: " + known + ".");
}

/// What would take hours is refused: for adding-doubling many indices, each of which brings directions of its own; for
/// walks light that nothing absorbs. A way through a layer is 2 d n^2 long in the mean, whatever scatters (Blanco and
/// Fournier 2003), or some lengths of absorption.
void CheckSlabCanBeSolved(const std::filesystem::path& file, const Slab& slab, const std::string& model) {
  constexpr size_t kMostIndices = 8;
  constexpr double kMostCollisions = 1e6;  // of a photon: 20 ms
  std::set<double> indices{slab.ior_above, slab.backing_contact ? slab.ior_above : slab.ior_below};
  double collisions = 0;
  for (const SlabLayer& l : slab.layers) {
    indices.insert(l.ior);
    const double way_mm = 2 * l.thickness_mm * l.ior * l.ior, absorption = l.absorption_per_mm;
    collisions += l.scattering_per_mm * (absorption > 0 ? std::min(way_mm, 10 / absorption) : way_mm);
  }
  if (model == "layered" && indices.size() > kMostIndices)
    throw InputError(file, "layers", "they have " + std::to_string(indices.size()) + " different indices, more than 8",
                     "Use --model path, or round ior: every index brings directions of its own.");
  if (model == "path" && collisions > kMostCollisions)
    throw InputError(file, "layers", "a photon would scatter some " + std::to_string(collisions) + " times on its way",
                     "Use --model layered, which needs no more time for it.");
}

}  // namespace

int RunFit(const CommandLine& line) {
  const auto begin = std::chrono::steady_clock::now();
  Progress progress(line.progress);
  std::vector<Capture> captures;
  for (const auto& file : line.captures) captures.push_back(ReadCapture(file));
  MakeFolder(line.output);
  FitOptions options = line.fit;
  if (options.is_planned()) {
    options = WithPlan(options, PlanFit(captures, options, progress));
    progress.Clear();
    std::fprintf(stderr, "Plan: %s.\n", options.model_choice.c_str());
  }
  const std::vector<CrownFit> fits = FitTogether(captures, options, progress);
  const CrownFit fit = Joined(fits);
  progress.Clear();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  const RunRecord run{line.text, line.fit.threads, wall.count()};
  for (size_t i = 0; i < fit.together.size(); ++i)
    WriteResultWithPage(line, line.output / "captures" / fit.together[i].name, fits[i], run, progress);
  WriteResultWithPage(line, line.output, fit, run, progress);
  progress.Clear();
  PrintMessages(fit.messages);
  if (line.json) {
    std::fputs(MaterialJson(fit).c_str(), stdout);
  } else {
    std::fputs(Summary(fit).c_str(), stdout);
    std::printf("\nWritten: %s (report.html, material.json, run.json%s) in %.1f s\n", line.output.c_str(),
                fit.photographs.empty() ? "" : ", figures/", wall.count());
  }
  return fit.usable ? 0 : 1;
}

int RunRender(const CommandLine& line) {
  if (line.half_float && line.fit.model != "shader")
    throw InputError("", "--half",
                     "is for model shader: the variances of walks are smaller than what half floats hold");
  Progress progress(line.progress);
  const Capture capture = ReadCapture(line.capture);
  const Material material = line.material.empty() ? StatedMaterial(capture) : ReadMaterialFile(line.material, capture);
  RenderOptions options{line.fit.model,       {},        line.paths,    line.fit.collisions,
                        line.fit.twelve_taps, line.fine, line.fit.seed, line.fit.threads,
                        line.derivatives,     line.scale};
  options.photograph = NamedPhotograph(capture, line.photograph);
  const auto messages = RenderPhotographs(capture, material, options, progress, [&](const RenderedPhotograph& r) {
    const PhotographSpec& photo = capture.photographs[r.photograph];
    Image picture = r.picture;
    for (size_t k = 0; k < picture.values.size(); ++k) {
      const uint64_t key = Key(line.fit.seed, 0x6e6f697365ull, r.photograph, k / 3);
      picture.values[k] = static_cast<float>(picture.values[k] * (1.0 + line.noise * Gaussian(key, k % 3)));
    }
    const auto file = line.output / (photo.name + ".exr");
    if (r.variance) {
      Image variance = *r.variance;
      for (size_t k = 0; k < variance.values.size(); ++k)
        variance.values[k] += static_cast<float>(std::pow(line.noise * r.picture.values[k], 2));
      WriteImageLayers(file, {{"", picture}, {"variance", variance}});
    } else {
      WriteImageFile(file, picture, line.half_float);
    }
    WriteImageFile(
        line.output / (photo.name + ".png"),
        DisplayPicture(picture, ComparisonScale(picture, r.on_object, photo.rgb_from_sensor), photo.rgb_from_sensor));
    progress.Clear();
    std::printf("%s\n", file.c_str());
    if (r.derivatives.empty()) return;
    const auto beside = line.output / (photo.name + "_derivatives.exr");
    WriteImageLayers(beside, r.derivatives);
    std::printf("%s\n", beside.c_str());
  });
  progress.Clear();
  PrintMessages(messages);
  return 0;
}

int RunSlab(const CommandLine& line) {
  const auto begin = std::chrono::steady_clock::now();
  const Slab slab = ReadSlab(line.capture);
  CheckSlabCanBeSolved(line.capture, slab, line.fit.model);
  Progress progress(line.progress);
  const std::string& model = line.fit.model;
  const auto show = [&](double share) { progress.Show("walking", share); };
  if (!slab.radii_mm.empty() && model != "path")
    throw InputError(line.capture, "radii_mm", "model " + model + " answers totals, so it has no rings",
                     "Remove the key, or use --model path.");
  SlabAnswer answer;
  if (model == "layered") answer = SolveByAddingDoubling(slab);
  if (model == "shader") answer = SolveByShader(slab);
  if (model == "diffusion")
    answer = SolveByDiffusion(slab, {line.photons, line.fit.seed, line.fit.threads, line.fit.collisions}, show);
  if (model == "path") answer = SolveByWalks(slab, {line.photons, line.fit.seed, line.fit.threads}, show);
  progress.Clear();
  answer.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::fputs(SlabAnswerJson(answer).c_str(), stdout);
  return 0;
}

int RunSynthesize(const CommandLine& line) {
  Progress progress(line.progress);
  const Recipe recipe = ReadRecipe(line.capture);
  MakeFolder(line.output);
  const auto messages = Synthesize(recipe, line.output, line.fit.threads,
                                   [&](const std::string& stage, double share) { progress.Show(stage, share); });
  progress.Clear();
  PrintMessages(messages);
  std::printf("%s\n", (line.output / "capture.json").c_str());
  return 0;
}

int RunCompare(const CommandLine& line) {
  PhotographFiles a, b;
  a.image = line.image_a;
  b.image = line.image_b;
  if (!line.mask.empty()) a.mask = line.mask;
  const Photograph first = ReadPhotograph(a), second = ReadPhotograph(b);
  if (first.linear.width != second.linear.width || first.linear.height != second.linear.height)
    throw InputError(line.image_b, "", "has another size than " + line.image_a.filename().string());
  std::vector<uint8_t> mask(first.usable.size());
  for (size_t i = 0; i < mask.size(); ++i) {
    const auto lit = [&](const Image& image) {
      return image.values[3 * i] + image.values[3 * i + 1] + image.values[3 * i + 2] > 0;
    };
    mask[i] = first.usable[i] && (first.has_mask || lit(first.linear) || lit(second.linear));
  }
  const ColourDifference d = ComparePictures(first.linear, second.linear, mask);
  if (d.pixels == 0) throw InputError(line.image_a, "", "no pixel is left to compare", "Check the mask.");
  if (!line.output.empty()) WriteImageFile(line.output, DifferenceFigure(d));
  Figures figures;
  figures.Add("de00_median", d.median, "dE00");
  figures.Add("de00_p95", d.p95, "dE00");
  figures.Add("de00_mean", d.mean, "dE00");
  figures.Add("share_below_pt", d.share_below_pt, "1");
  figures.Add("share_below_at", d.share_below_at, "1");
  figures.Add("de00_median_pixel", d.pixel_median, "dE00");
  figures.Add("de00_p95_pixel", d.pixel_p95, "dE00");
  figures.Add("pixels", static_cast<double>(d.pixels), "1");
  figures.Print(line.json);
  return 0;
}

namespace {

std::optional<std::pair<int, int>> SizeOf(const std::string& text) {
  if (text.empty()) return std::nullopt;
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 1 || height < 1 || width > 16384 ||
      height > 16384)
    throw InputError("", "--size", "'" + text + "' is not a size", "Write WxH, such as 1920x1080.");
  return std::pair{width, height};
}

}  // namespace

int RunView(const CommandLine& line) {
  if (line.capture.empty() == line.meshes.empty())
    throw InputError("", "view", line.capture.empty() ? "no crown is given" : "--capture and --mesh are both given",
                     "Give either --capture CAPTURE or --mesh FILE (repeated, outermost layer first).");
  Progress progress(line.progress);
  const Capture capture = line.meshes.empty() ? ReadCapture(line.capture) : CaptureOfMeshes(line.meshes, line.material);
  MaterialRecord record = ReadMaterialRecord(line.material, capture);
  const std::string note = line.physical ? "" : EffectiveNote(record);
  if (record.effective && !line.physical) record.material = *record.effective;
  const size_t photograph = NamedPhotograph(capture, line.photograph).value_or(0);
  const auto size = SizeOf(line.size);
  if (!line.screenshot && line.benchmark_frames == 0) {
    ViewInWindow(
        capture, record,
        {line.material, photograph, size, line.save_to, line.print_layout, line.meshes.empty(), line.fit.threads, note},
        progress);
    return 0;
  }
  const ViewOptions options{photograph, size, line.screenshot, line.benchmark_frames, line.fit.threads};
  const std::string said = ViewCrown(capture, record.material, options, progress);
  std::fputs(said.c_str(), stdout);
  if (!note.empty()) std::printf("Shows %s.\n", note.c_str());
  if (const std::string left_out = WhatShaderLeavesOut(capture); !left_out.empty()) PrintMessages({left_out});
  if (line.screenshot) std::printf("%s\n", line.screenshot->c_str());
  return 0;
}

int RunMatch(const CommandLine& line) {
  Progress progress(line.progress);
  const Capture capture = ReadCapture(line.capture);
  const Material material = ReadMaterialFile(line.material, capture);
  const MatchOptions options{line.paths, line.pixels, line.fit.seed, line.fit.threads};
  const ViewMatch match = MatchView(capture, material, options, progress);
  progress.Clear();
  WriteTextFile(line.output, MaterialJsonWithMatch(line.material, match, options));
  std::printf("%s\n%s\n", MatchSummary(match, material).c_str(), line.output.c_str());
  return 0;
}

}  // namespace crownfit
