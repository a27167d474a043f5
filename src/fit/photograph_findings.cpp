#include "fit/judge.h"
#include "photo/observer.h"

namespace crownfit {

std::vector<Finding> PhotographFindings(const Capture& capture, const std::vector<Photograph>& photographs) {
  std::vector<Finding> findings;
  bool every_exposure_free = true, encoded = false, colour_known = true, noise_known = true;
  std::vector<std::string> jpegs;
  const PhotographSpec* first_raw = nullptr;
  std::optional<std::array<double, 3>> white_balance;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const PhotographSpec& p = capture.photographs[i];
    const Photograph& photo = photographs[i];
    if (photo.white_balance) {
      if (!first_raw)
        first_raw = &p, white_balance = photo.white_balance;
      else if (photo.white_balance != white_balance)
        findings.push_back({FindingKind::kWhiteBalanceDiffers, {}, {first_raw->name, p.name}});
    }
    if (photo.has_foreign_primaries && !p.has_colour_file)
      findings.push_back({FindingKind::kForeignPrimaries, {}, {p.name, photo.encoding}});
    if (photo.transparent_pixels > 0)
      findings.push_back({FindingKind::kTransparentPixels, {static_cast<double>(photo.transparent_pixels)}, {p.name}});
    if (p.is_holdout) continue;
    every_exposure_free &= p.exposure_is_free;
    encoded |= photo.is_for_display;
    if (photo.was_jpeg) jpegs.push_back(p.name);
    colour_known &= p.has_colour_file;
    noise_known &= p.has_noise_file || p.files.variance.has_value();
  }
  const std::vector<double>& nm = capture.wavelengths_nm;
  if (!colour_known && !HaveColour(nm))
    findings.push_back({FindingKind::kNoColour, nm});
  else if (!colour_known && nm.size() == 3 && !AreRedGreenBlue(nm))
    findings.push_back({FindingKind::kFalseColours, nm});
  if (encoded) findings.push_back({FindingKind::kLightNotCalibrated});
  if (!jpegs.empty()) findings.push_back({FindingKind::kJpeg, {}, jpegs});
  if (encoded && !colour_known) findings.push_back({FindingKind::kColourNotCalibrated});
  if (every_exposure_free) findings.push_back({FindingKind::kEveryExposureFree});
  if (!noise_known) findings.push_back({FindingKind::kNoiseAssumed});
  return findings;
}

}  // namespace crownfit
