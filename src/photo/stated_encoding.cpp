#include "photo/stated_encoding.h"

#include <cmath>
#include <cstdint>
#include <fstream>
#include <optional>
#include <sstream>

#include "base/error.h"

namespace crownfit {
namespace {

uint32_t BigEndian(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  for (size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

/// The content of a PNG's chunk before its pixels, at most its first 64 bytes; nothing where there is none.
std::optional<std::string> PngChunk(const std::filesystem::path& file, const std::string& type) {
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(8);
  for (std::string header(8, '\0'); stream.read(header.data(), 8);) {
    const uint32_t length = BigEndian(header, 0);
    const std::string name = header.substr(4);
    if (name == "IDAT") break;
    if (name == type) {
      std::string content(std::min<uint32_t>(length, 64), '\0');
      if (!stream.read(content.data(), static_cast<std::streamsize>(content.size()))) break;
      return content;
    }
    stream.seekg(static_cast<std::streamoff>(length) + 4, std::ios::cur);
  }
  return std::nullopt;
}

StatedTransfer Undecoded(const std::string& fault) { return {Transfer::Kind::kUnknown, 1.0, "", fault, {}}; }

StatedTransfer OfGamma(double gamma, const std::string& source) {
  using Kind = Transfer::Kind;
  constexpr double kSame = 0.01;
  if (std::abs(gamma - 1.0) < kSame) return {Kind::kLinear, 1.0, source, "", {}};
  // PNG 3, 11.3.2.4: writers of sRGB state 45455 for programs that know no better.
  if (std::abs(gamma - 2.2) < kSame) return {Kind::kSrgb, 1.0, source, "", {}};
  return {Kind::kGamma, gamma, source, "", {}};
}

/// Of PNG's chunk: primaries, transfer function, matrix, full range. Transfer functions by their number in ITU-T H.273,
/// table 3.
StatedTransfer OfCicp(const std::string& chunk) {
  using Kind = Transfer::Kind;
  const int number = static_cast<unsigned char>(chunk[1]);
  const std::string source = "cICP " + std::to_string(number);
  if (chunk[3] != 1) return Undecoded("its encoding (cICP with narrow range) is not decoded");
  if (number == 8) return {Kind::kLinear, 1.0, source, "", {}};
  if (number == 13) return {Kind::kSrgb, 1.0, source, "", {}};
  if (number == 4) return {Kind::kGamma, 2.2, source, "", {}};
  if (number == 5) return {Kind::kGamma, 2.8, source, "", {}};
  return Undecoded("its encoding (cICP, transfer function " + std::to_string(number) + ") is not decoded");
}

StatedTransfer OfProfile(const OIIO::ParamValue& icc, int channels) {
  StatedTransfer stated;
  stated.profile =
      ReadIccProfile({static_cast<const std::byte*>(icc.data()), static_cast<size_t>(icc.datasize())}, channels);
  stated.source = "ICC profile '" + stated.profile.name + "'";
  stated.fault = stated.profile.fault;
  if (stated.fault.empty()) stated.kind = stated.profile.is_linear ? Transfer::Kind::kLinear : Transfer::Kind::kCurve;
  return stated;
}

}  // namespace

StatedTransfer TransferOf(const std::filesystem::path& file, const std::string& format, const OIIO::ImageSpec& spec) {
  using Kind = Transfer::Kind;
  if (format == "raw") return {Kind::kLinear, 1.0, "camera RAW", "", {}};
  const bool is_png = format == "png";
  if (is_png)
    if (const auto cicp = PngChunk(file, "cICP"); cicp && cicp->size() == 4) return OfCicp(*cicp);
  if (const auto* icc = spec.find_attribute("ICCProfile")) return OfProfile(*icc, spec.nchannels);
  if (is_png && PngChunk(file, "iCCP")) return Undecoded("its ICC profile can't be read");
  if (spec.format.is_floating_point()) return {Kind::kLinear, 1.0, "floating point", "", {}};
  if (format == "webp") return Undecoded("what a WebP file says of its encoding is not read");
  if (is_png && !PngChunk(file, "sRGB"))
    if (const auto gama = PngChunk(file, "gAMA"); gama && gama->size() == 4 && BigEndian(*gama, 0) > 0)
      return OfGamma(1e5 / BigEndian(*gama, 0), "gAMA");
  if (is_png) return {Kind::kSrgb, 1.0, "PNG", "", {}};
  if (spec.format.basesize() == 1) return {Kind::kSrgb, 1.0, "8 bits", "", {}};
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  if (format == "pnm" || (format == "dpx" && space.find("inear") != space.npos))
    return {Kind::kLinear, 1.0, format, "", {}};
  return {};
}

std::array<double, 3> HdrScale(const std::filesystem::path& file) {
  std::array<double, 3> scale{1, 1, 1};
  std::ifstream stream(file, std::ios::binary);
  std::string line;
  while (std::getline(stream, line) && !line.empty() && line != "\r") {
    double factor[3] = {1, 1, 1};
    if (line.starts_with("EXPOSURE="))
      factor[0] = factor[1] = factor[2] = std::strtod(line.c_str() + 9, nullptr);
    else if (line.starts_with("COLORCORR="))
      std::istringstream(line.substr(10)) >> factor[0] >> factor[1] >> factor[2];
    for (int c = 0; c < 3; ++c) scale[c] *= factor[c];
  }
  for (const double s : scale)
    if (!(s > 0 && std::isfinite(s)))
      throw InputError(file, "", "its EXPOSURE or COLORCORR is not a positive number",
                       "Write the file again, as EXR best.");
  std::string first, second;
  stream >> first >> line >> second;
  if (first != "-Y" || second != "+X")
    throw InputError(file, "", "its rows run " + first + " " + second + ", not from the top left (-Y +X)",
                     "Write the file again, as EXR best.");
  return scale;
}

}  // namespace crownfit
