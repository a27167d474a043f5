#include "photo/colour.h"
#include "report/crown_fit.h"

namespace crownfit {

std::vector<std::string> PhotographCaveats(const Capture& capture, const std::vector<Photograph>& photographs) {
  std::vector<std::string> caveats;
  bool every_exposure_free = true, encoded = false, colour_known = true, noise_known = true;
  std::string jpegs;
  const PhotographSpec* first_raw = nullptr;
  std::optional<std::array<double, 3>> white_balance;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const PhotographSpec& p = capture.photographs[i];
    const Photograph& photo = photographs[i];
    if (photo.white_balance) {
      if (!first_raw) {
        first_raw = &p, white_balance = photo.white_balance;
      } else if (photo.white_balance != white_balance) {
        caveats.push_back(
            "White balance differs between the camera's files of '" + first_raw->name + "' and '" + p.name +
            "': their red and blue stand on different scales. Set one white balance for all photographs.");
      }
    }
    if (photo.has_ignored_profile)
      caveats.push_back("'" + p.name +
                        "' carries a colour profile, so it is probably display-encoded; its values were taken as "
                        "linear light. Export it linear, or give the camera's RAW file.");
    if (p.is_holdout) continue;
    every_exposure_free &= p.exposure_is_free;
    encoded |= photo.was_srgb_encoded;
    if (photo.was_jpeg) jpegs += (jpegs.empty() ? "" : ", ") + p.name;
    colour_known &= p.has_colour_file;
    noise_known &= p.has_noise_file || p.files.variance.has_value();
  }
  if (!colour_known && !AreRedGreenBlue(capture.wavelengths_nm))
    caveats.push_back(
        "The channels are " + BandsText(capture.wavelengths_nm) +
        ": not red, green and blue in this order, which is that of the pictures' planes. Values count for "
        "the bands as stated; colours, CIEDE2000 and shades are those of pictures in false colours.");
  if (encoded)
    caveats.push_back(
        "The light was not calibrated: photographs are display-encoded (8-bit, sRGB assumed, the camera's own tone "
        "curve unknown). Ratios between bright and dark, and with them absorption and thickness, can't be trusted.");
  if (!jpegs.empty())
    caveats.push_back("JPEG (" + jpegs +
                      "): compression and sharpening move values by several per cent, alike over blocks of 8 pixels, "
                      "which no noise model here contains. Use the camera's RAW files.");
  if (encoded && !colour_known)
    caveats.push_back(
        "The colour was not calibrated: no colour chart, white balance unknown. Differences between the channels, and "
        "with them the colour of absorption and scattering, can't be trusted.");
  if (every_exposure_free)
    caveats.push_back(
        "Every exposure is free, so absolute reflectance is not identified: only the pattern over the crown and the "
        "channels' ratios speak.");
  if (!noise_known)
    caveats.push_back("No noise calibration: 1 % relative noise was assumed, and error bars rest on it.");
  return caveats;
}

}  // namespace crownfit
