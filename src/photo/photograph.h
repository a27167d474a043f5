#pragma once
// A photograph as measured light: linear values, a variance and a usable flag for every pixel.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "photo/image.h"
#include "photo/spectrum.h"
#include "photo/transfer.h"

namespace crownfit {

struct ImageFile;

/// Sensor noise per channel: variance = gain x signal + read_noise^2 + (relative x signal)^2, in units of the signal.
/// gain and read_noise come from noise.json; without one, 1 % relative noise and a floor of 0.0005 are assumed.
struct SensorNoise {
  Spectrum gain, read_noise = Spectrum(0.0005), black;
  double relative = 0.01;
  Spectrum saturation;              ///< 0: not stated
  std::filesystem::path file = {};  ///< that states it; empty where it is assumed
};

/// Reads noise.json ("crownfit-noise/1") of a camera with so many channels.
SensorNoise ReadSensorNoise(const std::filesystem::path& file, int channels = 3);

/// Throws InputError where black or saturation lies above all values that the integer picture `image` can hold, as
/// counts do. EXR and other floating point values have no such limit.
void RequireSharesOfFullScale(const SensorNoise& noise, const ImageFile& photo, const std::filesystem::path& image);

struct PhotographFiles {
  std::filesystem::path image;                     ///< or the first channel's, where each has its own
  std::vector<std::filesystem::path> planes = {};  ///< one single-channel picture per channel, if stated so
  std::vector<std::string> channel_names = {"R", "G", "B"};
  std::optional<std::filesystem::path> mask = {}, variance = {};
  SensorNoise noise = {};
  Encoding encoding = {};
  const char* encoding_key = "encoding";      ///< what the user may write to state it
  std::optional<double> saturation = {};      ///< linear value from which a pixel counts as saturated
  std::string saturation_key = "saturation";  ///< where the user stated it
};

struct Photograph {
  Image linear;                 ///< the capture's channels, proportional to the light, black level removed
  Image variance;               ///< of `linear`, same shape
  std::vector<uint8_t> usable;  ///< 1: inside the mask and not saturated; index y * width + x
  bool has_mask = false, was_jpeg = false;
  bool is_for_display = false;                         ///< encoded as pictures for display are, and nobody says why
  std::string encoding;                                ///< how values were decoded, and who says so
  bool has_foreign_primaries = false;                  ///< an ICC profile says that they are not sRGB's
  std::optional<std::array<double, 3>> white_balance;  ///< of camera RAW, as shot; green is 1
  int transparent_pixels = 0;                          ///< inside the mask, with an alpha below 1: not usable
  int saturated_pixels = 0;                            ///< inside the mask
};

/// Reads, linearises (IEC 61966-2-1 when the file is sRGB-encoded), masks (> 0.5) and gives every pixel its variance.
/// Throws InputError naming the file.
Photograph ReadPhotograph(const PhotographFiles& files);

/// Means over squares of `side` x `side` pixels; a remainder at the right and below is dropped. A square is usable
/// where at least the share `least_usable` of its pixels is, and is then the mean over those. `noise_is_known`:
/// variances are of independent noise, which averages out; assumed variances do not.
Photograph Averaged(Photograph photo, int side, bool noise_is_known, double least_usable = 1.0);

}  // namespace crownfit
