#include <algorithm>
#include <array>

#include "base/error.h"
#include "calibration/draw.h"
#include "calibration/estimate_camera.h"

namespace crownfit {

double Coverage(const std::vector<CameraView>& views, const CameraEstimate& estimate) {
  constexpr int kCells = 8;
  std::array<bool, kCells * kCells> seen{};
  for (size_t v : estimate.used)
    for (const auto& p : views[v].corners.pixel) {
      const int x = std::clamp(static_cast<int>(kCells * p.x / estimate.camera.width), 0, kCells - 1);
      const int y = std::clamp(static_cast<int>(kCells * p.y / estimate.camera.height), 0, kCells - 1);
      seen[y * kCells + x] = true;
    }
  return static_cast<double>(std::count(seen.begin(), seen.end(), true)) / (kCells * kCells);
}

namespace {

/// Every corner and its residual, enlarged fifty times, over the picture's frame; below it the rms of every view.
Image CameraPicture(const std::vector<CameraView>& views, const CameraEstimate& estimate) {
  const double scale = std::min(1.0, 900.0 / estimate.camera.width);
  const int width = static_cast<int>(estimate.camera.width * scale),
            height = static_cast<int>(estimate.camera.height * scale);
  constexpr int kLine = 18;
  const int lines = static_cast<int>(views.size()) + 2;
  Image picture(std::max(width, 480), height + kLine * lines, 3, 1.0f);
  DrawRectangle(picture, {0, 0}, {width - 1, height - 1}, {0.6, 0.6, 0.6});
  for (size_t i = 0; i < estimate.used.size(); ++i) {
    const BoardView& corners = views[estimate.used[i]].corners;
    const glm::dvec3 colour = DistinctColour(i);
    for (size_t k = 0; k < corners.pixel.size(); ++k) {
      const auto predicted = PixelFromPoint(estimate.camera, estimate.camera_from_board[i].Point(corners.board_mm[k]));
      if (!predicted) continue;
      const glm::dvec2 at = corners.pixel[k] * scale;
      DrawLine(picture, at, at + 50.0 * scale * (*predicted - corners.pixel[k]), colour);
      DrawDot(picture, at, 1.5, colour);
    }
  }
  int y = height + kLine;
  DrawText(picture, 6, y - 4, 12, "corners; lines: residuals, 50 times as long. rms " + Text(estimate.rms_px, "px"),
           0.0f);
  for (size_t v = 0; v < views.size(); ++v) {
    y += kLine;
    const auto at = std::find(estimate.used.begin(), estimate.used.end(), v);
    const bool used = at != estimate.used.end();
    if (used)
      FillRectangle(picture, {6, y - 12},
                    {6 + 150 * std::min(1.0, estimate.view_rms_px[v] / (3 * estimate.rms_px)), y - 4},
                    DistinctColour(at - estimate.used.begin()));
    DrawText(picture, 165, y - 4, 12,
             views[v].name + ": " + std::to_string(views[v].corners.pixel.size()) + " corners" +
                 (views[v].corners.pixel.empty() ? "" : ", rms " + Text(estimate.view_rms_px[v], "px")) +
                 (used ? "" : ", not used"),
             0.0f);
  }
  return picture;
}

}  // namespace

Product CameraProduct(const std::vector<CameraView>& views, int width, int height,
                      std::optional<Distortion> distortion) {
  constexpr double kLargestRms_px = 1.0, kLargestFocalError = 0.01, kLeastTilt_deg = 15.0, kGoodCoverage = 0.5;
  constexpr size_t kLeastViews = 4;
  size_t found = 0;
  for (const auto& view : views) found += view.corners.pixel.size() >= 6;
  const std::string advice =
      "Photograph the board 10 to 20 times, tilted 20 to 40 degrees in different directions, so that it reaches every "
      "corner of the picture at least once.";
  if (found < kLeastViews)
    throw InputError("", "",
                     "the board was found in " + std::to_string(found) + " of " + std::to_string(views.size()) +
                         " photographs; at least " + std::to_string(kLeastViews) + " are needed",
                     found ? advice
                           : "Check that --board, --corners and --dictionary are those of the printed board. Flip "
                             "photographs that were taken in a mirror.");
  const auto estimate = EstimateCamera(views, width, height, distortion);
  Check(estimate.has_value(), "four views make a camera");
  const Camera& camera = estimate->camera;

  Product product;
  product.format = "crownfit-camera/1";
  const std::vector<double> coefficients{camera.distortion[0], camera.distortion[1], camera.distortion[2],
                                         camera.distortion[3], camera.distortion[4]};
  product.content = {{"width", camera.width}, {"height", camera.height}, {"fx", camera.fx},           {"fy", camera.fy},
                     {"cx", camera.cx},       {"cy", camera.cy},         {"distortion", coefficients}};
  const auto& s = estimate->stddev;
  product.content.emplace_back("stddev",
                               JsonValue::Object{{"fx", s[0]},
                                                 {"fy", s[1]},
                                                 {"cx", s[2]},
                                                 {"cy", s[3]},
                                                 {"distortion", std::vector<double>(s.begin() + 4, s.end())}});
  const char* names[] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
  const double values[] = {camera.fx,       camera.fy,       camera.cx,       camera.cy,      coefficients[0],
                           coefficients[1], coefficients[2], coefficients[3], coefficients[4]};
  for (int i = 0; i < 9; ++i) {
    if (s[i] == 0) continue;
    product.figures.push_back({names[i], values[i], i < 4 ? "px" : ""});
    product.figures.push_back({std::string(names[i]) + "_stddev", s[i], i < 4 ? "px" : ""});
  }
  const double coverage = Coverage(views, *estimate);
  product.figures.push_back({"rms", estimate->rms_px, "px"});
  product.figures.push_back({"photographs_used", static_cast<double>(estimate->used.size()), ""});
  product.figures.push_back({"coverage", coverage, ""});
  product.figures.push_back({"tilt_range", estimate->tilt_range_deg, "deg"});

  for (size_t v = 0; v < views.size(); ++v) {
    if (std::find(estimate->used.begin(), estimate->used.end(), v) != estimate->used.end()) continue;
    product.notes.push_back(views[v].name + ": " +
                            (views[v].corners.pixel.size() < 6
                                 ? "the board was not found; the photograph is left out"
                                 : "does not fit the others (rms " + Text(estimate->view_rms_px[v], "px") +
                                       "); it is left out. It may show another board, or focus or zoom changed."));
  }
  if (estimate->used.size() < kLeastViews)
    product.refusals.push_back("only " + std::to_string(estimate->used.size()) +
                               " photographs agree with each other. " + advice);
  if (estimate->tilt_range_deg < kLeastTilt_deg)
    product.refusals.push_back("the boards are almost parallel (" + Text(estimate->tilt_range_deg, "degrees") +
                               " between the most different two), so focal length and distance can't be separated. " +
                               advice);
  if (estimate->rms_px > kLargestRms_px)
    product.refusals.push_back("rms " + Text(estimate->rms_px, "px") + " is over " + Text(kLargestRms_px, "px") +
                               ". Check --corners and --square-mm, that the board is flat, and that zoom and focus did "
                               "not change in between.");
  if (const double error = std::max(s[0] / camera.fx, s[1] / camera.fy); error > kLargestFocalError)
    product.refusals.push_back("the focal length is only known to " + Text(100 * error, "%") + ", above the limit of " +
                               Text(100 * kLargestFocalError, "%") + ". " + advice);
  if (coverage < kGoodCoverage)
    product.notes.push_back("corners cover " + Text(100 * coverage, "%") +
                            " of the picture; the distortion is extrapolated over the rest.");
  product.picture = CameraPicture(views, *estimate);
  return product;
}

}  // namespace crownfit
