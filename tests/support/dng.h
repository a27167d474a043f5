#pragma once
// A camera's RAW file, made by hand: 16 bits, uncompressed, RGGB.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>

namespace crownfit {

struct Dng {
  int width = 64, height = 48;
  uint16_t black = 2048, white = 15000;
  std::array<double, 3> neutral{0.5, 1.0, 0.8};  ///< what a white card gives, over green
  std::function<uint16_t(int x, int y)> counts;
};

void WriteDng(const std::filesystem::path& file, const Dng& dng);

}  // namespace crownfit
