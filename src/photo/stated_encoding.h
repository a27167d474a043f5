#pragma once
// What picture files say of their values, in places that OpenImageIO does not look at too.

#include <OpenImageIO/imageio.h>

#include <array>
#include <filesystem>
#include <string>

#include "photo/icc_profile.h"
#include "photo/transfer.h"

namespace crownfit {

struct StatedTransfer {
  Transfer::Kind kind = Transfer::Kind::kUnknown;
  double gamma = 1.0;
  std::string source, fault;  ///< as in Transfer
  IccProfile profile;
};

/// What a file states of how its values are encoded, the strongest statement first (PNG 3, 4.3: cICP, iCCP, sRGB,
/// gAMA). `format`: OpenImageIO's name.
StatedTransfer TransferOf(const std::filesystem::path& file, const std::string& format, const OIIO::ImageSpec& spec);

/// What a Radiance picture's values are to be divided by: EXPOSURE, and COLORCORR of each channel; each line of them
/// multiplies (Ward 1991). Throws InputError where its rows do not run from the top left.
std::array<double, 3> HdrScale(const std::filesystem::path& file);

}  // namespace crownfit
