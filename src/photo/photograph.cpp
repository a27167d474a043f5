#include "photo/photograph.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/json_file.h"
#include "photo/image_io.h"

namespace crownfit {
namespace {

void RequireSize(const Image& image, const Image& wanted, const std::filesystem::path& file,
                 const std::filesystem::path& photo) {
  if (image.width == wanted.width && image.height == wanted.height) return;
  throw InputError(file, "",
                   "is " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels, but " +
                       photo.filename().string() + " is " + std::to_string(wanted.width) + " x " +
                       std::to_string(wanted.height));
}

Image ThreeChannels(Image image, const std::filesystem::path& file) {
  if (image.channels == 3) return image;
  if (image.channels == 2)
    throw InputError(file, "", "the image has 2 channels, expected 3 (or 1 grey, or 4 with alpha)");
  Image rgb(image.width, image.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) rgb.at(x, y, c) = image.at(x, y, image.channels == 1 ? 0 : c);
  return rgb;
}

}  // namespace

double LinearFromSrgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }

double SrgbFromLinear(double v) {
  v = std::clamp(v, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

SensorNoise ReadSensorNoise(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root = file.RootOfFormat(
      "crownfit-noise/1", {"gain", "read_noise", "black", "saturation", "stddev", "quality", "provenance"});
  SensorNoise noise;
  noise.relative = 0.0;
  const auto channels = [&](const char* key, std::array<double, 3>& out) {
    if (const auto node = root.Find(key)) {
      const std::vector<double> values = node->IsNumber() ? std::vector<double>(3, node->Number()) : node->Numbers(3);
      for (int c = 0; c < 3; ++c) {
        if (values[c] < 0 && key != std::string("black")) node->Fail("must not be negative");
        out[c] = values[c];
      }
    }
  };
  root.Require("gain");
  root.Require("read_noise");
  channels("gain", noise.gain);
  channels("read_noise", noise.read_noise);
  channels("black", noise.black);
  std::array<double, 3> saturation{0, 0, 0};
  channels("saturation", saturation);
  for (int c = 0; c < 3; ++c) {
    if (saturation[c] > 0) noise.saturation[c] = saturation[c];
    if (noise.gain[c] == 0 && noise.read_noise[c] == 0)
      throw InputError(path, "read_noise", "gain and read_noise are both 0 in one channel",
                       "State the read noise: a value without noise would get infinite weight.");
  }
  return noise;
}

Photograph ReadPhotograph(const PhotographFiles& files) {
  ImageFile file = ReadImageFile(files.image);
  Photograph photo;
  photo.linear = ThreeChannels(std::move(file.image), files.image);
  photo.was_srgb_encoded = file.is_srgb_encoded;
  photo.was_jpeg = file.is_jpeg;
  photo.has_ignored_profile = file.has_colour_profile && file.is_integer && !file.is_srgb_encoded;
  photo.white_balance = file.white_balance;
  const size_t pixels = static_cast<size_t>(photo.linear.width) * photo.linear.height;
  photo.usable.assign(pixels, 1);
  if (files.mask) {
    const Image mask = ReadImageFile(*files.mask).image;
    RequireSize(mask, photo.linear, *files.mask, files.image);
    for (size_t i = 0; i < pixels; ++i) photo.usable[i] = mask.values[i * mask.channels] > 0.5f;
    photo.has_mask = true;
  }
  Image stated_variance;
  if (files.variance) {
    stated_variance = ThreeChannels(ReadImageFile(*files.variance).image, *files.variance);
    RequireSize(stated_variance, photo.linear, *files.variance, files.image);
  }

  // 8-bit values carry a quantisation error: half a step, uniformly distributed, times the decoding's slope.
  constexpr double kStep = 1.0 / 255.0;
  photo.variance = Image(photo.linear.width, photo.linear.height, 3);
  for (size_t i = 0; i < pixels; ++i) {
    bool saturated = false;
    for (int c = 0; c < 3; ++c) {
      const double stored = photo.linear.values[3 * i + c];
      double value = stored, rounding = 0.0;
      if (file.is_srgb_encoded) {
        value = LinearFromSrgb(stored);
        const double slope = (LinearFromSrgb(stored + 0.5 * kStep) - LinearFromSrgb(stored - 0.5 * kStep)) / kStep;
        rounding = kStep * kStep / 12.0 * slope * slope;
      }
      const std::optional<double> limit = files.saturation            ? files.saturation
                                          : files.noise.saturation[c] ? files.noise.saturation[c]
                                          : file.is_integer           ? std::optional<double>(0.995)
                                                                      : std::nullopt;
      saturated |= limit && value >= *limit;
      value -= files.noise.black[c];
      const double signal = std::max(0.0, value), relative = files.noise.relative * signal;
      const double read = files.noise.read_noise[c];
      double variance = files.noise.gain[c] * signal + read * read + relative * relative + rounding;
      if (files.variance) {
        variance = stated_variance.values[3 * i + c];
        if (!(variance > 0.0) && photo.usable[i])
          throw InputError(*files.variance, "",
                           "holds a variance that is not greater than 0 at pixel " +
                               std::to_string(i % photo.linear.width) + ", " + std::to_string(i / photo.linear.width));
      }
      photo.linear.values[3 * i + c] = static_cast<float>(value);
      photo.variance.values[3 * i + c] = static_cast<float>(variance);
    }
    photo.saturated_pixels += saturated && photo.usable[i];
    if (saturated) photo.usable[i] = 0;
  }
  return photo;
}

Photograph Averaged(Photograph photo, int side, bool noise_is_known) {
  const Image linear = std::move(photo.linear), variances = std::move(photo.variance);
  const std::vector<uint8_t> usable = std::move(photo.usable);
  const int width = linear.width / side, height = linear.height / side;
  Photograph mean = std::move(photo);
  mean.linear = mean.variance = Image(width, height, 3);
  mean.usable.assign(static_cast<size_t>(width) * height, 1);
  const double n = static_cast<double>(side) * side, of_variance = noise_is_known ? n * n : n;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      glm::dvec3 value(0.0), variance(0.0);
      for (int v = y * side; v < (y + 1) * side; ++v)
        for (int u = x * side; u < (x + 1) * side; ++u) {
          for (int c = 0; c < 3; ++c) value[c] += linear.at(u, v, c), variance[c] += variances.at(u, v, c);
          if (!usable[static_cast<size_t>(v) * linear.width + u]) mean.usable[static_cast<size_t>(y) * width + x] = 0;
        }
      for (int c = 0; c < 3; ++c) {
        mean.linear.at(x, y, c) = static_cast<float>(value[c] / n);
        mean.variance.at(x, y, c) = static_cast<float>(variance[c] / of_variance);
      }
    }
  return mean;
}

}  // namespace crownfit
