#include "scene/absorption_texture.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/error.h"
#include "base/parallel.h"
#include "base/text.h"
#include "capture/capture.h"
#include "geometry/mesh_file.h"
#include "geometry/ray_caster.h"
#include "photo/image_io.h"

namespace crownfit {
namespace {

constexpr double kLargest = 1000.0;  // of a factor

using Lookup = std::function<Spectrum(const SurfacePoint&)>;

/// Linear between pixel centres, repeated beyond the edges; u to the right, v up, as OBJ and glTF tools write them.
Spectrum PixelsAt(const Image& image, int channels, bool is_grey, const glm::dvec2& uv) {
  const auto wrapped = [](double i, int n) { return std::min(static_cast<int>(i - n * std::floor(i / n)), n - 1); };
  const double x = uv.x * image.width - 0.5, y = (1.0 - uv.y) * image.height - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y);
  Spectrum sum(channels, 0.0);
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const double weight = (dx ? x - x0 : 1 - (x - x0)) * (dy ? y - y0 : 1 - (y - y0));
      const int px = wrapped(x0 + dx, image.width), py = wrapped(y0 + dy, image.height);
      for (int c = 0; c < channels; ++c) sum[c] += weight * image.at(px, py, is_grey ? 0 : c);
    }
  return sum;
}

Lookup PictureOn(const TriangleMesh& mesh, const AbsorptionTextureSpec& spec, const std::filesystem::path& mesh_file,
                 const std::vector<std::string>& names) {
  if (mesh.corner_uv.empty())
    throw InputError(mesh_file, "", "the mesh has no texture coordinates, which absorption_texture.file needs",
                     "Export it as OBJ with vt, or as PLY with s, t (or u, v) per vertex or texcoord per face.");
  ImageFile file = ReadImageFile(*spec.file, names);
  const int channels = static_cast<int>(names.size()), found = file.image.channels - (file.alpha_channel >= 0 ? 1 : 0);
  if (found != channels && found > 2)
    throw InputError(*spec.file, "", Printed("the texture has %d channels, but the capture has %d", found, channels),
                     "Write it grey, or with the capture's channels.");
  return [&mesh, channels, is_grey = found != channels, image = std::move(file.image)](const SurfacePoint& p) {
    const auto& uv = mesh.corner_uv[p.triangle];
    return PixelsAt(image, channels, is_grey, p.weights.x * uv[0] + p.weights.y * uv[1] + p.weights.z * uv[2]);
  };
}

Lookup PropertiesOf(const TriangleMesh& mesh, const AbsorptionTextureSpec& spec, const std::filesystem::path& mesh_file,
                    int channels) {
  std::vector<const std::vector<double>*> values(static_cast<size_t>(channels));
  Spectrum unit(channels, 1.0);
  for (size_t c = 0; c < values.size(); ++c) {
    const std::string& name = spec.vertex_properties[spec.vertex_properties.size() == 1 ? 0 : c];
    const auto found = mesh.vertex_properties.find(name);
    if (found == mesh.vertex_properties.end())
      throw InputError(mesh_file, "", "the mesh has no vertex property '" + name + "', which absorption_texture names",
                       "Write it into the PLY file: one number for every vertex.");
    values[c] = &found->second;
    if (mesh.byte_properties.contains(name)) unit[static_cast<int>(c)] = 1.0 / 255.0;  // as of a picture of 8 bits
  }
  return [&mesh, values, unit](const SurfacePoint& p) {
    const glm::ivec3 t = mesh.triangles[p.triangle];
    Spectrum factor = unit;
    for (size_t c = 0; c < values.size(); ++c)
      factor[static_cast<int>(c)] =
          p.weights.x * (*values[c])[t.x] + p.weights.y * (*values[c])[t.y] + p.weights.z * (*values[c])[t.z];
    return unit * factor;
  };
}

}  // namespace

