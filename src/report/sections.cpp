#include "report/sections.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "geometry/signed_distance.h"
#include "photo/image_io.h"

namespace crownfit {
namespace {

constexpr int kPanel = 360, kMargin = 14, kTextLine = 22;
constexpr glm::vec3 kPaper(1.0f);
/// Darker from the outside inward, so that grey prints keep them apart.
const glm::vec3 kLayerColours[] = {
    {0.80f, 0.87f, 0.93f}, {0.93f, 0.80f, 0.55f}, {0.76f, 0.36f, 0.33f}, {0.45f, 0.35f, 0.60f}, {0.25f, 0.25f, 0.25f}};

const glm::vec3& ColourOf(size_t layer) { return kLayerColours[std::min(layer, std::size(kLayerColours) - 1)]; }

void Fill(Image& image, int x, int y, int width, int height, const glm::vec3& colour) {
  for (int v = y; v < y + height; ++v)
    for (int u = x; u < x + width; ++u)
      for (int c = 0; c < 3; ++c) image.at(u, v, c) = colour[c];
}

}  // namespace

Image SectionFigure(const std::vector<TriangleMesh>& surfaces, const std::vector<std::string>& names, int threads) {
  glm::dvec3 low(1e300), high(-1e300);
  std::vector<RayCaster> casters;
  for (const TriangleMesh& surface : surfaces) {
    const auto [a, b] = Bounds(surface);
    low = glm::min(low, a), high = glm::max(high, b);
    casters.emplace_back(std::vector<const TriangleMesh*>{&surface});
  }
  const glm::dvec3 middle = 0.5 * (low + high), size = high - low;
  const double mm_per_pixel = 1.05 * std::max({size.x, size.y, size.z}) / kPanel;

  Image figure(3 * kPanel + 4 * kMargin, kPanel + 3 * kMargin + 2 * kTextLine, 3, kPaper.x);
  // Axes to the right and upwards on the page.
  struct Slice {
    int right, up;
    const char* title;
  };
  constexpr Slice kSlices[] = {{0, 1, "x right, y up"}, {2, 1, "z right, y up"}, {0, 2, "x right, z up"}};
  for (int s = 0; s < 3; ++s) {
    const int x0 = kMargin + s * (kPanel + kMargin), y0 = kMargin + kTextLine;
    DrawText(figure, x0, kMargin + 14, 14, kSlices[s].title, 0.25f);
    ParallelFor(kPanel, threads, [&](size_t row) {
      for (int column = 0; column < kPanel; ++column) {
        glm::dvec3 p = middle;
        p[kSlices[s].right] += (column - 0.5 * kPanel + 0.5) * mm_per_pixel;
        p[kSlices[s].up] -= (static_cast<double>(row) - 0.5 * kPanel + 0.5) * mm_per_pixel;
        for (size_t layer = surfaces.size(); layer-- > 0;) {
          if (!IsInside(casters[layer], surfaces[layer], p)) continue;
          Fill(figure, x0 + column, y0 + static_cast<int>(row), 1, 1, ColourOf(layer));
          break;
        }
      }
    });
  }
  const int y = kPanel + 2 * kMargin + kTextLine;
  int x = kMargin;
  for (size_t layer = 0; layer < surfaces.size(); ++layer) {
    Fill(figure, x, y, 28, 16, ColourOf(layer));
    DrawText(figure, x + 36, y + 13, 14, names[layer], 0.25f);
    x += 60 + 9 * static_cast<int>(names[layer].size());
  }
  const int bar = static_cast<int>(std::lround(2.0 / mm_per_pixel));
  Fill(figure, figure.width - kMargin - bar, y + 6, bar, 3, glm::vec3(0.2f));
  DrawText(figure, figure.width - kMargin - bar - 50, y + 13, 14, "2 mm", 0.25f);
  return figure;
}

}  // namespace crownfit
