#pragma once
// blur.json ("crownfit-blur/1"): what the lens makes of a sharp picture.

#include <filesystem>
#include <vector>

#include "photo/image.h"

namespace crownfit {

/// A sum of Gaussians, applied to pixels that are averages over their squares, and a fraction of all light that is
/// spread evenly over the picture.
struct Blur {
  struct Gaussian {
    double sigma_px, weight;
  };
  std::vector<Gaussian> psf;  ///< weights add up to 1
  double veiling_glare = 0;
};

Blur ReadBlur(const std::filesystem::path& file);

/// The point spread on pixels, 2 radius + 1 wide, adding up to 1: discrete Gaussians (Lindeberg 1990), whose variance
/// is sigma^2 at any sigma. Less than one thousandth lies outside.
struct PsfKernel {
  int radius = 0;
  std::vector<float> weights;
  float at(int dx, int dy) const { return weights[static_cast<size_t>(dy + radius) * (2 * radius + 1) + dx + radius]; }
};
PsfKernel KernelOf(const Blur& blur);

/// The blurred picture; borders are repeated.
Image Seen(const Image& sharp, const Blur& blur, int threads);

/// Variance of a blurred picture whose sharp pixels have independent errors.
Image SeenVariance(const Image& variance, const Blur& blur, int threads);

}  // namespace crownfit
