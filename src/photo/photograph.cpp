#include "photo/photograph.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/json_file.h"
#include "base/text.h"
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

/// The picture's first `channels` planes, without alpha; one grey plane stands for each of them.
Image Planes(Image image, int channels, const std::filesystem::path& file) {
  if (image.channels == channels) return image;
  if (image.channels != 1 && image.channels != channels + 1)
    throw InputError(file, "", Printed("the image has %d channels, expected %d or 1", image.channels, channels));
  Image planes(image.width, image.height, channels);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < channels; ++c) planes.at(x, y, c) = image.at(x, y, image.channels == 1 ? 0 : c);
  return planes;
}

/// Refuses a picture with other channels than the capture has.
void RequireChannels(const ImageFile& file, const PhotographFiles& files) {
  const int found = file.image.channels - (file.alpha_channel >= 0 ? 1 : 0);
  const int wanted = static_cast<int>(files.channel_names.size());
  if (found == wanted) return;
  if (wanted == 3 && found < 3)
    throw InputError(files.image, "",
                     "is grey: it has " + std::to_string(file.image.channels) +
                         " channels, but a photograph needs red, green and blue",
                     "Give the photograph in colour.");
  std::string names;
  for (const std::string& name : files.channel_names) names += (names.empty() ? "" : ", ") + name;
  throw InputError(
      files.image, "", Printed("has %d channels, but the capture has %d: %s", found, wanted, names.c_str()),
      "Write an EXR whose channels have these names, or a TIFF with so many samples, or state one file per "
      "channel (\"files\").");
}

/// One file per channel, as one picture. What the first file says of its values holds for all.
ImageFile ReadPlanes(const PhotographFiles& files) {
  ImageFile all;
  const size_t count = files.planes.size();
  for (size_t c = 0; c < count; ++c) {
    ImageFile plane = ReadImageFile(files.planes[c]);
    if (plane.image.channels != 1)
      throw InputError(files.planes[c], "",
                       Printed("has %d channels, but a file of one channel has 1", plane.image.channels),
                       "Write it grey, or state one file with all channels (\"file\").");
    if (c == 0) {
      all = plane;
      all.image = Image(plane.image.width, plane.image.height, static_cast<int>(count));
    }
    RequireSize(plane.image, all.image, files.planes[c], files.planes[0]);
    if (plane.bits != all.bits || plane.is_integer != all.is_integer || plane.transfer.kind != all.transfer.kind ||
        plane.transfer.gamma != all.transfer.gamma)
      throw InputError(files.planes[c], "", "is encoded otherwise than " + files.planes[0].filename().string(),
                       "Write all channels in one way.");
    for (size_t i = 0; i < plane.image.values.size(); ++i) all.image.values[i * count + c] = plane.image.values[i];
  }
  return all;
}

/// Where alpha is 1, or there is none.
std::vector<uint8_t> Opaque(const ImageFile& file) {
  constexpr float kOpaque = 0.999f;
  const Image& image = file.image;
  std::vector<uint8_t> opaque(static_cast<size_t>(image.width) * image.height, 1);
  for (size_t i = 0; i < opaque.size() && file.alpha_channel >= 0; ++i)
    opaque[i] = image.values[i * image.channels + file.alpha_channel] >= kOpaque;
  return opaque;
}

void RequireShare(double value, const std::filesystem::path& file, const std::string& key, const ImageFile& photo,
                  const std::filesystem::path& image) {
  constexpr double kRounding = 1e-6;
  double most = 1.0;  // camera RAW: white times the white balance
  for (const double factor : photo.white_balance.value_or(std::array<double, 3>{})) most = std::max(most, factor);
  if (!photo.is_integer || value <= most + kRounding) return;
  throw InputError(
      file, key,
      Printed("is %g, but values of %s are shares of full scale, at most %g", value, image.filename().c_str(), most),
      Printed("Divide the count by that of full scale%s.",
              photo.white_balance ? "" : Printed(", %.0f", std::ldexp(1.0, photo.bits) - 1).c_str()));
}

