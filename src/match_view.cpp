#include "match_view.h"

#include <algorithm>
#include <cmath>

#include "base/json_file.h"
#include "base/text.h"
#include "fit/choose_pixels.h"
#include "fit/compare_photographs.h"
#include "path/path_photograph.h"
#include "scene/cast_capture.h"
#include "studio_capture.h"

namespace crownfit {
namespace {

constexpr double kSeen = 0.05;  // share of a picture's brightness: smaller differences have little influence

bool IsChosen(size_t layer, const ParameterRow& row) {
  return layer < 2 && (row.quantity == Quantity::kReducedScattering || row.quantity == Quantity::kAbsorption);
}

/// The capture with the material's values. Only those that the shader may adapt for appearance are free.
Capture WithValues(Capture capture, const Material& material) {
  for (const ParameterRow& row : kParameters) {
    const auto quantity = static_cast<size_t>(row.quantity);
    for (size_t l = 0; l < capture.layers.size(); ++l) {
      ParameterSpec& spec = capture.layers[l].parameters[quantity];
      const bool stated = spec.stated;
      spec = DefaultSpec(row);
      spec.stated = stated;
      spec.value = material.layers[l].values[quantity];
      spec.fixed = !IsChosen(l, row);
      if (row.per_channel) spec.sharing = Sharing::kNone;
    }
    capture.surface[quantity].value = material.surface.values[quantity];
    capture.surface[quantity].fixed = true;
  }
  return capture;
}

/// The path-traced picture as a photograph with perceptual weights. A difference counts relative to the picture's
/// brightness to the power of 2/3, as lightness does, so dark pictures count as much as bright ones. Monte Carlo noise
/// does not enter the weights: a small lamp's picture would then count for nothing beside a dome's.
Photograph PhotographOf(const PathPhotograph& walked) {
  Photograph photo;
  const int channels = walked.pixels.empty() ? 1 : walked.pixels[0].mean.size();
  photo.linear = photo.variance = Image(walked.width, walked.height, channels);
  std::vector<double> greens;
  for (const PixelEstimate& pixel : walked.pixels)
    if (pixel.on_object) greens.push_back(pixel.mean.Middle());
  std::sort(greens.begin(), greens.end());
  const double bright = greens.empty() ? 1.0 : std::max(greens[greens.size() * 19 / 20], 1e-6);
  for (size_t p = 0; p < walked.pixels.size(); ++p) {
    const Spectrum& mean = walked.pixels[p].mean;
    const double weight_of = kSeen * bright * std::pow(std::max(mean.Middle() / bright, 0.01), 2.0 / 3.0);
    for (int c = 0; c < channels; ++c) {
      photo.linear.values[channels * p + c] = static_cast<float>(mean[c]);
      photo.variance.values[channels * p + c] = static_cast<float>(weight_of * weight_of);
    }
    photo.usable.push_back(walked.pixels[p].on_object);
  }
  return photo;
}

CrownInput Walk(const Capture& studio, const Material& material, CrownSource source, const MatchOptions& options,
                Progress& progress) {
  const LayeredBody body(BuildSurfaces(studio, source, ThicknessesOf(studio, material)), options.threads,
                         source.absorption);
  PathOptions path;
  path.paths_per_pixel = options.paths_per_pixel;
  path.seed = options.seed;
  path.threads = options.threads;
  CrownInput input{studio, {}, std::move(source), {}};
  for (size_t i = 0; i < studio.photographs.size(); ++i)
    input.photographs.push_back(PhotographOf(RenderByPaths(studio, body, {}, material, i, path, [&](double share) {
      progress.Show("walking: " + studio.photographs[i].name, share);
    })));
  return input;
}

std::vector<ColourDifference> Differences(const CrownInput& input, const CastState& state, const Material& material,
                                          const std::vector<FitPixels>& pixels, int threads) {
  std::vector<ColourDifference> differences;
  const LinearScales scales{{}, StatedLightScales(input.capture), {}};
  for (const PhotographResult& r : ComparePhotographs(
           input, state, PredictorByShader(input, state, material, scales, threads), scales, pixels, threads))
    differences.push_back(r.difference);
  return differences;
}

}  // namespace

ViewMatch MatchView(const Capture& capture, const Material& material, const MatchOptions& options, Progress& progress) {
  RequirePhotographs(capture);
  CheckShaderSupports(capture, material);
  progress.Show("reading", 0.0);
  CrownSource source = ReadCrownSource(capture, options.threads);
  const auto [low, high] = Bounds(*source.meshes[0]);
  const Capture studio = WithValues(StudioCapture(capture, low, high, options.pixels), material);
  const CrownInput input = Walk(studio, material, std::move(source), options, progress);

  const FreeParameters free = FreeParametersOf(studio);
  CastOptions cast_options;
  cast_options.threads = options.threads;
  const CastState state = CastAll(input, ThicknessesOf(studio, material), cast_options, progress);
  const auto pixels = ChoosePixels(input, state, static_cast<size_t>(options.pixels) * options.pixels);
  const CalibrationState exact;
  const ImageResiduals residuals(studio, state, free, pixels, exact, {1.0, options.threads});
  const SolveResult solved =
      Solve(residuals, free, StartVector(free), {.use_priors = false},
            [&](int iteration, double) { progress.Show("matching", 1.0 - std::exp(-0.15 * iteration)); });
  ViewMatch match{MaterialAt(free, solved.x), false, {}};
  const auto physical = Differences(input, state, material, pixels, options.threads);
  auto effective = Differences(input, state, match.effective, pixels, options.threads);
  const auto matched = [&](const std::vector<ColourDifference>& views) {
    double sum = 0;
    for (size_t i = 0; i < views.size(); ++i) sum += studio.photographs[i].is_holdout ? 0.0 : views[i].median;
    return sum;
  };
  if (match.keeps_physical = !(matched(effective) < matched(physical)); match.keeps_physical) {
    match.effective = material;
    effective = physical;
  }
  for (size_t i = 0; i < studio.photographs.size(); ++i)
    match.views.push_back({studio.photographs[i].name, studio.photographs[i].is_holdout, physical[i], effective[i]});
  return match;
}

std::string MatchSummary(const ViewMatch& match, const Material& material) {
  std::string text = "CIEDE2000 between model shader and model path (median / 95 %)\n";
  text += Printed("%-28s %16s %16s\n", "light", "physical", "effective");
  for (const auto& v : match.views) {
    text += Printed("%-28s %8.2f /%6.1f %8.2f /%6.1f%s\n", v.name.c_str(), v.physical.median, v.physical.p95,
                    v.effective.median, v.effective.p95, v.is_holdout ? "  held out" : "");
  }
  if (match.keeps_physical)
    text +=
        "\nNo effective values were found that match better, so the physical ones are kept. More --paths or --pixels "
        "may help.\n";
  text += "\neffective (physical) values\n";
  for (size_t l = 0; l < material.layers.size(); ++l)
    for (const ParameterRow& row : kParameters) {
      if (row.owner != Owner::kLayer || !IsChosen(l, row)) continue;
      const Spectrum &e = match.effective.layers[l][row.quantity], &p = material.layers[l][row.quantity];
      text += Printed("%-36s", (material.layers[l].name + "." + row.key).c_str());
      for (int c = 0; c < e.size(); ++c) text += Printed("%s %.4g (%.4g)", c > 0 ? "," : "", e[c], p[c]);
      text += std::string(" ") + row.unit + "\n";
    }
  return text;
}

std::string MaterialJsonWithMatch(const std::filesystem::path& material_file, const ViewMatch& match,
                                  const MatchOptions& options) {
  JsonValue::Array layers, lights;
  for (size_t l = 0; l < match.effective.layers.size(); ++l) {
    JsonValue::Object layer{{"name", match.effective.layers[l].name}};
    for (const ParameterRow& row : kParameters) {
      const Spectrum& values = match.effective.layers[l][row.quantity];
      if (row.owner == Owner::kLayer && IsChosen(l, row))
        layer.emplace_back(row.key, std::vector<double>(values.begin(), values.end()));
    }
    layers.push_back(layer);
  }
  for (const auto& v : match.views)
    lights.push_back(JsonValue::Object{{"name", v.name},
                                       {"use", v.is_holdout ? "holdout" : "match"},
                                       {"de00_median", v.effective.median},
                                       {"de00_p95", v.effective.p95},
                                       {"de00_median_physical", v.physical.median},
                                       {"de00_p95_physical", v.physical.p95}});
  const JsonValue viewer = JsonValue::Object{
      {"note", "effective parameters: with them the real-time shader looks like path tracing with the physical ones"},
      {"layers", layers},
      {"matched", JsonValue::Object{{"paths_per_pixel", options.paths_per_pixel},
                                    {"pixels", options.pixels},
                                    {"seed", static_cast<double>(options.seed)},
                                    {"lights", lights}}}};
  JsonFile file(material_file);
  auto& root = std::get<JsonValue::Object>(file.value.data);
  const auto found =
      std::find_if(root.begin(), root.end(), [](const auto& member) { return member.first == "viewer"; });
  if (found != root.end()) {
    found->second = viewer;
  } else {
    root.emplace_back("viewer", viewer);
  }
  return ToJsonText(file.value);
}

}  // namespace crownfit
