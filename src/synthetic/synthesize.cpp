#include "synthetic/synthesize.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/random.h"
#include "geometry/cast_samples.h"
#include "photo/image_io.h"
#include "walk/path_photograph.h"

namespace crownfit {
namespace {

constexpr uint64_t kStream = 0x73796e7468ull;  // no fit's walks are keyed by it

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

/// Path of a file below the capture's folder: where it stood, or its name alone if it stood elsewhere.
std::filesystem::path Inside(const std::string& path) {
  const auto normal = std::filesystem::path(path).lexically_normal();
  const bool is_outside = normal.is_absolute() || (!normal.empty() && *normal.begin() == "..");
  return is_outside ? std::filesystem::path("files") / normal.filename() : normal;
}

/// Writes the recipe's capture with what synthesis changes.
class CaptureWriter {
 public:
  CaptureWriter(const Recipe& recipe, const std::filesystem::path& folder)
      : recipe_(recipe), folder_(folder), file_(recipe.capture.file), root_(file_.value) {
    Erase(root_, "synthesis");
    Set(root_, "format", "crownfit-capture/1");
    CopySurfaces();
    FreeParameters();
    WriteLights();
    for (size_t i = 0; i < recipe.capture.photographs.size(); ++i) DescribePhotograph(i);
  }

  void WriteCapture() { WriteTextFile(folder_ / "capture.json", ToJsonText(root_)); }

  /// Recorded over stated exposure of a photograph.
  double ExposureError(size_t photograph) const {
    return 1.0 + recipe_.error.exposure * Gaussian(Key(recipe_.seed, kStream, 1), photograph);
  }

 private:
  /// The file that `path` names moves along; `from_sub` and `to_sub` are where the file that names it stands.
  void Copy(JsonValue& path, const std::filesystem::path& from_sub = {}, const std::filesystem::path& to_sub = {}) {
    const std::string from = std::get<std::string>(path.data);
    const auto to = Inside(from);
    std::filesystem::create_directories((folder_ / to_sub / to).parent_path());
    std::filesystem::copy_file(recipe_.capture.folder / from_sub / from, folder_ / to_sub / to,
                               std::filesystem::copy_options::overwrite_existing);
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

  /// Named parameters start off by the factor, up and down by turns, inside their bounds.
  void FreeParameters() {
    JsonValue& object = *Find(root_, "object");
    for (size_t k = 0; k < recipe_.free.size(); ++k) {
      const std::string &name = recipe_.free[k], owner_name = name.substr(0, name.find('.')),
                        key = name.substr(name.find('.') + 1);
      JsonValue* owner = owner_name == "surface" ? Find(object, "surface") : nullptr;
      if (!owner)
        for (auto& layer : Items(*Find(object, "layers")))
          if (std::get<std::string>(Find(layer, "name")->data) == owner_name) owner = &layer;
      JsonValue* parameter = Find(*owner, key);
      const auto row =
          std::find_if(kParameters.begin(), kParameters.end(), [&](const auto& r) { return r.key == key; });
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
            x += recipe_.error.light_mm * Gaussian(Key(recipe_.seed, kStream, 2), 3 * i + axis);
          }
          Set(lights[i], "stddev_mm", recipe_.error.light_mm);
        }
    for (auto& light : lights)
      if (JsonValue* map = Find(light, "file")) Copy(*map, from.parent_path(), to.parent_path());
    WriteTextFile(folder_ / to, ToJsonText(rig.value));
    path = to.generic_string();
  }

  /// The stated pose; photographs of one true pose share one error, as from one calibration.
  JsonValue StatedPose(size_t photograph) {
    const auto& photos = recipe_.capture.photographs;
    size_t first = photograph;
    for (size_t i = 0; i < photograph; ++i)
      if (photos[i].camera_from_object.rotation == photos[photograph].camera_from_object.rotation &&
          photos[i].camera_from_object.translation_mm == photos[photograph].camera_from_object.translation_mm)
        first = std::min(first, i);
    const auto error = [&](uint64_t k) { return Gaussian(Key(recipe_.seed, kStream, 3), 6 * first + k); };
    RigidTransform pose = photos[photograph].camera_from_object;
    const glm::dvec3 turn =
        recipe_.error.pose_deg * std::numbers::pi / 180.0 * glm::dvec3(error(0), error(1), error(2));
    if (const double angle = glm::length(turn); angle > 0) {
      const glm::dvec3 a = turn / angle;
      const glm::dmat3 cross(glm::dvec3(0, a.z, -a.y), glm::dvec3(-a.z, 0, a.x), glm::dvec3(a.y, -a.x, 0));
      pose.rotation =
          (glm::dmat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * cross * cross) * pose.rotation;
    }
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
                            {"stddev", recipe_.error.exposure}});
  }

