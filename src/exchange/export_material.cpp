#include "exchange/export_material.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "capture/capture.h"
#include "exchange/exporters.h"
#include "geometry/signed_distance.h"
#include "path/path_derivatives.h"
#include "photo/figures.h"
#include "photo/image_io.h"

namespace crownfit {
namespace {

constexpr int kReferencePixels = 128;  // largest width or height of a reference picture

/// Layers that the capture lacks would be lost silently.
void CheckSameLayers(const MaterialOutline& outline, const Capture& capture, const std::filesystem::path& file) {
  for (const std::string& name : outline.layers) {
    const bool known = std::any_of(capture.layers.begin(), capture.layers.end(),
                                   [&](const LayerSpec& layer) { return layer.name == name; });
    if (!known)
      throw InputError(file, "layers", "has a layer called '" + name + "', but " + capture.file.string() + " does not",
                       "Give the capture that this material was fitted to, or use the same layer names.");
  }
}

/// Mean thicknesses where the material states none: of a shell its volume over the mean of its two areas; of the
/// innermost body twice its volume over its area, the mean half chord.
void MeasureThicknesses(ExportScene& scene) {
  for (size_t l = 0; l < scene.layers.size(); ++l) {
    if (scene.layers[l].thickness_mm) continue;
    const bool is_last = l + 1 == scene.layers.size();
    const double volume = Volume(scene.surfaces[l]) - (is_last ? 0.0 : Volume(scene.surfaces[l + 1]));
    const double area = Area(scene.surfaces[l]) + (is_last ? 0.0 : Area(scene.surfaces[l + 1]));
    scene.layers[l].thickness_mm = 2.0 * volume / area;
  }
}

/// Notes layers that partly lie outside the layer around them.
void NoteRoots(const ExportScene& scene, std::vector<std::string>& left_out) {
  for (size_t l = 1; l < scene.surfaces.size(); ++l) {
    const TriangleMesh &outer = scene.surfaces[l - 1], &inner = scene.surfaces[l];
    const RayCaster caster({&outer});
    constexpr double kTouching_mm = 0.05;
    const bool stands_out = std::any_of(inner.vertices.begin(), inner.vertices.end(), [&](const glm::dvec3& v) {
      return !IsInside(caster, outer, v) && caster.DistanceToSurface(v) > kTouching_mm;
    });
    if (stands_out)
      left_out.push_back("layer " + scene.layers[l].name + " reaches outside of " + scene.layers[l - 1].name +
                         ". The exported boundaries are nested and have wrong index steps there");
  }
}

struct Reference {
  std::string file;
  int pixels_per_side = 1;
  Spectrum mean, stderr_of_mean;   ///< over the pixels on the object
  double median_stderr_share = 0;  ///< of a pixel on the object
};

std::string Listed(const Spectrum& values) {
  std::string text;
  for (const double v : values) text += (text.empty() ? "" : ", ") + Printed("%.5f", v);
  return text;
}

/// A camera with the same view and pixels k times as wide; partial pixels at the right and below are cut off.
Camera Coarser(Camera camera, int k) {
  camera.width /= k, camera.height /= k;
  camera.fx /= k, camera.fy /= k, camera.cx /= k, camera.cy /= k;
  return camera;
}

Reference RenderReference(const CrownInput& input, const LayeredBody& body, const Material& material, size_t photograph,
                          const std::string& name, const ExportOptions& options, const std::filesystem::path& folder,
                          Progress& progress) {
  Capture capture = input.capture;
  PhotographSpec& spec = capture.photographs[photograph];
  Reference reference;
  const int longest = std::max(spec.camera.width, spec.camera.height);
  reference.pixels_per_side = (longest + kReferencePixels - 1) / kReferencePixels;
  spec.camera = Coarser(spec.camera, reference.pixels_per_side);
  PathOptions path;
  path.paths_per_pixel = options.paths_per_pixel;
  path.seed = options.seed;
  path.threads = options.threads;
  const PathPhotograph photo = RenderByPaths(capture, body, input.scenery, material, photograph, path,
                                             [&](double share) { progress.Show("reference of " + spec.name, share); });
  const int channels = capture.channels();
  Image picture(photo.width, photo.height, channels), variance = picture;
  std::vector<uint8_t> on_object;
  std::vector<double> shares;
  double count = 0;
  for (size_t p = 0; p < photo.pixels.size(); ++p) {
    const PixelEstimate& e = photo.pixels[p];
    const Spectrum mean = spec.exposure_scale * e.mean,
                   square = spec.exposure_scale * spec.exposure_scale * e.variance();
    for (int c = 0; c < channels; ++c) {
      picture.values[channels * p + c] = static_cast<float>(mean[c]);
      variance.values[channels * p + c] = static_cast<float>(square[c]);
    }
    on_object.push_back(e.on_object);
    if (!e.on_object) continue;
    reference.mean += mean, reference.stderr_of_mean += square, ++count;
    if (mean.Middle() > 0) shares.push_back(std::sqrt(square.Middle()) / mean.Middle());
  }
  if (count > 0) reference.mean /= count, reference.stderr_of_mean = Sqrt(reference.stderr_of_mean) / count;
  if (!shares.empty()) {
    std::nth_element(shares.begin(), shares.begin() + static_cast<long>(shares.size() / 2), shares.end());
    reference.median_stderr_share = shares[shares.size() / 2];
  }
  reference.file = "reference/" + name + ".exr";
  WriteImageLayers(folder / reference.file, {{"", picture}, {"variance", variance}}, ChannelsInFile(capture));
  WriteImageFile(
      folder / "reference" / (name + ".png"),
      DisplayPicture(picture, ComparisonScale(picture, on_object, spec.rgb_from_sensor), spec.rgb_from_sensor));
  return reference;
}

std::string Notes(const Exporter& exporter, const std::filesystem::path& material, const ExportScene& scene,
                  const std::vector<Reference>& references, int paths) {
  std::string text = std::string("# ") + exporter.title + "\n\nWritten by `crownfit export` from `" +
                     material.filename().string() +
                     "`. Lengths are millimetres and coefficients 1/mm unless a line says " +
                     "otherwise. Channels are the camera's own bands:";
  for (size_t c = 0; c < scene.channel_names.size(); ++c)
    text += (c ? ", " : " ") + scene.channel_names[c] + Printed(" %.0f nm", scene.wavelengths_nm[c]);
  text += ".\n\n";
  for (const std::string& warning : scene.warnings) text += "**" + warning + "**\n\n";
  text += exporter.how_to;
  text += std::string(
              "\n## How quantities are converted\n\n"
              "| quantity | here |\n"
              "|---|---|\n") +
          exporter.what_is;
  text += "\n## What is lost\n\n";
  text += exporter.is_lost;
  for (const std::string& what : scene.left_out) text += "- Of this capture: " + what + ".\n";
  if (references.empty()) return text;
  text +=
      "\n## Reference pictures\n\n"
      "Path-traced by crownfit with " +
      std::to_string(paths) +
      " paths per pixel, from the scene as it is exported (without what is lost of the capture). A pixel is the mean "
      "of k x k pixels of the photograph. The EXR's layer `variance` holds the variance of its noise.\n\n"
      "Tolerance: means of blocks of pixels agree within 4 standard errors of both programs, plus what this format "
      "loses. " +
      exporter.tolerance +
      "\n\n| file | k | mean on the object by channel | its standard error | median noise of a pixel |\n"
      "|---|---|---|---|---|\n";
  for (const Reference& r : references)
    text += "| " + r.file + Printed(" | %d | ", r.pixels_per_side) + Listed(r.mean) + " | " + Listed(r.stderr_of_mean) +
            Printed(" | %.1f %% |\n", 100 * r.median_stderr_share);
  return text;
}

}  // namespace

std::vector<std::string> ExportMaterial(const std::filesystem::path& material_file, const ExportOptions& options,
                                        const std::filesystem::path& folder, Progress& progress) {
  const Exporter& exporter = Exporters().at(options.format);
  const MaterialOutline outline = ReadMaterialOutline(material_file);
  Capture capture = options.capture ? ReadCapture(*options.capture) : CaptureOfOutline(outline, material_file);
  if (options.capture) CheckSameLayers(outline, capture, material_file);
  const MaterialRecord record = ReadMaterialRecord(material_file, capture);
  capture = WithLinearScales(std::move(capture), record.linear_scales);
  std::vector<std::string> left_out, said;
  Material carried = record.material;
  LeaveOutWhatOthersLack(capture, carried, left_out);
  ExportScene scene = SceneOfMaterial(capture, record);
  if (outline.status == "not_usable") {
    std::string reasons;
    for (const auto& reason : outline.reasons) reasons += (reasons.empty() ? "" : "; ") + reason;
    scene.warnings.push_back("The fit of this material is not usable: " + reasons + ".");
  }
  std::vector<Reference> references;
  std::optional<CrownInput> input;
  std::optional<Bodies> bodies;
  if (options.capture) {
    progress.Show("building the layers", 0.0);
    input = ReadInput(capture, options.threads, /*with_images=*/false);
    bodies.emplace(*input, options.threads);
    scene.surfaces = bodies->Of(carried).surfaces;
    scene.neck_is_opaque = capture.neck != Neck::kAir;
    if (capture.neck == Neck::kRoot)
      scene.neck_reflectance =
          Min(carried.surface[Quantity::kNeckReturn][0] * HalfSpaceReflectance(carried.layers.back()), Spectrum(1.0));
    MeasureThicknesses(scene);
    NoteRoots(scene, left_out);
    AddPhotographs(capture, input->scenery, scene);
    said = input->source.messages;
  }
  scene.left_out = left_out;
  if (!exporter.holds_all_channels) scene = InThreeChannels(std::move(scene));
  progress.Show("writing", 0.0);
  exporter.write(scene, folder);
  std::vector<std::string> names;
  for (const PhotographSpec& photo : capture.photographs) names.push_back(photo.name);
  names = FileNames(names);
  const bool makes_pictures = *exporter.tolerance != '\0';
  for (size_t p = 0; makes_pictures && p < names.size(); ++p)
    references.push_back(RenderReference(*input, bodies->Of(carried), carried, p, names[p], options, folder, progress));
  WriteTextFile(folder / "README.md", Notes(exporter, material_file, scene, references, options.paths_per_pixel));
  for (const std::string& what : scene.left_out) said.push_back("left out: " + what);
  said.insert(said.end(), scene.warnings.begin(), scene.warnings.end());
  return said;
}

}  // namespace crownfit
