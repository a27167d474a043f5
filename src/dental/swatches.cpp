#include "dental/swatches.h"

#include <algorithm>

#include "photo/image_io.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

constexpr int kColumn = 170, kBand = 110, kMargin = 22, kLine = 22, kHead = 16;
constexpr float kInk = 0.2f;

void Fill(Image& image, int x, int y, int width, int height, const glm::dvec3& linear) {
  for (int v = y; v < y + height; ++v)
    for (int u = x; u < x + width; ++u)
      for (int c = 0; c < 3; ++c) image.at(u, v, c) = static_cast<float>(SrgbFromLinear(linear[c]));
}

}  // namespace

Image SwatchFigure(const std::vector<Swatch>& swatches, const glm::dvec3& black, const glm::dvec3& white,
                   const glm::dvec3& stump) {
  size_t lines = 0;
  for (const Swatch& s : swatches) lines = std::max(lines, s.captions.size());
  constexpr float kPaper = 0.93f;
  const int left = 4 * kMargin, columns = static_cast<int>(swatches.size());
  Image figure(left + columns * kColumn + kMargin, kHead + 3 * kBand + kMargin + static_cast<int>(lines) * kLine, 3,
               kPaper);
  const glm::dvec3 under[] = {black, white, stump};
  const char* const names[] = {"black", "white", "stump"};
  for (int band = 0; band < 3; ++band) {
    const int y = kHead + band * kBand;
    DrawText(figure, kMargin, y + kBand / 2 + 6, 15, names[band], kInk);
    Fill(figure, left, y, columns * kColumn, kBand, under[band]);
    for (int i = 0; i < columns; ++i) {
      const glm::dvec3 over[] = {swatches[i].over_black, swatches[i].over_white, swatches[i].over_stump};
      Fill(figure, left + i * kColumn + kMargin, y, kColumn - 2 * kMargin, kBand, over[band]);
    }
  }
  for (int i = 0; i < columns; ++i)
    for (size_t line = 0; line < swatches[i].captions.size(); ++line)
      DrawText(figure, left + i * kColumn + kMargin, kHead + 3 * kBand + (static_cast<int>(line) + 1) * kLine, 15,
               swatches[i].captions[line], kInk);
  return figure;
}

}  // namespace crownfit
