#include "synthetic/capture_writer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/files.h"
#include "base/random.h"

namespace crownfit {
namespace {

JsonValue* Find(JsonValue& object, const std::string& key) {
  auto* members = std::get_if<JsonValue::Object>(&object.data);
  if (!members) return nullptr;
  for (auto& [name, value] : *members)
    if (name == key) return &value;
  return nullptr;
}

void Set(JsonValue& object, const std::string& key, JsonValue value) {
  if (JsonValue* found = Find(object, key)) {
    *found = std::move(value);
  } else {
    std::get<JsonValue::Object>(object.data).emplace_back(key, std::move(value));
  }
}

void Erase(JsonValue& object, const std::string& key) {
  std::erase_if(std::get<JsonValue::Object>(object.data), [&](const auto& member) { return member.first == key; });
}

JsonValue::Array& Items(JsonValue& list) { return std::get<JsonValue::Array>(list.data); }

JsonValue ToJson(const glm::dvec3& v) { return std::vector<double>{v.x, v.y, v.z}; }

/// Path of a file below the capture's folder: its relative path, or its name alone if it lay elsewhere.
std::filesystem::path Inside(const std::string& path) {
  const auto normal = std::filesystem::path(path).lexically_normal();
  const bool is_outside = normal.is_absolute() || (!normal.empty() && *normal.begin() == "..");
  return is_outside ? std::filesystem::path("files") / normal.filename() : normal;
}

/// Makes the recipe's capture, with the changes by synthesis.
class CaptureMaker {
 public:
  CaptureMaker(const Recipe& recipe, const std::filesystem::path& folder)
      : recipe_(recipe), folder_(folder), file_(recipe.capture.file), root_(file_.value) {
    Erase(root_, "synthesis");
    Set(root_, "format", "crownfit-capture/1");
    CopySurfaces();
    FreeParameters();
    WriteLights();
    for (size_t i = 0; i < recipe.capture.photographs.size(); ++i) DescribePhotograph(i);
  }

  JsonValue result() const { return root_; }

 private:
  /// Copies the file that `path` names; `from_sub` and `to_sub` are the folders of the file that names it.
  void Copy(JsonValue& path, const std::filesystem::path& from_sub = {}, const std::filesystem::path& to_sub = {}) {
    const std::string from = std::get<std::string>(path.data);
    const auto to = Inside(from), file = folder_ / to_sub / to;
    std::error_code error;
    std::filesystem::create_directories(file.parent_path(), error);
    if (!error)
      std::filesystem::copy_file(recipe_.capture.folder / from_sub / from, file,
                                 std::filesystem::copy_options::overwrite_existing, error);
    if (error)
      throw InputError(file, "", "can't be written: " + error.message(), "Choose an output folder you may write to.");
    path = to.generic_string();
  }

  void CopySurfaces() {
    JsonValue& object = *Find(root_, "object");
    for (auto& layer : Items(*Find(object, "layers"))) {
      if (JsonValue* surface = Find(layer, "surface")) Copy(*surface);
      if (JsonValue* texture = Find(layer, "absorption_texture"))
        if (JsonValue* picture = Find(*texture, "file")) Copy(*picture);
    }
    if (JsonValue* scenery = Find(object, "scenery"))
      for (auto& thing : Items(*scenery)) Copy(*Find(thing, "mesh"));
  }

  /// Frees the named parameters and moves their starts by the factor, alternately up and down, inside their bounds.
  void FreeParameters() {
    JsonValue& object = *Find(root_, "object");
    for (size_t k = 0; k < recipe_.free.size(); ++k) {
      const std::string &name = recipe_.free[k], owner_name = name.substr(0, name.rfind('.')),
                        key = name.substr(name.rfind('.') + 1);
      const auto row =
          std::find_if(kParameters.begin(), kParameters.end(), [&](const auto& r) { return r.key == key; });
      JsonValue* owner = row->owner == Owner::kSurface ? Find(object, "surface") : nullptr;
      if (!owner)
        for (auto& layer : Items(*Find(object, "layers")))
          if (std::get<std::string>(Find(layer, "name")->data) == owner_name) owner = &layer;
      JsonValue* parameter = Find(*owner, key);
      const double factor = k % 2 == 0 ? recipe_.initial_factor : 1.0 / recipe_.initial_factor;
      const auto off = [&](double v) { return JsonValue(std::clamp(v * factor, row->low, row->high)); };
      JsonValue* stated = Find(*parameter, "fixed");
      JsonValue start = stated ? *stated : *parameter;
      if (auto* list = std::get_if<JsonValue::Array>(&start.data)) {
        for (auto& v : *list) v = off(std::get<double>(v.data));
      } else {
        start = off(std::get<double>(start.data));
      }
      JsonValue::Object free{{"initial", start}};
      if (const JsonValue* shared = Find(*parameter, "shared")) free.emplace_back("shared", *shared);
      *parameter = free;
    }
  }

