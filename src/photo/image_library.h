#pragma once
// The calls of OpenImageIO, for image_io.cpp. They are a shared library of their own, loaded with the first picture.
// OpenImageIO depends on two hundred libraries, which would delay a program that reads no picture by a quarter of a
// second.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/limits.h"
#include "photo/image.h"
#include "photo/transfer.h"

namespace crownfit {

/// Result of decoding a file; the pixels follow it in memory.
struct DecodedImage {
  int width, height, channels;
  int alpha_channel;  ///< -1: none
  int bits;
  bool is_integer, is_jpeg, has_white_balance, has_foreign_primaries;
  double white_balance[3];
  double full_scale;  ///< value of integer files at which the first channel saturates
  Transfer::Kind transfer;
  double gamma;
  size_t curve_points;           ///< of kCurve: three curves of so many floats stand behind the pixels
  char source[120], fault[200];  ///< as in Transfer
};
static_assert(sizeof(DecodedImage) % sizeof(float) == 0);

[[noreturn]] inline void DamagedImage(const std::filesystem::path& file, std::string reason) {
  reason = reason.substr(0, 300);
  throw InputError(file, "", "the image can't be read: " + (reason.empty() ? "unknown format" : reason),
                   "Write the file again; EXR, PNG, TIFF, JPEG and camera RAW are read.");
}

/// None of it may run in two threads at once.
class ImageLibrary {
 public:
  virtual ~ImageLibrary() = default;
  /// Writes a DecodedImage and its pixels into the bytes that `memory` provides. `channels`: as for ReadImageFile.
  /// Throws InputError.
  virtual void Decode(const std::filesystem::path& file, const std::vector<std::string>& channels, const Limits& limits,
                      const std::function<std::span<std::byte>(size_t)>& memory) const = 0;
  /// As WriteImageFile of image_io.h; errors name `file`. Channels without names are R, G, B.
  virtual void Write(const std::filesystem::path& file, const std::filesystem::path& beside, const Image& image,
                     bool half, const std::vector<std::string>& channels) const = 0;
  virtual Image Resized(const Image& image, int width, int height) const = 0;
  virtual void DrawText(Image& image, int x, int y, int size_px, const std::string& text, float grey) const = 0;
};

/// Entry point of the shared library, found by this name.
extern "C" const ImageLibrary* CrownfitImageLibrary();

}  // namespace crownfit
