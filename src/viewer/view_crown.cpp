#include "viewer/view_crown.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "base/text.h"
#include "photo/figures.h"
#include "photo/image_io.h"
#include "scene/cast_capture.h"
#include "viewer/crown_renderer.h"
#include "viewer/scene_difference.h"

namespace crownfit {
namespace {

/// The same view on a picture of another size, as large as it fits.
Camera Resized(Camera camera, int width, int height) {
  const double scale = std::min(static_cast<double>(width) / camera.width, static_cast<double>(height) / camera.height);
  camera.fx *= scale;
  camera.fy *= scale;
  camera.cx = 0.5 * width + scale * (camera.cx - 0.5 * camera.width);
  camera.cy = 0.5 * height + scale * (camera.cy - 0.5 * camera.height);
  camera.width = width;
  camera.height = height;
  return camera;
}

/// The object turned by `angle` about the picture's upright axis through its middle.
RigidTransform Turned(const RigidTransform& camera_from_object, const glm::dvec3& middle, double angle) {
  const glm::dmat3 turn(glm::dvec3(std::cos(angle), 0, -std::sin(angle)), glm::dvec3(0, 1, 0),
                        glm::dvec3(std::sin(angle), 0, std::cos(angle)));
  const glm::dvec3 centre = camera_from_object.Point(middle);
  RigidTransform turned = camera_from_object;
  turned.rotation = turn * camera_from_object.rotation;
  turned.translation_mm = turn * (camera_from_object.translation_mm - centre) + centre;
  return turned;
}

struct FrameTimes {
  double median_ms = 0, worst_ms = 0;
};

FrameTimes Measure(int frames, const std::function<void(int)>& draw) {
  std::vector<double> ms;
  draw(0);  // compiles the shaders
  glFinish();
  for (int i = 0; i < frames; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    draw(i);
    glFinish();
    ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  std::sort(ms.begin(), ms.end());
  return {ms[ms.size() / 2], ms.back()};
}

std::string Benchmark(CrownRenderer& renderer, const Capture& capture, const Material& material,
                      const std::vector<double>& thickness, const PhotographSpec& photo, const Canvas& canvas,
                      int frames) {
  const auto bounds = Bounds(renderer.crown().fine);
  const glm::dvec3 middle = 0.5 * (bounds.first + bounds.second);
  const auto orbit = [&](Quality quality) {
    return Measure(frames, [&](int i) {
      PhotographSpec turned = photo;
      turned.camera_from_object = Turned(photo.camera_from_object, middle, 0.05 * i);
      renderer.Draw(turned, {}, canvas, quality);
    });
  };
  std::string report = Printed("%s\n%d x %d pixels, %zu triangles, %zu vertices, median of %d frames (worst):\n",
                               GraphicsProcessor().c_str(), photo.camera.width, photo.camera.height,
                               renderer.crown().fine.triangles.size(), renderer.crown().fine.vertices.size(), frames);
  const auto add = [&](const char* what, const FrameTimes& t) {
    report += Printed("  %-32s %8.2f ms (%.2f): %.0f frames/s\n", what, t.median_ms, t.worst_ms, 1000 / t.median_ms);
  };
  add("camera moves", orbit(Quality::kMoving));
  add("camera moves, all highlights", orbit(Quality::kStill));
  add("material moves", Measure(frames, [&](int) {
        renderer.SetMaterial(capture, material, thickness);
        renderer.Draw(photo, {}, canvas, Quality::kMoving);
      }));
  return report;
}

}  // namespace

std::string ViewCrown(const Capture& stated, const Material& material, const ViewOptions& options, Progress& progress) {
  const Capture capture = ForScreen(stated);
  CheckShaderSupports(capture, material);
  const OffscreenContext context;
  progress.Show("reading", 0.0);
  const CrownInput input = ReadInput(capture, options.threads, /*with_images=*/false);
  progress.Show("building the layers", 0.2);
  const auto crown = BuildCrown(capture, input.source, ThicknessesOf(capture, material), options.threads);
  const std::vector<double> thickness = CastThicknesses(capture, *crown, ThicknessesOf(capture, material));
  progress.Show("casting light", 0.7);
  CastOptions cast_options;
  cast_options.threads = options.threads;
  cast_options.shade_scenery = true;
  const VertexCast light = CastVertices(capture, *crown, input.scenery, options.photograph, cast_options);

  CrownRenderer renderer(crown, ShownChannelsOf(capture));
  renderer.SetLight(capture, options.photograph, light);
  renderer.SetMaterial(capture, material, thickness);
  PhotographSpec photo = capture.photographs[options.photograph];
  if (options.size) photo.camera = Resized(photo.camera, options.size->first, options.size->second);
  const Canvas canvas(photo.camera.width, photo.camera.height);
  renderer.Draw(photo, {}, canvas);
  Image picture = canvas.Read();
  for (float& v : picture.values) v *= static_cast<float>(photo.exposure_scale);
  progress.Clear();
  if (options.screenshot) {
    if (options.screenshot->extension() == ".exr") {
      WriteImageFile(*options.screenshot, picture);
    } else {
      renderer.Draw(photo, {.scenery = false}, canvas);
      const double scale = ComparisonScale(picture, LitPixels(canvas.Read()), photo.rgb_from_sensor);
      WriteImageFile(*options.screenshot, DisplayPicture(picture, scale, photo.rgb_from_sensor));
    }
  }
  if (options.benchmark_frames == 0) return "";
  return Benchmark(renderer, capture, material, thickness, photo, canvas, options.benchmark_frames);
}

}  // namespace crownfit
