#pragma once
// What OpenImageIO does not say of a camera's RAW file.

#include <array>
#include <filesystem>

namespace crownfit {

/// Factors for red, green and blue that make full scale 1 where black levels differ: LibRaw takes each place of the
/// mosaic's own black level away, but divides all by white less the lowest of them; of a demosaiced file, by white
/// itself. 1 where a mosaic has one level and where LibRaw can't open the file.
std::array<double, 3> RawFullScaleFactors(const std::filesystem::path& file);

}  // namespace crownfit
