#pragma once
// The input of exporters: a material in terms that other programs share and, with a capture, the scene of every
// photograph. Lengths in mm, coefficients in 1/mm, in the object's frame.

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "capture/camera.h"
#include "capture/rigid_transform.h"
#include "geometry/triangle_mesh.h"
#include "optics/material_file.h"
#include "photo/image.h"

namespace crownfit {

struct Capture;

/// A layer: Henyey-Greenstein scattering with the true coefficient, not the reduced one.
struct ExportedLayer {
  std::string name;
  double ior = 1, asymmetry = 0, isotropic_fraction = 0;
  Spectrum scattering_per_mm{}, absorption_per_mm{};
  std::optional<double> thickness_mm;  ///< mean; empty: not known, treated as a half space
  Spectrum reduced_scattering_per_mm() const {
    return scattering_per_mm * (1.0 - (1.0 - isotropic_fraction) * asymmetry);
  }
};

struct BallLamp {
  glm::dvec3 centre_mm{0.0};
  double radius_mm = 0;
};
struct DomeLamp {};
struct EnvironmentLamp {
  Image radiance;  ///< latitude-longitude in the object's frame, as EnvironmentMap; replaces the lamp's own
};

/// One-sided (towards the mesh's outside), of constant radiance.
struct ExportedLamp {
  std::string name;
  Spectrum radiance{};  ///< times pi and the exposure: so a radiance picture equals the photograph
  std::variant<TriangleMesh, BallLamp, DomeLamp, EnvironmentLamp> shape;
};

/// Opaque and Lambertian on both sides.
struct ExportedThing {
  std::string name;
  TriangleMesh mesh;
  Spectrum reflectance{};
};

struct ExportedPhotograph {
  std::string name;
  Camera camera;  ///< square pixels, no distortion
  RigidTransform camera_from_object;
  std::vector<ExportedLamp> lamps;
  std::vector<ExportedThing> things;
};

struct ExportScene {
  std::vector<std::string> channel_names;
  std::vector<double> wavelengths_nm;
  int channels() const { return static_cast<int>(channel_names.size()); }
  std::vector<ExportedLayer> layers;  ///< outermost first
  double roughness = 0, outside_ior = 1;
  MaterialRecord record;              ///< the file's data on every value
  std::vector<std::string> warnings;  ///< for example: the material states that it must not be used
  /// The rest is empty without a capture.
  std::vector<TriangleMesh> surfaces;  ///< of every layer, closed
  bool neck_is_opaque = false;         ///< where is_cut: black from outside, Lambertian from inside
  Spectrum neck_reflectance{};
  std::vector<ExportedPhotograph> photographs;
  std::vector<std::string> left_out;  ///< parts of the capture that no format here can hold
};

/// Below this roughness a surface is smooth, as it is for the path model.
inline constexpr double kSmoothBelow = 0.001;

/// Reduces the capture and the material to what other programs support: no polarisers, lens distortion, blur, film of
/// water, textures or optical contact; square pixels. Lists what was removed in `left_out`.
void LeaveOutWhatOthersLack(Capture& capture, Material& material, std::vector<std::string>& left_out);

/// The layers of a material; thicknesses where `record`'s file or the capture states them.
ExportScene SceneOfMaterial(const Capture& capture, const MaterialRecord& record);

/// Adds the photographs' cameras, lamps and objects. `scenery`: all meshes of the capture's scenery, in its order.
void AddPhotographs(const Capture& capture, const std::vector<TriangleMesh>& scenery, ExportScene& scene);

/// The scene in three channels, for formats that hold red, green and blue: those nearest to 600, 540 and 450 nm; says
/// in `left_out` which. A scene of three channels stays as it is.
ExportScene InThreeChannels(ExportScene scene);

/// Unique names of letters, digits, - and _ only, none equal to `taken`: for files and identifiers.
std::vector<std::string> FileNames(const std::vector<std::string>& names, const std::string& taken = "");

}  // namespace crownfit
