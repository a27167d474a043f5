#include "photo/transfer.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace crownfit {

double LinearFromSrgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }

double SrgbFromLinear(double v) {
  v = std::clamp(v, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

Encoding Encoding::Named(const std::string& text, const char* option) {
  if (text == "file") return {};
  if (text == "linear") return {Kind::kLinear, 1.0};
  if (text == "srgb") return {Kind::kSrgb, 1.0};
  double gamma = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), gamma);
  if (error != std::errc() || end != text.data() + text.size() || !(gamma >= 0.2 && gamma <= 5))
    throw InputError("", option, "'" + text + "' is no encoding",
                     "Write file (what the file states), linear, srgb, or a gamma such as 2.2.");
  return {Kind::kGamma, gamma};
}

double Transfer::Light(double value, int channel) const {
  if (kind == Kind::kSrgb) return LinearFromSrgb(value);
  if (kind == Kind::kGamma) return std::copysign(std::pow(std::abs(value), gamma), value);
  if (kind != Kind::kCurve) return value;
  const std::vector<float>& points = curve[static_cast<size_t>(std::min(channel, 2))];
  const double at = std::clamp(value, 0.0, 1.0) * static_cast<double>(points.size() - 1);
  const auto below = std::min(static_cast<size_t>(at), points.size() - 2);
  const double part = at - static_cast<double>(below);
  return (1.0 - part) * points[below] + part * points[below + 1];
}

std::string Transfer::InWords() const {
  const std::string what = kind == Kind::kLinear  ? "linear"
                           : kind == Kind::kSrgb  ? "sRGB"
                           : kind == Kind::kGamma ? "gamma " + Number(gamma)
                           : kind == Kind::kCurve ? "tone curve"
                                                  : "unknown";
  return source.empty() ? what : what + " (" + source + ")";
}

Transfer Resolved(const Transfer& of_file, const Encoding& asked, const std::filesystem::path& file, const char* key) {
  Transfer said;
  said.gamma = asked.gamma;
  said.source = "as stated";
  switch (asked.kind) {
    case Encoding::Kind::kFile:
      if (of_file.kind != Transfer::Kind::kUnknown) return of_file;
      throw InputError(file, key,
                       of_file.fault.empty()
                           ? "holds integers and no colour profile: how its values are encoded is unknown"
                           : of_file.fault,
                       "Export it as TIFF or PNG with an sRGB or a linear profile" +
                           (*key ? std::string(", or state ") + key + ": linear, srgb, or a gamma such as 2.2." : "."));
    case Encoding::Kind::kLinear:
      said.kind = Transfer::Kind::kLinear;
      break;
    case Encoding::Kind::kSrgb:
      said.kind = Transfer::Kind::kSrgb;
      break;
    case Encoding::Kind::kGamma:
      said.kind = Transfer::Kind::kGamma;
      break;
  }
  return said;
}

}  // namespace crownfit
