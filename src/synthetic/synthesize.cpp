#include "synthetic/synthesize.h"

#include <cmath>

#include "base/files.h"
#include "base/random.h"
#include "base/text.h"
#include "path/path_photograph.h"
#include "photo/image_io.h"
#include "scene/cast_photograph.h"
#include "scene/cast_samples.h"
#include "scene/crown_source.h"
#include "synthetic/capture_writer.h"

namespace crownfit {
namespace {

JsonValue TruthOf(const Recipe& recipe, const Material& material, const std::vector<double>& exposure_errors) {
  const auto values = [](const ParameterRow& row, const Material::Layer& owner) -> JsonValue {
    const Spectrum& v = owner[row.quantity];
    if (!row.per_channel) return v[0];
    return v.list();
  };
  JsonValue::Array layers, channels;
  for (size_t l = 0; l < material.layers.size(); ++l) {
    JsonValue::Object layer{{"name", material.layers[l].name}};
    for (const auto& row : kParameters)
      if (row.owner == Owner::kLayer && recipe.capture.layers[l][row.quantity].stated)
        layer.emplace_back(row.key, values(row, material.layers[l]));
    layers.emplace_back(layer);
  }
  JsonValue::Object surface;
  for (const auto& row : kParameters)
    if (IsOfSurface(recipe.capture, row)) surface.emplace_back(row.key, values(row, material.surface));
  for (size_t c = 0; c < recipe.capture.channel_names.size(); ++c)
    channels.emplace_back(JsonValue::Object{{"name", recipe.capture.channel_names[c]},
                                            {"wavelength_nm", recipe.capture.wavelengths_nm[c]}});
  return JsonValue::Object{{"format", "crownfit-material/1"},
                           {"model", "path"},
                           {"channels", channels},
                           {"layers", layers},
                           {"surface", surface},
                           {"provenance", JsonValue::Object{{"seed", static_cast<double>(recipe.seed)},
                                                            {"paths_per_pixel", recipe.paths_per_pixel},
                                                            {"recorded_over_stated_exposure", exposure_errors}}}};
}

}  // namespace

std::vector<std::string> Synthesize(const Recipe& recipe, const std::filesystem::path& folder, int threads,
                                    const std::function<void(const std::string&, double)>& progress) {
  const Capture& capture = recipe.capture;
  progress("reading", 0.0);
  const CrownSource source = ReadCrownSource(capture, threads);
  const auto scenery = ReadScenery(capture);
  const LayeredBody body(BuildSurfaces(capture, source, StatedThicknesses(capture)), threads, source.absorption);
  const Material material = StatedMaterial(capture);
  const JsonValue stated = PrepareCapture(recipe, folder);

  PathOptions options;
  options.paths_per_pixel = recipe.paths_per_pixel;
  options.seed = recipe.seed;
  options.stream = kSynthesisStream;
  options.threads = threads;
  std::vector<std::string> messages = source.messages;
  std::vector<double> exposure_errors;
  WalkCounters counters;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const PhotographSpec& spec = capture.photographs[i];
    const PathPhotograph photo = RenderByPaths(capture, body, scenery, material, i, options,
                                               [&](double share) { progress("walking " + spec.name, share); });
    counters.Add(photo.counters);
    const auto walk_covariance = SmoothedCovariance(photo);
    const int channels = capture.channels();
    const auto walk_variance = [&](size_t p, int c) { return walk_covariance[p][PairOf(c, c, channels)]; };
    exposure_errors.push_back(ExposureError(recipe, i));
    const double exposure = spec.exposure_scale * exposure_errors.back();
    Image picture(photo.width, photo.height, channels), variance = picture;
    double noise2 = 0, light = 0, on_object = 0;
    for (size_t p = 0; p < photo.pixels.size(); ++p)
      for (int c = 0; c < channels; ++c) {
        const double value = exposure * photo.pixels[p].mean[c];
        const double sensor = std::pow(recipe.noise_relative * value, 2) + std::pow(recipe.noise_floor, 2);
        const uint64_t key = Key(recipe.seed, kSynthesisStream, 4, i, p);
        picture.values[channels * p + c] = static_cast<float>(value + std::sqrt(sensor) * Gaussian(key, c));
        variance.values[channels * p + c] = static_cast<float>(sensor + exposure * exposure * walk_variance(p, c));
        if (photo.pixels[p].on_object && c == channels / 2) {
          noise2 += walk_variance(p, c);
          light += photo.pixels[p].mean[c];
          ++on_object;
        }
      }
    WriteImageFile(folder / "photos" / (spec.name + ".exr"), picture, false, ChannelsInFile(capture));
    WriteImageFile(folder / "photos" / (spec.name + "_variance.exr"), variance, false, ChannelsInFile(capture));
    messages.push_back(Printed("%s: Monte Carlo noise %.1f %% of the mean pixel (middle channel, rms over the object)",
                               spec.name.c_str(), 100.0 * std::sqrt(noise2 * on_object) / std::max(light, 1e-12)));
  }
  messages.push_back(LossesInWords(counters));
  WriteTextFile(folder / "capture.json", ToJsonText(stated));
  WriteTextFile(folder / "truth.json", ToJsonText(TruthOf(recipe, material, exposure_errors)));
  return messages;
}

}  // namespace crownfit
