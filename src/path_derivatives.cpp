#include "path_derivatives.h"

#include <cmath>

namespace crownfit {
namespace {

/// Steps of a parameter downwards and upwards, in what it is differentiated by; a zero step is not taken.
struct Steps {
  double down, up;
};

Steps StepsOf(Quantity quantity, double value) {
  constexpr double kShare = 0.2, kIorStep = 0.02, kFromSmooth = 0.05;
  if (quantity == Quantity::kIor) return {value - kIorStep >= 1.0 ? kIorStep : 0.0, kIorStep};
  if (quantity == Quantity::kRoughness)
    return value > 0.1 * kFromSmooth ? Steps{kShare * value, kShare * value} : Steps{0.0, kFromSmooth};
  return {-std::log(1.0 - kShare), std::log(1.0 + kShare)};
}

bool IsByLogarithm(Quantity q) { return q == Quantity::kThickness || q == Quantity::kThicknessScale; }

ChannelValues& ValuesOf(Material& material, const SlopeParameter& p) {
  return p.layer < material.layers.size() ? material.layers[p.layer][p.quantity] : material.surface[p.quantity];
}

/// Thicknesses that shape the crown, indices, roughness.
std::vector<SlopeParameter> DifferencedParameters(const Capture& capture, const Material& material) {
  std::vector<SlopeParameter> all;
  for (size_t l = 0; l < material.layers.size(); ++l) {
    all.push_back({l, Quantity::kIor});
    const bool has_offset = l + 1 < material.layers.size() && !capture.layers[l + 1].surface;
    if (has_offset) all.push_back({l, ThicknessQuantity(capture, l)});
  }
  all.push_back({material.layers.size(), Quantity::kRoughness});
  return all;
}

}  // namespace

std::string NameOf(const SlopeParameter& p, const Material& material) {
  const std::string owner = p.layer < material.layers.size() ? material.layers[p.layer].name : "surface";
  return owner + "." + RowOf(p.quantity).key;
}

DifferentiatedPhotograph DifferentiateByPaths(const CrownInput& input, const LayeredBody& body,
                                              const Material& material, size_t photograph, const PathOptions& stated,
                                              Progress& progress) {
  const Capture& capture = input.capture;
  const std::vector<SlopeParameter> parameters = DifferencedParameters(capture, material);
  const double pictures = 2.0 * static_cast<double>(parameters.size()) + 1.0;
  double done = 0;
  const auto body_of = [&](const Material& m) {
    return LayeredBody(BuildSurfaces(capture, input.source, ThicknessesOf(capture, m)), stated.threads,
                       input.source.absorption);
  };
  const auto render = [&](const Material& m, const LayeredBody& b, bool slopes) {
    PathOptions options = stated;
    options.slopes = slopes;
    options.keeps_groups = true;
    const std::string name = capture.photographs[photograph].name;
    PathPhotograph photo = RenderByPaths(capture, b, input.scenery, m, photograph, options, [&](double share) {
      progress.Show("walking " + name, (done + share) / pictures);
    });
    ++done;
    return photo;
  };
  PathPhotograph photo = render(material, body, true);
  std::vector<DifferenceSlopes> differences;
  for (const SlopeParameter& p : parameters) {
    Material moved = material;
    const double value = ValuesOf(moved, p)[0];
    const Steps steps = StepsOf(p.quantity, value);
    const auto at = [&](double step) {
      if (step == 0) return photo.group_values;
      ValuesOf(moved, p).fill(IsByLogarithm(p.quantity) ? value * std::exp(step) : value + step);
      return IsByLogarithm(p.quantity) ? render(moved, body_of(moved), false).group_values
                                       : render(moved, body, false).group_values;
    };
    const std::vector<glm::vec3> low = at(-steps.down), high = at(steps.up);
    // Of the parabola through three points, or of the line through two.
    const double sum = steps.down + steps.up;
    const float of_low = static_cast<float>(steps.down > 0 ? -steps.up / (steps.down * sum) : 0.0),
                of_high = static_cast<float>(steps.down > 0 ? steps.down / (steps.up * sum) : 1.0 / steps.up);
    DifferenceSlopes d{p, photo.group_values};
    for (size_t i = 0; i < d.values.size(); ++i)
      d.values[i] = of_low * (low[i] - d.values[i]) + of_high * (high[i] - d.values[i]);
    differences.push_back(std::move(d));
  }
  PooledSlopes slopes(photo, differences);
  return {std::move(photo), std::move(slopes)};
}

}  // namespace crownfit
