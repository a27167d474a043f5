#pragma once
// Lamps: one-sided, of constant radiance, not seen directly by the camera.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "base/json_file.h"
#include "capture/environment_map.h"
#include "capture/rigid_transform.h"

namespace crownfit {

/// Limits on radiance, irradiance and intensity in the photographs' unit, and on factors. No product overflows a
/// picture.
inline constexpr double kBrightest = 1e15, kLargestFactor = 1e9;

/// A factor on a light's intensity, or on a photograph's exposure.
struct Factor {
  double value = 1.0;
  double stddev = 0;     ///< 0: exact, or free
  bool is_free = false;  ///< nothing is known of it
};
/// Reads {"fixed": v} or {"initial": v}, and "stddev": a factor known within an error is not free. Throws InputError.
Factor ReadFactor(const JsonNode& node);

struct DirectionalLight {
  glm::dvec3 direction;
  Spectrum irradiance;
  double angular_radius;
};  ///< towards the light; radians
struct PointLight {
  glm::dvec3 position_mm;
  Spectrum radiant_intensity;
  double radius_mm;
};  ///< irradiance = I cos / d^2
struct DiskLight {
  glm::dvec3 centre_mm, normal;
  Spectrum radiance;
  double inner_radius_mm, outer_radius_mm;
};  ///< also rings; the normal is a unit vector
struct RectangleLight {
  glm::dvec3 centre_mm, half_axis_u_mm, half_axis_v_mm;
  Spectrum radiance;
};  ///< shines along u x v
struct DomeLight {
  Spectrum radiance;
};  ///< uniform sphere

struct EnvironmentLight {
  std::shared_ptr<const EnvironmentMap> map;
  Spectrum scale;
  glm::dmat3 map_from_frame{1.0};
};  ///< from all around, as a picture

using LightShape = std::variant<DirectionalLight, PointLight, DiskLight, RectangleLight, DomeLight, EnvironmentLight>;

/// Light from all directions, which surfaces find by sampling the hemisphere.
inline bool IsAllAround(const LightShape& shape) {
  return std::holds_alternative<DomeLight>(shape) || std::holds_alternative<EnvironmentLight>(shape);
}

struct Light {
  std::string name;
  bool in_camera_frame = false;
  bool scale_is_free = false;  ///< intensity_scale {"initial"}: solved in closed form
  double intensity_scale = 1.0;
  double intensity_stddev = 0;     ///< 0: exact, or free
  glm::dmat3 covariance_mm2{0.0};  ///< of its position, in its frame; 0: not stated
  double stddev_deg = 0;           ///< of a directional light's direction; 0: not stated
  LightShape shape;

  /// Of its position, along the least certain axis of its frame.
  double Stddev_mm() const {
    return std::sqrt(std::max({covariance_mm2[0][0], covariance_mm2[1][1], covariance_mm2[2][2]}));
  }
};

struct LightRig {
  std::vector<Light> lights;
  std::vector<std::filesystem::path> files;  ///< further files that were read
};

/// Reads light_rig.json ("crownfit-light-rig/1") and the maps it names, whose paths are relative to it. `channels`:
/// those of the capture; none: lists may have any length.
LightRig ReadLightRig(const std::filesystem::path& file, const std::vector<std::string>& channels = {});

/// The lights as a rig file holds them. Environment lights are not written, because their map stays where it is.
JsonValue::Array LightsJson(const std::vector<Light>& lights);

/// The light with every intensity multiplied, channel by channel.
LightShape Scaled(const LightShape& shape, const Spectrum& factor);

/// The light in another frame.
LightShape Transformed(const LightShape& shape, const RigidTransform& target_from_source);

}  // namespace crownfit
