#include "photo/image_io.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/files.h"

namespace crownfit {
namespace {

[[noreturn]] void Damaged(const std::filesystem::path& file, std::string reason) {
  reason = reason.substr(0, 300);
  throw InputError(file, "", "the image can't be read: " + (reason.empty() ? "unknown format" : reason),
                   "Write the file again; EXR, PNG, TIFF, JPEG and camera RAW are read.");
}

/// What LibRaw is to do with a camera's file. Its "linear" colour space would mix the channels and cut off what falls
/// below 0; "raw" leaves the camera's own bands.
OIIO::ImageSpec CameraRawSettings() {
  OIIO::ImageSpec settings;
  settings.attribute("raw:ColorSpace", "raw");
  settings.attribute("raw:Demosaic", "linear");
  settings.attribute("raw:auto_bright", 0);
  settings.attribute("raw:use_camera_wb", 1);
  settings.attribute("raw:user_flip", 0);
  return settings;
}

std::optional<std::array<double, 3>> WhiteBalance(const OIIO::ImageSpec& spec) {
  const auto* factors = spec.find_attribute("raw:cam_mul");
  if (!factors || !(factors->get_float_indexed(1) > 0)) return std::nullopt;
  const double green = factors->get_float_indexed(1);
  return std::array<double, 3>{factors->get_float_indexed(0) / green, 1.0, factors->get_float_indexed(2) / green};
}

void Write(const std::filesystem::path& file, const std::filesystem::path& beside, OIIO::ImageSpec spec,
           const Image& image) {
  // EXR wants a date; the same picture is to be the same file, which is known by its hash.
  if (file.extension() == ".exr") spec.attribute("DateTime", "1970:01:01 00:00:00");
  const auto output = OIIO::ImageOutput::create(beside.string());
  if (!output || !output->open(beside.string(), spec) ||
      !output->write_image(OIIO::TypeDesc::FLOAT, image.values.data()) || !output->close())
    throw InputError(file, "", "the image can't be written: " + (output ? output->geterror() : OIIO::geterror()));
}

}  // namespace

ImageFile ReadImageFile(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) throw InputError(file, "", "there is no such image file");
  if (std::filesystem::file_size(file, ignored) == 0) Damaged(file, "the file is empty");
  (void)OIIO::geterror();  // forget complaints about earlier files
  const OIIO::ImageSpec settings = CameraRawSettings();
  const auto input = OIIO::ImageInput::open(file.string(), &settings);
  if (!input) Damaged(file, OIIO::geterror());
  const OIIO::ImageSpec spec = input->spec();
  if (spec.width < 1 || spec.height < 1 || spec.width > 20000 || spec.height > 20000)
    Damaged(file, "its size " + std::to_string(spec.width) + " x " + std::to_string(spec.height) + " makes no sense");

  ImageFile result;
  result.image = Image(spec.width, spec.height, spec.nchannels);
  const bool read = input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, result.image.values.data());
  // read_image returns true on truncated TIFF files: a non-empty error string is a failure too.
  const std::string complaint = input->geterror() + OIIO::geterror();
  if (!read || !complaint.empty()) Damaged(file, complaint);
  for (float v : result.image.values) {
    if (!std::isfinite(v)) throw InputError(file, "", "the image holds a value that is not finite (NaN or infinity)");
  }
  result.is_jpeg = std::string(input->format_name()) == "jpeg";
  if (std::string(input->format_name()) == "raw") result.white_balance = WhiteBalance(spec);
  result.is_integer = !spec.format.is_floating_point();
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  const bool eight_bit = spec.format.basesize() == 1;
  result.is_srgb_encoded =
      result.is_integer && space.find("inear") == std::string::npos &&
      (eight_bit || space.find("RGB") != std::string::npos || space.find("Gamma") != std::string::npos);
  result.has_colour_profile = spec.find_attribute("ICCProfile") != nullptr;
  return result;
}

void WriteImageFile(const std::filesystem::path& file, const Image& image, bool half) {
  WriteBesideAndRename(file, [&](const std::filesystem::path& beside) {
    const bool exr = file.extension() == ".exr";
    OIIO::ImageSpec spec(image.width, image.height, image.channels,
                         exr ? (half ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT) : OIIO::TypeDesc::UINT8);
    if (!exr) spec.attribute("oiio:ColorSpace", "sRGB");
    if (file.extension() == ".jpg") {
      spec.attribute("CompressionQuality", 92);
      spec.attribute("jpeg:subsampling", "4:4:4");
    }
    Write(file, beside, spec, image);
  });
}

void WriteImageLayers(const std::filesystem::path& file, const std::vector<ImageLayer>& layers) {
  const int width = layers.at(0).image.width, height = layers[0].image.height,
            channels = 3 * static_cast<int>(layers.size());
  Image all(width, height, channels);
  std::vector<std::string> names;
  for (size_t l = 0; l < layers.size(); ++l) {
    const Image& image = layers[l].image;
    Check(image.width == width && image.height == height && image.channels == 3, "layers of one size");
    for (size_t p = 0; p < image.values.size() / 3; ++p)
      std::copy_n(&image.values[3 * p], 3, &all.values[channels * p + 3 * l]);
    for (const char* channel : {"R", "G", "B"})
      names.push_back(layers[l].name.empty() ? channel : layers[l].name + "." + channel);
  }
  WriteBesideAndRename(file, [&](const std::filesystem::path& beside) {
    OIIO::ImageSpec spec(width, height, channels, OIIO::TypeDesc::FLOAT);
    spec.channelnames = names;
    Write(file, beside, spec, all);
  });
}

Image Resized(const Image& image, int width, int height) {
  const auto spec = [&](int w, int h) { return OIIO::ImageSpec(w, h, image.channels, OIIO::TypeDesc::FLOAT); };
  Image result(width, height, image.channels);
  std::vector<float> values = image.values;
  const OIIO::ImageBuf from(spec(image.width, image.height), values.data());
  OIIO::ImageBuf to(spec(width, height), result.values.data());
  Check(OIIO::ImageBufAlgo::resize(to, from, "box"), "a picture that can be resized");
  return result;
}

void DrawText(Image& image, int x, int y, int size_px, const std::string& text, float grey) {
  if (x < 0 || y < size_px || x >= image.width || y >= image.height) return;  // OpenImageIO can't clip all of it
  OIIO::ImageBuf buffer(OIIO::ImageSpec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT),
                        image.values.data());
  const std::vector<float> colour(image.channels, grey);
  OIIO::ImageBufAlgo::render_text(buffer, x, y, text, size_px, "DejaVuSans", colour);
  (void)OIIO::geterror();
}

}  // namespace crownfit
