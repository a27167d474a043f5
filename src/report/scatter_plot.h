#pragma once
// Points over two logarithmic axes, as an SVG picture: cost against benefit.

#include <string>
#include <vector>

namespace crownfit {

struct ScatterPoint {
  double x = 0, y = 0;  ///< above 0
  std::string label;
  size_t series = 0;
  bool is_on_front = false;
};

struct ScatterPlot {
  std::string title, x_title, y_title;
  std::vector<std::string> series;  ///< names of the groups of points; at most four
  std::vector<ScatterPoint> points;
  struct Level {
    double y;
    std::string label;
  };
  std::vector<Level> levels;  ///< dashed horizontal lines
};

/// Marks the points that no other one beats in both x and y: the Pareto front of two costs.
void MarkFront(std::vector<ScatterPoint>& points);

/// The picture, 760 x 500. Points on the front are filled, and a line joins them.
std::string ScatterPlotSvg(const ScatterPlot& plot);

}  // namespace crownfit
