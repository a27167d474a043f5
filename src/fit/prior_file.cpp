#include "fit/prior_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "base/error.h"
#include "optics/material_file.h"

namespace crownfit {
namespace {

struct Gaussian1 {
  double mean, stddev;
};

/// Prior of a parameter in one channel, in the scale of the fit.
std::optional<Gaussian1> Stated(const ParameterRecord& record, double value, Scale scale, size_t channel) {
  if (record.stddev.empty()) return {};
  const std::optional<double> stddev = record.stddev[record.stddev.size() == 1 ? 0 : channel];
  if (!stddev || !(*stddev > 0)) return {};
  if (scale == Scale::kLinear) return Gaussian1{value, *stddev};
  return value > 0 ? std::optional(Gaussian1{std::log(value), *stddev / value}) : std::nullopt;
}

/// Prior of a linear combination of the channels' values. Its error assumes independent or fully correlated channels,
/// whichever gives more.
std::optional<Gaussian1> Combined(const ParameterRecord& record, const Spectrum& values, Scale scale,
                                  const Spectrum& weights) {
  double mean = 0, apart = 0, together = 0;
  for (int c = 0; c < values.size(); ++c) {
    const std::optional<Gaussian1> stated = Stated(record, values[c], scale, static_cast<size_t>(c));
    if (!stated) return {};
    mean += weights[c] * stated->mean;
    apart += std::pow(weights[c] * stated->stddev, 2);
    together += weights[c] * stated->stddev;
  }
  return Gaussian1{mean, std::max(std::sqrt(apart), std::abs(together))};
}

std::optional<Gaussian1> StatedOf(const FreeEntry& e, const FreeParameters& free, const ParameterRecord& record,
                                  const Spectrum& values) {
  switch (e.role) {
    case FreeEntry::Role::kPowerLevel:
      return Combined(record, values, Scale::kLog, WeightsOfPowerLaw(free.wavelengths_nm).level);
    case FreeEntry::Role::kPowerExponent:
      return Combined(record, values, Scale::kLog, WeightsOfPowerLaw(free.wavelengths_nm).exponent);
    case FreeEntry::Role::kOneChannel:
      return Stated(record, values[e.channel], e.scale, static_cast<size_t>(e.channel));
    default:
      return Stated(record, values.Middle(), e.scale, static_cast<size_t>(values.size() / 2));
  }
}

}  // namespace

void TakePriors(const std::filesystem::path& file, const Capture& capture, FreeParameters& free) {
  const MaterialRecord record = ReadMaterialRecord(file, capture);
  bool any = false;
  for (FreeEntry& e : free.entries) {
    const auto row = static_cast<size_t>(e.quantity);
    const bool is_surface = e.layer == kSurfaceOwner;
    const ParameterRecord& said = is_surface ? record.surface[row] : record.layers[e.layer][row];
    const Spectrum& values = (is_surface ? record.material.surface : record.material.layers[e.layer])[e.quantity];
    const std::optional<Gaussian1> prior = StatedOf(e, free, said, values);
    if (!prior) continue;
    e.prior_mean = prior->mean;
    e.prior_stddev = prior->stddev;
    any = true;
  }
  if (!any && free.count() > 0)
    throw InputError(file, "layers", "has no standard deviation of any parameter that this capture frees",
                     "Give the material.json of a fit, or add \"stddev\" to the values.");
}

}  // namespace crownfit
