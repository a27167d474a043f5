#include "photo/raw_levels.h"

#include <libraw/libraw.h>

#include <algorithm>
#include <memory>

namespace crownfit {
namespace {

/// Black levels: one of the whole picture, one of each colour (red, green, blue, second green), and a pattern of rows
/// and columns that repeats; they add up.
double PatternAt(const libraw_colordata_t& levels, unsigned row, unsigned column) {
  const unsigned rows = levels.cblack[4], columns = levels.cblack[5];
  return rows * columns > 0 ? levels.cblack[6 + (row % rows) * columns + column % columns] : 0.0;
}

}  // namespace

std::array<double, 3> RawFullScaleFactors(const std::filesystem::path& file) {
  std::array<double, 3> factors{1, 1, 1};
  const auto raw = std::make_unique<LibRaw>();  // too large for the stack
  if (raw->open_file(file.c_str()) != LIBRAW_SUCCESS) return factors;
  const libraw_colordata_t& levels = raw->imgdata.color;
  const bool is_mosaic = raw->imgdata.idata.filters != 0;
  // Mosaics repeat after 2, 6 or 16 pixels, black levels after their own number of rows and columns.
  const unsigned rows = 48 * std::clamp(levels.cblack[4], 1u, 8u), columns = 48 * std::clamp(levels.cblack[5], 1u, 8u);
  // Of a picture that is no mosaic, LibRaw divides by white alone.
  double sum[3] = {0, 0, 0}, count[3] = {0, 0, 0}, lowest = is_mosaic ? 1e9 : 0.0;
  for (unsigned row = 0; row < rows; ++row)
    for (unsigned column = 0; column < columns; ++column)
      for (int colour = 0; colour < 3; ++colour) {
        const int here = is_mosaic ? raw->COLOR(static_cast<int>(row), static_cast<int>(column)) : colour;
        if (here < 0 || here > 3 || (here == 3 ? 1 : here) != colour) continue;
        const double black = levels.black + levels.cblack[here] + PatternAt(levels, row, column);
        sum[colour] += black;
        ++count[colour];
        lowest = std::min(lowest, black);
      }
  for (int colour = 0; colour < 3; ++colour) {
    const double mean = count[colour] > 0 ? sum[colour] / count[colour] : lowest;
    if (levels.maximum > mean) factors[colour] = (levels.maximum - lowest) / (levels.maximum - mean);
  }
  return factors;
}

}  // namespace crownfit