/// The mask's first channel, for each pixel whether it is chosen.
std::vector<uint8_t> ReadMask(const std::filesystem::path& path, const PhotographFiles& files, const Image& wanted) {
  constexpr float kChosen = 0.5f;
  const ImageFile file = ReadImageFile(path);
  const Image& mask = file.image;
  RequireSize(mask, wanted, path, files.image);
  const std::vector<uint8_t> is_stated = Opaque(file);
  if (std::count(is_stated.begin(), is_stated.end(), 0) > 0)
    throw InputError(path, "", "the mask has transparent pixels, which may mean either side of it",
                     "Write it without alpha: white where the object is, black elsewhere.");
  std::vector<uint8_t> chosen;
  float most = 0;
  for (size_t i = 0; i < mask.values.size(); i += mask.channels) {
    chosen.push_back(mask.values[i] > kChosen);
    most = std::max(most, mask.values[i]);
  }
  const bool has_counts = file.is_integer && file.bits <= 16;
  const double white = has_counts ? std::ldexp(1.0, file.bits) - 1 : 1.0;
  if (most > 0 && most <= kChosen)
    throw InputError(path, "",
                     Printed("chooses no pixel: its largest value is %.4g, and white is %.0f", most * white, white),
                     Printed("Write %.0f where a pixel is used, and 0 elsewhere.", white));
  return chosen;
}

}  // namespace

SensorNoise ReadSensorNoise(const std::filesystem::path& path, int count) {
  const JsonFile file(path);
  const JsonObject root = file.RootOfFormat(
      "crownfit-noise/1", {"gain", "read_noise", "black", "saturation", "stddev", "quality", "provenance"});
  SensorNoise noise;
  noise.relative = 0.0;
  noise.file = path;
  const auto channels = [&](const char* key, Spectrum& out) {
    out = Spectrum(count, 0.0);
    const auto node = root.Find(key);
    if (!node) return;
    out = node->IsNumber() ? Spectrum(count, node->Number()) : Spectrum(node->Numbers(static_cast<size_t>(count)));
    if (out.Smallest() < 0 && key != std::string("black")) node->Fail("must not be negative");
  };
  root.Require("gain");
  root.Require("read_noise");
  channels("gain", noise.gain);
  channels("read_noise", noise.read_noise);
  channels("black", noise.black);
  channels("saturation", noise.saturation);
  for (int c = 0; c < count; ++c)
    if (noise.gain[c] == 0 && noise.read_noise[c] == 0)
      throw InputError(path, "read_noise", "gain and read_noise are both 0 in one channel",
                       "State the read noise: a value without noise would get infinite weight.");
  return noise;
}

void RequireSharesOfFullScale(const SensorNoise& noise, const ImageFile& photo, const std::filesystem::path& image) {
  RequireShare(noise.black.Largest(), noise.file, "black", photo, image);
  RequireShare(noise.saturation.Largest(), noise.file, "saturation", photo, image);
}

