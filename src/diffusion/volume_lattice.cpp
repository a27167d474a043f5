#include "diffusion/volume_lattice.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "geometry/ray_caster.h"
#include "geometry/signed_distance.h"

namespace crownfit {
namespace {

constexpr int kPoints = 4;            // quadrature points along an element: two-point Gauss in either half
constexpr double kFictitious = 1e-4;  // conductivity outside, over the element's length: the same for every material

/// Index of a neighbour in LatticeNodes::beside, from corner a to corner b of one element.
constexpr int BesideOf(int a, int b) {
  const int dx = (b & 1) - (a & 1), dy = (b >> 1 & 1) - (a >> 1 & 1), dz = (b >> 2) - (a >> 2);
  return (dx + 1) + 3 * (dy + 1) + 9 * (dz + 1);
}

/// Trilinear shape functions of the eight corners at a point in [0, 1]^3, and their gradients.
struct Corners {
  std::array<double, 8> value;
  std::array<glm::dvec3, 8> gradient;
  explicit Corners(const glm::dvec3& at) {
    for (int k = 0; k < 8; ++k) {
      const glm::dvec3 up(k & 1, k >> 1 & 1, k >> 2);
      const glm::dvec3 f = up * at + (1.0 - up) * (1.0 - at), sign = 2.0 * up - 1.0;
      value[k] = f.x * f.y * f.z;
      gradient[k] = sign * glm::dvec3(f.y * f.z, f.x * f.z, f.x * f.y);
    }
  }
};

const std::vector<std::pair<glm::dvec3, Corners>>& QuadraturePoints() {
  static const auto points = [] {
    std::vector<std::pair<glm::dvec3, Corners>> all;
    const auto along = [](int i) { return (i < 2 ? 0.25 : 0.75) + (i % 2 ? 0.25 : -0.25) / std::sqrt(3.0); };
    for (int i = 0; i < kPoints * kPoints * kPoints; ++i) {
      const glm::dvec3 at(along(i % kPoints), along(i / kPoints % kPoints), along(i / (kPoints * kPoints)));
      all.emplace_back(at, Corners(at));
    }
    return all;
  }();
  return points;
}

/// Which layer holds a point.
class LayerFinder {
 public:
  explicit LayerFinder(const std::vector<TriangleMesh>& surfaces) : surfaces_(surfaces) {
    for (const TriangleMesh& mesh : surfaces) casters_.emplace_back(std::vector<const TriangleMesh*>{&mesh});
  }
  /// -1: none.
  int LayerAt(const glm::dvec3& p) const {
    for (int l = static_cast<int>(surfaces_.size()) - 1; l >= 0; --l)
      if (IsInside(casters_[l], surfaces_[l], p)) return l;
    return -1;
  }
  bool IsNearSurface(const glm::dvec3& p, double within_mm) const {
    return std::any_of(casters_.begin(), casters_.end(),
                       [&](const RayCaster& c) { return !std::isinf(c.DistanceToSurface(p, within_mm)); });
  }

