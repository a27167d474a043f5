#include "material_priors.h"

#include <cmath>
#include <optional>
#include <vector>

#include "base/error.h"
#include "exchange/material_file.h"

namespace crownfit {
namespace {

struct Gaussian1 {
  double mean, stddev;
};

/// Of a parameter in one channel, in the scale that the fit moves it in.
std::optional<Gaussian1> Stated(const ParameterRecord& record, double value, Scale scale, size_t channel) {
  if (record.stddev.empty()) return {};
  const std::optional<double> stddev = record.stddev[record.stddev.size() == 1 ? 0 : channel];
  if (!stddev || !(*stddev > 0)) return {};
  if (scale == Scale::kLinear) return Gaussian1{value, *stddev};
  return value > 0 ? std::optional(Gaussian1{std::log(value), *stddev / value}) : std::nullopt;
}

}  // namespace

void TakePriors(const std::filesystem::path& file, const Capture& capture, FreeParameters& free) {
  const MaterialRecord record = ReadMaterialRecord(file, capture);
  bool any = false;
  for (FreeEntry& e : free.entries) {
    if (e.role == FreeEntry::Role::kPowerExponent) continue;  // its level says it
    const auto row = static_cast<size_t>(e.quantity);
    const bool is_surface = e.layer == kSurfaceOwner;
    const ParameterRecord& said = is_surface ? record.surface[row] : record.layers[e.layer][row];
    const ChannelValues& values = (is_surface ? record.material.surface : record.material.layers[e.layer])[e.quantity];
    // A power law's level stands at 540 nm: at the middle channel's, nearly.
    const size_t channel = e.role == FreeEntry::Role::kOneChannel ? static_cast<size_t>(e.channel) : 1;
    const std::optional<Gaussian1> prior = Stated(said, values[channel], e.scale, channel);
    if (!prior) continue;
    e.prior_mean = prior->mean;
    e.prior_stddev = prior->stddev;
    any = true;
  }
  if (!any && free.count() > 0)
    throw InputError(file, "layers", "states no standard deviation of anything that this capture frees",
                     "Give a material.json of a fit, or \"stddev\" beside the values.");
}

}  // namespace crownfit