  const Recipe& recipe_;
  const std::filesystem::path& folder_;
  JsonFile file_;
  JsonValue root_;
};

/// Variance of the mean of a walked pixel, averaged over its neighbours on the object: a pixel's own estimate goes up
/// and down with its value, and weights made from it would favour the dark ones.
std::vector<glm::dvec3> SmoothedVariance(const PathPhotograph& photo) {
  constexpr int kReach = 3;
  std::vector<glm::dvec3> smooth(photo.pixels.size());
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      const PixelEstimate& here = photo.pixels[static_cast<size_t>(y) * photo.width + x];
      glm::dvec3 sum(0.0);
      double count = 0;
      for (int v = std::max(0, y - kReach); v <= std::min(photo.height - 1, y + kReach); ++v)
        for (int u = std::max(0, x - kReach); u <= std::min(photo.width - 1, x + kReach); ++u) {
          const PixelEstimate& near = photo.pixels[static_cast<size_t>(v) * photo.width + u];
          if (near.on_object == here.on_object) sum += near.variance(), ++count;
        }
      smooth[static_cast<size_t>(y) * photo.width + x] = sum / count;
    }
  return smooth;
}

JsonValue TruthOf(const Recipe& recipe, const Material& material, const std::vector<double>& exposure_errors) {
  const auto values = [](const ParameterRow& row, const Material::Layer& owner) -> JsonValue {
    const ChannelValues& v = owner[row.quantity];
    if (!row.per_channel) return v[0];
    return std::vector<double>(v.begin(), v.end());
  };
  JsonValue::Array layers, channels;
  for (size_t l = 0; l < material.layers.size(); ++l) {
    JsonValue::Object layer{{"name", material.layers[l].name}};
    for (const auto& row : kParameters)
      if (row.owner == Owner::kLayer && recipe.capture.layers[l][row.quantity].stated)
        layer.emplace_back(row.key, values(row, material.layers[l]));
    layers.emplace_back(layer);
  }
  JsonValue::Object surface;
  for (const auto& row : kParameters)
    if (IsOfSurface(recipe.capture, row)) surface.emplace_back(row.key, values(row, material.surface));
  for (int c = 0; c < kChannels; ++c)
    channels.emplace_back(JsonValue::Object{{"name", recipe.capture.channel_names[c]},
                                            {"wavelength_nm", recipe.capture.wavelengths_nm[c]}});
  return JsonValue::Object{{"format", "crownfit-material/1"},
                           {"model", "path"},
                           {"channels", channels},
                           {"layers", layers},
                           {"surface", surface},
                           {"provenance", JsonValue::Object{{"seed", static_cast<double>(recipe.seed)},
                                                            {"paths_per_pixel", recipe.paths_per_pixel},
                                                            {"recorded_over_stated_exposure", exposure_errors}}}};
}

}  // namespace

