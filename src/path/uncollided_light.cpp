#include "path/uncollided_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/parallel.h"
#include "path/vector_clones.h"

namespace crownfit {
namespace {

constexpr float kUnit = 32767.0f;  // of a direction's components

CROWNFIT_FOR_EVERY_VECTOR
void LocateIn(const LayerCells::Lattice& cells, int outside, int count, const double* x, const double* y,
              const double* z, const int* layer, float* at_x, float* at_y, float* at_z, int* part) {
  const glm::dmat3 m = cells.cells_from_place;
  const glm::dvec3 low = cells.low;
  const int across = cells.count.x, down = cells.count.y, deep = cells.count.z, layers = cells.layers;
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    const double u = m[0][0] * x[i] + m[1][0] * y[i] + m[2][0] * z[i] - low.x,
                 v = m[0][1] * x[i] + m[1][1] * y[i] + m[2][1] * z[i] - low.y,
                 w = m[0][2] * x[i] + m[1][2] * y[i] + m[2][2] * z[i] - low.z;
    const int cu = static_cast<int>(u), cv = static_cast<int>(v), cw = static_cast<int>(w);
    const bool is_in = layer[i] >= 0 && u >= 0 && v >= 0 && w >= 0 && cu < across && cv < down && cw < deep;
    at_x[i] = static_cast<float>(u), at_y[i] = static_cast<float>(v), at_z[i] = static_cast<float>(w);
    const int inside = ((cw * down + cv) * across + cu) * layers + layer[i];
    part[i] = is_in ? inside : outside;
  }
}

/// A block and a collision in it.
struct Scattering {
  const int16_t* directions;
  const uint16_t* shares;
  const float* fluence;
  int channels;
  bool own_shares;
  glm::vec3 at, to;  ///< place about the cell's middle, in cells; opposite of the direction that light must take
  float g, isotropic_fraction;
};

CROWNFIT_FOR_EVERY_VECTOR
void AddScatteredTo(float* __restrict sums, const Scattering s, const float* __restrict weights) {
  constexpr int kCount = UncollidedLight::kGroups;
  constexpr float kSphere = static_cast<float>(0.25 / std::numbers::pi);
  const float square = 1.0f + s.g * s.g, twice = 2.0f * s.g / kUnit, x = twice * s.to.x, y = twice * s.to.y,
              z = twice * s.to.z, isotropic = kSphere * s.isotropic_fraction,
              peaked = kSphere * (1.0f - s.isotropic_fraction) * (1.0f - s.g * s.g);
  const int16_t* __restrict directions = s.directions;
  alignas(64) float scattered[kCount];
  for (int k = 0; k < kCount; ++k) {
    // Henyey and Greenstein 1941, mixed with isotropic scattering, per steradian.
    const float base = square + x * static_cast<float>(directions[k]) + y * static_cast<float>(directions[kCount + k]) +
                       z * static_cast<float>(directions[2 * kCount + k]);
    scattered[k] = isotropic + peaked / (base * std::sqrt(base));
  }
  for (int c = 0; c < s.channels; ++c) {
    const float* f = s.fluence + 4 * c;
    const uint16_t* __restrict shares = s.shares + (s.own_shares ? kCount * c : 0);
    const float scale = weights[c] * (f[0] + f[1] * s.at.x + f[2] * s.at.y + f[3] * s.at.z);
    float* __restrict to = sums + kCount * c;
#pragma GCC unroll 1
    for (int k = 0; k < kCount; ++k) to[k] += scale * static_cast<float>(shares[k]) * scattered[k];
  }
}

/// A piece of a ray in a medium: its transmittance, the integral of exp(-s t) over its length d, and the mean t under
/// that weight.
struct Attenuated {
  double passes, integral, middle;
  Attenuated(double s, double d) {
    const double x = s * d;
    if (x < 1e-3) {
      passes = 1.0 - x * (1.0 - 0.5 * x);
      integral = d * (1.0 - x * (0.5 - x / 6.0));
      middle = d * (0.5 - x / 12.0);
      return;
    }
    passes = std::exp(-x);
    integral = (1.0 - passes) / s;
    middle = (1.0 - x * passes / (1.0 - passes)) / s;
  }
};

/// In which layers light collides first: power that rays leave to collisions, all channels together.
class FirstCollisions : public UncollidedRays::Receiver {
 public:
  explicit FirstCollisions(const Media& media) : power_(media.size(), 0.0), media_(media) {}
  double LongestPiece_mm() const override { return kFar; }
  bool Receive(const glm::dvec3& from, const glm::dvec3& direction, double length_mm, int medium,
               UncollidedRay& ray) override {
    const Medium& m = media_[medium];
    const double stands_for = ray.StandsFor();
    if (stands_for == 0) return false;
    const Spectrum absorbed =
        m.texture ? m.absorption * m.texture->Along(from, direction, length_mm) / std::max(length_mm, 1e-12)
                  : m.absorption;
    for (int c = 0; c < ray.power.size(); ++c) {
      const Attenuated piece(m.scattering[c] + absorbed[c], length_mm);
      power_[static_cast<size_t>(medium)] += stands_for * m.scattering[c] * ray.power[c] * piece.integral;
      ray.power[c] *= piece.passes;
    }
    return true;
  }
  /// Of the layers where much light collides first.
  double ShortestFreePath_mm() const {
    constexpr double kMuch = 0.02;
    const double all = std::accumulate(power_.begin(), power_.end(), 0.0);
    double shortest = kFar;
    for (size_t l = 1; l < power_.size(); ++l) {
      const Medium& m = media_[static_cast<int>(l)];
      if (power_[l] > kMuch * all) shortest = std::min(shortest, 1.0 / (m.scattering + m.absorption).Largest());
    }
    return shortest;
  }

