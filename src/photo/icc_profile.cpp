#include "photo/icc_profile.h"

#include <lcms2.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace crownfit {
namespace {

constexpr int kPoints = 65536;  // every value of 16 bits

std::string DescriptionOf(cmsHPROFILE profile) {
  char text[80] = "";
  cmsGetProfileInfoASCII(profile, cmsInfoDescription, "en", "US", text, sizeof text);
  std::string name = text;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return c < 32 || c > 126 || c == '\''; }, '?');
  return name;
}

bool HasSrgbPrimaries(cmsHPROFILE profile) {
  // Adapted to D50, as profiles have them.
  constexpr double kSrgb[3][3] = {{0.43607, 0.22249, 0.01392}, {0.38515, 0.71687, 0.09708}, {0.14307, 0.06061, 0.7141}};
  constexpr cmsTagSignature kTags[] = {cmsSigRedColorantTag, cmsSigGreenColorantTag, cmsSigBlueColorantTag};
  for (int c = 0; c < 3; ++c) {
    const auto* xyz = static_cast<const cmsCIEXYZ*>(cmsReadTag(profile, kTags[c]));
    if (!xyz) return false;
    const double off =
        std::max({std::abs(xyz->X - kSrgb[c][0]), std::abs(xyz->Y - kSrgb[c][1]), std::abs(xyz->Z - kSrgb[c][2])});
    if (off > 0.01) return false;
  }
  return true;
}

}  // namespace

IccProfile ReadIccProfile(std::span<const std::byte> bytes, int channels) {
  IccProfile result;
  const std::unique_ptr<void, decltype(&cmsCloseProfile)> profile(
      cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())), cmsCloseProfile);
  if (!profile) {
    result.fault = "its ICC profile is damaged";
    return result;
  }
  result.name = DescriptionOf(profile.get());
  const cmsColorSpaceSignature space = cmsGetColorSpace(profile.get());
  const bool is_grey = space == cmsSigGrayData;
  if (!is_grey && space != cmsSigRgbData) {
    const auto code = static_cast<unsigned>(space);
    result.fault = "its ICC profile is for the colour space '" +
                   std::string{static_cast<char>(code >> 24), static_cast<char>(code >> 16 & 255),
                               static_cast<char>(code >> 8 & 255), static_cast<char>(code & 255)} +
                   "', not for RGB or grey";
    return result;
  }
  if (is_grey && channels > 2) {
    result.fault = "its ICC profile is for grey pictures, but it has colours";
    return result;
  }
  constexpr cmsTagSignature kCurves[] = {cmsSigRedTRCTag, cmsSigGreenTRCTag, cmsSigBlueTRCTag};
  result.is_linear = true;
  for (int c = 0; c < 3; ++c) {
    const auto* curve =
        static_cast<const cmsToneCurve*>(cmsReadTag(profile.get(), is_grey ? cmsSigGrayTRCTag : kCurves[c]));
    if (!curve) {
      result.fault = "its ICC profile '" + result.name + "' has no tone curves";
      return result;
    }
    result.curve[c].resize(kPoints);
    for (int i = 0; i < kPoints; ++i) {
      const float value = static_cast<float>(i) / (kPoints - 1), light = cmsEvalToneCurveFloat(curve, value);
      result.curve[c][i] = light;
      if (!(light >= -0.01f && light <= 1.01f) || (i > 0 && light < result.curve[c][i - 1] - 1e-6f)) {
        result.fault = "a tone curve of its ICC profile '" + result.name + "' does not rise from 0 to 1";
        return result;
      }
      result.is_linear = result.is_linear && std::abs(light - value) < 2e-5f;
    }
  }
  result.has_srgb_primaries = is_grey || HasSrgbPrimaries(profile.get());
  return result;
}

}  // namespace crownfit
