#include "photo/image_io.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <set>

#include "base/confined.h"
#include "base/error.h"
#include "base/files.h"
#include "base/limits.h"

namespace crownfit {
namespace {

/// OpenImageIO keeps to the calling thread, so that a forked child misses none of its threads ...
void PrepareLibrary() {
  static const bool done =
      OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1) &&
      !OIIO::get_string_attribute("format_list").empty();  // looked up here once, not by each child
  Check(done, "OpenImageIO takes its settings");
}

/// ... and no child is forked while another thread is inside it.
std::mutex& LibraryLock() {
  static std::mutex lock;
  return lock;
}

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
  const std::lock_guard hold(LibraryLock());
  PrepareLibrary();
  // EXR wants a date; the same picture is to be the same file, which is known by its hash.
  if (file.extension() == ".exr") spec.attribute("DateTime", "1970:01:01 00:00:00");
  const auto output = OIIO::ImageOutput::create(beside.string());
  if (!output || !output->open(beside.string(), spec) ||
      !output->write_image(OIIO::TypeDesc::FLOAT, image.values.data()) || !output->close())
    throw InputError(file, "", "the image can't be written: " + (output ? output->geterror() : OIIO::geterror()));
}

/// What the child finds out about a file; the pixels follow it in memory.
struct Found {
  int width, height, channels;
  bool is_integer, is_srgb_encoded, is_jpeg, has_colour_profile, has_white_balance;
  double white_balance[3];
};
static_assert(sizeof(Found) % sizeof(float) == 0);

/// What a picture's header may not be, before memory is asked for.
void CheckHeader(const std::filesystem::path& file, const std::string& format, const OIIO::ImageSpec& spec,
                 const Limits& limits) {
  // OpenImageIO reads films, sockets' streams and pictures that it makes up, too.
  const std::set<std::string> known{"openexr", "png", "tiff", "jpeg", "raw", "hdr",
                                    "bmp",     "pnm", "webp", "heif", "dpx", "jpeg2000"};
  if (!known.contains(format)) Damaged(file, "photographs are not read in the format '" + format + "'");
  const auto size = std::to_string(spec.width) + " x " + std::to_string(spec.height);
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1)
    Damaged(file, "its size " + size + " makes no sense");
  if (static_cast<double>(spec.width) * spec.height > 1e6 * limits.image_megapixels)
    throw InputError(
        file, "",
        "the image has " + size + " pixels, more than " + std::to_string(static_cast<int>(limits.image_megapixels)) +
            " million",
        "Cut the photograph to the crown and calibrate at that size, or raise CROWNFIT_MAX_IMAGE_MEGAPIXELS.");
  if (spec.deep) Damaged(file, "it holds deep pixels; write flat ones");
  if (format != "openexr") return;
  if (spec.x != spec.full_x || spec.y != spec.full_y || spec.width != spec.full_width ||
      spec.height != spec.full_height)
    throw InputError(file, "",
                     "its data window (" + size + " from " + std::to_string(spec.x) + ", " + std::to_string(spec.y) +
                         ") is not its display window (" + std::to_string(spec.full_width) + " x " +
                         std::to_string(spec.full_height) + " from " + std::to_string(spec.full_x) + ", " +
                         std::to_string(spec.full_y) + ")",
                     "A camera's calibration counts the pixels of the whole picture: write it without cropping.");
  for (int c = 0; c < 3 && spec.nchannels >= 3; ++c)
    if (!OIIO::Strutil::iequals(spec.channelnames[c], std::string(1, "RGB"[c])))
      Damaged(file,
              "its channel " + std::to_string(c) + " is called '" + spec.channelnames[c] + "', expected R, G and B");
}

