#include "fit_steps.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/limits.h"
#include "fit_pixels.h"
#include "geometry/long_axis.h"
#include "geometry/signed_distance.h"

namespace crownfit {
namespace {

/// Where a lamp of finite place stands in the object's frame. A ring may lie around the object.
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

/// Light is followed through the air from camera and lamps: neither may stand inside the object.
void CheckNothingStandsInside(const Capture& capture, const TriangleMesh& outer) {
  const RayCaster caster({&outer});
  for (const PhotographSpec& photo : capture.photographs) {
    const RigidTransform object_from_camera = photo.camera_from_object.Inverse();
    const auto refuse_inside = [&](const glm::dvec3& place, const char* key, const std::string& what) {
      if (IsInside(caster, outer, place))
        throw InputError(capture.file, photo.key + key,
                         "in photograph '" + photo.name + "' " + what + " stands inside the object",
                         "Check lengths (mm) and frames (\"object\" or \"camera\").");
    };
    refuse_inside(object_from_camera.translation_mm, ".camera_from_object", "the camera");
    for (size_t l : photo.lights)
      if (const auto place = PlaceOf(capture.lights[l], object_from_camera))
        refuse_inside(*place, ".lights", "the light '" + capture.lights[l].name + "'");
  }
}

void CheckObjectIsInPicture(const Capture& capture, const TriangleMesh& outer) {
  for (const PhotographSpec& photo : capture.photographs) {
    bool seen = false;
    for (size_t v = 0; v < outer.vertices.size() && !seen; ++v) {
      const auto pixel = PixelFromPoint(photo.camera, photo.camera_from_object.Point(outer.vertices[v]));
      seen = pixel && pixel->x >= 0 && pixel->y >= 0 && pixel->x < photo.camera.width && pixel->y < photo.camera.height;
    }
    if (!seen)
      throw InputError(
          capture.file, photo.key + ".camera_from_object",
          "in photograph '" + photo.name + "' no part of the object is in front of the camera and in the picture",
          "Check translation_mm (z is the distance along the view) and the mesh's origin.");
  }
}

/// What can be said before the object's place in the picture is known.
void CheckAnyPixelIsUsable(const Capture& capture, const PhotographSpec& spec, const Photograph& photo) {
  bool is_black = true;
  size_t usable = 0;
  for (size_t p = 0; p < photo.usable.size(); ++p) {
    if (!photo.usable[p]) continue;
    ++usable;
    for (int c = 0; c < kChannels; ++c) is_black &= photo.linear.values[p * kChannels + c] <= 0;
  }
  if (usable > 0 && !is_black) return;
  if (usable > 0)
    throw InputError(
        capture.file, spec.key + ".file",
        "photograph '" + spec.name + "' is black: none of its " + std::to_string(usable) + " usable pixels is above 0",
        "Check its exposure, its dark frame and its file, or leave the photograph out.");
  throw InputError(
      capture.file, spec.key,
      "photograph '" + spec.name + "' has no usable pixel: " +
          (photo.saturated_pixels > 0 ? "all " + std::to_string(photo.saturated_pixels) + " in the mask are saturated"
                                      : "its mask holds no value above 0.5"),
      "Expose it less, correct the mask, or leave the photograph out.");
}

/// One picture counted twice would claim information that is not there: intervals would be too narrow by the square
/// root of 2, without a word.
void CheckPicturesDiffer(const Capture& capture, const std::vector<Photograph>& photographs) {
  for (size_t i = 0; i < photographs.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (photographs[i].linear.width == photographs[k].linear.width &&
          photographs[i].linear.values == photographs[k].linear.values)
        throw InputError(capture.file, capture.photographs[i].key + ".file",
                         "photograph '" + capture.photographs[i].name + "' is the same picture as '" +
                             capture.photographs[k].name + "', pixel for pixel: it would count twice",
                         "Remove one of the two.");
}

/// Of the part of the picture that the object may fill: the box around its vertices.
double PixelsAround(const PhotographSpec& photo, const TriangleMesh& outer) {
  glm::dvec2 low(photo.camera.width, photo.camera.height), high(0.0);
  for (const glm::dvec3& v : outer.vertices)
    if (const auto pixel = PixelFromPoint(photo.camera, photo.camera_from_object.Point(v)))
      low = glm::min(low, *pixel), high = glm::max(high, *pixel);
  low = glm::max(low, glm::dvec2(0.0)), high = glm::min(high, glm::dvec2(photo.camera.width, photo.camera.height));
  return std::max(0.0, high.x - low.x) * std::max(0.0, high.y - low.y);
}

/// A photograph with more pixels on the crown than its light has detail is averaged over squares of whole pixels: all
/// of its light is used, and time and memory are those of a small picture. The squares' side; 1: left as it is.
int AverageIfLarge(const TriangleMesh& outer, PhotographSpec& spec, Photograph& photo) {
  const double most = 1e6 * InputLimits().crown_megapixels;
  const int side = static_cast<int>(std::lround(std::sqrt(PixelsAround(spec, outer) / most)));
  if (side <= 1) return 1;
  photo = Averaged(std::move(photo), side, spec.has_noise_file || spec.files.variance);
  spec.camera = WithPixels(spec.camera, photo.linear.width, photo.linear.height, side, side);
  if (spec.blur)
    for (auto& gaussian : spec.blur->psf) gaussian.sigma_px /= side;
  return side;
}

/// One after the other, so that only one is held in full.
void ReadPhotographs(CrownInput& input) {
  std::string averaged;
  for (PhotographSpec& spec : input.capture.photographs) {
    Photograph photo = ReadPhotograph(spec.files);
    if (photo.linear.width != spec.camera.width || photo.linear.height != spec.camera.height)
      throw InputError(spec.files.image, "",
                       "is " + std::to_string(photo.linear.width) + " x " + std::to_string(photo.linear.height) +
                           " pixels, but " + spec.camera_file.filename().string() + " says " +
                           std::to_string(spec.camera.width) + " x " + std::to_string(spec.camera.height),
                       "Use the camera file of this resolution; the photograph must not be cropped or resized.");
    CheckAnyPixelIsUsable(input.capture, spec, photo);
    if (const int side = AverageIfLarge(*input.source.meshes[0], spec, photo); side > 1)
      averaged +=
          (averaged.empty() ? "" : ", ") + spec.name + " " + std::to_string(side) + " x " + std::to_string(side);
    input.photographs.push_back(std::move(photo));
  }
  if (!averaged.empty())
    input.source.messages.push_back("Large photographs were averaged over squares of pixels (docs/limits.md): " +
                                    averaged);
  CheckPicturesDiffer(input.capture, input.photographs);
}

double MedianDepth(const Crown& crown) {
  std::vector<double> depth;
  for (const Column& c : crown.columns) depth.push_back(c.straight.total_mm);
  std::nth_element(depth.begin(), depth.begin() + static_cast<long>(depth.size() / 2), depth.end());
  return depth[depth.size() / 2];
}

/// A prediction as the lens shows it. Around the object stands what scenery shows, and elsewhere the photograph itself,
/// which is blurred already: wrong within a blur's width of the rim, where nothing is known.
Image SeenOverPhotograph(const Image& prediction, const PhotographCast& cast, const Photograph& photo, const Blur& blur,
                         double exposure, int threads) {
  Image whole = photo.linear;
  for (const BackgroundPixel& b : cast.background)
    for (int c = 0; c < kChannels; ++c) whole.at(b.x, b.y, c) = static_cast<float>(exposure * b.value[c]);
  for (const PixelCast& pixel : cast.pixels)
    if (!pixel.at_silhouette)
      for (int c = 0; c < kChannels; ++c) whole.at(pixel.x, pixel.y, c) = prediction.at(pixel.x, pixel.y, c);
  const Image seen = Seen(whole, blur, threads);
  Image result = prediction;
  for (const PixelCast& pixel : cast.pixels)
    for (int c = 0; c < kChannels; ++c) result.at(pixel.x, pixel.y, c) = seen.at(pixel.x, pixel.y, c);
  return result;
}

glm::dvec3 PositionOf(const Crown& crown, const Interpolation& at) {
  glm::dvec3 position(0.0);
  for (int i = 0; at.exists() && i < 3; ++i)
    position += static_cast<double>(at.weights[i]) * crown.fine.vertices[at.vertices[i]];
  return position;
}

/// 0, 1, 2: cervical, middle, incisal.
int ThirdOf(double along) { return std::clamp(static_cast<int>(3.0 * along), 0, 2); }

}  // namespace

CrownInput ReadInput(const Capture& capture, int threads, bool with_images) {
  RequirePhotographs(capture);
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

CastState CastAll(const CrownInput& input, const std::vector<double>& thickness_mm, const CastOptions& options,
                  Progress& progress, std::optional<size_t> only) {
  const Capture& capture = input.capture;
  CastState state;
  progress.Show("building the layers", 0.0);
  state.crown = BuildCrown(capture, input.source, thickness_mm, options.threads, options.kernel);
  state.thickness_mm = CastThicknesses(capture, *state.crown, thickness_mm);
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    state.photographs.emplace_back();
    if (only && *only != i) continue;
    progress.Show("casting rays", static_cast<double>(i) / static_cast<double>(capture.photographs.size()),
                  capture.photographs[i].name);
    state.photographs.back() = CastPhotograph(capture, *state.crown, input.scenery, i, options);
  }
  return state;
}

std::vector<double> ThicknessesOf(const Capture& capture, const Material& material) {
  std::vector<double> thickness;
  for (size_t i = 0; i < capture.layers.size(); ++i)
    thickness.push_back(material.layers[i][ThicknessQuantity(capture, i)][0]);
  return thickness;
}

std::vector<double> CastThicknesses(const Capture& capture, const Crown& crown, std::vector<double> built_mm) {
  if (!capture.layers.back()[Quantity::kThickness].fixed) built_mm.back() = MedianDepth(crown);
  return built_mm;
}

bool GeometryIsStale(const FreeParameters& free, const Eigen::VectorXd& cast_at, const Eigen::VectorXd& x,
                     const DataKnowledge& knowledge) {
  constexpr double kMoved = 1e-3;
  for (int k = 0; k < free.count(); ++k) {
    if (!free.entries[k].moves_surface) continue;
    const double stddev = std::sqrt(knowledge.Variance(Eigen::RowVectorXd::Unit(free.count(), k)));
    const double range = free.entries[k].high - free.entries[k].low;
    if (std::abs(x[k] - cast_at[k]) > std::max(kMoved, 0.1 * std::min(stddev, range))) return true;
  }
  return false;
}

Eigen::VectorXd HalfWay(const FreeParameters& free, const Eigen::VectorXd& cast_at, Eigen::VectorXd x) {
  for (int k = 0; k < free.count(); ++k)
    if (free.entries[k].moves_surface) x[k] = 0.5 * (cast_at[k] + x[k]);
  return x;
}

bool AnyBlurred(const Capture& capture) {
  return std::any_of(capture.photographs.begin(), capture.photographs.end(),
                     [](const auto& p) { return p.blur.has_value(); });
}

Predictor PredictorByShader(const CrownInput& input, const CastState& state, const Material& material,
                            const LinearScales& scales, int threads) {
  return [&input, &state, &material, &scales, threads](size_t photograph) {
    return PredictPixels(input.capture, state, photograph, material, scales.light, threads);
  };
}

std::vector<PhotographResult> ComparePhotographs(const CrownInput& input, const CastState& state,
                                                 const Predictor& predict, const LinearScales& scales,
                                                 const std::vector<FitPixels>& fitted, int threads) {
  std::vector<PhotographResult> results(input.capture.photographs.size());
  const std::optional<LongAxis> axis = LongAxisOf(input.capture, *input.source.meshes[0]);
  // The exposure of a group that was fitted holds for its held-out photographs too.
  std::map<std::string, double> exposure_of_group;
  for (const FitPixels& p : fitted)
    if (p.exposure >= 0)
      exposure_of_group[ExposureGroup(input.capture.photographs[p.photograph])] = scales.exposure[p.exposure];
  for (size_t i = 0; i < results.size(); ++i) {
    const PhotographSpec& spec = input.capture.photographs[i];
    const Photograph& photo = input.photographs[i];
    const auto& cast_pixels = state.photographs[i].pixels;
    PhotographResult& r = results[i];
    r.name = spec.name;
    r.is_holdout = spec.is_holdout;
    r.exposure_is_fitted = spec.exposure_is_free || spec.exposure_stddev > 0;
    r.saturated_pixels = photo.saturated_pixels;
    r.rgb_from_sensor = spec.rgb_from_sensor;
    r.photograph = photo.linear;
    r.prediction = Image(photo.linear.width, photo.linear.height, 3);
    r.compared.assign(photo.usable.size(), 0);
    const std::vector<glm::dvec3> values = predict(i);

    r.exposure = spec.exposure_scale;
    if (const auto group = exposure_of_group.find(ExposureGroup(spec)); group != exposure_of_group.end()) {
      r.exposure = group->second;
    } else if (spec.exposure_is_free) {
      double top = 0, bottom = 0;  // a held-out photograph of its own exposure: least squares on itself
      for (size_t k = 0; k < values.size(); ++k)
        for (int c = 0; c < kChannels && IsUsable(photo, cast_pixels[k]); ++c) {
          const double w = 1.0 / photo.variance.at(cast_pixels[k].x, cast_pixels[k].y, c);
          top += w * values[k][c] * photo.linear.at(cast_pixels[k].x, cast_pixels[k].y, c);
          bottom += w * values[k][c] * values[k][c];
        }
      if (bottom > 0) r.exposure = top / bottom;
    }
    for (size_t k = 0; k < values.size(); ++k)
      for (int c = 0; c < kChannels; ++c)
        r.prediction.at(cast_pixels[k].x, cast_pixels[k].y, c) = static_cast<float>(r.exposure * values[k][c]);
    if (spec.blur)
      r.prediction = SeenOverPhotograph(r.prediction, state.photographs[i], photo, *spec.blur, r.exposure, threads);
    if (axis) r.thirds.assign(photo.usable.size(), 0);
    double chi2 = 0, both = 0, predicted = 0;
    const std::vector<int> compared = ComparablePixels(spec, state.photographs[i], photo, threads);
    for (int k : compared) {
      const PixelCast& pixel = cast_pixels[k];
      const size_t place = static_cast<size_t>(pixel.y) * photo.linear.width + pixel.x;
      r.compared[place] = 1;
      if (axis) r.thirds[place] = static_cast<uint8_t>(1 + ThirdOf(axis->At(PositionOf(*state.crown, pixel.at))));
      const glm::dvec3 variance = VarianceAt(photo, pixel);
      for (int c = 0; c < kChannels; ++c) {
        const double p = r.prediction.at(pixel.x, pixel.y, c), seen = photo.linear.at(pixel.x, pixel.y, c);
        chi2 += (p - seen) * (p - seen) / variance[c];
        both += p * seen / variance[c];
        predicted += p * p / variance[c];
      }
    }
    if (predicted > 0) r.level = both / predicted;
    r.reduced_chi2 = compared.empty() ? 0.0 : chi2 / static_cast<double>(kChannels * compared.size());
    r.difference = ComparePictures(r.photograph, r.prediction, r.compared, r.rgb_from_sensor);
  }
  return results;
}

}  // namespace crownfit
