#include "exchange/import_capture.h"

#include <algorithm>

#include "base/error.h"
#include "capture/light_rig.h"
#include "exchange/imported_views.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;

std::vector<ImportedView> ReadViews(const Path& source) {
  std::error_code ignored;
  if (std::filesystem::is_directory(source, ignored)) {
    const Path transforms = source / "transforms.json";
    return std::filesystem::exists(transforms, ignored) ? ReadNerfTransforms(transforms) : ReadColmap(source);
  }
  if (source.extension() == ".json") return ReadNerfTransforms(source);
  throw InputError(source, "", "is neither a folder of COLMAP's model nor a transforms.json");
}

/// The file of a photograph that a source names with or without its folder and its ending.
std::optional<Path> FileOf(const Path& folder, const std::string& name) {
  std::error_code ignored;
  for (const Path& candidate : {folder / name, folder / Path(name).filename()}) {
    if (std::filesystem::is_regular_file(candidate, ignored)) return candidate;
    for (const char* ending : {".exr", ".dng", ".tif", ".tiff", ".png", ".jpg", ".jpeg"}) {
      const Path with = candidate.string() + ending;
      if (std::filesystem::is_regular_file(with, ignored)) return with;
    }
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::string> ImportCapture(ImportParts parts, const Path& folder) {
  std::vector<std::string> left_out;
  CaptureParts& capture = parts.capture;
  for (const ImportedView& view : ReadViews(parts.source)) {
    const auto file = FileOf(parts.photographs, view.photograph);
    if (!file) {
      left_out.push_back(view.photograph);
      continue;
    }
    const std::string name = file->stem().string();
    RigidTransform pose = view.camera_from_world;
    pose.translation_mm *= parts.mm_per_unit;
    capture.photographs.emplace_back(name, *file);
    capture.views.push_back({name, view.camera, pose});
  }
  if (capture.photographs.empty())
    throw InputError(parts.photographs, "--photographs",
                     left_out.empty() ? "the source has no photograph"
                                      : "has none of the source's photographs, such as " + left_out[0],
                     "Name the folder in which they lie.");
  const auto is_a_photograph = [&](const std::string& name) {
    return std::any_of(capture.photographs.begin(), capture.photographs.end(),
                       [&](const auto& photograph) { return photograph.first == name; });
  };
  std::vector<std::string> always;
  const LightRig rig = ReadLightRig(capture.lights);
  for (const Light& light : rig.lights)
    if (!is_a_photograph(light.name)) always.push_back(light.name);
  for (const Light& light : rig.lights) {
    if (!is_a_photograph(light.name)) continue;
    std::vector<std::string> on = always;
    on.push_back(light.name);
    capture.lit.emplace_back(light.name, on);
  }
  if (always.size() < rig.lights.size())
    for (const auto& photograph : capture.photographs)
      if (std::none_of(capture.lit.begin(), capture.lit.end(),
                       [&](const auto& lit) { return lit.first == photograph.first; }))
        capture.lit.emplace_back(photograph.first, always);
  InitCapture(capture, folder);
  return left_out;
}

}  // namespace crownfit
