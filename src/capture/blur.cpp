#include "capture/blur.h"

#include <algorithm>
#include <cmath>

#include "base/json_file.h"
#include "base/parallel.h"

namespace crownfit {
namespace {

Image Convolved(const Image& image, const PsfKernel& kernel, bool squared, int threads) {
  Image out = image;
  const int r = kernel.radius;
  ParallelFor(image.height, threads, [&](size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < image.channels; ++c) {
        double sum = 0;
        for (int dy = -r; dy <= r; ++dy)
          for (int dx = -r; dx <= r; ++dx) {
            const double w = kernel.at(dx, dy);
            sum += (squared ? w * w : w) *
                   image.at(std::clamp(x + dx, 0, image.width - 1), std::clamp(y + dy, 0, image.height - 1), c);
          }
        out.at(x, y, c) = static_cast<float>(sum);
      }
  });
  return out;
}

}  // namespace

Blur ReadBlur(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root =
      file.RootOfFormat("crownfit-blur/1", {"psf", "veiling_glare", "stddev", "quality", "provenance"});
  Blur blur;
  double total = 0;
  const JsonNode psf = root.Require("psf");
  for (const JsonNode& node : psf.Items()) {
    const JsonObject gaussian(node, {"sigma_px", "weight"});
    blur.psf.push_back({gaussian.Require("sigma_px").Number(0.0, 50.0), gaussian.Require("weight").Number(0.0, 1.0)});
    total += blur.psf.back().weight;
  }
  if (std::abs(total - 1.0) > 1e-3) psf.Fail("the weights add up to " + std::to_string(total) + ", expected 1");
  if (const auto glare = root.Find("veiling_glare")) blur.veiling_glare = glare->Number(0.0, 0.9);
  return blur;
}

PsfKernel KernelOf(const Blur& blur) {
  PsfKernel kernel;
  for (const auto& g : blur.psf)
    if (g.weight > 1e-3) kernel.radius = std::max(kernel.radius, static_cast<int>(std::ceil(3.7 * g.sigma_px)));
  const int width = 2 * kernel.radius + 1;
  std::vector<double> sum(static_cast<size_t>(width) * width, 0.0);
  for (const auto& g : blur.psf) {
    std::vector<double> line(width, 0.0);
    const double t = g.sigma_px * g.sigma_px;
    double total = 0;
    for (int i = -kernel.radius; i <= kernel.radius; ++i)
      total += line[i + kernel.radius] = std::exp(-t) * std::cyl_bessel_i(static_cast<double>(std::abs(i)), t);
    for (int y = 0; y < width; ++y)
      for (int x = 0; x < width; ++x)
        sum[static_cast<size_t>(y) * width + x] += g.weight * line[x] * line[y] / (total * total);
  }
  double total = 0;
  for (double w : sum) total += w;
  for (double w : sum) kernel.weights.push_back(static_cast<float>(w / total));
  return kernel;
}

Image Seen(const Image& sharp, const Blur& blur, int threads) {
  Image seen = Convolved(sharp, KernelOf(blur), false, threads);
  std::vector<double> mean(sharp.channels, 0.0);
  const double pixels = static_cast<double>(sharp.width) * sharp.height;
  for (size_t i = 0; i < sharp.values.size(); ++i) mean[i % sharp.channels] += sharp.values[i] / pixels;
  for (size_t i = 0; i < seen.values.size(); ++i)
    seen.values[i] += static_cast<float>(blur.veiling_glare * (mean[i % sharp.channels] - seen.values[i]));
  return seen;
}

Image SeenVariance(const Image& variance, const Blur& blur, int threads) {
  Image seen = Convolved(variance, KernelOf(blur), true, threads);
  const double kept = 1.0 - blur.veiling_glare;
  for (float& v : seen.values) v *= static_cast<float>(kept * kept);
  return seen;
}

}  // namespace crownfit
