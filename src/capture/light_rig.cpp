#include "capture/light_rig.h"

#include <glm/gtc/type_ptr.hpp>
#include <numbers>
#include <set>

#include "base/error.h"
#include "capture/covariance.h"
#include "capture/parameters.h"

namespace crownfit {
namespace {

std::vector<std::string> KeysOf(const std::string& type) {
  std::vector<std::string> keys{"name", "type", "frame", "intensity_scale", "stddev_mm", "covariance", "stddev_deg"};
  const auto add = [&](std::initializer_list<const char*> more) { keys.insert(keys.end(), more.begin(), more.end()); };
  if (type == "directional") add({"direction", "irradiance_rgb", "angular_radius_deg"});
  if (type == "point") add({"position_mm", "radiant_intensity_rgb", "radius_mm"});
  if (type == "disk") add({"centre_mm", "normal", "radius_mm", "radiance_rgb"});
  if (type == "rectangle") add({"centre_mm", "half_axis_u_mm", "half_axis_v_mm", "radiance_rgb"});
  if (type == "ring") add({"centre_mm", "axis", "inner_radius_mm", "outer_radius_mm", "radiance_rgb"});
  if (type == "dome") add({"radiance_rgb"});
  if (type == "environment") add({"file", "radiance_scale_rgb"});
  return keys;
}

std::string TypeOf(const JsonNode& node) {
  // The type decides which keys are allowed, so it is read before the others are compared.
  for (const auto& [key, value] : node.Members())
    if (key == "type") return value.OneOf({"directional", "point", "disk", "rectangle", "ring", "dome", "environment"});
  return JsonObject(node, KeysOf("")).Require("type").String();
}

LightShape ReadShape(const JsonObject& o, const std::string& type, const std::vector<std::string>& channels,
                     std::vector<std::filesystem::path>& files) {
  const int count = static_cast<int>(channels.size());
  const auto rgb = [&](const char* key) { return ReadSpectrum(o.Require(key), kBrightest, count); };
  if (type == "directional") {
    const auto radius = o.Find("angular_radius_deg");
    const double degrees = radius ? radius->Number(0.0, 90.0) : 1.0;
    return DirectionalLight{ReadUnitVector(o.Require("direction")), rgb("irradiance_rgb"),
                            degrees * std::numbers::pi / 180.0};
  }
  if (type == "point") {
    // Default: 1 degree as seen from the origin of its frame, because a smooth surface can't reflect a light of no
    // size.
    const glm::dvec3 position = ReadPlace(o.Require("position_mm"));
    const auto radius = o.Find("radius_mm");
    return PointLight{
        position, rgb("radiant_intensity_rgb"),
        radius ? radius->Number(0.0, kFarthestPlace_mm) : glm::length(position) * std::numbers::pi / 180.0};
  }
  if (type == "disk")
    return DiskLight{ReadPlace(o.Require("centre_mm")), ReadUnitVector(o.Require("normal")), rgb("radiance_rgb"), 0.0,
                     o.Require("radius_mm").Positive(kFarthestPlace_mm)};
  if (type == "ring") {
    const double inner = o.Require("inner_radius_mm").Number(0.0, kFarthestPlace_mm),
                 outer = o.Require("outer_radius_mm").Positive(kFarthestPlace_mm);
    if (inner >= outer) o.Require("outer_radius_mm").Fail("must be greater than inner_radius_mm");
    return DiskLight{ReadPlace(o.Require("centre_mm")), ReadUnitVector(o.Require("axis")), rgb("radiance_rgb"), inner,
                     outer};
  }
  if (type == "rectangle") {
    const RectangleLight light{ReadPlace(o.Require("centre_mm")), ReadPlace(o.Require("half_axis_u_mm")),
                               ReadPlace(o.Require("half_axis_v_mm")), rgb("radiance_rgb")};
    if (glm::length(glm::cross(light.half_axis_u_mm, light.half_axis_v_mm)) < 1e-12)
      o.Require("half_axis_v_mm").Fail("the two half axes span no area");
    return light;
  }
  if (type == "environment") {
    files.push_back(o.node().file().parent_path() / o.Require("file").String());
    const auto scale = o.Find("radiance_scale_rgb");
    const Spectrum as_it_is = count > 0 ? Spectrum(count, 1.0) : Spectrum(1.0);
    return EnvironmentLight{ReadEnvironmentMap(files.back(), channels),
                            scale ? ReadSpectrum(*scale, kBrightest, count) : as_it_is};
  }
  return DomeLight{rgb("radiance_rgb")};
}

}  // namespace

Factor ReadFactor(const JsonNode& node) {
  const JsonObject spec(node, {"fixed", "initial", "stddev"});
  const auto fixed = spec.Find("fixed"), initial = spec.Find("initial"), stddev = spec.Find("stddev");
  if (fixed.has_value() == initial.has_value()) node.Fail("expected either {\"fixed\": v} or {\"initial\": v}");
  Factor factor{(fixed ? *fixed : *initial).Positive(kLargestFactor)};
  if (stddev) factor.stddev = stddev->Positive();
  factor.is_free = initial && !stddev;
  return factor;
}

LightRig ReadLightRig(const std::filesystem::path& path, const std::vector<std::string>& channels) {
  const JsonFile file(path);
  const JsonObject root = file.RootOfFormat("crownfit-light-rig/1", {"lights", "quality", "provenance"});
  LightRig rig;
  std::set<std::string> names;
  for (const auto& item : root.Require("lights").Items(1000)) {
    const std::string type = TypeOf(item);
    const JsonObject object(item, KeysOf(type));
    Light light;
    light.name = object.Require("name").Name();
    if (!names.insert(light.name).second) object.Require("name").Fail("two lights are called '" + light.name + "'");
    if (const auto frame = object.Find("frame")) light.in_camera_frame = frame->OneOf({"object", "camera"}) == "camera";
    if (const auto scale = object.Find("intensity_scale")) {
      const Factor factor = ReadFactor(*scale);
      light.intensity_scale = factor.value, light.intensity_stddev = factor.stddev;
      light.scale_is_free = factor.is_free;
    }
    const auto stddev = object.Find("stddev_mm"), covariance = object.Find("covariance");
    if (stddev && covariance) covariance->Fail("can't be combined with stddev_mm", "Keep one of them.");
    if (stddev) light.covariance_mm2 = glm::dmat3(std::pow(stddev->Positive(kFarthestPlace_mm), 2));
    if (covariance) light.covariance_mm2 = glm::make_mat3(ReadCovariance(*covariance, 3).data());
    if (const auto turn = object.Find("stddev_deg")) light.stddev_deg = turn->Positive();
    light.shape = ReadShape(object, type, channels, rig.files);
    rig.lights.push_back(light);
  }
  if (rig.lights.empty()) root.Require("lights").Fail("the rig has no lights");
  return rig;
}

JsonValue::Array LightsJson(const std::vector<Light>& lights) {
  struct Write {
    JsonValue::Object& o;
    void operator()(const DirectionalLight& l) const {
      o.emplace_back("type", "directional");
      o.emplace_back("direction", VectorJson(l.direction));
      o.emplace_back("irradiance_rgb", SpectrumJson(l.irradiance));
      o.emplace_back("angular_radius_deg", l.angular_radius * 180.0 / std::numbers::pi);
    }
    void operator()(const PointLight& l) const {
      o.emplace_back("type", "point");
      o.emplace_back("position_mm", VectorJson(l.position_mm));
      o.emplace_back("radiant_intensity_rgb", SpectrumJson(l.radiant_intensity));
      o.emplace_back("radius_mm", l.radius_mm);
    }
    void operator()(const DiskLight& l) const {
      const bool ring = l.inner_radius_mm > 0;
      o.emplace_back("type", ring ? "ring" : "disk");
      o.emplace_back("centre_mm", VectorJson(l.centre_mm));
      o.emplace_back(ring ? "axis" : "normal", VectorJson(l.normal));
      if (ring) o.emplace_back("inner_radius_mm", l.inner_radius_mm);
      o.emplace_back(ring ? "outer_radius_mm" : "radius_mm", l.outer_radius_mm);
      o.emplace_back("radiance_rgb", SpectrumJson(l.radiance));
    }
    void operator()(const RectangleLight& l) const {
      o.emplace_back("type", "rectangle");
      o.emplace_back("centre_mm", VectorJson(l.centre_mm));
      o.emplace_back("half_axis_u_mm", VectorJson(l.half_axis_u_mm));
      o.emplace_back("half_axis_v_mm", VectorJson(l.half_axis_v_mm));
      o.emplace_back("radiance_rgb", SpectrumJson(l.radiance));
    }
    void operator()(const DomeLight& l) const {
      o.emplace_back("type", "dome");
      o.emplace_back("radiance_rgb", SpectrumJson(l.radiance));
    }
    void operator()(const EnvironmentLight&) const {}
  };
  JsonValue::Array all;
  for (const Light& light : lights) {
    if (std::holds_alternative<EnvironmentLight>(light.shape)) continue;
    JsonValue::Object o{{"name", light.name}};
    std::visit(Write{o}, light.shape);
    o.emplace_back("frame", light.in_camera_frame ? "camera" : "object");
    if (light.scale_is_free)
      o.emplace_back("intensity_scale", JsonValue::Object{{"initial", light.intensity_scale}});
    else if (light.intensity_stddev > 0)
      o.emplace_back("intensity_scale",
                     JsonValue::Object{{"fixed", light.intensity_scale}, {"stddev", light.intensity_stddev}});
    const glm::dmat3& covariance = light.covariance_mm2;
    if (covariance != glm::dmat3(covariance[0][0]))
      o.emplace_back("covariance",
                     JsonValue::Array{VectorJson(covariance[0]), VectorJson(covariance[1]), VectorJson(covariance[2])});
    else if (covariance[0][0] > 0)
      o.emplace_back("stddev_mm", light.Stddev_mm());
    if (light.stddev_deg > 0) o.emplace_back("stddev_deg", light.stddev_deg);
    all.emplace_back(o);
  }
  return all;
}

LightShape Scaled(const LightShape& shape, const Spectrum& factor) {
  struct Multiply {
    const Spectrum& factor;
    LightShape operator()(DirectionalLight l) const { return l.irradiance *= factor, l; }
    LightShape operator()(PointLight l) const { return l.radiant_intensity *= factor, l; }
    LightShape operator()(DiskLight l) const { return l.radiance *= factor, l; }
    LightShape operator()(RectangleLight l) const { return l.radiance *= factor, l; }
    LightShape operator()(DomeLight l) const { return l.radiance *= factor, l; }
    LightShape operator()(EnvironmentLight l) const { return l.scale *= factor, l; }
  };
  return std::visit(Multiply{factor}, shape);
}

LightShape Transformed(const LightShape& shape, const RigidTransform& t) {
  struct Move {
    const RigidTransform& t;
    LightShape operator()(DirectionalLight l) const {
      l.direction = t.Direction(l.direction);
      return l;
    }
    LightShape operator()(PointLight l) const {
      l.position_mm = t.Point(l.position_mm);
      return l;
    }
    LightShape operator()(DiskLight l) const {
      l.centre_mm = t.Point(l.centre_mm);
      l.normal = t.Direction(l.normal);
      return l;
    }
    LightShape operator()(RectangleLight l) const {
      l.centre_mm = t.Point(l.centre_mm);
      l.half_axis_u_mm = t.Direction(l.half_axis_u_mm);
      l.half_axis_v_mm = t.Direction(l.half_axis_v_mm);
      return l;
    }
    LightShape operator()(DomeLight l) const { return l; }
    LightShape operator()(EnvironmentLight l) const {
      l.map_from_frame = l.map_from_frame * glm::transpose(t.rotation);
      return l;
    }
  };
  return std::visit(Move{t}, shape);
}

}  // namespace crownfit
