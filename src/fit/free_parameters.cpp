#include "fit/free_parameters.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "capture/capture.h"

namespace crownfit {
namespace {

constexpr double kReferenceWavelength_nm = 540.0;

struct Named {
  ParameterSpec& spec;
  const ParameterRow& row;
};

Named SpecNamed(Capture& capture, const std::string& name, const std::string& option) {
  const size_t dot = name.rfind('.');
  const std::string owner = name.substr(0, dot), key = dot == std::string::npos ? "" : name.substr(dot + 1);
  for (size_t i = 0; i < kParameters.size(); ++i) {
    if (kParameters[i].key != key) continue;
    if (owner == "surface" && kParameters[i].owner == Owner::kSurface) return {capture.surface[i], kParameters[i]};
    for (auto& layer : capture.layers)
      if (layer.name == owner && kParameters[i].owner == Owner::kLayer) return {layer.parameters[i], kParameters[i]};
  }
  std::string known;
  for (const auto& row : kParameters) {
    if (row.owner == Owner::kSurface)
      known += std::string(known.empty() ? "" : ", ") + "surface." + row.key;
    else
      known += std::string(known.empty() ? "" : ", ") + capture.layers[0].name + "." + row.key;
  }
  throw InputError("", option, "there is no parameter '" + name + "'",
                   "Known (layer keys for each layer): " + known + ".");
}

double InScale(Scale scale, double value) { return scale == Scale::kLog ? std::log(value) : value; }

void AddEntries(const Capture& capture, const ParameterSpec& spec, const ParameterRow& row, size_t layer,
                const std::string& owner, FreeParameters& free) {
  if (spec.fixed) return;
  FreeEntry entry{
      owner + "." + row.key, layer, row.quantity, FreeEntry::Role::kAllChannels, 0, row.scale, 0, 0, 0, 0, 0};
  entry.moves_surface = row.owner == Owner::kLayer && layer + 1 < capture.layers.size() &&
                        !capture.layers[layer + 1].surface && row.quantity == ThicknessQuantity(capture, layer);
  entry.low = InScale(row.scale, spec.low);
  entry.high = InScale(row.scale, spec.high);
  const bool is_thickness = row.quantity == Quantity::kThickness;
  // A thickness has no population value: its prior mean is the capture's start value.
  entry.prior_mean = InScale(row.scale, spec.prior_mean.value_or(is_thickness ? spec.value[0] : row.prior_mean));
  entry.prior_stddev = spec.prior_log_stddev.value_or(row.prior_stddev);
  const auto start = [&](double value) { return std::clamp(InScale(row.scale, value), entry.low, entry.high); };
  if (spec.sharing == Sharing::kOneValue) {
    entry.start = start(spec.value[0]);
    free.entries.push_back(entry);
    return;
  }
  if (spec.sharing == Sharing::kNone) {
    for (int c = 0; c < capture.channels(); ++c) {
      entry.role = FreeEntry::Role::kOneChannel;
      entry.channel = c;
      entry.name = owner + "." + row.key + "[" + capture.channel_names[static_cast<size_t>(c)] + "]";
      entry.start = start(spec.value[c]);
      free.entries.push_back(entry);
    }
    return;
  }
  if (HaveOneWavelength(capture.wavelengths_nm))
    throw InputError(capture.file, "channels",
                     "all channels have the same wavelength, but " + entry.name + " follows a power law of wavelength",
                     "State the wavelengths of the bands, or write \"shared\": \"channels\" or \"none\".");
  const PowerLawWeights line = WeightsOfPowerLaw(capture.wavelengths_nm);
  const double level = line.level.Dot(Log(spec.value)), exponent_start = line.exponent.Dot(Log(spec.value));
  entry.role = FreeEntry::Role::kPowerLevel;
  entry.start = std::clamp(level, entry.low, entry.high);
  free.entries.push_back(entry);
  FreeEntry exponent{owner + "." + row.key + " (power-law exponent)",
                     layer,
                     row.quantity,
                     FreeEntry::Role::kPowerExponent,
                     0,
                     Scale::kLinear,
                     std::clamp(exponent_start, -1.0, 5.0),
                     -1.0,
                     5.0,
                     1.0,
                     1.0};
  free.entries.push_back(exponent);
}

/// ln(wavelength / 540 nm), the factor of the power law's exponent.
double Lever(const FreeParameters& free, int channel) {
  return std::log(free.wavelengths_nm[static_cast<size_t>(channel)] / kReferenceWavelength_nm);
}

}  // namespace

bool HaveOneWavelength(std::span<const double> wavelengths_nm) {
  return std::ranges::all_of(wavelengths_nm, [&](double nm) { return nm == wavelengths_nm[0]; });
}

PowerLawWeights WeightsOfPowerLaw(std::span<const double> wavelengths_nm) {
  const Spectrum x = Log(Spectrum(wavelengths_nm) / kReferenceWavelength_nm);
  const double mean = x.Mean(), spread = (x - mean).Dot(x - mean);
  const Spectrum exponent = -(x - mean) / spread;
  return {1.0 / static_cast<double>(wavelengths_nm.size()) + mean * exponent, exponent};
}

void ApplyOverrides(Capture& capture, const FitOverrides& overrides) {
  for (const auto& [name, values] : overrides.fix) {
    ParameterSpec& spec = SpecNamed(capture, name, "--fix").spec;
    const double low = spec.low, high = spec.high;
    if (values.size() != 1 && static_cast<int>(values.size()) != capture.channels())
      throw InputError(
          "", "--fix",
          name + ": expected one number, or one for each of " + std::to_string(capture.channels()) + " channels");
    for (double value : values)
      if (!(value >= low && value <= high))
        throw InputError("", "--fix",
                         name + " = " + std::to_string(value) + " is outside [" + std::to_string(low) + ", " +
                             std::to_string(high) + "]");
    spec.fixed = true;
    spec.stated = true;
    spec.value = values.size() == 1 ? Spectrum(capture.channels(), values[0]) : Spectrum(values);
  }
  for (const auto& name : overrides.free) {
    ParameterSpec& spec = SpecNamed(capture, name, "--free").spec;
    spec.fixed = false;
    spec.stated = true;
    spec.value = Min(Max(spec.value, Spectrum(spec.low)), Spectrum(spec.high));
  }
  for (const auto& [name, sharing] : overrides.share) {
    const auto [spec, row] = SpecNamed(capture, name, "--share");
    if (!row.per_channel && sharing != Sharing::kOneValue)
      throw InputError("", "--share", name + " has one value for all channels");
    if (spec.fixed)
      throw InputError("", "--share", name + " is not fitted, because the capture fixes it",
                       "Add --free " + name + ".");
    spec.sharing = sharing;
    if (sharing == Sharing::kOneValue) spec.value.fill(std::exp(Log(spec.value).Mean()));
  }
}

FreeParameters FreeParametersOf(const Capture& capture) {
  FreeParameters free;
  free.start = StatedMaterial(capture);
  free.wavelengths_nm = capture.wavelengths_nm;
  for (size_t l = 0; l < capture.layers.size(); ++l)
    for (size_t i = 0; i < kParameters.size(); ++i)
      if (kParameters[i].owner == Owner::kLayer)
        AddEntries(capture, capture.layers[l].parameters[i], kParameters[i], l, capture.layers[l].name, free);
  for (size_t i = 0; i < kParameters.size(); ++i)
    if (kParameters[i].owner == Owner::kSurface)
      AddEntries(capture, capture.surface[i], kParameters[i], kSurfaceOwner, "surface", free);
  return free;
}

Eigen::VectorXd StartVector(const FreeParameters& free) {
  Eigen::VectorXd x(free.count());
  for (int k = 0; k < free.count(); ++k) x[k] = free.entries[k].start;
  return x;
}

void StartFrom(const Eigen::VectorXd& x, FreeParameters& free) {
  for (int k = 0; k < free.count(); ++k)
    free.entries[k].start = std::clamp(x[k], free.entries[k].low, free.entries[k].high);
}

Material MaterialAt(const FreeParameters& free, const Eigen::VectorXd& x) {
  Material material = free.start;
  for (int k = 0; k < free.count(); ++k) {
    const FreeEntry& e = free.entries[k];
    Spectrum& v = (e.layer == kSurfaceOwner ? material.surface : material.layers[e.layer])[e.quantity];
    const double value = e.scale == Scale::kLog ? std::exp(x[k]) : x[k];
    if (e.role == FreeEntry::Role::kOneChannel) {
      v[e.channel] = value;
    } else if (e.role != FreeEntry::Role::kPowerExponent) {
      v.fill(value);
    } else {
      // Its level precedes it in the list.
      for (int c = 0; c < v.size(); ++c) v[c] *= std::exp(-x[k] * Lever(free, c));
    }
  }
  return material;
}

bool HasWalkDerivative(const FreeEntry& entry) {
  switch (entry.quantity) {
    case Quantity::kReducedScattering:
    case Quantity::kAbsorption:
    case Quantity::kAsymmetry:
    case Quantity::kIor:
    case Quantity::kRoughness:
      return true;
    default:
      return entry.moves_surface;
  }
}

std::vector<int> HeldByWalks(const Capture& capture, const std::vector<FreeEntry>& entries) {
  std::vector<int> held;
  for (int k = 0; k < static_cast<int>(entries.size()); ++k)
    if (!HasWalkDerivative(entries[k]) && (entries[k].layer == kSurfaceOwner || capture.measurements.empty()))
      held.push_back(k);
  return held;
}

Eigen::RowVectorXd ValueGradient(const FreeParameters& free, const Eigen::VectorXd& x, size_t layer, Quantity quantity,
                                 int channel) {
  const Material material = MaterialAt(free, x);
  Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Zero(free.count());
  for (int k = 0; k < free.count(); ++k) {
    const FreeEntry& e = free.entries[k];
    if (e.layer != layer || e.quantity != quantity) continue;
    if (e.role == FreeEntry::Role::kOneChannel && e.channel != channel) continue;
    const double value = (layer == kSurfaceOwner ? material.surface : material.layers[layer])[quantity][channel];
    if (e.role == FreeEntry::Role::kPowerExponent)
      gradient[k] = -Lever(free, channel) * value;
    else
      gradient[k] = e.scale == Scale::kLog ? value : 1.0;
  }
  return gradient;
}

}  // namespace crownfit
