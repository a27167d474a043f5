#pragma once
// Image files. OpenImageIO is named in image_library.cpp only, and decodes in a child process (base/confined). It
// brings some hundred thousand lines of decoders for a dozen formats; a broken file may crash the child but not this
// program.

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "photo/image.h"
#include "photo/transfer.h"

namespace crownfit {

struct ImageFile {
  Image image;
  int bits = 32;            ///< of a value
  bool is_integer = false;  ///< values are scaled to [0, 1]; from `full_scale` on they are saturated
  double full_scale = 1.0;  ///< 1, or of camera RAW the smallest factor of the white balance
  bool is_jpeg = false;
  Transfer transfer;                                   ///< how the values stand for light, as the file states it
  bool has_foreign_primaries = false;                  ///< an ICC profile says that they are not sRGB's
  int alpha_channel = -1;                              ///< -1: none
  std::optional<std::array<double, 3>> white_balance;  ///< camera RAW: factors applied, green's is 1
};

/// EXR, PNG, TIFF (8, 16, 32 bit), JPEG, camera RAW, Radiance HDR, BMP, PNM, WebP, DPX and JPEG 2000. Values are
/// as stored, not linearised. 1 to 4 channels; of an EXR with more layers the first, which must be R, G, B. Camera RAW
/// comes out linear in the camera's own primaries: black level removed, white balance as shot, interpolated linearly,
/// neither turned nor brightened, `full_scale` where saturated. Alpha multiplies nothing, but an EXR's values are
/// products with it. Throws InputError when the file is missing,
/// damaged, truncated, cropped (an EXR whose data window is not its display window) or beyond the limits of
/// base/limits.h, or holds a value that is not finite. `channels`: names of the channels that are wanted. An EXR that
/// has them all gives them in this order; another file may then have as many channels as there are names.
ImageFile ReadImageFile(const std::filesystem::path& file, const std::vector<std::string>& channels = {});

/// .exr as 32-bit (or 16-bit when `half`) float; .png and .jpg (quality 92, colours not subsampled) as 8 bit. Written
/// atomically. An EXR's channels have the names `channels`, or R, G, B.
void WriteImageFile(const std::filesystem::path& file, const Image& image, bool half = false,
                    const std::vector<std::string>& channels = {});

/// A picture among others of its size and channels.
struct ImageLayer {
  std::string name;
  Image image;
};
/// Writes several as one EXR (32-bit), with channels LAYER.CHANNEL, or CHANNEL of a layer without a name.
void WriteImageLayers(const std::filesystem::path& file, const std::vector<ImageLayer>& layers,
                      const std::vector<std::string>& channels = {"R", "G", "B"});

/// A smaller copy of a picture, by means over the pixels that each new one covers.
Image Resized(const Image& image, int width, int height);

/// Draws text with its baseline's left end at (x, y). Without any font on the machine nothing is drawn.
void DrawText(Image& image, int x, int y, int size_px, const std::string& text, float grey = 1.0f);

}  // namespace crownfit
