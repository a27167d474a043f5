#include "calibration/find_chart.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <opencv2/mcc.hpp>

#include "calibration/estimate_colour.h"
#include "calibration/opencv_image.h"

namespace crownfit {

std::optional<ChartCorners> FindClassicChart(const ImageFile& photo, const Image& linear, const Chart& chart) {
  const cv::Mat bgr = Bgr8(photo);
  const auto detector = cv::mcc::CCheckerDetector::create();
  std::optional<ChartCorners> best;
  double best_agreement = -1;
  for (const double size : {0.0, 1500.0, 2250.0, 3000.0}) {
    const double scale = size > 0 ? size / std::max(bgr.cols, bgr.rows) : 1.0;
    if (size > 0 && scale <= 1.0) continue;
    cv::Mat picture = bgr;
    if (size > 0) cv::resize(bgr, picture, {}, scale, scale, cv::INTER_CUBIC);
    if (!detector->process(picture, cv::mcc::MCC24, 1)) continue;
    const std::vector<cv::Point2f> box = detector->getBestColorChecker()->getBox();
    if (box.size() != 4) continue;
    ChartCorners corners;
    for (int k = 0; k < 4; ++k) corners[k] = (glm::dvec2(box[k].x, box[k].y) + 0.5) / scale;
    corners = RefineCorners(linear, chart, corners, kClassicGap);
    const double agreement = AgreementOf(chart, ReadPatches(linear, chart, corners, kClassicGap, glm::dvec3(1e30)));
    if (agreement > best_agreement) best = corners, best_agreement = agreement;
    if (agreement > 0.97) break;
  }
  return best;
}

}  // namespace crownfit
