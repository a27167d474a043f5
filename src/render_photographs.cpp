#include "render_photographs.h"

#include <algorithm>
#include <cmath>

#include "fit/compare_photographs.h"
#include "path/path_derivatives.h"
#include "path/path_photograph.h"
#include "scene/cast_capture.h"
#include "shader/predict.h"
#include "shader/twelve_taps.h"

namespace crownfit {
namespace {

using Done = std::function<void(const RenderedPhotograph&)>;

std::vector<std::string> RenderByShader(const CrownInput& input, const Material& material, const RenderOptions& options,
                                        Progress& progress, const Done& done) {
  const Capture& capture = input.capture;
  CheckShaderSupports(capture, material);
  CastOptions cast_options;
  cast_options.threads = options.threads;
  if (options.twelve_taps) cast_options.crown.kernel = TwelveTapKernel();
  cast_options.shade_scenery = true;
  if (options.fine) {
    cast_options.strata *= 2;
    cast_options.gather_strata *= 2;
  }
  const CastState state = CastAll(input, ThicknessesOf(capture, material), cast_options, progress, options.photograph);
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    if (options.photograph && *options.photograph != i) continue;
    const PhotographSpec& photo = capture.photographs[i];
    const PhotographCast& cast = state.photographs[i];
    const auto values = PredictPixels(capture, state, i, material, StatedLightScales(capture), options.threads);
    RenderedPhotograph r{i, Image(photo.camera.width, photo.camera.height, capture.channels()), {}, {}, {}};
    r.on_object.resize(r.picture.values.size() / r.picture.channels);
    const auto put = [&](int x, int y, const Spectrum& value) {
      for (int c = 0; c < r.picture.channels; ++c)
        r.picture.at(x, y, c) = static_cast<float>(photo.exposure_scale * value[c]);
    };
    for (size_t k = 0; k < values.size(); ++k) {
      put(cast.pixels[k].x, cast.pixels[k].y, values[k]);
      r.on_object[static_cast<size_t>(cast.pixels[k].y) * photo.camera.width + cast.pixels[k].x] = 1;
    }
    for (const auto& b : cast.background) put(b.x, b.y, b.value);
    if (photo.blur) r.picture = Seen(r.picture, *photo.blur, options.threads);
    done(r);
  }
  const std::string left_out = WhatShaderLeavesOut(capture);
  return left_out.empty() ? std::vector<std::string>{} : std::vector{left_out};
}

std::vector<ImageLayer> DerivativeLayers(const DifferentiatedPhotograph& d, const PhotographSpec& photo,
                                         const Material& material, int threads) {
  std::vector<ImageLayer> layers;
  const PooledDerivatives& derivatives = d.derivatives;
  for (size_t j = 0; j < derivatives.parameters().size(); ++j) {
    const int channels = derivatives.channels();
    Image slope(d.photo.width, d.photo.height, channels), stddev(d.photo.width, d.photo.height, channels);
    for (size_t p = 0; p < d.photo.pixels.size(); ++p)
      for (int c = 0; c < channels; ++c) {
        const PooledDerivatives::OfPixel of_pixel = derivatives.DerivativeOf(j, c, p);
        slope.values[channels * p + c] = static_cast<float>(photo.exposure_scale * of_pixel.value);
        stddev.values[channels * p + c] = static_cast<float>(photo.exposure_scale * of_pixel.stddev);
      }
    if (photo.blur) {  // a polynomial's errors are correlated over more pixels than the blur spreads light
      slope = Seen(slope, *photo.blur, threads);
      stddev = Seen(stddev, *photo.blur, threads);
    }
    const std::string name = NameOf(derivatives.parameters()[j], material);
    layers.push_back({name, std::move(slope)});
    layers.push_back({name + ".stddev", std::move(stddev)});
  }
  return layers;
}

std::vector<std::string> RenderByPath(const CrownInput& input, const Material& material, const RenderOptions& options,
                                      Progress& progress, const Done& done) {
  const Capture& capture = input.capture;
  Bodies bodies(input, options.threads);
  PathOptions path;
  path.paths_per_pixel = options.paths_per_pixel;
  path.seed = options.seed;
  path.threads = options.threads;
  path.collisions = options.collisions;
  path.estimator = options.estimator;
  if (options.model == Model::kDiffusion) path.lattice = &bodies.LatticeOf(material);
  WalkCounters counters;
  std::vector<std::string> notes;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    if (options.photograph && *options.photograph != i) continue;
    const PhotographSpec& photo = capture.photographs[i];
    std::vector<ImageLayer> derivatives;
    const PathPhotograph rendered = [&] {
      if (!options.derivatives)
        return RenderByPaths(capture, bodies.Of(material), input.scenery, material, i, path,
                             [&](double share) { progress.Show("walking " + photo.name, share); });
      DifferentiatedPhotograph d =
          std::move(DifferentiateByPaths(input, bodies, material, {i}, path, DifferencedParameters(capture),
                                         "walking " + photo.name, progress)
                        .front());
      derivatives = DerivativeLayers(d, photo, material, options.threads);
      return std::move(d.photo);
    }();
    counters.Add(rendered.counters);
    if (rendered.estimator != path.estimator)
      notes.push_back(
          "photograph " + photo.name +
          ": scattering is too strong for the object's size to find lamps at collisions. Its paths looked for "
          "lamps where they leave the object, with more noise.");
    const Image black(rendered.width, rendered.height, capture.channels());
    RenderedPhotograph r{i, black, black, std::move(derivatives), {}};
    for (size_t p = 0; p < rendered.pixels.size(); ++p) {
      const PixelEstimate& e = rendered.pixels[p];
      const Spectrum mean = photo.exposure_scale * e.mean,
                     variance = photo.exposure_scale * photo.exposure_scale * e.variance();
      for (int c = 0; c < black.channels; ++c) {
        r.picture.values[black.channels * p + c] = static_cast<float>(mean[c]);
        r.variance->values[black.channels * p + c] = static_cast<float>(variance[c]);
      }
      r.on_object.push_back(e.on_object);
    }
    if (photo.blur) {
      r.picture = Seen(r.picture, *photo.blur, options.threads);
      r.variance = SeenVariance(*r.variance, *photo.blur, options.threads);
    }
    done(r);
  }
  notes.push_back(LossesInWords(counters));
  return notes;
}

/// The capture with larger pixels in all cameras.
Capture AtScale(Capture capture, double scale) {
  for (PhotographSpec& photo : capture.photographs) {
    Camera& camera = photo.camera;
    const int width = std::max(1, static_cast<int>(std::lround(scale * camera.width))),
              height = std::max(1, static_cast<int>(std::lround(scale * camera.height)));
    const double across = static_cast<double>(width) / camera.width, down = static_cast<double>(height) / camera.height;
    camera = WithPixels(camera, width, height, 1.0 / across, 1.0 / down);
    if (photo.blur)
      for (auto& gaussian : photo.blur->psf) gaussian.sigma_px *= scale;
  }
  return capture;
}

}  // namespace

std::vector<std::string> RenderPhotographs(const Capture& capture, const Material& material,
                                           const RenderOptions& options, Progress& progress, const Done& done) {
  progress.Show("reading", 0.0);
  const CrownInput input = ReadInput(AtScale(capture, options.scale), options.threads, /*with_images=*/false);
  std::vector<std::string> messages = options.model == Model::kShader
                                          ? RenderByShader(input, material, options, progress, done)
                                          : RenderByPath(input, material, options, progress, done);
  messages.insert(messages.begin(), input.source.messages.begin(), input.source.messages.end());
  return messages;
}

}  // namespace crownfit
