#include "scene/crown_input.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "base/error.h"
#include "base/files.h"
#include "base/limits.h"
#include "capture/capture.h"
#include "geometry/signed_distance.h"
#include "scene/cast_photograph.h"

namespace crownfit {
namespace {

/// Light is followed through the air from camera and lamps: neither may stand inside the object.
void CheckNothingStandsInside(const Capture& capture, const TriangleMesh& outer) {
  const RayCaster caster({&outer});
  for (const PhotographSpec& photo : capture.photographs) {
    const RigidTransform object_from_camera = photo.camera_from_object.Inverse();
    const auto refuse_inside = [&](const glm::dvec3& place, const char* key, const std::string& what) {
      if (IsInside(caster, outer, place))
        throw InputError(capture.file, photo.key + key,
                         "in photograph '" + photo.name + "' " + what + " is inside the object",
                         "Check lengths (mm) and frames (\"object\" or \"camera\").");
    };
    refuse_inside(object_from_camera.translation_mm, ".camera_from_object", "the camera");
    for (size_t l : photo.lights)
      if (const auto place = PlaceOf(capture.lights[l], object_from_camera))
        refuse_inside(*place, ".lights", "the light '" + capture.lights[l].name + "'");
  }
}

/// Whether a grid of rays meets the object: a face may be in the picture though none of its corners is.
bool FillsPicture(const PhotographSpec& photo, const TriangleMesh& outer) {
  constexpr int kRays = 32;
  const RayCaster caster({&outer});
  const RigidTransform object_from_camera = photo.camera_from_object.Inverse();
  for (int y = 0; y < kRays; ++y)
    for (int x = 0; x < kRays; ++x) {
      const glm::dvec2 pixel((x + 0.5) * photo.camera.width / kRays, (y + 0.5) * photo.camera.height / kRays);
      const glm::dvec3 direction = object_from_camera.Direction(DirectionFromPixel(photo.camera, pixel));
      if (caster.Nearest(object_from_camera.translation_mm, direction)) return true;
    }
  return false;
}

void CheckObjectIsInPicture(const Capture& capture, const TriangleMesh& outer) {
  for (const PhotographSpec& photo : capture.photographs) {
    bool seen = false;
    for (size_t v = 0; v < outer.vertices.size() && !seen; ++v) {
      const auto pixel = PixelFromPoint(photo.camera, photo.camera_from_object.Point(outer.vertices[v]));
      seen = pixel && pixel->x >= 0 && pixel->y >= 0 && pixel->x < photo.camera.width && pixel->y < photo.camera.height;
    }
    seen = seen || FillsPicture(photo, outer);
    if (!seen)
      throw InputError(
          capture.file, photo.key + ".camera_from_object",
          "in photograph '" + photo.name + "' no part of the object is in front of the camera and inside the picture",
          "Check translation_mm (z is the distance along the view) and the origin of the mesh.");
  }
}

/// Checks that need no knowledge of the object's place in the picture.
void CheckAnyPixelIsUsable(const Capture& capture, const PhotographSpec& spec, const Photograph& photo) {
  bool is_black = true;
  size_t usable = 0;
  for (size_t p = 0; p < photo.usable.size(); ++p) {
    if (!photo.usable[p]) continue;
    ++usable;
    is_black &= PixelOf(photo.linear, p).Largest() <= 0;
  }
  if (usable > 0 && !is_black) return;
  if (usable > 0)
    throw InputError(
        capture.file, spec.key + ".file",
        "photograph '" + spec.name + "' is black: none of its " + std::to_string(usable) + " usable pixels is above 0",
        "Check its exposure, dark frame and file, or remove the photograph.");
  throw InputError(
      capture.file, spec.key,
      "photograph '" + spec.name + "' has no usable pixel: " +
          (photo.transparent_pixels > 0 ? std::to_string(photo.transparent_pixels) + " have an alpha below 1"
           : photo.saturated_pixels > 0 ? "all " + std::to_string(photo.saturated_pixels) + " in the mask are saturated"
                                        : "its mask has no value above 0.5"),
      "Expose it less, correct the mask, or remove the photograph.");
}

/// Counting one picture twice would claim information that does not exist: intervals would silently be too narrow by
/// the square root of 2.
void CheckPicturesDiffer(const Capture& capture, const std::vector<Photograph>& photographs) {
  for (size_t i = 0; i < photographs.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (photographs[i].linear.width == photographs[k].linear.width &&
          photographs[i].linear.values == photographs[k].linear.values)
        throw InputError(capture.file, capture.photographs[i].key + ".file",
                         "photograph '" + capture.photographs[i].name + "' is the same picture as '" +
                             capture.photographs[k].name + "', pixel for pixel, and would count twice",
                         "Remove one of the two.");
}

/// Pixels in the part of the picture that the object may fill: the box around its vertices.
double PixelsAround(const PhotographSpec& photo, const TriangleMesh& outer) {
  glm::dvec2 low(photo.camera.width, photo.camera.height), high(0.0);
  for (const glm::dvec3& v : outer.vertices)
    if (const auto pixel = PixelFromPoint(photo.camera, photo.camera_from_object.Point(v)))
      low = glm::min(low, *pixel), high = glm::max(high, *pixel);
  low = glm::max(low, glm::dvec2(0.0)), high = glm::min(high, glm::dvec2(photo.camera.width, photo.camera.height));
  return std::max(0.0, high.x - low.x) * std::max(0.0, high.y - low.y);
}

/// Reads one after the other, so that only one is held in full. One that has more pixels on the crown than its light
/// has detail is averaged: all of its light is used, at the time and memory of a small picture.
void ReadPhotographs(CrownInput& input) {
  const double most_pixels = 1e6 * InputLimits().crown_megapixels;
  std::string averaged;
  for (PhotographSpec& spec : input.capture.photographs) {
    Photograph photo = ReadPhotograph(spec.files);
    if (photo.linear.width != spec.camera.width || photo.linear.height != spec.camera.height)
      throw InputError(spec.files.image, "",
                       "is " + std::to_string(photo.linear.width) + " x " + std::to_string(photo.linear.height) +
                           " pixels, but " + spec.camera_file.filename().string() + " says " +
                           std::to_string(spec.camera.width) + " x " + std::to_string(spec.camera.height),
                       "Use the camera file of this resolution, and do not crop or resize the photograph.");
    CheckAnyPixelIsUsable(input.capture, spec, photo);
    const bool noise_is_known = spec.has_noise_file || spec.files.variance;
    if (const int side = AverageCrown(*input.source.meshes[0], most_pixels, noise_is_known, spec, photo); side > 1)
      averaged +=
          (averaged.empty() ? "" : ", ") + spec.name + " " + std::to_string(side) + " x " + std::to_string(side);
    input.photographs.push_back(std::move(photo));
  }
  if (!averaged.empty())
    input.source.messages.push_back("Large photographs were averaged over squares of pixels (docs/limits.md): " +
                                    averaged);
  CheckPicturesDiffer(input.capture, input.photographs);
}

/// Missing files are named before anything is computed.
void RequirePictures(const Capture& capture) {
  for (const PhotographSpec& photo : capture.photographs)
    for (const auto& file : {std::optional(photo.files.image), photo.files.mask, photo.files.variance}) {
      std::error_code ignored;
      if (file && !std::filesystem::is_regular_file(*file, ignored))
        throw InputError(
            *file, "", "there is no such image file",
            RemedyOfMissing(*file, "Photograph '" + photo.name + "' of " + capture.file.filename().string() +
                                       " names it: correct the path, or copy the file there."));
    }
}

}  // namespace

std::optional<glm::dvec3> PlaceOf(const Light& light, const RigidTransform& object_from_camera) {
  struct Centre {
    std::optional<glm::dvec3> operator()(const PointLight& l) const { return l.position_mm; }
    std::optional<glm::dvec3> operator()(const DiskLight& l) const {
      return l.inner_radius_mm > 0 ? std::nullopt : std::optional(l.centre_mm);
    }
    std::optional<glm::dvec3> operator()(const RectangleLight& l) const { return l.centre_mm; }
    std::optional<glm::dvec3> operator()(const DirectionalLight&) const { return std::nullopt; }
    std::optional<glm::dvec3> operator()(const DomeLight&) const { return std::nullopt; }
    std::optional<glm::dvec3> operator()(const EnvironmentLight&) const { return std::nullopt; }
  };
  const auto place = std::visit(Centre{}, light.shape);
  return place && light.in_camera_frame ? std::optional(object_from_camera.Point(*place)) : place;
}

int AverageCrown(const TriangleMesh& outer, double most_pixels, bool noise_is_known, PhotographSpec& spec,
                 Photograph& photo, double least_usable) {
  const int side = static_cast<int>(std::lround(std::sqrt(PixelsAround(spec, outer) / most_pixels)));
  if (side <= 1) return 1;
  photo = Averaged(std::move(photo), side, noise_is_known, least_usable);
  spec.camera = WithPixels(spec.camera, photo.linear.width, photo.linear.height, side, side);
  if (spec.blur)
    for (auto& gaussian : spec.blur->psf) gaussian.sigma_px /= side;
  return side;
}

CrownInput ReadInput(const Capture& capture, int threads, bool with_images) {
  RequirePhotographs(capture);
  if (with_images) RequirePictures(capture);
  CrownInput input;
  input.capture = capture;
  input.source = ReadCrownSource(capture, threads);
  for (auto& message : KeepBuildable(input.source, input.capture)) input.source.messages.push_back(std::move(message));
  CheckObjectIsInPicture(capture, *input.source.meshes[0]);
  CheckNothingStandsInside(capture, *input.source.meshes[0]);
  if (with_images) ReadPhotographs(input);
  input.scenery = ReadScenery(capture);
  return input;
}

}  // namespace crownfit