Recipe ReadRecipe(const std::filesystem::path& path) {
  Recipe recipe;
  recipe.capture = ReadRecipeCapture(path);
  const JsonFile file(path);
  const JsonObject root =
      file.RootOfFormat("crownfit-recipe/1", {"object", "channels", "light_rig", "photographs", "synthesis"});
  const JsonObject o(root.Require("synthesis"),
                     {"paths_per_pixel", "noise", "seed", "initial_factor", "free", "calibration_error"});
  if (const auto n = o.Find("paths_per_pixel")) recipe.paths_per_pixel = n->Integer(2, 100000000);
  if (const auto n = o.Find("seed")) recipe.seed = static_cast<uint64_t>(n->Integer(0, 2000000000));
  if (const auto n = o.Find("initial_factor")) recipe.initial_factor = n->Number(0.01, 100.0);
  if (const auto noise = o.Find("noise")) {
    const JsonObject n(*noise, {"relative", "floor"});
    if (const auto v = n.Find("relative")) recipe.noise_relative = v->Number(0.0, 1.0);
    if (const auto v = n.Find("floor")) recipe.noise_floor = v->Number(0.0, 1.0);
  }
  if (const auto error = o.Find("calibration_error")) {
    const JsonObject e(*error, {"exposure", "pose_deg", "pose_mm", "light_mm"});
    if (const auto v = e.Find("exposure")) recipe.error.exposure = v->Number(0.0, 0.3);
    if (const auto v = e.Find("pose_deg")) recipe.error.pose_deg = v->Number(0.0, 30.0);
    if (const auto v = e.Find("pose_mm")) recipe.error.pose_mm = v->Number(0.0, 1000.0);
    if (const auto v = e.Find("light_mm")) recipe.error.light_mm = v->Number(0.0, 1000.0);
  }
  const auto require_fixed = [&](const ParameterSpec& spec, const std::string& name) {
    if (!spec.fixed)
      throw InputError(path, name, "a recipe states the truth: every parameter is fixed",
                       "Write {\"fixed\": v} and name it in synthesis.free.");
  };
  std::vector<std::string> names;
  for (const auto& row : kParameters) {
    if (row.owner == Owner::kSurface) {
      require_fixed(recipe.capture.surface[static_cast<size_t>(row.quantity)],
                    std::string("object.surface.") + row.key);
      if (recipe.capture.surface[static_cast<size_t>(row.quantity)].stated)
        names.push_back(std::string("surface.") + row.key);
      continue;
    }
    for (const auto& layer : recipe.capture.layers) {
      require_fixed(layer[row.quantity], layer.name + "." + row.key);
      if (layer[row.quantity].stated) names.push_back(layer.name + "." + row.key);
    }
  }
  if (const auto free = o.Find("free"))
    for (const auto& item : free->Items()) {
      recipe.free.push_back(item.String());
      if (std::find(names.begin(), names.end(), recipe.free.back()) == names.end())
        item.Fail("the object states no parameter '" + recipe.free.back() + "'",
                  "Name one as layer.key or surface.key, such as enamel.absorption_per_mm, and give it a value.");
    }
  return recipe;
}

std::vector<std::string> Synthesize(const Recipe& recipe, const std::filesystem::path& folder, int threads,
                                    const std::function<void(const std::string&, double)>& progress) {
  const Capture& capture = recipe.capture;
  progress("reading", 0.0);
  const CrownSource source = ReadCrownSource(capture, threads);
  const auto scenery = ReadScenery(capture);
  const LayeredBody body(BuildSurfaces(capture, source, StatedThicknesses(capture)), threads, source.absorption);
  const Material material = StatedMaterial(capture);
  CaptureWriter writer(recipe, folder);

  PathOptions options;
  options.paths_per_pixel = recipe.paths_per_pixel;
  options.seed = recipe.seed;
  options.stream = kStream;
  options.threads = threads;
  std::vector<std::string> messages = source.messages;
  std::vector<double> exposure_errors;
  WalkCounters counters;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const PhotographSpec& spec = capture.photographs[i];
    const PathPhotograph photo = RenderByPaths(capture, body, scenery, material, i, options,
                                               [&](double share) { progress("walking " + spec.name, share); });
    counters.Add(photo.counters);
    const auto walk_variance = SmoothedVariance(photo);
    exposure_errors.push_back(writer.ExposureError(i));
    const double exposure = spec.exposure_scale * exposure_errors.back();
    Image picture(photo.width, photo.height, 3), variance(photo.width, photo.height, 3);
    double noise2 = 0, light = 0, on_object = 0;
    for (size_t p = 0; p < photo.pixels.size(); ++p)
      for (int c = 0; c < kChannels; ++c) {
        const double value = exposure * photo.pixels[p].mean[c];
        const double sensor = std::pow(recipe.noise_relative * value, 2) + std::pow(recipe.noise_floor, 2);
        const uint64_t key = Key(recipe.seed, kStream, 4, i, p);
        picture.values[3 * p + c] = static_cast<float>(value + std::sqrt(sensor) * Gaussian(key, c));
        variance.values[3 * p + c] = static_cast<float>(sensor + exposure * exposure * walk_variance[p][c]);
        if (photo.pixels[p].on_object && c == 1) {
          noise2 += walk_variance[p][c];
          light += photo.pixels[p].mean[c];
          ++on_object;
        }
      }
    WriteImageFile(folder / "photos" / (spec.name + ".exr"), picture);
    WriteImageFile(folder / "photos" / (spec.name + "_variance.exr"), variance);
    char text[200];
    std::snprintf(text, sizeof text, "%s: Monte Carlo noise %.1f %% of the mean pixel (green, rms over the object)",
                  spec.name.c_str(), 100.0 * std::sqrt(noise2 * on_object) / std::max(light, 1e-12));
    messages.emplace_back(text);
  }
  messages.push_back(LossesInWords(counters));
  writer.WriteCapture();
  WriteTextFile(folder / "truth.json", ToJsonText(TruthOf(recipe, material, exposure_errors)));
  return messages;
}

}  // namespace crownfit
