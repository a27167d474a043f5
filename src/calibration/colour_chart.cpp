#include "calibration/colour_chart.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/json_file.h"
#include "photo/colour.h"

namespace crownfit {
namespace {

/// Maps the unit square to a quadrilateral (Heckbert 1989, section 2.2.3).
struct Projective {
  glm::dmat3 m;
  explicit Projective(const ChartCorners& q) {
    const glm::dvec2 d1 = q[1] - q[2], d2 = q[3] - q[2], s = q[0] - q[1] + q[2] - q[3];
    const double determinant = d1.x * d2.y - d2.x * d1.y;
    const double g = (s.x * d2.y - d2.x * s.y) / determinant, h = (d1.x * s.y - s.x * d1.y) / determinant;
    const glm::dvec2 a = q[1] - q[0] + g * q[1], b = q[3] - q[0] + h * q[3];
    m = glm::dmat3(glm::dvec3(a, g), glm::dvec3(b, h), glm::dvec3(q[0], 1.0));
  }
  glm::dvec2 operator()(double u, double v) const {
    const glm::dvec3 p = m * glm::dvec3(u, v, 1.0);
    return glm::dvec2(p) / p.z;
  }
};

bool IsInside(const glm::dvec2 (&q)[4], const glm::dvec2& p) {
  for (int i = 0; i < 4; ++i) {
    const glm::dvec2 a = q[(i + 1) % 4] - q[i], b = p - q[i];
    const glm::dvec2 c = q[(i + 2) % 4] - q[(i + 1) % 4];
    if ((a.x * b.y - a.y * b.x) * (a.x * c.y - a.y * c.x) < 0) return false;
  }
  return true;
}

}  // namespace

Chart ReadChart(const std::string& name_or_file) {
  const auto known = ChartTexts().find(name_or_file + ".json");
  const JsonFile file =
      known != ChartTexts().end() ? JsonFile("calib/" + name_or_file + ".json", known->second) : JsonFile(name_or_file);
  const JsonObject root = file.RootOfFormat("crownfit-chart/1", {"name", "columns", "illuminant", "patches"});
  Chart chart;
  chart.name = root.Require("name").String();
  chart.columns = root.Require("columns").Integer(1, 100);
  root.Require("illuminant").OneOf({"D50"});
  for (const JsonNode& node : root.Require("patches").Items()) {
    const JsonObject patch(node, {"name", "lab"});
    const auto lab = patch.Require("lab").Numbers(3);
    chart.patches.push_back({patch.Require("name").String(), LinearRgbFromLabD50({lab[0], lab[1], lab[2]})});
  }
  if (chart.patches.empty() || chart.patches.size() % chart.columns)
    root.Require("patches").Fail("holds " + std::to_string(chart.patches.size()) +
                                 " patches, which is not a number of whole rows");
  return chart;
}

std::vector<PatchReading> ReadPatches(const Image& linear, const Chart& chart, const ChartCorners& corners, double gap,
                                      const glm::dvec3& saturation, double margin) {
  // Size of the chart between the outer edges of its first and last patches, in patches.
  const double width = chart.columns + gap * (chart.columns - 1), height = chart.rows() + gap * (chart.rows() - 1);
  const Projective place(corners);
  std::vector<PatchReading> readings;
  for (int i = 0; i < static_cast<int>(chart.patches.size()); ++i) {
    const int column = i % chart.columns, row = i / chart.columns;
    const double u = column * (1 + gap), v = row * (1 + gap);
    PatchReading reading;
    const glm::dvec2 of_patch[] = {
        {margin, margin}, {1 - margin, margin}, {1 - margin, 1 - margin}, {margin, 1 - margin}};
    glm::dvec2 low(1e9), high(-1e9);
    for (int k = 0; k < 4; ++k) {
      reading.corners[k] = place((u + of_patch[k].x) / width, (v + of_patch[k].y) / height);
      low = glm::min(low, reading.corners[k]);
      high = glm::max(high, reading.corners[k]);
    }
    glm::dvec3 sum(0.0), squares(0.0);
    double count = 0, saturated = 0;
    if (low.x >= 0 && low.y >= 0 && high.x <= linear.width && high.y <= linear.height)
      for (int y = static_cast<int>(low.y); y < std::min<double>(high.y, linear.height); ++y)
        for (int x = static_cast<int>(low.x); x < std::min<double>(high.x, linear.width); ++x) {
          if (!IsInside(reading.corners, {x + 0.5, y + 0.5})) continue;
          glm::dvec3 value;
          bool is_saturated = false;
          for (int c = 0; c < 3; ++c) {
            value[c] = linear.at(x, y, std::min(c, linear.channels - 1));
            is_saturated |= value[c] >= saturation[c];
          }
          sum += value;
          squares += value * value;
          ++count;
          saturated += is_saturated;
        }
    if (count < 4) {
      reading.damage = "outside the picture or smaller than 4 pixels";
    } else {
      reading.mean = sum / count;
      const glm::dvec3 variance = glm::max(glm::dvec3(0), squares / count - reading.mean * reading.mean);
      const double brightest = std::max({reading.mean.x, reading.mean.y, reading.mean.z, 1e-9});
      reading.spread = std::sqrt(std::max({variance.x, variance.y, variance.z})) / brightest;
      reading.saturated = saturated / count;
      if (reading.saturated > 0.01) reading.damage = "saturated";
    }
    readings.push_back(reading);
  }
  // Noise, texture and fall-off spread all patches alike; noise that does not depend on light spreads dark ones more. A
  // patch that spreads far more is scratched, stained or half hidden.
  double brightest = 0;
  for (const auto& r : readings) brightest = std::max(brightest, r.mean.y);
  const auto spread_of = [&](const PatchReading& r) {
    const double level = std::max({r.mean.x, r.mean.y, r.mean.z});
    return r.spread * level / (level + 0.05 * brightest);
  };
  std::vector<double> spreads;
  for (const auto& r : readings)
    if (r.damage.empty()) spreads.push_back(spread_of(r));
  if (spreads.size() > 3) {
    std::nth_element(spreads.begin(), spreads.begin() + static_cast<std::ptrdiff_t>(spreads.size() / 2), spreads.end());
    const double limit = std::max(0.05, 4.0 * spreads[spreads.size() / 2]);
    for (auto& r : readings)
      if (r.damage.empty() && spread_of(r) > limit) r.damage = "uneven: scratched, stained, in glare or half hidden";
  }
  return readings;
}

ChartCorners RefineCorners(const Image& linear, const Chart& chart, const ChartCorners& corners, double gap) {
  const auto unevenness = [&](const ChartCorners& c) {
    double sum = 0;
    for (const PatchReading& r : ReadPatches(linear, chart, c, gap, glm::dvec3(1e30), 0.12))
      sum += r.mean == glm::dvec3(0.0) ? 1.0 : std::min(r.spread, 0.5);
    return sum;
  };
  ChartCorners best = corners;
  double least = unevenness(best);
  const double patch_px = glm::length(corners[1] - corners[0]) / (chart.columns * (1 + gap));
  // Shifts, stretches and moves of single corners, in ever smaller steps.
  double step = 0.4 * patch_px;
  for (int finer = 0; finer < 6; ++finer, step *= 0.6)
    for (bool moved = true; moved;) {
      moved = false;
      const ChartCorners from = best;
      for (int which = 1; which < 16; ++which)
        for (const glm::dvec2& direction : {glm::dvec2(1, 0), glm::dvec2(-1, 0), glm::dvec2(0, 1), glm::dvec2(0, -1)}) {
          if (which != 15 && which != 3 && which != 6 && which != 12 && which != 9 && (which & (which - 1))) continue;
          ChartCorners tried = from;
          for (int k = 0; k < 4; ++k)
            if (which >> k & 1) tried[k] += step * direction;
          const double value = unevenness(tried);
          if (value < least * 0.999) best = tried, least = value, moved = true;
        }
    }
  return best;
}

}  // namespace crownfit
