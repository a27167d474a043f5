#pragma once
// The only definition of every quantity that a capture can state and a fit can free: key, unit, default, bounds and
// prior.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/json_file.h"
#include "photo/spectrum.h"

namespace crownfit {

inline constexpr size_t kMostLayers = 16;

enum class Quantity {
  kThickness,       ///< thickness_mm, where the layer below is an inward offset
  kThicknessScale,  ///< thickness_scale, where the layer below has a mesh of its own
  kIor,
  kAsymmetry,
  kIsotropicFraction,
  kReducedScattering,
  kAbsorption,
  kRoughness,
  kWetness,
  kNeckReturn,  ///< light returned through a root-like neck, relative to what the root's half space would return
  kCount        ///< no quantity: their number
};

enum class Scale { kLog, kLinear };  ///< scale of the fit's steps and of priors
enum class Owner { kLayer, kSurface };

/// One row of the table. A fit starts and stays inside [low, high]. Values that are stated but not fitted may lie
/// anywhere in [least, most]; 0 is the white, the clear, the polished limit. Ray tracing needs layers thicker than the
/// wavelength.
struct ParameterRow {
  Quantity quantity;
  const char* key;
  const char* unit;
  Owner owner;
  bool per_channel;
  Scale scale;
  double initial, low, high, least, most;
  double prior_mean, prior_stddev;  ///< weak: population value and its spread in ln (kLog) or in the unit (kLinear)
};

/// Priors are wide on purpose (ln standard deviation 1 is a factor 2.7 either way): they resolve ambiguities and do not
/// replace measurements. Ranges: enamel, dentine and dental ceramics, Zijp et al. 1995, Fried et al. 1995,
/// Fernandez-Oliveras 2013.
inline constexpr std::array<ParameterRow, static_cast<size_t>(Quantity::kCount)> kParameters{{
    {Quantity::kThickness, "thickness_mm", "mm", Owner::kLayer, false, Scale::kLog, 1.0, 0.02, 20.0, 1e-3, 1e3, 1.0,
     0.7},
    {Quantity::kThicknessScale, "thickness_scale", "1", Owner::kLayer, false, Scale::kLog, 1.0, 0.2, 5.0, 0.2, 5.0, 1.0,
     0.3},
    {Quantity::kIor, "ior", "1", Owner::kLayer, false, Scale::kLinear, 1.54, 1.0, 3.0, 1.0, 3.0, 1.55, 0.1},
    {Quantity::kAsymmetry, "g", "1", Owner::kLayer, false, Scale::kLinear, 0.8, -0.99, 0.99, -0.99, 0.999, 0.8, 0.2},
    {Quantity::kIsotropicFraction, "isotropic_fraction", "1", Owner::kLayer, false, Scale::kLinear, 0.0, 0.0, 1.0, 0.0,
     1.0, 0.1, 0.2},
    {Quantity::kReducedScattering, "reduced_scattering_per_mm", "1/mm", Owner::kLayer, true, Scale::kLog, 2.0, 1e-3,
     100.0, 0.0, 1e4, 2.0, 1.2},
    {Quantity::kAbsorption, "absorption_per_mm", "1/mm", Owner::kLayer, true, Scale::kLog, 0.05, 1e-5, 20.0, 0.0, 1e3,
     0.05, 1.8},
    {Quantity::kRoughness, "roughness", "1", Owner::kSurface, false, Scale::kLog, 0.15, 0.01, 1.0, 0.0, 1.0, 0.15, 0.8},
    {Quantity::kWetness, "wetness", "1", Owner::kSurface, false, Scale::kLinear, 0.0, 0.0, 1.0, 0.0, 1.0, 0.2, 0.3},
    {Quantity::kNeckReturn, "neck_return", "1", Owner::kSurface, false, Scale::kLinear, 1.0, 0.0, 2.0, 0.0, 2.0, 1.0,
     0.5},
}};

/// Row i describes quantity i, and no row is missing: RowOf and every array of parameters count on it.
constexpr bool RowsFollowQuantities() {
  for (size_t i = 0; i < kParameters.size(); ++i)
    if (kParameters[i].quantity != static_cast<Quantity>(i) || kParameters[i].key == nullptr) return false;
  return true;
}
static_assert(RowsFollowQuantities(), "kParameters needs one row per Quantity, in the same order");

constexpr const ParameterRow& RowOf(Quantity quantity) { return kParameters[static_cast<size_t>(quantity)]; }

enum class Sharing { kOneValue, kNone, kPowerLaw };  ///< one value, one per channel, or s0 (wavelength / 540 nm)^-b

/// As files and options name it: "channels", "none", "power_law".
const char* Word(Sharing sharing);
std::optional<Sharing> SharingOf(const std::string& word);

/// What a capture says about one parameter.
struct ParameterSpec {
  bool fixed = true;
  bool stated = false;  ///< false: absent from the file, so the table's default holds
  Spectrum value;       ///< fixed or initial, per channel; equal entries when one value is shared
  double low = 0, high = 0;
  std::optional<double> prior_mean, prior_log_stddev;
  Sharing sharing = Sharing::kOneValue;
};

/// One number, or one per channel, inside [least, most]; as many entries as channels. Throws InputError.
Spectrum ReadPhysicalValues(const JsonNode& node, const ParameterRow& row, int channels);

/// Numbers in [0, most], one per channel or one for all; `channels` 0: of an unknown number. Throws InputError.
Spectrum ReadSpectrum(const JsonNode& node, double most, int channels);

/// One value per channel, or one for all, as files hold it.
JsonValue SpectrumJson(const Spectrum& values);

/// The default of the table (fixed).
ParameterSpec DefaultSpec(const ParameterRow& row, int channels = 3);

/// Reads {"fixed": v} or {"initial": v, "bounds", "prior", "shared"}, or a bare number (fixed).
ParameterSpec ReadParameterSpec(const JsonNode& node, const ParameterRow& row, int channels);

/// Keys of the parameters of a layer or of the surface.
std::vector<std::string> ParameterKeys(Owner owner);

}  // namespace crownfit
