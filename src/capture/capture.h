#pragma once
// A capture: what was photographed, from where, under which light. Read strictly from capture.json.

#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/blur.h"
#include "capture/camera.h"
#include "capture/light_rig.h"
#include "capture/measurement.h"
#include "capture/parameters.h"
#include "capture/rigid_transform.h"
#include "photo/colour.h"
#include "photo/photograph.h"

namespace crownfit {

/// A layer's thickness where it varies over the crown; times the layer's thickness_scale.
struct ThicknessField {
  std::array<double, 3> zones_mm{};  ///< in the middle of the cervical, middle and incisal third, smooth between
  std::string vertex_property;       ///< or a number at every vertex of the layer's mesh, by name
};

/// Unevenness of the junction to the next layer: added to the thickness; the same for the same seed.
struct JunctionNoise {
  double amplitude_mm = 0;  ///< root mean square
  double wavelength_mm = 1;
  uint64_t seed = 1;
};

/// A factor on a layer's absorption that varies over its surface and holds at every depth below it.
struct AbsorptionTextureSpec {
  std::optional<std::filesystem::path> file;   ///< a picture, by the mesh's texture coordinates; values as stored
  std::vector<std::string> vertex_properties;  ///< or numbers at the vertices: one name, or one per channel
  double low = 0, high = 1;                    ///< the factors that values of 0 and 1 stand for
};

struct LayerSpec {
  std::string name;
  std::optional<std::filesystem::path> surface;  ///< mesh; absent: inward offset of the layer above
  std::optional<ThicknessField> thickness_field;
  JunctionNoise junction_noise;
  std::optional<AbsorptionTextureSpec> absorption_texture;
  std::array<ParameterSpec, kParameters.size()> parameters;
  const ParameterSpec& operator[](Quantity q) const { return parameters[static_cast<size_t>(q)]; }
  ParameterSpec& operator[](Quantity q) { return parameters[static_cast<size_t>(q)]; }
};

struct ScenerySpec {
  std::string name;
  std::filesystem::path mesh;
  glm::dvec3 reflectance{0.0};
};

struct BackingSpec {
  std::string name;
  glm::dvec3 point_mm{0.0}, normal{0.0, 0.0, 1.0};
  double size_mm = 30.0;
  glm::dvec3 reflectance{0.0};
  bool in_contact = false;  ///< no air between the tile and what of the object lies on it
  bool has_place = true;    ///< false: point and normal are not stated, as under an instrument
};

enum class Polarisation { kNone, kCross, kParallel };

/// What light meets inside at the cut where an open scan ends.
enum class Neck {
  kAir,        ///< the dielectric boundary of the rest
  kAbsorbing,  ///< nothing comes back
  kRoot        ///< the innermost layer's material goes on: a Lambertian return of its half space
};

/// What becomes of light S that kept its polarisation: none = S + D, cross = D, parallel = 2 S + D, as photographs are
/// normalised to a white card seen through the filters.
struct Polarisers {
  double of_kept;        ///< factor on S
  double memory_events;  ///< a share exp(-n / this) of light that was scattered n times is S; 0: none is

  static Polarisers Of(Polarisation polarisation, double memory_events = 0) {
    return {polarisation == Polarisation::kNone    ? 1.0
            : polarisation == Polarisation::kCross ? 0.0
                                                   : 2.0,
            memory_events};
  }
  /// Factor on light that layers scattered `events` times and nothing else has depolarised.
  template <class T>
  T OfScattered(const T& events) const {
    using std::exp;
    return memory_events > 0 ? 1.0 + (of_kept - 1.0) * exp(-events / memory_events) : T(1.0);
  }
};

struct PhotographSpec {
  std::string name, key;  ///< key: where it stands in capture.json
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
  /// How well the pose is known, as in StatedPose: of a turn (rad) and a shift (mm) in the camera frame after it.
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
  std::array<std::string, kChannels> channel_names{"R", "G", "B"};
  std::array<double, kChannels> wavelengths_nm{600, 540, 450};
  std::vector<Light> lights;
  std::vector<PhotographSpec> photographs;         ///< empty: instruments alone have measured the material
  std::vector<FlatMeasurement> measurements;       ///< of flat samples
  std::vector<std::filesystem::path> input_files;  ///< everything read, for provenance
};

/// The surface's rows that are part of its material: all, but the neck's only where the capture speaks of it.
inline bool IsOfSurface(const Capture& capture, const ParameterRow& row) {
  return row.owner == Owner::kSurface &&
         (row.quantity != Quantity::kNeckReturn || capture.surface[static_cast<size_t>(row.quantity)].stated);
}

/// The quantity that sets layer `layer`'s thickness: thickness_mm, or thickness_scale where a mesh or a field has it.
Quantity ThicknessQuantity(const Capture& capture, size_t layer);

/// For what needs a shape: throws InputError where the capture has measurements alone.
void RequirePhotographs(const Capture& capture);

/// Reads capture.json, or the one in the folder `path`, with its camera, light, noise and colour files.
/// Images and meshes are not read here. Throws InputError.
Capture ReadCapture(const std::filesystem::path& path);

/// Reads the capture that a recipe ("crownfit-recipe/1") describes; its "synthesis" is left to the reader in
/// synthetic/.
Capture ReadRecipeCapture(const std::filesystem::path& file);

}  // namespace crownfit
