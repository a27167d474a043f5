#include "path/path_derivatives.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/capture.h"

namespace crownfit {
namespace {

/// Steps of a parameter downwards and upwards, in the quantity of differentiation; a zero step is skipped.
struct Steps {
  double down, up;
};

Steps StepsOf(Quantity quantity, double value, double high) {
  constexpr double kShare = 0.2, kIorStep = 0.02, kFromSmooth = 0.05, kLeast = 0.02;
  if (quantity == Quantity::kIor) return {value - kIorStep >= 1.0 ? kIorStep : 0.0, kIorStep};
  if (quantity == Quantity::kRoughness)
    return value > 0.1 * kFromSmooth ? Steps{kShare * value, kShare * value} : Steps{0.0, kFromSmooth};
  const double up = std::log(std::min(1.0 + kShare, high / value));
  return {-std::log(1.0 - kShare), up > kLeast ? up : 0.0};
}

double HighestOf(const Capture& capture, const DerivativeParameter& p) {
  return (p.layer < capture.layers.size() ? capture.layers[p.layer][p.quantity]
                                          : capture.surface[static_cast<size_t>(p.quantity)])
      .high;
}

Spectrum& ValuesOf(Material& material, const DerivativeParameter& p) {
  return p.layer < material.layers.size() ? material.layers[p.layer][p.quantity] : material.surface[p.quantity];
}

}  // namespace

bool IsDifferentiatedByLogarithm(Quantity q) {
  return q == Quantity::kThickness || q == Quantity::kThicknessScale || q == Quantity::kReducedScattering ||
         q == Quantity::kAbsorption;
}

double ElementFor(const std::vector<TriangleMesh>& surfaces, const Material& material, double shortest_resolved_mm) {
  double steepest = 0;
  for (const Material::Layer& layer : material.layers)
    steepest = std::max(steepest, (layer[Quantity::kReducedScattering] + layer[Quantity::kAbsorption]).Largest());
  return VolumeLattice::ElementFor(surfaces, std::max(1.0 / std::max(steepest, 1e-9), shortest_resolved_mm));
}

Bodies::Built& Bodies::BuiltFor(const Material& material) {
  constexpr size_t kKept = 4;
  const std::vector<double> thicknesses = ThicknessesOf(input_.capture, material);
  const auto built =
      std::find_if(built_.begin(), built_.end(), [&](const Built& b) { return b.thicknesses == thicknesses; });
  if (built != built_.end()) {
    built_.splice(built_.begin(), built_, built);
  } else {
    built_.push_front({thicknesses, LayeredBody(BuildSurfaces(input_.capture, input_.source, thicknesses), threads_,
                                                input_.source.absorption)});
    if (built_.size() > kKept) built_.pop_back();
  }
  return built_.front();
}

const LayeredBody& Bodies::Of(const Material& material) { return BuiltFor(material).body; }

const VolumeLattice& Bodies::LatticeOf(const Material& material) {
  Built& built = BuiltFor(material);
  const double element_mm = ElementFor(built.body.surfaces, material, shortest_resolved_mm_);
  if (!built.lattice || built.lattice->element_mm() != element_mm)
    built.lattice.emplace(built.body.surfaces, built.body.is_exposed, built.body.absorption, element_mm, threads_);
  return *built.lattice;
}

std::vector<DerivativeParameter> DifferencedParameters(const Capture& capture) {
  std::vector<DerivativeParameter> all;
  for (size_t l = 0; l < capture.layers.size(); ++l) {
    all.push_back({l, Quantity::kIor});
    const bool has_offset = l + 1 < capture.layers.size() && !capture.layers[l + 1].surface;
    if (has_offset) all.push_back({l, ThicknessQuantity(capture, l)});
  }
  all.push_back(RoughnessOf(capture));
  return all;
}

std::string NameOf(const DerivativeParameter& p, const Material& material) {
  const std::string owner = p.layer < material.layers.size() ? material.layers[p.layer].name : "surface";
  return owner + "." + RowOf(p.quantity).key;
}

std::vector<DifferentiatedPhotograph> DifferentiateByPaths(const CrownInput& input, Bodies& bodies,
                                                           const Material& material,
                                                           const std::vector<size_t>& photographs,
                                                           const PathOptions& stated,
                                                           const std::vector<DerivativeParameter>& differenced,
                                                           const std::string& stage, Progress& progress) {
  const Capture& capture = input.capture;
  const double pictures = 2.0 * static_cast<double>(differenced.size()) + 1.0;
  double done = 0;
  const auto render = [&](const Material& m, bool derivatives) {
    PathOptions options = stated;
    options.derivatives = derivatives;
    if (stated.lattice) options.lattice = &bodies.LatticeOf(m);
    options.keeps_groups = !differenced.empty();
    auto photos = RenderTogether(capture, bodies.Of(m), input.scenery, m, photographs, options,
                                 [&](double share) { progress.Show(stage, (done + share) / pictures, "derivatives"); });
    ++done;
    return photos;
  };
  std::vector<PathPhotograph> photos = render(material, true);
  std::vector<std::vector<FiniteDifferences>> differences(photos.size());  // per photograph
  for (const DerivativeParameter& p : differenced) {
    Material moved = material;
    const double value = ValuesOf(moved, p)[0];
    const Steps steps = StepsOf(p.quantity, value, HighestOf(capture, p));
    for (size_t k = 0; k < photos.size(); ++k) differences[k].push_back({p, photos[k].group_values});
    // Derivative weights of the parabola through three points, or of the line through two.
    const auto [down, up] = steps;
    const double of_low = down > 0 ? (up > 0 ? -up / (down * (down + up)) : -1.0 / down) : 0.0,
                 of_high = up > 0 ? (down > 0 ? down / (up * (down + up)) : 1.0 / up) : 0.0;
    for (auto& of_photo : differences) of_photo.back().values.Scale(-(of_low + of_high));
    for (const auto& [step, weight] : {std::pair(-down, of_low), std::pair(up, of_high)}) {
      if (weight == 0) continue;
      ValuesOf(moved, p).fill(IsDifferentiatedByLogarithm(p.quantity) ? value * std::exp(step) : value + step);
      const std::vector<PathPhotograph> there = render(moved, false);
      for (size_t k = 0; k < photos.size(); ++k)
        for (size_t i = 0; i < there[k].group_values.size(); ++i)
          differences[k].back().values.Add(i, weight, there[k].group_values, i);
    }
  }
  std::vector<DifferentiatedPhotograph> all;
  for (size_t k = 0; k < photos.size(); ++k) {
    PooledDerivatives derivatives(photos[k], differences[k]);
    all.push_back({std::move(photos[k]), std::move(derivatives)});
  }
  return all;
}

}  // namespace crownfit