 private:
  std::vector<double> power_;
  const Media& media_;
};

}  // namespace

/// What the rays of one group leave in the cells, per part and source: a direction; the sum of power x length that it
/// was drawn from, all channels together; the drawn ray's power x length of each channel, of all that of the mean
/// channel; per channel power x length and its first moments, in cells, about the cell's middle.
class UncollidedLight::Deposits : public UncollidedRays::Receiver {
 public:
  struct Entry {
    size_t home, source;
  };
  /// `entry_of`: work space, -1 for every part of a cell.
  Deposits(const Media& media, const LayerCells& cells, std::vector<int32_t>& entry_of)
      : media_(media), cells_(cells), channels_(media.channels()), entry_of_(entry_of) {
    for (int m = 1; m < static_cast<int>(media_.size()); ++m)
      extinction_.push_back(media_[m].scattering + media_[m].absorption);
  }

  void Begin(size_t source) {
    for (; cleared_ < entries_.size(); ++cleared_) entry_of_[entries_[cleared_].home] = -1;
    source_ = source;
  }
  const std::vector<Entry>& entries() const { return entries_; }
  const double* SumsOf(size_t entry) const { return &sums_[entry * size()]; }

  double LongestPiece_mm() const override { return std::numbers::sqrt3 * cells_.cell_mm(); }
  bool Receive(const glm::dvec3& from, const glm::dvec3& direction, double length_mm, int medium,
               UncollidedRay& ray) override {
    const Medium& m = media_[medium];
    Spectrum extinction = extinction_[static_cast<size_t>(medium - 1)];
    glm::dvec3 at = cells_.Place(from);
    const glm::dvec3 way = cells_.Way(direction);
    glm::ivec3 cell(glm::floor(at));
    for (double gone = 0; gone < length_mm;) {
      int axis = 0;
      double piece = kFar;
      for (int k = 0; k < 3; ++k) {
        if (way[k] == 0) continue;
        const double until = ((way[k] > 0 ? cell[k] + 1 : cell[k]) - at[k]) / way[k];
        if (until < piece) piece = until, axis = k;
      }
      piece = std::max(0.0, piece);
      const bool is_last = piece >= length_mm - gone;
      if (is_last) piece = length_mm - gone;
      if (m.texture)
        extinction = m.scattering + m.absorption * m.texture->Along(from + gone * direction, direction, piece) /
                                        std::max(piece, 1e-12);
      const double stands_for = ray.StandsFor();
      if (stands_for == 0) return false;
      if (cells_.Holds(cell))
        Add(stands_for, cells_.IndexOf(cell, medium), cell, at, way, direction, piece, extinction, ray);
      gone += piece;
      if (is_last) break;
      at += piece * way;
      cell[axis] += way[axis] > 0 ? 1 : -1;
    }
    return true;
  }

 private:
  size_t size() const { return 4 + 5 * static_cast<size_t>(channels_); }

  void Add(double stands_for, size_t index, const glm::ivec3& cell, const glm::dvec3& at, const glm::dvec3& way,
           const glm::dvec3& direction, double length_mm, const Spectrum& extinction, UncollidedRay& ray) {
    const size_t home = cells_.HomeOf(index);
    int32_t& entry = entry_of_[home];
    if (entry < 0) {
      entry = static_cast<int32_t>(entries_.size());
      entries_.push_back({home, source_});
      sums_.resize(sums_.size() + size(), 0.0);
    }
    double* drawn = &sums_[static_cast<size_t>(entry) * size()];
    double* channel = drawn + 4 + channels_;
    const glm::dvec3 start = at - (glm::dvec3(home == index ? cell : cells_.CellOf(home)) + 0.5);
    double all = 0;
    std::array<double, kMostChannels> lights;
    for (int c = 0; c < channels_; ++c, channel += 4) {
      const Attenuated piece(extinction[c], length_mm);
      const double light = stands_for * ray.power[c] * piece.integral;
      lights[static_cast<size_t>(c)] = light;
      all += light;
      channel[0] += light;
      for (int k = 0; k < 3; ++k) channel[1 + k] += light * (start[k] + piece.middle * way[k]);
      ray.power[c] *= piece.passes;
    }
    drawn[3] += all;
    if (!(ray.random.Next() * drawn[3] < all)) return;
    for (int k = 0; k < 3; ++k) drawn[k] = direction[k];
    for (int c = 0; c < channels_; ++c) drawn[4 + c] = lights[static_cast<size_t>(c)] / all;
  }

