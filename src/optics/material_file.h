#pragma once
// Material files of other runs.

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "optics/joint_values.h"
#include "optics/material.h"

namespace crownfit {

/// Reads the values of material.json or truth.json ("crownfit-material/1") for the layers of a capture, by name; what
/// the file does not state keeps the capture's value. Throws InputError when a layer is missing or its bands are more
/// than 10 nm off the capture's.
Material ReadMaterialFile(const std::filesystem::path& file, const Capture& capture);

/// What the file says about a parameter beside its value.
struct ParameterRecord {
  bool is_stated = false;                           ///< false: the file does not speak of it
  std::string status;                               ///< empty: a bare value
  std::vector<std::string> status_by_channel = {};  ///< empty: as `status`
  std::vector<std::optional<double>>
      stddev;  ///< one, or one per channel, nothing where not known; empty: none is given
  /// One, or one per channel; empty: the file gives none. An entry is absent where an end is not known.
  std::vector<std::optional<std::array<double, 2>>> interval95;
};

struct MaterialRecord {
  using Owner = std::array<ParameterRecord, kParameters.size()>;
  Material material;
  std::vector<Owner> layers;
  Owner surface;
  std::map<std::string, double> linear_scales;  ///< such as "exposure_scale front", "intensity_scale left"
  bool is_usable = true;                        ///< false: its fit says that it must not be used
  std::optional<std::vector<std::string>> channel_names;
  std::optional<std::vector<double>> wavelengths_nm;  ///< where the file states them
  std::optional<JointValues> joint;   ///< of the fitted values; absent: each value has its own uncertainty only
  std::optional<Material> effective;  ///< values of the block "viewer", with which the real-time shader looks right
};

/// The same with everything that a fit states about its values.
MaterialRecord ReadMaterialRecord(const std::filesystem::path& file, const Capture& capture);

/// The same without a capture beside it: all layers in the file; values that it does not state are the table's
/// defaults.
MaterialRecord ReadMaterialRecord(const std::filesystem::path& file);

/// Describes the effective parameters and their distance from the physical ones; empty where there are none or they are
/// equal.
std::string EffectiveNote(const MaterialRecord& record);

/// Whether the row is part of a layer's material: the thickness where the next layer follows from it, a scale where one
/// is stated or a mesh or a field defines the thickness.
bool IsOfLayer(const Capture& capture, size_t layer, const ParameterRow& row);

/// The capture with the exposures and the lamps' intensities of a fit.
Capture WithLinearScales(Capture capture, const std::map<std::string, double>& linear_scales);

/// What a material file says without a capture beside it.
struct MaterialOutline {
  std::vector<std::string> layers;   ///< names, outermost first
  std::string status;                ///< "usable", "not_usable"; empty: the file does not say
  std::vector<std::string> reasons;  ///< why it must not be used
  std::optional<std::vector<std::string>> channel_names;
  std::optional<std::vector<double>> wavelengths_nm;
  int channels() const { return channel_names ? static_cast<int>(channel_names->size()) : 3; }
};
MaterialOutline ReadMaterialOutline(const std::filesystem::path& file);

/// A capture of those layers and nothing else, with the table's defaults.
Capture CaptureOfOutline(const MaterialOutline& outline, const std::filesystem::path& file);

/// Writes values that were set by hand: no intervals, every status "fixed", the file's own "not_usable".
void WriteHandSetMaterial(const std::filesystem::path& file, const Capture& capture, const Material& material,
                          const std::map<std::string, double>& linear_scales, const std::string& made_from);

}  // namespace crownfit
