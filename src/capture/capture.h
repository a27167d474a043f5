#pragma once
// A capture: what was photographed, from where, under which light. Read strictly from capture.json.

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/blur.h"
#include "capture/camera.h"
#include "capture/layer_spec.h"
#include "capture/light_rig.h"
#include "capture/measurement.h"
#include "capture/parameters.h"
#include "capture/polarisation.h"
#include "capture/rigid_transform.h"
#include "photo/colour.h"
#include "photo/photograph.h"

namespace crownfit {

struct ScenerySpec {
  std::string name;
  std::filesystem::path mesh;
  Spectrum reflectance;
};

struct BackingSpec {
  std::string name;
  glm::dvec3 point_mm{0.0}, normal{0.0, 0.0, 1.0};
  double size_mm = 30.0;
  Spectrum reflectance;
  bool in_contact = false;  ///< no air gap between the tile and the part of the object that lies on it
  bool has_place = true;    ///< false: point and normal are not stated, as under an instrument
};

/// Boundary condition inside the cut where an open scan ends.
enum class Neck {
  kAir,        ///< a dielectric boundary, as everywhere else
  kAbsorbing,  ///< no light comes back
  kRoot        ///< the innermost layer's material continues: Lambertian reflection by its half space
};

struct PhotographSpec {
  std::string name, key;  ///< key: its path in capture.json
  PhotographFiles files;
  std::filesystem::path camera_file;
  Camera camera;
  RigidTransform camera_from_object;
  std::vector<size_t> lights;  ///< indices into Capture::lights
  Polarisation polarisation = Polarisation::kNone;
  double polarisation_memory_events = 0;
  std::optional<size_t> backing;
  std::vector<size_t> scenery;
  bool exposure_is_free = false;
  double exposure_scale = 1.0;
  /// Covariance of the pose, as in StatedPose: of a rotation (rad) and a shift (mm) in the camera frame after it.
  std::optional<std::array<double, 36>> pose_covariance;
  double exposure_stddev = 0;  ///< 0: exact, or free
  std::string exposure_group;  ///< photographs of one group share one free exposure
  bool is_holdout = false;
  bool has_noise_file = false;
  ColourTransform rgb_from_sensor;
  std::optional<Blur> blur;
  bool has_colour_file = false;

  Polarisers polarisers() const { return Polarisers::Of(polarisation, polarisation_memory_events); }
};

struct Capture {
  std::filesystem::path file, folder;
  std::vector<LayerSpec> layers;  ///< outermost first
  std::array<ParameterSpec, kParameters.size()> surface;
  std::vector<ScenerySpec> scenery;
  std::vector<BackingSpec> backings;
  double outside_ior = 1.0;
  Neck neck = Neck::kRoot;
  std::optional<glm::dvec3> long_axis;  ///< unit, towards the incisal edge; thickness zones lie along it
  std::vector<std::string> channel_names{"R", "G", "B"};
  std::vector<double> wavelengths_nm{600, 540, 450};
  std::vector<Light> lights;
  std::vector<PhotographSpec> photographs;         ///< empty: only instruments have measured the material
  std::vector<FlatMeasurement> measurements;       ///< of flat samples
  std::vector<std::filesystem::path> input_files;  ///< everything read, for provenance

  int channels() const { return static_cast<int>(channel_names.size()); }
};

/// Names of the channels in pictures that the program writes: R, G and B of three, else the capture's own.
std::vector<std::string> ChannelsInFile(const Capture& capture);

/// Whether a surface row is part of the material: all are, but the neck's only where the capture mentions it.
inline bool IsOfSurface(const Capture& capture, const ParameterRow& row) {
  return row.owner == Owner::kSurface &&
         (row.quantity != Quantity::kNeckReturn || capture.surface[static_cast<size_t>(row.quantity)].stated);
}

/// The quantity that sets layer `layer`'s thickness: thickness_mm, or thickness_scale where a mesh or a field defines
/// it.
Quantity ThicknessQuantity(const Capture& capture, size_t layer);

/// Throws InputError where the capture has measurements alone, and so no shape.
void RequirePhotographs(const Capture& capture);

/// Reads capture.json, or the one in the folder `path`, with its camera, light, noise and colour files.
/// Images and meshes are not read here. Throws InputError.
Capture ReadCapture(const std::filesystem::path& path);

/// Reads the capture that a recipe ("crownfit-recipe/1") describes; its "synthesis" is left to the reader in
/// synthetic/.
Capture ReadRecipeCapture(const std::filesystem::path& file);

}  // namespace crownfit