  const Media& media_;
  const LayerCells& cells_;
  int channels_;
  std::vector<int32_t>& entry_of_;
  std::vector<Spectrum> extinction_;  ///< per layer
  size_t source_ = 0, cleared_ = 0;
  std::vector<Entry> entries_;
  std::vector<double> sums_;
};

UncollidedLight::UncollidedLight(const PathContext& context, const Media& media, const LayeredBody& body,
                                 const UncollidedOptions& options, uint64_t seed, int threads)
    : media_(&media),
      channels_(media.channels()),
      own_shares_(media.heroes() > 1),
      lines_of_block_((kFluence + 4 * static_cast<size_t>(channels_) + 15) / 16) {
  constexpr int kFewRays = 2000;                            // per source
  constexpr double kFreePaths = 2.0, kMostFreePaths = 4.0;  // along a cell
  constexpr double kFewestAlong = 24;                       // cells along the object
  const UncollidedRays rays(context, media, body);
  sources_ = rays.sources();
  double cell_mm = options.cell_mm;
  if (cell_mm == 0) {
    FirstCollisions collisions(media);
    for (size_t s = 0; s < sources_.size(); ++s) rays.Trace(s, kFewRays, Key(seed, 0x63656c6cull, s), collisions);
    const double free_path_mm = collisions.ShortestFreePath_mm();
    if (LayerCells::Shortest_mm(body) > kMostFreePaths * free_path_mm) return;
    cell_mm = kFreePaths * free_path_mm;
  }
  const glm::dvec3 size = body.high - body.low;
  cell_mm = std::min(cell_mm, std::max({size.x, size.y, size.z}) / kFewestAlong);
  cells_.emplace(body, context.scene, std::max(cell_mm, LayerCells::Shortest_mm(body)), threads);

  std::vector<std::optional<Deposits>> found(kGroups);
  ParallelFor(kGroups, threads, [&](size_t group) {
    std::vector<int32_t> entry_of(cells_->size(), -1);
    found[group].emplace(media, *cells_, entry_of);
    for (size_t s = 0; s < sources_.size(); ++s) {
      found[group]->Begin(s);
      rays.Trace(s, std::max(1, options.rays / kGroups), Key(seed, 0x756e636full, group, s), *found[group]);
    }
  });

  // Parts of cells with light, and their blocks.
  std::vector<int32_t> part_of_home(cells_->size(), -1);
  std::vector<Deposits::Entry> blocks;
  for (const auto& of_group : found)
    for (const Deposits::Entry& entry : of_group->entries()) {
      int32_t& part = part_of_home[entry.home];
      if (part < 0) {
        part = static_cast<int32_t>(block_of_.size() / sources_.size());
        block_of_.resize(block_of_.size() + sources_.size(), -1);
      }
      int32_t& block = block_of_[static_cast<size_t>(part) * sources_.size() + entry.source];
      if (block >= 0) continue;
      block = static_cast<int32_t>(blocks.size());
      blocks.push_back(entry);
    }
  part_of_.resize(cells_->size());
  for (size_t i = 0; i < part_of_.size(); ++i) part_of_[i] = part_of_home[cells_->HomeOf(i)];
  part_of_.push_back(-1);

  const auto channels = static_cast<size_t>(channels_), kinds = own_shares_ ? channels : 1;
  lobes_.resize(blocks.size());
  lines_.resize(blocks.size() * lines_of_block_);
  shares_.resize(own_shares_ ? blocks.size() * channels : 0);
  std::vector<double> sums(blocks.size() * 4 * channels);
  std::vector<float> shares(blocks.size() * kinds * kGroups);
  for (size_t group = 0; group < kGroups; ++group)
    for (size_t e = 0; e < found[group]->entries().size(); ++e) {
      const Deposits::Entry& entry = found[group]->entries()[e];
      const auto block = static_cast<size_t>(
          block_of_[static_cast<size_t>(part_of_home[entry.home]) * sources_.size() + entry.source]);
      const double* drawn = found[group]->SumsOf(e);
      for (size_t k = 0; k < 3; ++k)
        lobes_[block].directions[k][group] = static_cast<int16_t>(std::lround(kUnit * drawn[k]));
      for (size_t c = 0; c < kinds; ++c)
        shares[(block * kinds + c) * kGroups + group] =
            static_cast<float>(drawn[3] * (own_shares_ ? drawn[4 + c] : 1.0));
      for (size_t k = 0; k < 4 * channels; ++k) sums[4 * channels * block + k] += drawn[4 + channels + k];
    }
  const std::vector<LayerCells::Moments> moments = cells_->MomentsOf(part_of_home, block_of_.size() / sources_.size());
  for (size_t block = 0; block < blocks.size(); ++block)
    SetBlock(block, blocks[block].home, &sums[4 * channels * block],
             moments[static_cast<size_t>(part_of_home[blocks[block].home])], &shares[block * kinds * kGroups]);
}

