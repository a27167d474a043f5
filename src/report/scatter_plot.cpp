#include "report/scatter_plot.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/html.h"
#include "base/text.h"

namespace crownfit {
namespace {

constexpr double kWidth = 760, kHeight = 500, kLeft = 72, kRight = 24, kTop = 44, kBottom = 60;
constexpr double kLetter = 6.3, kLine = 14;  // px, for 12 px text
constexpr std::array<const char*, 4> kColours{"#0b5cad", "#c2410c", "#15803d", "#7e22ce"};

std::string Text(double x, double y, const char* anchor, const std::string& words, const char* more = "") {
  return Printed("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" %s>", x, y, anchor, more) + Html(words) + "</text>\n";
}

struct LogAxis {
  double low, high;  ///< log10 of the axis's ends
  double begin, end;
  double At(double v) const { return begin + (end - begin) * (std::log10(v) - low) / (high - low); }
};

/// An axis around all values, with ends at 1, 2 or 5 of a decade.
LogAxis AxisAround(const std::vector<double>& values, double begin, double end) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const auto down = [](double v) {
    const double decade = std::pow(10, std::floor(std::log10(v)));
    return decade * (v >= 5 * decade ? 5 : v >= 2 * decade ? 2 : 1);
  };
  const double low = down(*least / 1.15), under = down(*most * 1.15);
  const double lead = under / std::pow(10, std::floor(std::log10(under)));
  return {std::log10(low), std::log10(under * (lead > 1.5 && lead < 3 ? 2.5 : 2)), begin, end};
}

/// Ticks at 1, 2 and 5 of every decade.
std::vector<double> Ticks(const LogAxis& axis) {
  std::vector<double> ticks;
  for (int decade = static_cast<int>(std::floor(axis.low)); decade <= axis.high; ++decade)
    for (const double lead : {1, 2, 5})
      if (const double at = std::log10(lead) + decade; at > axis.low - 1e-9 && at < axis.high + 1e-9)
        ticks.push_back(lead * std::pow(10, decade));
  return ticks;
}

struct Box {
  double x, y, width, height;  ///< from the top left
  bool Meets(const Box& b) const {
    return x < b.x + b.width && b.x < x + width && y < b.y + b.height && b.y < y + height;
  }
};

/// Place of a label beside its point that overlaps the fewest points and labels.
Box PlaceOf(const std::string& label, double x, double y, const std::vector<Box>& taken) {
  const double width = kLetter * static_cast<double>(label.size());
  Box best{};
  double fewest = HUGE_VAL;
  for (const auto& [right, down] : {std::pair{0, 0}, {1, 0}, {0, -1}, {0, 1}, {1, -1}, {1, 1}, {0, -2}, {0, 2}}) {
    const Box box{right ? x - 9 - width : x + 9, y - 0.5 * kLine + down * kLine, width, kLine};
    double in_the_way = 0;
    for (const Box& b : taken) in_the_way += b.Meets(box);
    if (box.x < kLeft || box.x + width > kWidth - 2) in_the_way += 10;
    if (in_the_way < fewest) fewest = in_the_way, best = box;
  }
  return best;
}

}  // namespace

void MarkFront(std::vector<ScatterPoint>& points) {
  for (ScatterPoint& p : points)
    p.is_on_front = std::none_of(points.begin(), points.end(), [&](const ScatterPoint& q) {
      return q.x <= p.x && q.y <= p.y && (q.x < p.x || q.y < p.y);
    });
}

std::string ScatterPlotSvg(const ScatterPlot& plot) {
  std::vector<double> xs, ys;
  for (const ScatterPoint& p : plot.points) xs.push_back(p.x), ys.push_back(p.y);
  for (const auto& level : plot.levels) ys.push_back(level.y);
  std::string svg = Printed(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %g %g\" width=\"%g\" height=\"%g\" "
      "font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n<rect width=\"100%%\" height=\"100%%\" "
      "fill=\"#fff\"/>\n",
      kWidth, kHeight, kWidth, kHeight);
  svg += Text(kLeft, 24, "start", plot.title, "font-size=\"15\" font-weight=\"bold\"");
  if (plot.points.empty()) return svg + Text(kLeft, 60, "start", "Nothing was measured.") + "</svg>\n";
  const LogAxis across = AxisAround(xs, kLeft, kWidth - kRight), up = AxisAround(ys, kHeight - kBottom, kTop);
  for (const double tick : Ticks(across)) {
    const double x = across.At(tick);
    svg += Printed("<path d=\"M%.1f %.1fV%.1f\" stroke=\"#e2e2e2\"/>\n", x, kTop, kHeight - kBottom);
    svg += Text(x, kHeight - kBottom + 16, "middle", Printed("%g", tick));
  }
  for (const double tick : Ticks(up)) {
    const double y = up.At(tick);
    svg += Printed("<path d=\"M%.1f %.1fH%.1f\" stroke=\"#e2e2e2\"/>\n", kLeft, y, kWidth - kRight);
    svg += Text(kLeft - 6, y + 4, "end", Printed("%g", tick));
  }
  svg += Text(0.5 * (kLeft + kWidth - kRight), kHeight - 24, "middle", plot.x_title);
  svg += Text(0, 0, "middle", plot.y_title,
              Printed("transform=\"translate(18 %.1f) rotate(-90)\"", 0.5 * (kTop + kHeight - kBottom)).c_str());
  std::vector<Box> taken;
  for (const auto& level : plot.levels) {
    const double y = up.At(level.y);
    svg +=
        Printed("<path d=\"M%.1f %.1fH%.1f\" stroke=\"#777\" stroke-dasharray=\"5 4\"/>\n", kLeft, y, kWidth - kRight);
    svg += Text(kWidth - kRight - 4, y - 4, "end", level.label, "fill=\"#555\"");
    const double width = kLetter * static_cast<double>(level.label.size());
    taken.push_back({kWidth - kRight - 4 - width, y - 4 - kLine, width, kLine});
  }
  std::vector<const ScatterPoint*> front;
  for (const ScatterPoint& p : plot.points) {
    taken.push_back({across.At(p.x) - 5, up.At(p.y) - 5, 10, 10});
    if (p.is_on_front) front.push_back(&p);
  }
  std::sort(front.begin(), front.end(), [](const auto* a, const auto* b) { return a->x < b->x; });
  std::string joined;
  for (const ScatterPoint* p : front)
    joined += Printed("%s%.1f %.1f", joined.empty() ? "M" : "L", across.At(p->x), up.At(p->y));
  if (front.size() > 1) svg += "<path d=\"" + joined + "\" fill=\"none\" stroke=\"#222\" stroke-width=\"1.5\"/>\n";
  for (const ScatterPoint& p : plot.points) {
    const double x = across.At(p.x), y = up.At(p.y);
    const char* colour = kColours[p.series % kColours.size()];
    svg += Printed("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"5\" fill=\"%s\" stroke=\"%s\" stroke-width=\"2\"/>\n", x, y,
                   p.is_on_front ? colour : "#fff", colour);
    const Box box = PlaceOf(p.label, x, y, taken);
    taken.push_back(box);
    svg += box.x < x ? Text(x - 9, box.y + 11, "end", p.label) : Text(box.x, box.y + 11, "start", p.label);
  }
  double x = kLeft;
  for (size_t s = 0; s < plot.series.size(); ++s) {
    svg += Printed("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"5\" fill=\"%s\"/>\n", x + 5, kHeight - 6 - 5.0,
                   kColours[s % kColours.size()]);
    svg += Text(x + 15, kHeight - 7, "start", plot.series[s]);
    x += 30 + kLetter * static_cast<double>(plot.series[s].size());
  }
  svg += Text(x + 10, kHeight - 7, "start", "line and filled points: the Pareto front", "fill=\"#555\"");
  return svg + "</svg>\n";
}

}  // namespace crownfit
