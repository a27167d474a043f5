#include "scene/thickness_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/random.h"
#include "capture/capture.h"

namespace crownfit {
namespace {

std::string KeyOf(size_t layer) { return "object.layers[" + std::to_string(layer) + "].thickness_mm"; }

/// Plane waves of one wavelength with random directions and phases: their sum is stationary noise.
std::vector<glm::dvec4> WavesOf(const JunctionNoise& noise) {
  constexpr int kWaves = 48;
  const double wave_number = 2 * std::numbers::pi / noise.wavelength_mm;
  std::vector<glm::dvec4> waves;
  for (int i = 0; i < kWaves && noise.amplitude_mm > 0; ++i) {
    const uint64_t key = Key(noise.seed, 0x6a756e63ull, i);
    const double z = 2 * Uniform(key, 0) - 1, a = 2 * std::numbers::pi * Uniform(key, 1), r = std::sqrt(1 - z * z);
    waves.emplace_back(wave_number * glm::dvec3(r * std::cos(a), r * std::sin(a), z),
                       2 * std::numbers::pi * Uniform(key, 2));
  }
  return waves;
}

}  // namespace

ThicknessMap::ThicknessMap(const Capture& capture, size_t layer, const TriangleMesh* mesh, const TriangleMesh& outer)
    : field_(capture.layers[layer].thickness_field),
      waves_(WavesOf(capture.layers[layer].junction_noise)),
      mesh_(mesh) {
  amplitude_mm_ = capture.layers[layer].junction_noise.amplitude_mm;
  if (!field_) return;
  if (field_->vertex_property.empty()) {
    axis_ = LongAxisOf(capture, outer);
    if (!axis_)
      throw InputError(capture.file, KeyOf(layer) + ".zones",
                       "the mesh is closed, so it is not known which end is incisal",
                       "State \"long_axis\": [x, y, z] in \"object\", towards the incisal edge.");
    return;
  }
  const auto fail = [&](const std::string& message) {
    throw InputError(capture.file, KeyOf(layer) + ".vertex_property", message,
                     "Write the property into the PLY file of the layer, one number in mm for every vertex.");
  };
  if (!mesh) fail("layer '" + capture.layers[layer].name + "' has no mesh of its own");
  const auto found = mesh->vertex_properties.find(field_->vertex_property);
  if (found == mesh->vertex_properties.end()) {
    std::string known;
    for (const auto& [name, values] : mesh->vertex_properties) known += (known.empty() ? "" : ", ") + name;
    fail("the mesh has no vertex property '" + field_->vertex_property +
         "' (it has: " + (known.empty() ? "none" : known) + ")");
  }
  property_ = &found->second;
  for (double v : *property_)
    if (!(v >= 0 && v <= RowOf(Quantity::kThickness).high)) fail("a vertex has a thickness outside [0, 20] mm");
  caster_ = RayCaster({mesh});
}

double ThicknessMap::FieldAt(const glm::dvec3& p) const {
  if (property_) {
    const SurfacePoint at = caster_.ClosestPoint(p);
    const glm::ivec3 t = mesh_->triangles[at.triangle];
    return at.weights.x * (*property_)[t.x] + at.weights.y * (*property_)[t.y] + at.weights.z * (*property_)[t.z];
  }
  // Smooth steps between the middles of the thirds.
  const double u = std::clamp(3.0 * axis_->At(p) - 0.5, 0.0, 2.0);
  const int zone = u < 1.0 ? 0 : 1;
  const double f = u - zone, smooth = f * f * (3.0 - 2.0 * f);
  return (1.0 - smooth) * field_->zones_mm[zone] + smooth * field_->zones_mm[zone + 1];
}

double ThicknessMap::At(const glm::dvec3& p, double thickness) const {
  const double even = field_ ? thickness * FieldAt(p) : thickness;
  if (waves_.empty()) return even;
  double sum = 0;
  for (const glm::dvec4& w : waves_) sum += std::cos(glm::dot(glm::dvec3(w), p) + w.w);
  return even + amplitude_mm_ * std::sqrt(2.0 / static_cast<double>(waves_.size())) * sum;
}

}  // namespace crownfit
