#include "optics/adding_doubling.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "optics/layer_modes.h"

namespace crownfit {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Refractive index before the backing: the last layer's when they are in contact.
double BelowIor(const Slab& slab) { return slab.backing_contact ? slab.layers.back().ior : slab.ior_below; }

std::vector<double> IndicesOf(const Slab& slab) {
  std::vector<double> indices{slab.ior_above, BelowIor(slab)};
  for (const auto& layer : slab.layers) indices.push_back(layer.ior);
  return indices;
}

/// Fractions are exact to rounding errors of the total light, so a negative value of that size counts as 0.
double Share(double sum) {
  constexpr double kRoundings = 1e-14;
  return sum < 0.0 && sum > -kRoundings ? 0.0 : sum;
}

/// A slab's layers, solved for any thicknesses.
struct Assembly {
  Assembly(const Slab& slab, int nodes, const std::vector<double>& views)
      : all(IndicesOf(slab), nodes, views), above(all.In(slab.ior_above)), below(all.In(BelowIor(slab))) {
    for (const auto& layer : slab.layers) {
      // Phase functions that peak backwards need an even number, so that the peak that delta-M cuts off is not
      // negative.
      const int moments = layer.g < 0 ? 2 * nodes : 2 * nodes - 1;
      inside.push_back(all.In(layer.ior));
      modes.emplace_back(layer, inside.back(), moments);
    }
  }
  /// Specular reflectance of the first surface, per direction.
  VectorXd Mirrored() const { return Boundary(0).reflect_down; }
  /// The boundary above layer `i`; for the index after the last, the one below it.
  Interface Boundary(size_t i) const {
    return {i == 0 ? above : inside[i - 1], i == inside.size() ? below : inside[i]};
  }
  Stack OfThicknesses(const std::vector<double>& mm) const {
    Stack stack = Add(Boundary(0), modes[0].OfThickness(mm[0]));
    for (size_t i = 1; i < modes.size(); ++i) stack = Add(Add(stack, Boundary(i)), modes[i].OfThickness(mm[i]));
    return Add(stack, Boundary(modes.size()));
  }
  AllDirections all;
  Directions above, below;
  std::vector<Directions> inside;
  std::vector<LayerModes> modes;
};

/// A slab, the light that an instrument sends, and the weights with which it sees light.
class SlabView {
 public:
  SlabView(const Slab& slab, MeasuredAt geometry, const AddingDoublingOptions& options)
      : assembly_(slab, options.nodes, Looked(geometry)) {
    for (const double index : IndicesOf(slab)) Check(index >= slab.ior_above, "a slab is seen from its rarest medium");
    const VectorXd in = assembly_.above.FluxWeights(), out = assembly_.below.FluxWeights();
    const bool is_lit_around = geometry == MeasuredAt::kD_8 || geometry == MeasuredAt::kD_D;
    // Incident basic radiance of flux 1, diffuse or from straight above; and the weights of what is seen.
    above_ = {VectorXd::Constant(in.size(), 1.0 / in.sum()), in};
    if (!is_lit_around) {
      const Index normal = assembly_.all.NormalIncidence();
      above_.light = VectorXd::Unit(in.size(), normal) / in[normal];
    }
    if (!Looked(geometry).empty()) above_.sight = VectorXd::Unit(in.size(), assembly_.all.View(0));
    below_ = {VectorXd::Constant(out.size(), 1.0 / out.sum()), out};
    mirrored_ = above_.sight.dot(assembly_.Mirrored().cwiseProduct(above_.light));
  }

  ViewedSlab At(const std::vector<double>& mm) const {
    const Stack stack = assembly_.OfThicknesses(mm);
    return {Share(above_.sight.dot(stack.reflect_down * above_.light) - mirrored_), mirrored_,
            below_.sight.dot(stack.transmit_down * above_.light), above_.sight.dot(stack.transmit_up * below_.light),
            below_.sight.dot(stack.reflect_up * below_.light)};
  }