Photograph ReadPhotograph(const PhotographFiles& files) {
  ImageFile file = files.planes.empty() ? ReadImageFile(files.image, files.channel_names) : ReadPlanes(files);
  const int channels = static_cast<int>(files.channel_names.size());
  RequireChannels(file, files);
  RequireSharesOfFullScale(files.noise, file, files.image);
  if (files.saturation) RequireShare(*files.saturation, files.image, files.saturation_key, file, files.image);
  const Transfer transfer = Resolved(file.transfer, files.encoding, files.image, files.encoding_key);
  Photograph photo;
  const std::vector<uint8_t> opaque = Opaque(file);
  photo.linear = Planes(std::move(file.image), channels, files.image);
  photo.is_for_display = transfer.is_encoded() && files.encoding.kind == Encoding::Kind::kFile &&
                         (file.bits == 8 || transfer.source == "PNG");
  photo.encoding = transfer.InWords();
  photo.was_jpeg = file.is_jpeg;
  photo.has_foreign_primaries = file.has_foreign_primaries;
  photo.white_balance = file.white_balance;
  const size_t pixels = static_cast<size_t>(photo.linear.width) * photo.linear.height;
  photo.usable.assign(pixels, 1);
  if (files.mask) {
    photo.usable = ReadMask(*files.mask, files, photo.linear);
    photo.has_mask = true;
  }
  for (size_t i = 0; i < pixels; ++i)
    if (!opaque[i] && photo.usable[i]) photo.usable[i] = 0, ++photo.transparent_pixels;
  Image stated_variance;
  if (files.variance) {
    stated_variance = Planes(ReadImageFile(*files.variance, files.channel_names).image, channels, *files.variance);
    RequireSize(stated_variance, photo.linear, *files.variance, files.image);
  }

  // 8-bit values carry a quantisation error: half a step, uniformly distributed, times the decoding's slope.
  const double step = std::ldexp(1.0, -file.bits) / (1.0 - std::ldexp(1.0, -file.bits));
  photo.variance = Image(photo.linear.width, photo.linear.height, channels);
  for (size_t i = 0; i < pixels; ++i) {
    bool saturated = false;
    for (int c = 0; c < channels; ++c) {
      const size_t at = channels * i + c;
      const double stored = photo.linear.values[at];
      double value = stored, rounding = 0.0;
      if (transfer.is_encoded()) {
        value = transfer.Light(stored, c);
        const double slope = (transfer.Light(stored + 0.5 * step, c) - transfer.Light(stored - 0.5 * step, c)) / step;
        rounding = step * step / 12.0 * slope * slope;
      }
      const std::optional<double> limit = files.saturation                ? files.saturation
                                          : files.noise.saturation[c] > 0 ? std::optional(files.noise.saturation[c])
                                          : file.is_integer ? std::optional<double>(0.995 * file.full_scale)
                                                            : std::nullopt;
      saturated |= limit && value >= *limit;
      value -= files.noise.black[c];
      const double signal = std::max(0.0, value), relative = files.noise.relative * signal;
      const double read = files.noise.read_noise[c];
      double variance = files.noise.gain[c] * signal + read * read + relative * relative + rounding;
      if (files.variance) {
        variance = stated_variance.values[at];
        if (!(variance > 0.0) && photo.usable[i])
          throw InputError(*files.variance, "",
                           "holds a variance that is not greater than 0 at pixel " +
                               std::to_string(i % photo.linear.width) + ", " + std::to_string(i / photo.linear.width));
      }
      photo.linear.values[at] = static_cast<float>(value);
      photo.variance.values[at] = static_cast<float>(variance);
    }
    photo.saturated_pixels += saturated && photo.usable[i];
    if (saturated) photo.usable[i] = 0;
  }
  return photo;
}

Photograph Averaged(Photograph photo, int side, bool noise_is_known, double least_usable) {
  const Image linear = std::move(photo.linear), variances = std::move(photo.variance);
  const std::vector<uint8_t> usable = std::move(photo.usable);
  const int width = linear.width / side, height = linear.height / side;
  Photograph mean = std::move(photo);
  const int channels = linear.channels;
  mean.linear = mean.variance = Image(width, height, channels);
  mean.usable.assign(static_cast<size_t>(width) * height, 0);
  const double all = static_cast<double>(side) * side, least = std::max(1.0, least_usable * all);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto is_usable = [&](int u, int v) { return usable[static_cast<size_t>(v) * linear.width + u] != 0; };
      const auto each = [&](const auto& pixel) {
        for (int v = y * side; v < (y + 1) * side; ++v)
          for (int u = x * side; u < (x + 1) * side; ++u) pixel(u, v);
      };
      double n = 0;
      each([&](int u, int v) { n += is_usable(u, v); });
      const bool enough = n >= least;
      mean.usable[static_cast<size_t>(y) * width + x] = enough;
      if (!enough) n = all;
      Spectrum value(channels, 0.0), variance(channels, 0.0);
      each([&](int u, int v) {
        if (enough && !is_usable(u, v)) return;
        for (int c = 0; c < channels; ++c) value[c] += linear.at(u, v, c), variance[c] += variances.at(u, v, c);
      });
      for (int c = 0; c < channels; ++c) {
        mean.linear.at(x, y, c) = static_cast<float>(value[c] / n);
        mean.variance.at(x, y, c) = static_cast<float>(variance[c] / (noise_is_known ? n * n : n));
      }
    }
  return mean;
}

}  // namespace crownfit
