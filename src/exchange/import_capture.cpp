#include "exchange/import_capture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.h"
#include "capture/light_rig.h"
#include "exchange/import_scenes.h"
#include "exchange/mitsuba_xml.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;

/// The scenes among the sources, in the order of their names; empty where another program wrote them.
std::vector<Path> ScenesOf(const std::vector<Path>& sources) {
  std::error_code ignored;
  std::vector<Path> scenes;
  for (const Path& source : sources) {
    const auto is_there = [&](const char* name) { return std::filesystem::exists(source / name, ignored); };
    if (!std::filesystem::is_directory(source, ignored)) {
      if (source.extension() == ".xml") scenes.push_back(source);
    } else if (!is_there("transforms.json") && !is_there("images.bin") && !is_there("images.txt")) {
      std::vector<Path> found;
      for (const auto& entry : std::filesystem::directory_iterator(source, ignored))
        if (entry.path().extension() == ".xml" && IsXmlOf(entry.path(), "scene")) found.push_back(entry.path());
      std::sort(found.begin(), found.end());
      scenes.insert(scenes.end(), found.begin(), found.end());
    }
  }
  if (!scenes.empty() && scenes.size() < sources.size())
    throw InputError(sources[0], "SOURCE", "some sources are scenes of Mitsuba, and some are not",
                     "Import them one by one.");
  return scenes;
}

std::vector<ImportedView> ReadViews(const std::vector<Path>& sources) {
  if (sources.size() != 1)
    throw InputError("", "SOURCE", "only scenes of Mitsuba can be several", "Import other sources one by one.");
  const Path& source = sources[0];
  std::error_code ignored;
  if (std::filesystem::is_directory(source, ignored)) {
    const Path transforms = source / "transforms.json";
    return std::filesystem::exists(transforms, ignored) ? ReadNerfTransforms(transforms) : ReadColmap(source);
  }
  if (source.extension() == ".json") return ReadNerfTransforms(source);
  throw InputError(source, "", "is neither a folder of COLMAP's model, nor a transforms.json, nor a scene of Mitsuba");
}

constexpr const char* kEndings[] = {".exr", ".dng", ".tif", ".tiff", ".png", ".jpg", ".jpeg"};
/// Of the picture of a photograph's variances, beside it.
constexpr const char* kVarianceEnding = "_variance.exr";

/// The file of a photograph that a source names with or without its folder and its ending.
std::optional<Path> FileOf(const Path& folder, const std::string& name) {
  std::error_code ignored;
  for (const Path& candidate : {folder / name, folder / Path(name).filename()}) {
    if (std::filesystem::is_regular_file(candidate, ignored)) return candidate;
    for (const char* ending : kEndings) {
      const Path with = candidate.string() + ending;
      if (std::filesystem::is_regular_file(with, ignored)) return with;
    }
  }
  return std::nullopt;
}

/// A light that is named like a photograph is on in it alone, and nowhere where that photograph was left out.
void LightByNames(const std::vector<std::string>& left_out, CaptureParts& capture) {
  const auto is_taken = [&](const std::string& name) {
    return std::any_of(capture.photographs.begin(), capture.photographs.end(),
                       [&](const auto& photograph) { return photograph.first == name; });
  };
  const auto is_a_photograph = [&](const std::string& name) {
    return is_taken(name) || std::any_of(left_out.begin(), left_out.end(), [&](const std::string& file) {
             return Path(file).stem() == name || file == name;
           });
  };
  std::vector<std::string> always;
  const LightRig rig = ReadLightRig(capture.lights);
  for (const Light& light : rig.lights)
    if (!is_a_photograph(light.name)) always.push_back(light.name);
  for (const Light& light : rig.lights) {
    if (!is_taken(light.name)) continue;
    std::vector<std::string> on = always;
    on.push_back(light.name);
    capture.lit.emplace_back(light.name, on);
  }
  if (always.size() < rig.lights.size())
    for (const auto& photograph : capture.photographs)
      if (std::none_of(capture.lit.begin(), capture.lit.end(),
                       [&](const auto& lit) { return lit.first == photograph.first; }))
        capture.lit.emplace_back(photograph.first, always);
}