  /// First-order changes, except by indices: for each layer, from the light that arrives at it and the weight with
  /// which light that leaves it is seen.
  std::vector<ViewedSlab> Changes(const std::vector<double>& mm,
                                  const std::vector<std::vector<SlabLayer>>& changes) const {
    const size_t layers = mm.size();
    std::vector<Stack> layer, over{AsStack(assembly_.Boundary(0))}, under{AsStack(assembly_.Boundary(layers))};
    for (size_t l = 0; l < layers; ++l) layer.push_back(assembly_.modes[l].OfThickness(mm[l]));
    for (size_t l = 1; l < layers; ++l) {
      over.push_back(Add(Add(over.back(), layer[l - 1]), assembly_.Boundary(l)));
      under.insert(under.begin(), Add(assembly_.Boundary(layers - l), Add(layer[layers - l], under.front())));
    }
    std::vector<ViewedSlab> seen(changes.size());
    for (size_t l = 0; l < layers; ++l) {
      std::vector<LayerModes::Change> of_layer;
      for (const auto& change : changes) of_layer.push_back(assembly_.modes[l].ChangeBy(change[l]));
      if (std::all_of(of_layer.begin(), of_layer.end(), [](const auto& c) { return c.IsNone(); })) continue;
      const Index n = assembly_.inside[l].size();
      // Around the layer: the light that it sends up comes back down, and vice versa.
      MatrixXd around = MatrixXd::Zero(2 * n, 2 * n), through(2 * n, 2 * n);
      around.topLeftCorner(n, n) = over[l].reflect_up;
      around.bottomRightCorner(n, n) = under[l].reflect_down;
      through << layer[l].reflect_down, layer[l].transmit_up, layer[l].transmit_down, layer[l].reflect_up;
      MatrixXd light = MatrixXd::Zero(2 * n, 2), sight = light;
      light.col(0).head(n) = over[l].transmit_down * above_.light;
      light.col(1).tail(n) = under[l].transmit_up * below_.light;
      sight.col(0).head(n) = over[l].transmit_up.transpose() * above_.sight;
      sight.col(1).tail(n) = under[l].transmit_down.transpose() * below_.sight;
      const MatrixXd between = (MatrixXd::Identity(2 * n, 2 * n) - around * through).inverse();
      const MatrixXd arriving = between * light;
      sight += (sight.transpose() * through * between * around).transpose();  // (1 - through around)^-1, transposed
      const std::vector<MatrixXd> more = assembly_.modes[l].SeenChanges(mm[l], of_layer, arriving, sight);
      for (size_t k = 0; k < changes.size(); ++k) {
        seen[k].reflectance += more[k](0, 0);
        seen[k].transmittance += more[k](1, 0);
        seen[k].emergence += more[k](0, 1);
        seen[k].reflectance_below += more[k](1, 1);
      }
    }
    return seen;
  }

 private:
  struct Side {
    VectorXd light, sight;
  };
  /// Cosines of the viewing directions; none where a sphere collects all.
  static std::vector<double> Looked(MeasuredAt geometry) {
    if (geometry == MeasuredAt::k0_D || geometry == MeasuredAt::kD_D) return {};
    return {std::cos((geometry == MeasuredAt::kD_8 ? 8.0 : 45.0) * std::numbers::pi / 180.0)};
  }

  Assembly assembly_;
  Side above_, below_;  ///< below_: diffuse light, seen in all directions
  double mirrored_;
};

constexpr std::array kSeen{&ViewedSlab::reflectance, &ViewedSlab::mirrored, &ViewedSlab::transmittance,
                           &ViewedSlab::emergence, &ViewedSlab::reflectance_below};

}  // namespace

SlabAnswer SolveByAddingDoubling(const Slab& slab, const AddingDoublingOptions& options) {
  const Assembly assembly(slab, options.nodes, {});
  const Directions &above = assembly.above, &below = assembly.below;
  std::vector<double> thickness_mm;
  for (const auto& layer : slab.layers) thickness_mm.push_back(layer.thickness_mm);
  Stack stack = assembly.OfThicknesses(thickness_mm);
  if (slab.backing_reflectance > 0) stack = Add(stack, Backing(below, slab.backing_reflectance));

  SlabAnswer answer;
  answer.model = Model::kLayered;
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
  const SlabView view(slab, geometry, options);
  std::vector<ViewedSlab> views;
  for (const auto& mm : thicknesses_mm) views.push_back(view.At(mm));
  return views;
}

std::vector<std::vector<ViewedSlab>> ViewSlabChanges(const Slab& slab,
                                                     const std::vector<std::vector<double>>& thicknesses_mm,
                                                     MeasuredAt geometry,
                                                     const std::vector<std::vector<SlabLayer>>& changes,
                                                     const AddingDoublingOptions& options) {
  const SlabView view(slab, geometry, options);
  std::vector<std::vector<ViewedSlab>> views;
  for (const auto& mm : thicknesses_mm) views.push_back(view.Changes(mm, changes));
  for (size_t k = 0; k < changes.size(); ++k) {
    double largest = 0;
    for (const SlabLayer& layer : changes[k]) largest = std::max(largest, std::abs(layer.ior));
    if (largest == 0) continue;
    // Directions depend on the indices, and so does everything solved in them. No index may fall below the one above
    // the slab.
    constexpr double kStep = 1e-3;
    double room = kStep;
    for (const SlabLayer& layer : slab.layers) room = std::min(room, layer.ior - slab.ior_above);
    const auto displaced = [&](double step) {
      Slab there = slab;
      for (size_t l = 0; l < changes[k].size(); ++l) there.layers[l].ior += step / largest * changes[k][l].ior;
      return ViewSlab(there, thicknesses_mm, geometry, options);
    };
    const auto up = displaced(kStep), down = displaced(-room);
    for (size_t i = 0; i < views.size(); ++i)
      for (const auto quantity : kSeen)
        views[i][k].*quantity += largest * (up[i].*quantity - down[i].*quantity) / (kStep + room);
  }
  return views;
}

}  // namespace crownfit
