#include "path/collision_lanes.h"

#include "path/lane_math.h"
#include "path/vector_clones.h"

namespace crownfit {
namespace {

CROWNFIT_FOR_EVERY_VECTOR
void Attenuate(int count, const float* begun, const float* absorption, const double* length_mm, float* weight) {
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    const float depth = absorption[i] * static_cast<float>(length_mm[i]);
    weight[i] = begun[i] * ExpOf(depth < 80.0f ? -depth : -80.0f);
  }
}

}  // namespace

void CollisionLanes::Open(int lane, const CameraPath& path) {
  const Medium& medium = media_[path.state.medium];
  const bool is_reduced = context_.IsReduced(path.state);  // the field of diffuse light holds all light there
  layer_[lane] = is_reduced ? -1 : path.state.medium - 1;
  last_[lane] = context_.hand_over.fields ? context_.hand_over.collisions - path.state.collisions : 0;
  is_simple_[lane] = media_.heroes() == 1 && !medium.texture;
  if (is_reduced || !is_simple_[lane]) return;
  const Spectrum weight = path.WeightOfCollision();
  for (int c = 0; c < media_.channels(); ++c) {
    begun_[static_cast<size_t>(c)][lane] = static_cast<float>(weight[c]);
    absorption_[static_cast<size_t>(c)][lane] = static_cast<float>(medium.absorption[c]);
  }
}

void CollisionLanes::Move(int from, int to) {
  layer_[to] = layer_[from];
  last_[to] = last_[from];
  is_simple_[to] = is_simple_[from];
  for (size_t c = 0; c < static_cast<size_t>(media_.channels()); ++c)
    begun_[c][to] = begun_[c][from], absorption_[c][to] = absorption_[c][from];
}

void CollisionLanes::Locate(const UncollidedLight& light, bool is_last, const FlightLanes& flights, int count) {
  for (int i = 0; i < count; ++i)
    wanted_[i] = flights.collides[i] != 0.0 && (flights.collisions[i] + 1.0 == last_[i]) == is_last ? layer_[i] : -1;
  light.Locate(count, flights.x.data(), flights.y.data(), flights.z.data(), wanted_.data(), at_x_.data(), at_y_.data(),
               at_z_.data(), part_.data());
}

void CollisionLanes::Weigh(const FlightLanes& flights, int count) {
  for (size_t c = 0; c < static_cast<size_t>(media_.channels()); ++c)
    Attenuate(count, begun_[c].data(), absorption_[c].data(), flights.length_mm.data(), weight_[c].data());
}

}  // namespace crownfit
