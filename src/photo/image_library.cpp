#include "photo/image_library.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "photo/font.h"
#include "photo/raw_levels.h"
#include "photo/stated_encoding.h"

namespace crownfit {
namespace {

/// Settings of LibRaw. Its "linear" colour space would mix the channels and clip negative values; "raw" keeps the
/// camera's own bands.
OIIO::ImageSpec CameraRawSettings() {
  OIIO::ImageSpec settings;
  settings.attribute("raw:ColorSpace", "raw");
  settings.attribute("raw:Demosaic", "linear");
  settings.attribute("raw:auto_bright", 0);
  settings.attribute("raw:use_camera_wb", 1);
  settings.attribute("raw:user_flip", 0);
  return settings;
}

/// Factors of the camera's white balance as shot, green's 1; nothing where the file has none.
std::optional<std::array<double, 3>> WhiteBalance(const OIIO::ImageSpec& spec) {
  const auto* factors = spec.find_attribute("raw:cam_mul");
  if (!factors || !(factors->get_float_indexed(0) > 0) || !(factors->get_float_indexed(1) > 0) ||
      !(factors->get_float_indexed(2) > 0))
    return std::nullopt;
  const double green = factors->get_float_indexed(1);
  return std::array<double, 3>{factors->get_float_indexed(0) / green, 1.0, factors->get_float_indexed(2) / green};
}

/// LibRaw's values are such that the smallest factor of the white balance is 1, which green's is to be, and that full
/// scale is 1 for the lowest of the black levels.
void ScaleRaw(const std::filesystem::path& file, const DecodedImage& image, float* values) {
  const std::array<double, 3> levels = RawFullScaleFactors(file);
  const size_t pixels = static_cast<size_t>(image.width) * image.height;
  for (size_t i = 0; i < pixels; ++i)
    for (int c = 0; c < std::min(3, image.channels); ++c)
      values[i * image.channels + c] *= static_cast<float>(image.full_scale * levels[c]);
}

/// Whether the file's ending is one of those that belong to LibRaw.
bool IsCameraRaw(const std::filesystem::path& file) {
  const auto endings = OIIO::get_extension_map();
  const auto of_raw = endings.find("raw");
  std::string ending = OIIO::Strutil::lower(file.extension().string());
  if (of_raw == endings.end() || ending.empty()) return false;
  ending.erase(0, 1);
  return std::find(of_raw->second.begin(), of_raw->second.end(), ending) != of_raw->second.end();
}

/// What OpenImageIO reads wrongly.
void CheckTiff(const std::filesystem::path& file, const OIIO::ImageSpec& spec) {
  const int bits = spec.get_int_attribute("oiio:BitsPerSample", static_cast<int>(8 * spec.format.basesize()));
  constexpr int kWhiteIsZero = 0;
  if (bits < 8 && spec.get_string_attribute("compression", "none") == "none")
    throw InputError(
        file, "",
        "is an uncompressed TIFF with fewer than 8 bits a sample (" + std::to_string(bits) + "), which can't be read",
        "Write it with 8 bits, or as PNG.");
  if (bits > 8 && spec.get_int_attribute("tiff:PhotometricInterpretation", 1) == kWhiteIsZero)
    throw InputError(file, "", "is a TIFF in which 0 stands for white, which can't be read with 16 bits",
                     "Write it with black as 0 (\"MinIsBlack\"), or as PNG.");
}

/// Refuses a picture whose channels are neither those wanted nor R, G, B, nor a single one. Samples of other formats
/// than EXR have no names of their own, and count in their order.
void CheckChannels(const std::filesystem::path& file, const std::string& format, const OIIO::ImageSpec& spec,
                   const std::vector<std::string>& wanted) {
  const std::vector<std::string>& found = spec.channelnames;
  const auto is_called = [&](size_t c) { return OIIO::Strutil::iequals(found[c], std::string(1, "RGB"[c])); };
  const size_t first = std::min<size_t>(3, found.size());
  size_t right = 0;
  while (right < first && is_called(right)) ++right;
  if (right == 3 || found.size() - (spec.alpha_channel >= 0) < 2) return;
  if (wanted.size() == 3 || wanted.empty() || format != "openexr") {
    if (first == 3)
      DamagedImage(file,
                   "its channel " + std::to_string(right) + " is called '" + found[right] + "', expected R, G and B");
    return;
  }
  const auto missing = std::find_if(wanted.begin(), wanted.end(), [&](const std::string& name) {
    return std::find(found.begin(), found.end(), name) == found.end();
  });
  throw InputError(file, "", "has no channel called '" + *missing + "'; it has " + OIIO::Strutil::join(found, ", "),
                   "Give the file's channels the names that the capture lists in \"channels\".");
}

/// Checks a picture's header before memory is allocated.
void CheckHeader(const std::filesystem::path& file, const std::string& format, const OIIO::ImageSpec& spec,
                 const std::vector<std::string>& wanted, bool by_name, const Limits& limits) {
  // OpenImageIO also reads films, network streams and generated pictures.
  const std::set<std::string> known{"openexr", "png", "tiff", "jpeg", "raw",     "hdr",
                                    "bmp",     "pnm", "webp", "dpx",  "jpeg2000"};
  if (format == "heif")  // the library turns them and does not say so
    throw InputError(file, "",
                     "HEIC and AVIF are not read: neither how they are turned nor how they are encoded is known",
                     "Photograph in RAW, or convert it to TIFF or PNG.");
  if (!known.contains(format)) DamagedImage(file, "photographs are not read in the format '" + format + "'");
  const auto size = std::to_string(spec.width) + " x " + std::to_string(spec.height);
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1)
    DamagedImage(file, "its size " + size + " is not valid");
  if (static_cast<double>(spec.width) * spec.height > 1e6 * limits.image_megapixels)
    throw InputError(
        file, "",
        "the image has " + size + " pixels, more than " + std::to_string(static_cast<int>(limits.image_megapixels)) +
            " million",
        "Crop the photographs to the crown and calibrate at that size, or raise CROWNFIT_MAX_IMAGE_MEGAPIXELS.");
  if (spec.deep) DamagedImage(file, "it has deep pixels; write it with flat ones");
  if (format != "raw" && IsCameraRaw(file))
    throw InputError(file, "", "LibRaw can't decode this camera RAW, and what else it holds is a preview",
                     "Convert it to a DNG with an uncompressed mosaic of integers.");
  if (format == "tiff") CheckTiff(file, spec);
  const bool has_wanted = spec.nchannels - (spec.alpha_channel >= 0) == static_cast<int>(wanted.size());
  if (format != "openexr" && spec.nchannels > 3 && !(spec.nchannels == 4 && spec.alpha_channel == 3) && !has_wanted)
    throw InputError(
        file, "", "has " + std::to_string(spec.nchannels) + " channels, of which no three are known to be R, G and B",
        "Write three channels, or three and alpha.");
  if (format != "openexr") return;
  if (spec.x != spec.full_x || spec.y != spec.full_y || spec.width != spec.full_width ||
      spec.height != spec.full_height)
    throw InputError(file, "",
                     "its data window (" + size + " from " + std::to_string(spec.x) + ", " + std::to_string(spec.y) +
                         ") is not its display window (" + std::to_string(spec.full_width) + " x " +
                         std::to_string(spec.full_height) + " from " + std::to_string(spec.full_x) + ", " +
                         std::to_string(spec.full_y) + ")",
                     "Write the whole picture without cropping: the camera's calibration refers to it.");
  if (!by_name) CheckChannels(file, format, spec, wanted);
}

/// Where the named channels lie; empty unless all are there.
std::vector<int> PlacesOf(const std::vector<std::string>& names, const std::vector<std::string>& channels) {
  std::vector<int> places;
  for (const std::string& name : names) {
    const auto at = std::find(channels.begin(), channels.end(), name);
    if (at == channels.end()) return {};
    places.push_back(static_cast<int>(at - channels.begin()));
  }
  return places;
}

/// Whether an EXR has an alpha, and not only one of a layer.
bool HasOwnAlpha(const OIIO::ImageSpec& spec) {
  return spec.alpha_channel >= 0 &&
         spec.channelnames[static_cast<size_t>(spec.alpha_channel)].find('.') == std::string::npos;
}

/// Wraps pixels in place for OpenImageIO's functions.
OIIO::ImageBuf Wrapped(int width, int height, int channels, float* values) {
  return {OIIO::ImageSpec(width, height, channels, OIIO::TypeDesc::FLOAT), values};
}

/// The ids of this process's threads.
std::set<std::string> Threads() {
  std::set<std::string> numbers;
  std::error_code gone_meanwhile;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task", gone_meanwhile))
    numbers.insert(thread.path().filename());
  return numbers;
}

/// Waits, for a second at most, until all threads that are not in `before` have ended.
void WaitForThreadsBut(const std::set<std::string>& before) {
  using namespace std::chrono_literals;
  const auto are_gone = [&] {
    const std::set<std::string> now = Threads();
    return std::includes(before.begin(), before.end(), now.begin(), now.end());
  };
  for (int i = 0; i < 1000 && !are_gone(); ++i) std::this_thread::sleep_for(1ms);
}

class OpenImageIo : public ImageLibrary {
 public:
  OpenImageIo() {
    // OpenImageIO runs on the calling thread, so that a forked child lacks none of its threads. The thread that starts
    // its pool deregisters under a spin lock. A child forked before that thread has ended may wait for the lock for
    // ever.
    const std::set<std::string> before = Threads();
    const bool takes_settings =
        OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1) &&
        !OIIO::get_string_attribute("format_list").empty();  // looked up here once, not in each child
    Check(takes_settings, "OpenImageIO takes its settings");
    WaitForThreadsBut(before);
  }