/// The folder in which parts of a scene wait to be copied.
struct Waiting {
  explicit Waiting(const Path& capture) : folder(capture / "imported_parts") {}
  ~Waiting() {
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
  }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  Path folder;
};

/// The views of the sources in mm. Scenes bring the capture's object and lamps with them.
std::vector<SceneView> ViewsOf(ImportParts& parts, const std::vector<Path>& scenes, const Path& waiting) {
  if (!scenes.empty()) return TakeMitsubaScenes(scenes, parts.mm_per_unit, waiting, parts.capture);
  std::vector<SceneView> views;
  for (const ImportedView& view : parts.views.empty() ? ReadViews(parts.sources) : parts.views) {
    views.push_back({view, {}, {}});
    views.back().view.camera_from_world.translation_mm *= parts.mm_per_unit;
  }
  if (parts.capture.meshes.empty())
    throw InputError("", "--mesh", "is needed: the source says nothing of the object's shape",
                     "Give the surface of its outermost layer, such as --mesh enamel=crown.ply.");
  if (parts.capture.lights.empty())
    throw InputError("", "--lights", "is needed: the source says nothing of the lamps",
                     "Give light_rig.json of `crownfit calibrate lights`.");
  return views;
}

}  // namespace

std::vector<std::string> PhotographsIn(const Path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
    if (!entry.path().string().ends_with(kVarianceEnding) &&
        std::find(std::begin(kEndings), std::end(kEndings), entry.path().extension()) != std::end(kEndings))
      names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

double ScaleFromPoints(const std::string& text) {
  double v[7];
  int end = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf:%lf,%lf,%lf=%lf%n", v, v + 1, v + 2, v + 3, v + 4, v + 5, v + 6, &end) !=
          7 ||
      static_cast<size_t>(end) != text.size())
    throw InputError("", "--scale-from", "expected X,Y,Z:X,Y,Z=MM, found '" + text + "'",
                     "Give two points in the source's unit and their distance in mm.");
  const double distance = glm::distance(glm::dvec3(v[0], v[1], v[2]), glm::dvec3(v[3], v[4], v[5]));
  if (!(distance > 0 && std::isfinite(distance) && v[6] > 0 && std::isfinite(v[6])))
    throw InputError("", "--scale-from", "the points need to differ, and their distance to be positive");
  return v[6] / distance;
}

std::vector<std::string> ImportCapture(ImportParts parts, const Path& folder) {
  std::vector<std::string> left_out;
  CaptureParts& capture = parts.capture;
  const bool lights_are_given = !capture.lights.empty();
  const std::vector<Path> scenes = parts.views.empty() ? ScenesOf(parts.sources) : std::vector<Path>();
  const Waiting waiting(folder);
  for (const SceneView& seen : ViewsOf(parts, scenes, waiting.folder)) {
    const auto file = FileOf(parts.photographs, seen.view.photograph);
    if (!file) {
      left_out.push_back(seen.view.photograph);
      continue;
    }
    const std::string name = file->stem().string();
    capture.photographs.emplace_back(name, *file);
    std::error_code ignored;
    if (const Path variance = file->parent_path() / (name + kVarianceEnding);
        std::filesystem::exists(variance, ignored))
      capture.variances.emplace_back(name, variance);
    capture.views.push_back({name, seen.view.camera, seen.view.camera_from_world});
    if (!lights_are_given) capture.lit.emplace_back(name, seen.lights);
    for (StatedThing& thing : capture.scenery)
      if (std::find(seen.things.begin(), seen.things.end(), thing.name) != seen.things.end())
        thing.photographs.push_back(name);
  }
  if (capture.photographs.empty())
    throw InputError(parts.photographs, "--photographs",
                     left_out.empty() ? "the source has no photograph"
                                      : "has none of the source's photographs, such as " + left_out[0],
                     "Name the folder in which they lie.");
  if (lights_are_given) LightByNames(left_out, capture);
  InitCapture(capture, folder);
  return left_out;
}

}  // namespace crownfit
