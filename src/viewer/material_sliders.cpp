#include "viewer/material_sliders.h"

#include <algorithm>

#include "capture/capture.h"
#include "shader/predict.h"

namespace crownfit {
namespace {

/// The reason why a slider would change nothing.
std::string Idle(const Capture& capture, size_t layer, Quantity quantity) {
  const auto slots = SlotsOf(capture);
  const bool is_seen = std::any_of(slots.begin(), slots.end(), [&](const auto& slot) {
    return slot && slot->layer == layer && slot->quantity == quantity;
  });
  if (!is_seen) return "not in this model";
  const bool is_last = layer + 1 == capture.layers.size();
  if (quantity == Quantity::kThickness && is_last && capture.layers[layer][quantity].fixed) return "as the mesh is";
  return "";
}

SliderParameter SliderOf(const Capture& capture, size_t layer, const ParameterRow& row, const Spectrum& values,
                         const ParameterRecord& record) {
  SliderParameter parameter{layer, row.quantity, record.status, Idle(capture, layer, row.quantity), {}};
  const size_t count = row.per_channel ? static_cast<size_t>(values.size()) : 1;
  for (size_t c = 0; c < count; ++c) {
    const double value = values[static_cast<int>(c)];
    SliderNumber number{value, value, {}};
    if (!record.interval95.empty()) number.interval95 = record.interval95[std::min(c, record.interval95.size() - 1)];
    parameter.numbers.push_back(number);
  }
  return parameter;
}

}  // namespace

std::vector<SliderGroup> SlidersOf(const Capture& capture, const MaterialRecord& record) {
  std::vector<SliderGroup> groups;
  for (size_t l = 0; l < capture.layers.size(); ++l) {
    SliderGroup group{capture.layers[l].name, {}};
    for (const ParameterRow& row : kParameters)
      if (IsOfLayer(capture, l, row))
        group.parameters.push_back(SliderOf(capture, l, row, record.material.layers[l][row.quantity],
                                            record.layers[l][static_cast<size_t>(row.quantity)]));
    // Parameters that change the picture come first.
    std::stable_partition(group.parameters.begin(), group.parameters.end(),
                          [](const SliderParameter& p) { return p.idle.empty(); });
    groups.push_back(group);
  }
  SliderGroup surface{"surface", {}};
  for (const ParameterRow& row : kParameters)
    if (IsOfSurface(capture, row))
      surface.parameters.push_back(SliderOf(capture, kSurfaceOwner, row, record.material.surface[row.quantity],
                                            record.surface[static_cast<size_t>(row.quantity)]));
  groups.push_back(surface);
  return groups;
}

Material MaterialOf(const std::vector<SliderGroup>& groups, Material material) {
  for (const SliderGroup& group : groups)
    for (const SliderParameter& p : group.parameters) {
      Spectrum& values = (p.layer == kSurfaceOwner ? material.surface : material.layers[p.layer])[p.quantity];
      for (int c = 0; c < values.size(); ++c)
        values[c] = p.numbers[std::min(static_cast<size_t>(c), p.numbers.size() - 1)].value;
    }
  return material;
}

}  // namespace crownfit