/// In the child: decodes the file into `memory`.
void Decode(const std::filesystem::path& file, const Limits& limits, SharedMemory& memory) {
  const OIIO::ImageSpec settings = CameraRawSettings();
  const auto input = OIIO::ImageInput::open(file.string(), &settings);
  if (!input) Damaged(file, OIIO::geterror());
  const OIIO::ImageSpec spec = input->spec();
  const std::string format = input->format_name();
  CheckHeader(file, format, spec, limits);
  Found found{};
  found.width = spec.width;
  found.height = spec.height;
  found.channels = spec.nchannels > 4 ? 3 : spec.nchannels;  // beyond alpha stand layers of other pictures
  found.is_jpeg = format == "jpeg";
  if (const auto balance = WhiteBalance(spec); balance && format == "raw") {
    found.has_white_balance = true;
    std::copy(balance->begin(), balance->end(), found.white_balance);
  }
  found.is_integer = !spec.format.is_floating_point();
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  const bool eight_bit = spec.format.basesize() == 1;
  found.is_srgb_encoded =
      found.is_integer && space.find("inear") == std::string::npos &&
      (eight_bit || space.find("RGB") != std::string::npos || space.find("Gamma") != std::string::npos);
  found.has_colour_profile = spec.find_attribute("ICCProfile") != nullptr;
  memory.Resize(sizeof found + sizeof(float) * spec.width * static_cast<size_t>(spec.height) * found.channels);
  const auto bytes = memory.Bytes();
  std::memcpy(bytes.data(), &found, sizeof found);
  const bool read = input->read_image(0, 0, 0, found.channels, OIIO::TypeDesc::FLOAT, bytes.data() + sizeof found);
  // read_image returns true on truncated TIFF files: a non-empty error string is a failure too.
  const std::string complaint = input->geterror() + OIIO::geterror();
  if (!read || !complaint.empty()) Damaged(file, complaint);
}

}  // namespace

ImageFile ReadImageFile(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) throw InputError(file, "", "there is no such image file");
  if (std::filesystem::file_size(file, ignored) == 0) Damaged(file, "the file is empty");
  const Limits limits = InputLimits();
  // A decoder holds the picture several times over, as counts, as floats and in the layers that are not asked for.
  constexpr double kBase = 2e9, kPerPixel = 64;
  const double memory_bytes = kBase + kPerPixel * 1e6 * limits.image_megapixels;
  SharedMemory memory;
  Ending ending{};
  {
    const std::lock_guard hold(LibraryLock());
    PrepareLibrary();
    (void)OIIO::geterror();  // forget complaints about earlier files
    ending =
        RunConfined({limits.image_seconds, static_cast<size_t>(memory_bytes)}, [&] { Decode(file, limits, memory); });
  }
  const auto bytes = memory.Bytes();
  if (ending == Ending::kTookTooLong)
    throw InputError(file, "", "the image can't be decoded within " + std::to_string(limits.image_seconds) + " s",
                     "Write the file again, or raise CROWNFIT_MAX_IMAGE_SECONDS on a slow machine.");
  if (ending == Ending::kNeededTooMuchMemory)
    Damaged(file, "decoding it needs more than " + std::to_string(static_cast<int>(1e-6 * memory_bytes)) + " MB");
  if (ending != Ending::kDone || bytes.size() < sizeof(Found))
    Damaged(file, "the library that decodes it crashed on it");

  Found found;
  std::memcpy(&found, bytes.data(), sizeof found);
  ImageFile result;
  result.image = Image(found.width, found.height, found.channels);
  Check(bytes.size() == sizeof found + sizeof(float) * result.image.values.size(), "a decoded image has its size");
  std::memcpy(result.image.values.data(), bytes.data() + sizeof found, bytes.size() - sizeof found);
  for (float v : result.image.values) {
    if (!std::isfinite(v)) throw InputError(file, "", "the image holds a value that is not finite (NaN or infinity)");
  }
  result.is_jpeg = found.is_jpeg;
  result.is_integer = found.is_integer;
  result.is_srgb_encoded = found.is_srgb_encoded;
  result.has_colour_profile = found.has_colour_profile;
  if (found.has_white_balance)
    result.white_balance =
        std::array<double, 3>{found.white_balance[0], found.white_balance[1], found.white_balance[2]};
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
  const std::lock_guard hold(LibraryLock());
  PrepareLibrary();
  OIIO::ImageBuf buffer(OIIO::ImageSpec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT),
                        image.values.data());
  const std::vector<float> colour(image.channels, grey);
  OIIO::ImageBufAlgo::render_text(buffer, x, y, text, size_px, "DejaVuSans", colour);
  (void)OIIO::geterror();
}

}  // namespace crownfit
