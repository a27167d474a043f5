#pragma once
// A camera's RAW file, made by hand: 16 bits, uncompressed, RGGB.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>

namespace crownfit {

struct Dng {
  int width = 64, height = 48;
  std::array<uint16_t, 4> black{2048, 2048, 2048, 2048};  ///< of each place of the mosaic, row by row
  uint16_t white = 15000;
  bool is_mosaic = true;                         ///< otherwise every pixel has red, green and blue, each `counts`
  std::array<double, 3> neutral{0.5, 1.0, 0.8};  ///< what a white card gives, over green
  std::function<uint16_t(int x, int y)> counts;
};

void WriteDng(const std::filesystem::path& file, const Dng& dng);

}  // namespace crownfit
