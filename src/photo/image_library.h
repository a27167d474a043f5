#pragma once
// What image_library.cpp does with OpenImageIO, for image_io.cpp. It is a shared library of its own, loaded with the
// first picture: two hundred libraries stand behind OpenImageIO, which a program that reads no picture would wait a
// quarter of a second for.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/limits.h"
#include "photo/image.h"

namespace crownfit {

/// What decoding finds out about a file; the pixels follow it in memory.
struct DecodedImage {
  int width, height, channels;
  bool is_integer, is_srgb_encoded, is_jpeg, has_colour_profile, has_white_balance;
  double white_balance[3];
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
  /// A DecodedImage and its pixels, into so many bytes as `memory` gives. Throws InputError.
  virtual void Decode(const std::filesystem::path& file, const Limits& limits,
                      const std::function<std::span<std::byte>(size_t)>& memory) const = 0;
  /// As WriteImageFile of image_io.h; what is wrong is said of `file`. Channels without names are R, G, B.
  virtual void Write(const std::filesystem::path& file, const std::filesystem::path& beside, const Image& image,
                     bool half, const std::vector<std::string>& channels) const = 0;
  virtual Image Resized(const Image& image, int width, int height) const = 0;
  virtual void DrawText(Image& image, int x, int y, int size_px, const std::string& text, float grey) const = 0;
};

/// What the shared library gives, by this name.
extern "C" const ImageLibrary* CrownfitImageLibrary();

}  // namespace crownfit
