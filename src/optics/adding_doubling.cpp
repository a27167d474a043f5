#include "optics/adding_doubling.h"

#include <cmath>
#include <numbers>

#include "base/error.h"
#include "optics/shading_terms.h"
#include "optics/stack.h"

namespace crownfit {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The medium that the backing lies in: one in contact has no other before it.
double BelowIor(const Slab& slab) { return slab.backing_contact ? slab.layers.back().ior : slab.ior_below; }

std::vector<double> IndicesOf(const Slab& slab) {
  std::vector<double> indices{slab.ior_above, BelowIor(slab)};
  for (const auto& layer : slab.layers) indices.push_back(layer.ior);
  return indices;
}

/// A slab's layers, ready for any thicknesses.
struct Assembly {
  Assembly(const Slab& slab, int nodes, const std::vector<double>& views)
      : all(IndicesOf(slab), nodes, views), above(all.In(slab.ior_above)), below(all.In(BelowIor(slab))) {
    for (const auto& layer : slab.layers) {
      inside.push_back(all.In(layer.ior));
      modes.emplace_back(layer, inside.back(), 2 * nodes - 1);
    }
  }
  Stack OfThicknesses(const std::vector<double>& mm) const {
    Stack stack = Add(Interface(above, inside[0]), modes[0].OfThickness(mm[0]));
    for (size_t i = 1; i < modes.size(); ++i)
      stack = Add(Add(stack, Interface(inside[i - 1], inside[i])), modes[i].OfThickness(mm[i]));
    return Add(stack, Interface(inside.back(), below));
  }
  AllDirections all;
  Directions above, below;
  std::vector<Directions> inside;
  std::vector<LayerModes> modes;
};

}  // namespace

SlabAnswer SolveByAddingDoubling(const Slab& slab, const AddingDoublingOptions& options) {
  const Assembly assembly(slab, options.nodes, {});
  const Directions &above = assembly.above, &below = assembly.below;
  std::vector<double> thickness_mm;
  for (const auto& layer : slab.layers) thickness_mm.push_back(layer.thickness_mm);
  Stack stack = assembly.OfThicknesses(thickness_mm);
  if (slab.backing_reflectance > 0) stack = Add(stack, Backing(below, slab.backing_reflectance));

  SlabAnswer answer;
  answer.model = "layered";
  SetSpecular(slab, answer);
  const VectorXd in = above.FluxWeights(), out = below.FluxWeights();
  const VectorXd reflected = (in.transpose() * stack.reflect_down).transpose().cwiseQuotient(in),
                 transmitted = (out.transpose() * stack.transmit_down).transpose().cwiseQuotient(in);
  const Index normal = assembly.all.NormalIncidence();
  answer.value.reflectance_collimated = reflected[normal] - answer.specular;
  answer.value.transmittance_collimated = transmitted[normal];
  double mirrored = 0;  // by the first surface, over the same directions
  for (Index i = 0; i < above.size(); ++i)
    mirrored +=
        in[i] / in.sum() * Terms<double>::FresnelReflectance(above.cosine[i], slab.layers[0].ior / slab.ior_above);
  answer.value.reflectance_diffuse = reflected.dot(in) / in.sum() - mirrored;
  answer.value.transmittance_diffuse = transmitted.dot(in) / in.sum();
  return answer;
}

std::vector<ViewedSlab> ViewSlab(const Slab& slab, const std::vector<std::vector<double>>& thicknesses_mm,
                                 MeasuredAt geometry, const AddingDoublingOptions& options) {
  for (const double index : IndicesOf(slab)) Check(index >= slab.ior_above, "a slab is seen from its rarest medium");
  const bool is_sphere = geometry == MeasuredAt::kD_8;
  const double cosine = std::cos((is_sphere ? 8.0 : 45.0) * std::numbers::pi / 180.0);
  const Assembly assembly(slab, options.nodes, {cosine});
  const VectorXd in = assembly.above.FluxWeights(), out = assembly.below.FluxWeights();
  const VectorXd every_below = VectorXd::Ones(out.size());
  const Index view = assembly.all.View(0);
  // Basic radiance that arrives, of flux 1: from everywhere, or from straight above.
  VectorXd light = VectorXd::Constant(in.size(), 1.0 / in.sum());
  if (!is_sphere)
    light = VectorXd::Unit(in.size(), assembly.all.NormalIncidence()) / in[assembly.all.NormalIncidence()];
  const double mirrored =
      is_sphere ? light[view] * Terms<double>::FresnelReflectance(cosine, slab.layers[0].ior / slab.ior_above) : 0.0;
  std::vector<ViewedSlab> views;
  for (const auto& mm : thicknesses_mm) {
    const Stack stack = assembly.OfThicknesses(mm);
    ViewedSlab v;
    v.reflectance = stack.reflect_down.row(view).dot(light) - mirrored;
    v.transmittance = out.dot(stack.transmit_down * light);
    v.emergence = stack.transmit_up.row(view).sum() / out.sum();
    v.reflectance_below = out.dot(stack.reflect_up * every_below) / out.sum();
    views.push_back(v);
  }
  return views;
}

}  // namespace crownfit