/// `shares`: per channel or for all, the light that the directions were drawn from.
void UncollidedLight::SetBlock(size_t block, size_t home, const double* sums, const LayerCells::Moments& filled,
                               float* shares) {
  constexpr double kSliver = 1e-4, kOfSlivers = 1e-3;
  constexpr float kLargest = 65535.0f;
  if (filled.volume < kSliver) return;
  const double h = cells_->cell_mm();
  const double n = (*media_)[cells_->MediumOf(home)].ior / (*media_)[kOutside].ior;
  const double per_volume = 1.0 / (kGroups * filled.volume * h * h * h * n * n);
  const glm::dvec3 centroid = filled.first / filled.volume;
  const glm::dmat3 spread = filled.second / filled.volume - glm::outerProduct(centroid, centroid) +
                            glm::dmat3(kOfSlivers * (1.0 - std::min(1.0, filled.volume)));
  const glm::dmat3 inverse = glm::inverse(spread);
  float* values = lines_[block * lines_of_block_].v.data();
  const glm::ivec3 cell = cells_->CellOf(home);
  for (int k = 0; k < 3; ++k) values[k] = static_cast<float>(cell[k]) + 0.5f;
  double scale = 0;
  for (int c = 0; c < channels_; ++c) {
    if (c == 0 || own_shares_) {
      const float* of_groups = shares + (own_shares_ ? kGroups * c : 0);
      const float largest = *std::max_element(of_groups, of_groups + kGroups);
      auto& to =
          own_shares_ ? shares_[block * static_cast<size_t>(channels_) + static_cast<size_t>(c)] : lobes_[block].shares;
      for (size_t k = 0; k < kGroups; ++k)
        to[k] = static_cast<uint16_t>(largest > 0 ? std::lround(kLargest * of_groups[k] / largest) : 0);
      double light = 0;
      for (int k = 0; k < (own_shares_ ? 1 : channels_); ++k) light += sums[4 * (c + k)];
      scale = light > 0 ? static_cast<double>(largest) / (static_cast<double>(kLargest) * light) : 0.0;
    }
    const double* channel = sums + 4 * c;
    const glm::dvec3 first(channel[1], channel[2], channel[3]);
    const glm::dvec3 slope = per_volume * (inverse * (first - channel[0] * centroid));
    float* to = values + kFluence + 4 * c;
    to[0] = static_cast<float>(scale * (per_volume * channel[0] - glm::dot(slope, centroid)));
    for (int k = 0; k < 3; ++k) to[1 + k] = static_cast<float>(scale * slope[k]);
  }
}

void UncollidedLight::Locate(int count, const double* x, const double* y, const double* z, const int* layer,
                             float* at_x, float* at_y, float* at_z, int* part) const {
  LocateIn(cells_->lattice(), static_cast<int>(part_of_.size()) - 1, count, x, y, z, layer, at_x, at_y, at_z, part);
  for (int i = 0; i < count; ++i) __builtin_prefetch(&part_of_[static_cast<size_t>(part[i])]);
}

void UncollidedLight::AddScattered(const Here& here, size_t source, const glm::dvec3& direction, const Medium& medium,
                                   const float* weights, OfGroups* sums) const {
  const auto block = static_cast<size_t>(here.blocks[source]);
  const float* values = lines_[block * lines_of_block_].v.data();
  AddScatteredTo(sums->data(),
                 {lobes_[block].directions[0].data(),
                  own_shares_ ? shares_[block * static_cast<size_t>(channels_)].data() : lobes_[block].shares.data(),
                  values + kFluence, channels_, own_shares_, here.at - glm::vec3(values[0], values[1], values[2]),
                  direction, static_cast<float>(medium.g), static_cast<float>(medium.isotropic_fraction)},
                 weights);
}

size_t UncollidedLight::bytes() const {
  return 4 * (part_of_.size() + block_of_.size()) + sizeof(Lobe) * lobes_.size() + sizeof(Line) * lines_.size() +
         2 * kGroups * shares_.size();
}

}  // namespace crownfit