 private:
  const std::vector<TriangleMesh>& surfaces_;
  std::vector<RayCaster> casters_;
};

}  // namespace

/// Integrals over the parts of one element.
struct VolumeLattice::ElementSum {
  using Pairs = std::array<double, 64>;
  struct Part {
    Pairs gradients{};
    std::vector<Pairs> products;  ///< per channel of the layer's texture; one without texture
  };
  std::vector<Part> parts;  ///< per layer
  Pairs outside{};
  std::array<double, 8> volume{};
};

double VolumeLattice::ElementFor(const std::vector<TriangleMesh>& surfaces, double shortest_mm) {
  constexpr double kLongest = 0.35, kOfThickness = 0.5, kOfPath = 0.8, kMostElements = 4e5, kShortest = 0.12;
  const auto [low, high] = Bounds(surfaces[0]);
  const glm::dvec3 size = high - low;
  const double thickness = 2.0 * std::abs(Volume(surfaces[0])) / Area(surfaces[0]);  // of a plate; else less
  const double finest = std::max(kShortest, std::cbrt(size.x * size.y * size.z / kMostElements));
  const double wanted = std::max(finest, std::min(kOfThickness * thickness, kOfPath * shortest_mm));
  double element = kLongest;
  while (element > wanted) element /= std::sqrt(2.0);
  while (element < finest) element *= std::sqrt(2.0);
  return element;
}

double VolumeLattice::NodesFor(const TriangleMesh& outer, double element_mm) {
  // Nodes belong to elements that touch the object, so they lie within an element around it: on either side by half of
  // |n.x| + |n.y| + |n.z|, whose mean over directions is 3 / 2.
  constexpr double kMeanWidth = 1.5;
  const double h = element_mm;
  return (std::abs(Volume(outer)) / h + kMeanWidth * Area(outer)) / (h * h);
}

VolumeLattice::VolumeLattice(const std::vector<TriangleMesh>& surfaces,
                             const std::vector<std::vector<uint8_t>>& is_exposed,
                             const std::vector<std::shared_ptr<const AbsorptionTexture>>& textures, double element_mm,
                             int threads)
    : element_mm_(element_mm), layers_(static_cast<int>(surfaces.size())) {
  const glm::dvec3 axis = glm::normalize(glm::dvec3(0.48, 0.31, 0.82)),
                   about = glm::normalize(glm::dvec3(0.9, -0.5, 0.2));
  const glm::dvec3 side = glm::normalize(about - glm::dot(about, axis) * axis);
  lattice_from_object_ = glm::transpose(glm::dmat3(axis, side, glm::cross(axis, side)));
  glm::dvec3 low = Stood(surfaces[0].vertices[0]), high = low;
  for (const TriangleMesh& mesh : surfaces)
    for (const glm::dvec3& v : mesh.vertices) low = glm::min(low, Stood(v)), high = glm::max(high, Stood(v));
  const glm::dvec3 room = (high - low) / element_mm + 0.5;
  elements_ = glm::ivec3(glm::ceil(room));
  low_ = 0.5 * (low + high) - 0.5 * element_mm * glm::dvec3(elements_);
  Integrate(surfaces, textures, threads);
  FindPieces(surfaces, is_exposed, threads);
}

void VolumeLattice::Integrate(const std::vector<TriangleMesh>& surfaces,
                              const std::vector<std::shared_ptr<const AbsorptionTexture>>& textures, int threads) {
  const LayerFinder finder(surfaces);
  const size_t count = static_cast<size_t>(elements_.x) * elements_.y * elements_.z;
  const auto place_of = [&](size_t e) {
    return glm::ivec3(e % elements_.x, e / elements_.x % elements_.y,
                      e / (static_cast<size_t>(elements_.x) * elements_.y));
  };
  const double h = element_mm_, share = h * h * h / (kPoints * kPoints * kPoints);
  std::vector<std::unique_ptr<ElementSum>> sums(count);
  products_.resize(layers_);
  for (int l = 0; l < layers_; ++l) products_[l].resize(textures[l] ? textures[l]->channels() : 1);
  ParallelFor(count, threads, [&](size_t e) {
    const glm::dvec3 corner = low_ + h * glm::dvec3(place_of(e)), middle = Back(corner + 0.5 * h);
    const bool is_cut = finder.IsNearSurface(middle, 0.5 * std::sqrt(3.0) * h);
    const int whole = is_cut ? -1 : finder.LayerAt(middle);
    if (!is_cut && whole < 0) return;
    auto sum = std::make_unique<ElementSum>();
    sum->parts.resize(layers_);
    for (int l = 0; l < layers_; ++l) sum->parts[l].products.resize(products_[l].size());
    bool holds_any = false;
    for (const auto& [at, corners] : QuadraturePoints()) {
      const glm::dvec3 p = Back(corner + h * at);
      const int layer = is_cut ? finder.LayerAt(p) : whole;
      holds_any |= layer >= 0;
      ElementSum::Part* part = layer >= 0 ? &sum->parts[layer] : nullptr;
      const Spectrum factor = layer >= 0 && textures[layer] ? textures[layer]->At(p) : Spectrum(1.0);
      for (int a = 0; a < 8; ++a) {
        if (part) sum->volume[a] += share * corners.value[a];
        for (int b = 0; b < 8; ++b) {
          const double gradients = share / (h * h) * glm::dot(corners.gradient[a], corners.gradient[b]);
          if (!part) {
            sum->outside[8 * a + b] += gradients;
            continue;
          }
          part->gradients[8 * a + b] += gradients;
          for (size_t c = 0; c < part->products.size(); ++c)
            part->products[c][8 * a + b] += share * factor[static_cast<int>(c)] * corners.value[a] * corners.value[b];
        }
      }
    }
    if (holds_any || is_cut) sums[e] = std::move(sum);
  });

  const glm::ivec3 size = elements_ + 1;
  std::vector<uint8_t> is_used(static_cast<size_t>(size.x) * size.y * size.z, 0);
  const auto corner_of = [](const glm::ivec3& element, int k) {
    return element + glm::ivec3(k & 1, k >> 1 & 1, k >> 2);
  };
  for (size_t e = 0; e < count; ++e)
    if (sums[e])
      for (int k = 0; k < 8; ++k) {
        const glm::ivec3 p = corner_of(place_of(e), k);
        is_used[(static_cast<size_t>(p.z) * size.y + p.y) * size.x + p.x] = 1;
      }
  nodes_ = LatticeNodes(size, std::move(is_used));
  const size_t entries = static_cast<size_t>(nodes_.count()) * LatticeNodes::kBeside;
  gradients_.assign(layers_, LatticeMatrix(entries, 0.0));
  for (std::vector<LatticeMatrix>& of_layer : products_)
    for (LatticeMatrix& products : of_layer) products.assign(entries, 0.0);
  outside_.assign(entries, 0.0);
  volume_mm3_.assign(nodes_.count(), 0.0);
  corners_.assign(count, {-1, -1, -1, -1, -1, -1, -1, -1});
  for (size_t e = 0; e < count; ++e) {
    if (!sums[e]) continue;
    std::array<int, 8>& node = corners_[e];
    for (int k = 0; k < 8; ++k) node[k] = nodes_.At(corner_of(place_of(e), k));
    for (int a = 0; a < 8; ++a) {
      volume_mm3_[node[a]] += sums[e]->volume[a];
      for (int b = 0; b < 8; ++b) {
        const size_t at = static_cast<size_t>(node[a]) * LatticeNodes::kBeside + BesideOf(a, b);
        outside_[at] += sums[e]->outside[8 * a + b];
        for (int l = 0; l < layers_; ++l) {
          gradients_[l][at] += sums[e]->parts[l].gradients[8 * a + b];
          for (size_t c = 0; c < products_[l].size(); ++c)
            products_[l][c][at] += sums[e]->parts[l].products[c][8 * a + b];
        }
      }
    }
  }
}

void VolumeLattice::FindPieces(const std::vector<TriangleMesh>& surfaces,
                               const std::vector<std::vector<uint8_t>>& is_exposed, int threads) {
  const LayerFinder finder(surfaces);
  const double longest = element_mm_, aside = 1e-4 * element_mm_;
  struct Candidate {
    glm::dvec3 position, normal;
    double area_mm2;
    bool is_cut;
    int layer = -1;
  };
  std::vector<Candidate> candidates;
  for (size_t s = 0; s < surfaces.size(); ++s)
    for (int t = 0; t < static_cast<int>(surfaces[s].triangles.size()); ++t) {
      if (s > 0 && !is_exposed[s][t]) continue;
      const glm::ivec3& corner = surfaces[s].triangles[t];
      const glm::dvec3 a = surfaces[s].vertices[corner.x], u = surfaces[s].vertices[corner.y] - a,
                       v = surfaces[s].vertices[corner.z] - a, n = FaceNormal(surfaces[s], t);
      const double edge = std::max({glm::length(u), glm::length(v), glm::length(u - v)});
      const int parts = std::max(1, static_cast<int>(std::ceil(edge / longest)));
      const double area = 0.5 * glm::length(glm::cross(u, v)) / (parts * parts);
      for (int i = 0; i < parts; ++i)
        for (int j = 0; i + j < parts; ++j)
          for (const double third : {1.0 / 3.0, 2.0 / 3.0}) {
            if (third > 0.5 && i + j + 1 >= parts) continue;
            const glm::dvec3 p = a + ((i + third) * u + (j + third) * v) / static_cast<double>(parts);
            candidates.push_back({p, n, area, surfaces[s].cut(t)});
          }
    }
  ParallelFor(candidates.size(), threads, [&](size_t i) {
    Candidate& c = candidates[i];
    if (layers_ > 1 && finder.LayerAt(c.position + aside * c.normal) >= 0) return;
    c.layer = layers_ > 1 ? finder.LayerAt(c.position - aside * c.normal) : 0;
  });
  for (const Candidate& c : candidates)
    if (c.layer >= 0)
      if (const auto place = PlaceOf(c.position))
        pieces_.push_back({c.position, c.normal, c.area_mm2, c.layer, c.is_cut, StencilOf(*place)});
}

std::optional<LatticePlace> VolumeLattice::PlaceOf(const glm::dvec3& p) const {
  const glm::dvec3 in_elements = (Stood(p) - low_) / element_mm_, floor = glm::floor(in_elements);
  const glm::ivec3 e(floor);
  if (glm::any(glm::lessThan(e, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(e, elements_))) return std::nullopt;
  const int element = (e.z * elements_.y + e.y) * elements_.x + e.x;
  if (corners_[element][0] < 0) return std::nullopt;
  const glm::dvec3 at = in_elements - floor;
  return LatticePlace{element, {static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z)}};
}

LatticeStencil VolumeLattice::StencilOf(const LatticePlace& place) const {
  const double x = place.at.x, y = place.at.y, z = place.at.z;
  const double xy[4] = {(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y};
  LatticeStencil s{corners_[place.element], {}};
  for (int k = 0; k < 4; ++k) s.weight[k] = xy[k] * (1 - z), s.weight[k + 4] = xy[k] * z;
  return s;
}

glm::dvec3 VolumeLattice::PositionOf(const LatticePlace& place) const {
  const glm::ivec3 e(place.element % elements_.x, place.element / elements_.x % elements_.y,
                     place.element / (elements_.x * elements_.y));
  return Back(low_ + element_mm_ * (glm::dvec3(e) + glm::dvec3(place.at.x, place.at.y, place.at.z)));
}

LatticeMatrix VolumeLattice::Matrix(std::span<const double> conduction, std::span<const double> sink,
                                    std::span<const double> leak, int channel) const {
  LatticeMatrix m(outside_.size(), 0.0);
  for (int l = 0; l < layers_; ++l) {
    const LatticeMatrix& products = products_[l][products_[l].size() > 1 ? channel : 0];
    for (size_t i = 0; i < m.size(); ++i) m[i] += conduction[l] * gradients_[l][i] + sink[l] * products[i];
  }
  const double fictitious = kFictitious * element_mm_;
  for (size_t i = 0; i < m.size(); ++i) m[i] += fictitious * outside_[i];
  for (size_t p = 0; p < pieces_.size(); ++p) {
    const LatticeStencil& s = pieces_[p].stencil;
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b)
        m[static_cast<size_t>(s.node[a]) * LatticeNodes::kBeside + BesideOf(a, b)] +=
            pieces_[p].area_mm2 * leak[p] * s.weight[a] * s.weight[b];
  }
  return m;
}

namespace {

void AddProduct(const LatticeNodes& nodes, const LatticeMatrix& m, double factor, std::span<const double> x,
                std::span<double> y) {
  std::vector<double> product(nodes.count());
  Multiply(nodes, m, x, product);
  for (size_t i = 0; i < product.size(); ++i) y[i] += factor * product[i];
}

}  // namespace

void VolumeLattice::AddConduction(int layer, double factor, std::span<const double> x, std::span<double> y) const {
  AddProduct(nodes_, gradients_[layer], factor, x, y);
}

void VolumeLattice::AddSink(int layer, int channel, double factor, std::span<const double> x,
                            std::span<double> y) const {
  AddProduct(nodes_, products_[layer][products_[layer].size() > 1 ? channel : 0], factor, x, y);
}

}  // namespace crownfit
