#include "calibration/scan_poses_product.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/contours.h"
#include "calibration/draw.h"
#include "capture/poses.h"

namespace crownfit {
namespace {

Image Overlay(const RayCaster& caster, const std::vector<int>& parts, const ScanPhotograph& photo,
              const RigidTransform& pose) {
  const double zoom = std::min(4.0, 900.0 / photo.linear->width);
  Image picture = DisplayCopy(*photo.linear, zoom);
  const int step = std::max(1, static_cast<int>(std::lround(1.0 / zoom)));
  for (const auto& c : Contours(caster, parts, photo.camera, photo.start, step))
    DrawDot(picture, zoom * c.pixel, 0.8, {0.9, 0.1, 0.1});
  for (const auto& c : Contours(caster, parts, photo.camera, pose, step))
    DrawDot(picture, zoom * c.pixel, 0.8, {0.1, 0.9, 0.1});
  return picture;
}

}  // namespace

Product ScanPosesProduct(const TriangleMesh& mesh, const std::vector<std::string>& names,
                         const std::vector<ScanPhotograph>& photographs, const std::vector<AlignedScan>& aligned) {
  constexpr double kLeastContrast = 0.3, kLeastMatched = 0.25, kGoodMatched = 0.85, kLargestRms_px = 4.0,
                   kLargestSize = 0.03, kGoodSize = 0.01;
  const RayCaster caster({&mesh});
  const std::vector<int> parts = ConnectedParts(mesh);
  const auto [low, high] = Bounds(mesh);
  const glm::dvec3 centre = 0.5 * (low + high);
  Product product;
  product.format = "crownfit-poses/1";
  std::vector<StatedPose> poses;
  for (size_t k = 0; k < photographs.size(); ++k) {
    const bool together = aligned.size() == 1;
    const AlignedScan& a = aligned[together ? 0 : k];
    const size_t i = together ? k : 0;
    const std::string& name = names[k];
    const auto& c = a.covariance[i];
    const double scale = std::max(1.0, photographs[k].linear->width / 1440.0);
    product.figures.push_back({name + "_contour_rms", a.rms_px[i], "px"});
    product.figures.push_back({name + "_contour_matched", 100 * a.matched[i], "%"});
    product.figures.push_back({name + "_colour_contrast", a.contrast[i], ""});
    product.figures.push_back(
        {name + "_rotation_stddev", std::sqrt(std::max({c[0], c[7], c[14]})) * 180 / std::numbers::pi, "deg"});
    const glm::dmat3 place = PlaceCovariance(c, a.camera_from_object[i].Point(centre));
    product.figures.push_back({name + "_across_stddev", std::sqrt(std::max(place[0][0], place[1][1])), "mm"});
    product.figures.push_back({name + "_along_view_stddev", std::sqrt(place[2][2]), "mm"});
    if (a.contrast[i] < kLeastContrast)
      product.refusals.push_back(name + ": the object has nearly the colour of its surroundings (contrast " +
                                 Text(a.contrast[i]) + ", below the limit of " + Text(kLeastContrast) +
                                 "). Photograph it on a background of another colour, or use a jig.");
    else if (a.matched[i] < kLeastMatched || a.rms_px[i] > kLargestRms_px * scale)
      product.refusals.push_back(
          name + ": " + Text(100 * a.matched[i], "%") + " of the outline lies on an edge, off by " +
          Text(a.rms_px[i], "px") +
          ". The rough pose is too far off, the scan is of another object or not in mm, or the camera file is wrong.");
    else if (a.from_start >= 1.0)
      product.refusals.push_back(
          name +
          ": the outline fits best more than three times --search-mm and --search-deg away from the rough pose. Look "
          "at the picture, and give a better rough pose, or search further.");
    else if (a.matched[i] < kGoodMatched)
      product.notes.push_back(name + ": only " + Text(100 * a.matched[i], "%") +
                              " of the outline lies on an edge. Look at the picture.");
    poses.push_back({name, a.camera_from_object[i], c});
    AppendBelow(product.picture, Overlay(caster, parts, photographs[k], a.camera_from_object[i]));
  }
  for (size_t k = 0; k < aligned.size(); ++k) {
    // One photograph separates size from distance only through the camera's focal length, which is not enough.
    const AlignedScan& a = aligned[k];
    if (a.camera_from_object.size() < 2) continue;
    product.figures.push_back({"size", 100 * (1 + a.larger), "% of the mesh"});
    product.figures.push_back({"size_stddev", 100 * a.larger_stddev, "%"});
    if (const double off = std::abs(a.larger); off > 3 * a.larger_stddev && off > kLargestSize)
      product.refusals.push_back("the object is " + Text(100 * a.larger, "%") + " larger than its mesh. " +
                                 (off > 0.15
                                      ? "The mesh may be enlarged for sintering, or not in mm."
                                      : "The jig may be printed at another scale, or the crown is another one."));
    else if (off > 3 * a.larger_stddev && off > kGoodSize)
      product.notes.push_back("the object is " + Text(100 * a.larger, "%") +
                              " larger than its mesh. Check that the jig was printed at 100 %.");
  }
  product.content = {{"poses", PosesJson(poses)}};
  return product;
}

}  // namespace crownfit
