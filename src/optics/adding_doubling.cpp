#include "optics/adding_doubling.h"

#include <cmath>
#include <numbers>

#include "base/error.h"
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

/// Shares are exact to some roundings of all light: what is less than none by that is none.
double Share(double sum) {
  constexpr double kRoundings = 1e-14;
  return sum < 0.0 && sum > -kRoundings ? 0.0 : sum;
}

/// A slab's layers, ready for any thicknesses.
struct Assembly {
  Assembly(const Slab& slab, int nodes, const std::vector<double>& views)
      : all(IndicesOf(slab), nodes, views), above(all.In(slab.ior_above)), below(all.In(BelowIor(slab))) {
    for (const auto& layer : slab.layers) {
      // Phase functions that peak backwards want an even number: what delta-M cuts off must not be less than nothing.
      const int moments = layer.g < 0 ? 2 * nodes : 2 * nodes - 1;
      inside.push_back(all.In(layer.ior));
      modes.emplace_back(layer, inside.back(), moments);
    }
  }
  /// By the first surface, per direction.
  VectorXd Mirrored() const { return Interface(above, inside[0]).reflect_down; }
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
  answer.value.reflectance_collimated = Share(reflected[normal] - answer.specular);
  answer.value.transmittance_collimated = Share(transmitted[normal]);
  answer.value.reflectance_diffuse = Share((reflected - assembly.Mirrored()).dot(in) / in.sum());
  answer.value.transmittance_diffuse = Share(transmitted.dot(in) / in.sum());
  return answer;
}

std::vector<ViewedSlab> ViewSlab(const Slab& slab, const std::vector<std::vector<double>>& thicknesses_mm,
                                 MeasuredAt geometry, const AddingDoublingOptions& options) {
  for (const double index : IndicesOf(slab)) Check(index >= slab.ior_above, "a slab is seen from its rarest medium");
  const bool is_lit_around = geometry == MeasuredAt::kD_8 || geometry == MeasuredAt::kD_D;
  const bool collects = geometry == MeasuredAt::k0_D || geometry == MeasuredAt::kD_D;
  const double cosine = std::cos((geometry == MeasuredAt::kD_8 ? 8.0 : 45.0) * std::numbers::pi / 180.0);
  const Assembly assembly(slab, options.nodes, collects ? std::vector<double>{} : std::vector{cosine});
  const VectorXd in = assembly.above.FluxWeights(), out = assembly.below.FluxWeights();
  const VectorXd every_below = VectorXd::Ones(out.size());
  const Index normal = assembly.all.NormalIncidence();
  // Basic radiance that arrives, of flux 1: from everywhere, or from straight above; and what is seen of it.
  VectorXd light = VectorXd::Constant(in.size(), 1.0 / in.sum()), eye = in;
  if (!is_lit_around) light = VectorXd::Unit(in.size(), normal) / in[normal];
  if (!collects) eye = VectorXd::Unit(in.size(), assembly.all.View(0));
  const double mirrored = eye.dot(assembly.Mirrored().cwiseProduct(light));
  std::vector<ViewedSlab> views;
  for (const auto& mm : thicknesses_mm) {
    const Stack stack = assembly.OfThicknesses(mm);
    ViewedSlab v;
    v.mirrored = mirrored;
    v.reflectance = Share(eye.dot(stack.reflect_down * light) - mirrored);
    v.transmittance = out.dot(stack.transmit_down * light);
    v.emergence = eye.dot(stack.transmit_up * every_below) / out.sum();
    v.reflectance_below = out.dot(stack.reflect_up * every_below) / out.sum();
    views.push_back(v);
  }
  return views;
}

}  // namespace crownfit