AbsorptionTexture::AbsorptionTexture(const Capture& capture, size_t layer, const std::filesystem::path& mesh_file,
                                     int threads) {
  const AbsorptionTextureSpec& spec = *capture.layers[layer].absorption_texture;
  const TriangleMesh mesh = ReadMeshFile(mesh_file);
  const RayCaster caster({&mesh});
  const Lookup value = spec.file ? PictureOn(mesh, spec, mesh_file, capture.channel_names)
                                 : PropertiesOf(mesh, spec, mesh_file, capture.channels());

  const auto [low, high] = Bounds(mesh);
  const glm::dvec3 size = high - low;
  step_mm_ = std::max(0.1, std::max({size.x, size.y, size.z}) / 96.0);
  low_ = low;
  count_ = glm::ivec3(glm::ceil(size / step_mm_)) + 1;
  factor_.resize(static_cast<size_t>(count_.x) * count_.y * count_.z, capture.channels());
  ParallelFor(static_cast<size_t>(count_.y) * count_.z, threads, [&](size_t row) {
    const size_t y = row % count_.y, z = row / count_.y;
    for (int x = 0; x < count_.x; ++x) {
      const glm::dvec3 node = low_ + step_mm_ * glm::dvec3(x, static_cast<double>(y), static_cast<double>(z));
      factor_.Set(row * count_.x + x, spec.low + (spec.high - spec.low) * value(caster.ClosestPoint(node)));
    }
  });
  for (size_t i = 0; i < factor_.size(); ++i)
    for (const double f : factor_[i])
      if (!(f >= 0 && f <= kLargest))
        throw InputError(capture.file, "object.layers[" + std::to_string(layer) + "].absorption_texture",
                         "the texture has the factor " + std::to_string(f) + " on absorption, outside [0, 1000]",
                         "Set the factors that 0 and 1 stand for with \"range\": [low, high].");
}

AbsorptionTexture::Corners AbsorptionTexture::Around(const glm::dvec3& p) const {
  const glm::dvec3 last = glm::dvec3(count_ - 1), q = glm::clamp((p - low_) / step_mm_, glm::dvec3(0.0), last);
  const glm::ivec3 cell = glm::min(glm::ivec3(q), glm::max(count_ - 2, glm::ivec3(0)));
  const glm::dvec3 f = q - glm::dvec3(cell);
  Corners corners;
  for (size_t corner = 0; corner < 8; ++corner) {
    const glm::ivec3 up(corner & 1, (corner >> 1) & 1, corner >> 2), node = glm::min(cell + up, count_ - 1);
    corners.weight[corner] = (up.x ? f.x : 1 - f.x) * (up.y ? f.y : 1 - f.y) * (up.z ? f.z : 1 - f.z);
    corners.node[corner] = (static_cast<size_t>(node.z) * count_.y + node.y) * count_.x + node.x;
  }
  return corners;
}

Spectrum AbsorptionTexture::At(const glm::dvec3& p) const {
  const Corners corners = Around(p);
  Spectrum sum(factor_.channels(), 0.0);
  for (size_t k = 0; k < 8; ++k) sum += corners.weight[k] * factor_[corners.node[k]];
  return sum;
}

double AbsorptionTexture::At(const glm::dvec3& p, int channel) const {
  const Corners corners = Around(p);
  double sum = 0;
  for (size_t k = 0; k < 8; ++k) sum += corners.weight[k] * factor_.at(corners.node[k], channel);
  return sum;
}

Spectrum AbsorptionTexture::Along(const glm::dvec3& from, const glm::dvec3& direction, double length_mm) const {
  const int steps = std::max(1, static_cast<int>(std::ceil(length_mm / step_mm_)));
  const double step = length_mm / steps;
  Spectrum sum(factor_.channels(), 0.0);
  for (int i = 0; i < steps; ++i) sum += At(from + (i + 0.5) * step * direction);
  return step * sum;
}

}  // namespace crownfit