  void WriteLights() {
    JsonValue& path = *Find(root_, "light_rig");
    const std::filesystem::path from = std::get<std::string>(path.data), to = Inside(from.string());
    JsonFile rig(recipe_.capture.folder / from);
    auto& lights = Items(*Find(rig.value, "lights"));
    for (size_t i = 0; recipe_.error.light_mm > 0 && i < lights.size(); ++i)
      for (const char* key : {"centre_mm", "position_mm"})
        if (JsonValue* place = Find(lights[i], key)) {
          for (size_t axis = 0; axis < 3; ++axis) {
            auto& x = std::get<double>(Items(*place)[axis].data);
            x += recipe_.error.light_mm * Gaussian(Key(recipe_.seed, kSynthesisStream, 2), 3 * i + axis);
          }
          Set(lights[i], "stddev_mm", recipe_.error.light_mm);
        }
    for (auto& light : lights)
      if (JsonValue* map = Find(light, "file")) Copy(*map, from.parent_path(), to.parent_path());
    WriteTextFile(folder_ / to, ToJsonText(rig.value));
    path = to.generic_string();
  }

  /// The stated pose; photographs of one true pose share one error, as from a single calibration.
  JsonValue StatedPose(size_t photograph) {
    const auto& photos = recipe_.capture.photographs;
    size_t first = photograph;
    for (size_t i = 0; i < photograph; ++i)
      if (photos[i].camera_from_object.rotation == photos[photograph].camera_from_object.rotation &&
          photos[i].camera_from_object.translation_mm == photos[photograph].camera_from_object.translation_mm)
        first = std::min(first, i);
    const auto error = [&](uint64_t k) { return Gaussian(Key(recipe_.seed, kSynthesisStream, 3), 6 * first + k); };
    RigidTransform pose = photos[photograph].camera_from_object;
    const glm::dvec3 turn =
        recipe_.error.pose_deg * std::numbers::pi / 180.0 * glm::dvec3(error(0), error(1), error(2));
    pose.rotation = RotationFromVector(turn) * pose.rotation;
    pose.translation_mm += recipe_.error.pose_mm * glm::dvec3(error(3), error(4), error(5));
    JsonValue::Array rows;
    for (int r = 0; r < 3; ++r)
      rows.emplace_back(std::vector<double>{pose.rotation[0][r], pose.rotation[1][r], pose.rotation[2][r]});
    JsonValue::Object stated{{"rotation", rows}, {"translation_mm", ToJson(pose.translation_mm)}};
    if (recipe_.error.pose_deg > 0 || recipe_.error.pose_mm > 0)
      stated.emplace_back("stddev", JsonValue::Object{{"rotation_deg", recipe_.error.pose_deg},
                                                      {"translation_mm", recipe_.error.pose_mm}});
    return stated;
  }

  void DescribePhotograph(size_t i) {
    JsonValue& photo = Items(*Find(root_, "photographs"))[i];
    const std::string& name = recipe_.capture.photographs[i].name;
    Copy(*Find(photo, "camera"));
    Set(photo, "file", "photos/" + name + ".exr");
    Set(photo, "variance", "photos/" + name + "_variance.exr");
    Set(photo, "camera_from_object", StatedPose(i));
    if (recipe_.error.exposure > 0)
      Set(photo, "exposure_scale",
          JsonValue::Object{{"fixed", recipe_.capture.photographs[i].exposure_scale},
                            {"stddev", recipe_.error.exposure * recipe_.capture.photographs[i].exposure_scale}});
  }

  const Recipe& recipe_;
  const std::filesystem::path& folder_;
  JsonFile file_;
  JsonValue root_;
};

}  // namespace

JsonValue PrepareCapture(const Recipe& recipe, const std::filesystem::path& folder) {
  return CaptureMaker(recipe, folder).result();
}

double ExposureError(const Recipe& recipe, size_t photograph) {
  return 1.0 + recipe.error.exposure * Gaussian(Key(recipe.seed, kSynthesisStream, 1), photograph);
}

}  // namespace crownfit
