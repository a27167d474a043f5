#pragma once
// How a picture's stored values stand for light.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace crownfit {

/// What a user says of a picture's encoding ("encoding" in capture.json, --encoding).
struct Encoding {
  enum class Kind { kFile, kLinear, kSrgb, kGamma };
  Kind kind = Kind::kFile;  ///< as the file states it
  double gamma = 1.0;       ///< light = value^gamma

  /// From "file", "linear", "srgb" or a gamma such as "2.2". Throws InputError that names `option`.
  static Encoding Named(const std::string& text, const char* option);
};

/// Light from stored values in [0, 1], black level included, relative to the light of 1.
struct Transfer {
  enum class Kind { kUnknown, kLinear, kSrgb, kGamma, kCurve };
  Kind kind = Kind::kUnknown;
  double gamma = 1.0;
  std::array<std::vector<float>, 3> curve;  ///< of kCurve, per channel: light at even steps of the value from 0 to 1
  std::string source;                       ///< who says so: "gAMA", "ICC profile 'Adobe RGB'", "8 bits"
  std::string fault;                        ///< of kUnknown: why the file's own statement can't be decoded

  bool is_encoded() const { return kind != Kind::kLinear && kind != Kind::kUnknown; }
  double Light(double value, int channel) const;
  std::string InWords() const;  ///< "sRGB (ICC profile 'sRGB')"
};

/// What a picture's values stand for: as the user says, or else as the file does. Throws InputError where that is not
/// known. `key`: what the user may write ("encoding", "--encoding").
Transfer Resolved(const Transfer& of_file, const Encoding& asked, const std::filesystem::path& file, const char* key);

double LinearFromSrgb(double encoded);  ///< IEC 61966-2-1
double SrgbFromLinear(double linear);   ///< its inverse, clamped to [0, 1]

}  // namespace crownfit
