#pragma once
// Colours of spectra.

#include <optional>
#include <span>
#include <vector>

#include "photo/colour.h"

namespace crownfit {

/// Linear sRGB of each channel's value 1, from reflectances in channels of these wavelengths: CIE 1931 observer (2
/// degrees), D65, reflectance linear between neighbouring channels and constant beyond the outermost. White is (1, 1,
/// 1). Empty unless at least 8 channels cover 400 to 700 nm, so that every wavelength there is within 30 nm of a
/// channel.
std::optional<std::vector<glm::dvec3>> ObserverColumns(std::span<const double> wavelengths_nm);

/// Whether the colours of a camera with these channels are known without a colour file: of three they are taken as
/// linear sRGB, of many they follow from the observer.
bool HaveColour(std::span<const double> wavelengths_nm);

/// The transform for channels without a colour file. Where there is no colour, it shows the mean as grey.
ColourTransform ColourOfChannels(std::span<const double> wavelengths_nm);

}  // namespace crownfit