  void Decode(const std::filesystem::path& file, const std::vector<std::string>& channels, const Limits& limits,
              const std::function<std::span<std::byte>(size_t)>& memory) const override {
    OIIO::ImageSpec settings = CameraRawSettings();
    settings.attribute("oiio:UnassociatedAlpha", 1);  // values as stored: alpha must not multiply light
    (void)OIIO::geterror();                           // forget complaints about earlier files
    auto input = OIIO::ImageInput::open(file.string(), &settings);
    if (input && std::string(input->format_name()) == "raw" && !WhiteBalance(input->spec())) {
      // Without one as shot, LibRaw would take daylight's.
      const float even[4] = {1, 1, 1, 1};
      settings.attribute("raw:use_camera_wb", 0);
      settings.attribute("raw:user_mul", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 4), even);
      input = OIIO::ImageInput::open(file.string(), &settings);
    }
    if (!input) DamagedImage(file, OIIO::geterror());
    OIIO::ImageSpec spec = input->spec();
    const std::string format = input->format_name();
    // Programs declare a second or fourth sample to be alpha that is a channel as the others are.
    if (format == "tiff" && spec.nchannels == static_cast<int>(channels.size())) spec.alpha_channel = -1;
    std::vector<int> chosen = format == "openexr" ? PlacesOf(channels, spec.channelnames) : std::vector<int>();
    CheckHeader(file, format, spec, channels, !chosen.empty(), limits);
    const bool has_alpha_beside = !chosen.empty() && HasOwnAlpha(spec) &&
                                  std::find(chosen.begin(), chosen.end(), spec.alpha_channel) == chosen.end();
    if (has_alpha_beside) chosen.push_back(spec.alpha_channel);
    DecodedImage found{};
    found.width = spec.width;
    found.height = spec.height;
    // Of an EXR, channels after R, G, B and alpha are layers of other pictures.
    const bool has_more = format != "openexr" && spec.nchannels > 4;
    found.channels = !chosen.empty()                          ? static_cast<int>(chosen.size())
                     : spec.nchannels < 4 || has_more         ? spec.nchannels
                     : spec.alpha_channel == 3                ? 4
                     : static_cast<int>(channels.size()) == 4 ? 4
                                                              : 3;
    found.alpha_channel = has_alpha_beside                                        ? found.channels - 1
                          : chosen.empty() && spec.alpha_channel < found.channels ? spec.alpha_channel
                                                                                  : -1;
    found.is_jpeg = format == "jpeg";
    found.bits = static_cast<int>(8 * spec.format.basesize());
    found.is_integer = !spec.format.is_floating_point();
    found.full_scale = 1.0;
    if (const auto balance = WhiteBalance(spec); balance && format == "raw") {
      found.has_white_balance = true;
      std::copy(balance->begin(), balance->end(), found.white_balance);
      found.full_scale = *std::min_element(balance->begin(), balance->end());
    }
    const StatedTransfer stated = TransferOf(file, format, spec);
    found.transfer = stated.kind;
    found.gamma = stated.gamma;
    found.has_foreign_primaries =
        stated.profile.fault.empty() && !stated.profile.curve[0].empty() && !stated.profile.has_srgb_primaries;
    found.curve_points = stated.kind == Transfer::Kind::kCurve ? stated.profile.curve[0].size() : 0;
    std::snprintf(found.source, sizeof found.source, "%s", stated.source.c_str());
    std::snprintf(found.fault, sizeof found.fault, "%s", stated.fault.c_str());
    const size_t values = static_cast<size_t>(spec.width) * spec.height * found.channels;
    const auto bytes = memory(sizeof found + sizeof(float) * (values + 3 * found.curve_points));
    std::memcpy(bytes.data(), &found, sizeof found);
    auto* pixels = reinterpret_cast<float*>(bytes.data() + sizeof found);
    bool read = true;
    if (chosen.empty()) {
      read = input->read_image(0, 0, 0, found.channels, OIIO::TypeDesc::FLOAT, pixels);
    } else {
      std::vector<float> all(static_cast<size_t>(spec.width) * spec.height * spec.nchannels);
      read = input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, all.data());
      for (size_t i = 0; i < values; ++i)
        pixels[i] = all[i / chosen.size() * spec.nchannels + chosen[i % chosen.size()]];
    }
    // read_image returns true on truncated TIFF files: a non-empty error string is a failure too.
    const std::string complaint = input->geterror() + OIIO::geterror();
    if (!read || !complaint.empty()) DamagedImage(file, complaint);
    for (size_t c = 0; c < 3 && found.curve_points > 0; ++c)
      std::copy(stated.profile.curve[c].begin(), stated.profile.curve[c].end(),
                pixels + values + c * found.curve_points);
    if (format == "raw") ScaleRaw(file, found, pixels);
    if (format == "hdr") {
      const std::array<double, 3> scale = HdrScale(file);
      for (size_t i = 0; i < values; ++i) pixels[i] = static_cast<float>(pixels[i] / scale[i % found.channels]);
    }
  }

  void Write(const std::filesystem::path& file, const std::filesystem::path& beside, const Image& image, bool half,
             const std::vector<std::string>& channels) const override {
    const bool is_exr = file.extension() == ".exr";
    OIIO::ImageSpec spec(image.width, image.height, image.channels,
                         !is_exr ? OIIO::TypeDesc::UINT8
                         : half  ? OIIO::TypeDesc::HALF
                                 : OIIO::TypeDesc::FLOAT);
    if (!channels.empty()) spec.channelnames = channels;
    // EXR requires a date. The same picture must give the same file, because files are identified by their hash.
    if (is_exr)
      spec.attribute("DateTime", "1970:01:01 00:00:00");
    else
      spec.attribute("oiio:ColorSpace", "sRGB");
    if (file.extension() == ".jpg") {
      spec.attribute("CompressionQuality", 92);
      spec.attribute("jpeg:subsampling", "4:4:4");
    }
    const auto output = OIIO::ImageOutput::create(beside.string());
    if (!output || !output->open(beside.string(), spec) ||
        !output->write_image(OIIO::TypeDesc::FLOAT, image.values.data()) || !output->close())
      throw InputError(file, "", "the image can't be written: " + (output ? output->geterror() : OIIO::geterror()));
  }

  Image Resized(const Image& image, int width, int height) const override {
    Image result(width, height, image.channels);
    std::vector<float> values = image.values;
    const OIIO::ImageBuf from = Wrapped(image.width, image.height, image.channels, values.data());
    OIIO::ImageBuf to = Wrapped(width, height, image.channels, result.values.data());
    Check(OIIO::ImageBufAlgo::resize(to, from, "box"), "a picture that can be resized");
    return result;
  }

  void DrawText(Image& image, int x, int y, int size_px, const std::string& text, float grey) const override {
    // OpenImageIO can't clip all of it.
    if (x < 0 || y < size_px || x >= image.width || y >= image.height) return;
    OIIO::ImageBuf buffer = Wrapped(image.width, image.height, image.channels, image.values.data());
    const std::vector<float> colour(image.channels, grey);
    // Elsewhere the font is found by name; OpenImageIO 2.5 finds only fonts that lie in /usr/share/fonts itself.
    std::error_code ignored;
    const std::string font = std::filesystem::exists(kFontFile, ignored) ? kFontFile : "DejaVuSans";
    OIIO::ImageBufAlgo::render_text(buffer, x, y, text, size_px, font, colour);
    (void)buffer.geterror();
  }
};

}  // namespace

extern "C" const ImageLibrary* CrownfitImageLibrary() {
  static const OpenImageIo library;
  return &library;
}

}  // namespace crownfit
