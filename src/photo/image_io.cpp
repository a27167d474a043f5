#include "photo/image_io.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>

#include "base/confined.h"
#include "base/error.h"
#include "base/files.h"
#include "base/limits.h"
#include "photo/image_library.h"

namespace crownfit {
namespace {

/// The shared library, found through the program's list of folders (RPATH).
const ImageLibrary& LoadedLibrary() {
  static const ImageLibrary* const library = [] {
    void* module = dlopen("crownfit_images.so", RTLD_LAZY | RTLD_LOCAL);
    void* entry = module ? dlsym(module, "CrownfitImageLibrary") : nullptr;
    if (!entry)
      throw InputError("", "", "the library that reads pictures can't be loaded: " + std::string(dlerror()),
                       "Install crownfit again, and keep its bin/ and lib/ side by side.");
    return reinterpret_cast<decltype(&CrownfitImageLibrary)>(entry)();
  }();
  return *library;
}

/// Holds the library for one thread, so that no child is forked while another thread is inside it.
class InUse {
 public:
  const ImageLibrary* operator->() const { return &library_; }

 private:
  static std::mutex& Lock() {
    static std::mutex lock;
    return lock;
  }
  std::lock_guard<std::mutex> hold_{Lock()};
  const ImageLibrary& library_ = LoadedLibrary();
};

void Write(const std::filesystem::path& file, const Image& image, bool half, const std::vector<std::string>& channels) {
  WriteBesideAndRename(
      file, [&](const std::filesystem::path& beside) { InUse()->Write(file, beside, image, half, channels); });
}

}  // namespace

ImageFile ReadImageFile(const std::filesystem::path& file, const std::vector<std::string>& channels) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    throw InputError(file, "", "there is no such image file", RemedyOfMissing(file));
  if (std::filesystem::file_size(file, ignored) == 0) DamagedImage(file, "the file is empty");
  const Limits limits = InputLimits();
  // A decoder holds the picture several times: as counts, as floats, and in layers that are not asked for.
  constexpr double kBase = 2e9, kPerPixel = 64;
  const double memory_bytes = kBase + kPerPixel * 1e6 * limits.image_megapixels;
  SharedMemory memory;
  Ending ending{};
  {
    const InUse library;
    const auto memory_of = [&](size_t bytes) { return memory.Resize(bytes), memory.Bytes(); };
    ending = RunConfined({limits.image_seconds, static_cast<size_t>(memory_bytes)},
                         [&] { library->Decode(file, channels, limits, memory_of); });
  }
  const auto bytes = memory.Bytes();
  if (ending == Ending::kTookTooLong)
    throw InputError(
        file, "",
        "the image can't be decoded within " + std::to_string(static_cast<int>(std::ceil(limits.image_seconds))) + " s",
        "Write the file again; on a slow machine, raise CROWNFIT_MAX_IMAGE_SECONDS.");
  if (ending == Ending::kNeededTooMuchMemory)
    DamagedImage(file, "decoding it needs more than " + std::to_string(static_cast<int>(1e-6 * memory_bytes)) + " MB");
  if (ending != Ending::kDone || bytes.size() < sizeof(DecodedImage))
    DamagedImage(file, "the library that decodes it crashed");

  DecodedImage found;
  std::memcpy(&found, bytes.data(), sizeof found);
  ImageFile result;
  result.image = Image(found.width, found.height, found.channels);
  const size_t pixel_bytes = sizeof(float) * result.image.values.size();
  Check(bytes.size() == sizeof found + pixel_bytes + 3 * sizeof(float) * found.curve_points,
        "a decoded image has its size");
  std::memcpy(result.image.values.data(), bytes.data() + sizeof found, pixel_bytes);
  for (size_t i = 0; i < result.image.values.size(); ++i)
    if (!std::isfinite(result.image.values[i])) {
      const size_t pixel = i / result.image.channels;
      throw InputError(file, "",
                       "the value at column " + std::to_string(pixel % result.image.width) + ", row " +
                           std::to_string(pixel / result.image.width) + " is not finite (NaN or infinity)",
                       "Render or write the picture again, and exclude such pixels by a mask.");
    }
  result.is_jpeg = found.is_jpeg;
  result.bits = found.bits;
  result.is_integer = found.is_integer;
  result.full_scale = found.full_scale;
  result.has_foreign_primaries = found.has_foreign_primaries;
  result.alpha_channel = found.alpha_channel;
  result.transfer.kind = found.transfer;
  result.transfer.gamma = found.gamma;
  result.transfer.source.assign(found.source, strnlen(found.source, sizeof found.source));
  result.transfer.fault.assign(found.fault, strnlen(found.fault, sizeof found.fault));
  const std::byte* curves = bytes.data() + sizeof found + pixel_bytes;
  for (size_t c = 0; c < 3 && found.curve_points > 0; ++c) {
    result.transfer.curve[c].resize(found.curve_points);
    std::memcpy(result.transfer.curve[c].data(), curves + c * sizeof(float) * found.curve_points,
                sizeof(float) * found.curve_points);
  }
  if (found.has_white_balance)
    result.white_balance =
        std::array<double, 3>{found.white_balance[0], found.white_balance[1], found.white_balance[2]};
  return result;
}

void WriteImageFile(const std::filesystem::path& file, const Image& image, bool half,
                    const std::vector<std::string>& channels) {
  Write(file, image, half, channels);
}

void WriteImageLayers(const std::filesystem::path& file, const std::vector<ImageLayer>& layers,
                      const std::vector<std::string>& channels) {
  const int width = layers.at(0).image.width, height = layers[0].image.height;
  const size_t planes = channels.size(), all_planes = planes * layers.size();
  Image all(width, height, static_cast<int>(all_planes));
  std::vector<std::string> names;
  for (size_t l = 0; l < layers.size(); ++l) {
    const Image& image = layers[l].image;
    Check(image.width == width && image.height == height && image.channels == static_cast<int>(planes),
          "layers of one size");
    for (size_t p = 0; p < image.values.size() / planes; ++p)
      std::copy_n(&image.values[planes * p], planes, &all.values[all_planes * p + planes * l]);
    for (const std::string& channel : channels)
      names.push_back(layers[l].name.empty() ? channel : layers[l].name + "." + channel);
  }
  Write(file, all, false, names);
}

Image Resized(const Image& image, int width, int height) { return InUse()->Resized(image, width, height); }

void DrawText(Image& image, int x, int y, int size_px, const std::string& text, float grey) {
  InUse()->DrawText(image, x, y, size_px, text, grey);
}

}  // namespace crownfit
