#include "path/uncollided_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "path/uncollided_deposits.h"
#include "path/vector_clones.h"

namespace crownfit {

/// A block and a collision in it.
struct UncollidedLight::Scattering {
  const int16_t* directions;
  const uint16_t* shares;
  const float* fluence;
  int channels;
  bool own_shares;
  glm::vec3 at, to;  ///< place about the cell's middle, in cells; opposite of the direction that light must take
  float g, isotropic_fraction;
  int lengths;
  const float* own_lengths;
};

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

CROWNFIT_FOR_EVERY_VECTOR
void AddScatteredTo(float* __restrict sums, const UncollidedLight::Scattering s, const float* __restrict weights) {
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

/// Sums over the groups of rays of shares of light times the phase function, times its derivative by g, and times the
/// phase function and every kind of length as far as it is the group's own. Per channel with own shares, else once.
CROWNFIT_FOR_EVERY_VECTOR
void SumScattered(const UncollidedLight::Scattering s, float* __restrict sums) {
  constexpr int kCount = UncollidedLight::kGroups;
  constexpr float kSphere = static_cast<float>(0.25 / std::numbers::pi);
  const float square = 1.0f + s.g * s.g, rest = 1.0f - s.g * s.g, isotropic = kSphere * s.isotropic_fraction,
              peaked = kSphere * (1.0f - s.isotropic_fraction);
  const glm::vec3 to = s.to / kUnit;
  const int16_t* __restrict directions = s.directions;
  alignas(64) float scattered[kCount], slope[kCount];
  for (int k = 0; k < kCount; ++k) {
    const float cosine = to.x * static_cast<float>(directions[k]) + to.y * static_cast<float>(directions[kCount + k]) +
                         to.z * static_cast<float>(directions[2 * kCount + k]),
                base = square + 2.0f * s.g * cosine, power = peaked / (base * std::sqrt(base));
    scattered[k] = isotropic + rest * power;
    slope[k] = power * (-2.0f * s.g - 3.0f * rest * (s.g + cosine) / base);
  }
  for (int c = 0; c < (s.own_shares ? s.channels : 1); ++c) {
    const uint16_t* __restrict shares = s.shares + kCount * c;
    float sum = 0, sum_by_g = 0;
    for (int k = 0; k < kCount; ++k) {
      sum += static_cast<float>(shares[k]) * scattered[k];
      sum_by_g += static_cast<float>(shares[k]) * slope[k];
    }
    *sums++ = sum, *sums++ = sum_by_g;
    for (int kind = 0; kind < s.lengths; ++kind) {
      const float* __restrict own = s.own_lengths + kCount * (s.lengths * c + kind);
      float of_kind = 0;
      for (int k = 0; k < kCount; ++k) of_kind += static_cast<float>(shares[k]) * scattered[k] * own[k];
      *sums++ = of_kind;
    }
  }
}

}  // namespace

UncollidedLight::UncollidedLight(const PathContext& context, const Media& media, const LayeredBody& body,
                                 const UncollidedOptions& options, uint64_t seed, int threads)
    : media_(&media),
      channels_(media.channels()),
      own_shares_(media.heroes() > 1),
      lengths_(!context.wants_derivatives ? 0 : (media.size() - 1) * (media.has_textures() ? 2 : 1)),
      is_by_true_media_(&media == &context.media),
      lines_of_block_((kFluence + 4 * (1 + lengths_) * static_cast<size_t>(channels_) + 15) / 16) {
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

  std::vector<std::optional<UncollidedDeposits>> found(kGroups);
  ParallelFor(kGroups, threads, [&](size_t group) {
    std::vector<int32_t> entry_of(cells_->size(), -1);
    found[group].emplace(media, *cells_, lengths_, entry_of);
    for (size_t s = 0; s < sources_.size(); ++s) {
      found[group]->Begin(s);
      rays.Trace(s, std::max(1, options.rays / kGroups), Key(seed, 0x756e636full, group, s), *found[group]);
    }
  });

  // Parts of cells with light, and their blocks.
  std::vector<int32_t> part_of_home(cells_->size(), -1);
  std::vector<UncollidedDeposits::Entry> blocks;
  for (const auto& of_group : found)
    for (const UncollidedDeposits::Entry& entry : of_group->entries()) {
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
  const size_t moments_of_block = 4 * (1 + lengths_) * channels;
  std::vector<double> sums(blocks.size() * moments_of_block);
  std::vector<float> shares(blocks.size() * kinds * kGroups);
  std::vector<double> drawn_lengths(lengths_ > 0 ? blocks.size() * kGroups * (3 + lengths_) : 0);
  for (size_t group = 0; group < kGroups; ++group)
    for (size_t e = 0; e < found[group]->entries().size(); ++e) {
      const UncollidedDeposits::Entry& entry = found[group]->entries()[e];
      const auto block = static_cast<size_t>(
          block_of_[static_cast<size_t>(part_of_home[entry.home]) * sources_.size() + entry.source]);
      const double* drawn = found[group]->SumsOf(e);
      for (size_t k = 0; k < 3; ++k)
        lobes_[block].directions[k][group] = static_cast<int16_t>(std::lround(kUnit * drawn[k]));
      for (size_t c = 0; c < kinds; ++c)
        shares[(block * kinds + c) * kGroups + group] =
            static_cast<float>(drawn[3] * (own_shares_ ? drawn[4 + c] : 1.0));
      for (size_t k = 0; k < moments_of_block; ++k) sums[moments_of_block * block + k] += drawn[4 + channels + k];
      if (lengths_ > 0)
        std::copy_n(found[group]->DrawnOf(e), 3 + lengths_, &drawn_lengths[(block * kGroups + group) * (3 + lengths_)]);
    }
  own_lengths_.resize(blocks.size() * kinds * lengths_ * kGroups);
  const std::vector<LayerCells::Moments> moments = cells_->MomentsOf(part_of_home, block_of_.size() / sources_.size());
  for (size_t block = 0; block < blocks.size(); ++block)
    SetBlock(block, blocks[block].home, &sums[moments_of_block * block],
             moments[static_cast<size_t>(part_of_home[blocks[block].home])], &shares[block * kinds * kGroups],
             lengths_ > 0 ? &drawn_lengths[block * kGroups * (3 + lengths_)] : nullptr);
}

/// `shares`: per channel or for all, the light that the directions were drawn from. `drawn_lengths`: per group, place
/// and lengths of the drawn ray.
void UncollidedLight::SetBlock(size_t block, size_t home, const double* sums, const LayerCells::Moments& filled,
                               float* shares, const double* drawn_lengths) {
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
      if (drawn_lengths)
        SetOwnLengths(
            &own_lengths_[(block * static_cast<size_t>(own_shares_ ? channels_ : 1) + static_cast<size_t>(c)) *
                          lengths_ * kGroups],
            sums + 4 * c, own_shares_ ? 1 : channels_, inverse, centroid, drawn_lengths);
      scale = light > 0 ? static_cast<double>(largest) / (static_cast<double>(kLargest) * light) : 0.0;
    }
    for (size_t kind = 0; kind <= lengths_; ++kind) {
      const size_t at = 4 * (kind * static_cast<size_t>(channels_) + static_cast<size_t>(c));
      const double* moments = sums + at;
      const glm::dvec3 first(moments[1], moments[2], moments[3]);
      const glm::dvec3 slope = per_volume * (inverse * (first - moments[0] * centroid));
      float* to = values + kFluence + at;
      to[0] = static_cast<float>(scale * (per_volume * moments[0] - glm::dot(slope, centroid)));
      for (int k = 0; k < 3; ++k) to[1 + k] = static_cast<float>(scale * slope[k]);
    }
  }
}

/// The lengths of a group's direction beyond the mean length of all light where it was drawn, in one channel or all.
/// Light that has come a longer way keeps to other directions: without this, derivatives by scattering of a plate under
/// a wide lamp are off by a fifth.
void UncollidedLight::SetOwnLengths(float* own, const double* sums, int channels, const glm::dmat3& inverse_spread,
                                    const glm::dvec3& centroid, const double* drawn) const {
  const auto moments_of = [&](size_t kind) {
    glm::dvec4 moments(0.0);
    for (int c = 0; c < channels; ++c)
      for (int k = 0; k < 4; ++k)
        moments[k] +=
            sums[4 * (kind * static_cast<size_t>(channels_) + static_cast<size_t>(c)) + static_cast<size_t>(k)];
    return moments;
  };
  const glm::dvec4 light = moments_of(0);
  if (!(light[0] > 0)) return;
  const auto slope_of = [&](const glm::dvec4& m) {
    return inverse_spread * (glm::dvec3(m[1], m[2], m[3]) - m[0] * centroid) / light[0];
  };
  const glm::dvec3 middle = glm::dvec3(light[1], light[2], light[3]) / light[0];
  for (size_t kind = 0; kind < lengths_; ++kind) {
    const glm::dvec4 moments = moments_of(1 + kind);
    const double mean = moments[0] / light[0];
    const glm::dvec3 slope = slope_of(moments) - mean * slope_of(light);
    for (size_t group = 0; group < kGroups; ++group) {
      const double* of_group = drawn + group * (3 + lengths_);
      const glm::dvec3 place(of_group[0], of_group[1], of_group[2]);
      own[kind * kGroups + group] = static_cast<float>(of_group[3 + kind] - mean - glm::dot(slope, place - middle));
    }
  }
}

void UncollidedLight::Locate(int count, const double* x, const double* y, const double* z, const int* layer,
                             float* at_x, float* at_y, float* at_z, int* part) const {
  LocateIn(cells_->lattice(), static_cast<int>(part_of_.size()) - 1, count, x, y, z, layer, at_x, at_y, at_z, part);
  for (int i = 0; i < count; ++i) __builtin_prefetch(&part_of_[static_cast<size_t>(part[i])]);
}

void UncollidedLight::AddScattered(const Here& here, size_t source, const glm::dvec3& direction, const Medium& medium,
                                   const float* weights, OfGroups* sums) const {
  AddScatteredTo(sums->data(), ScatteringOf(here, source, direction, medium), weights);
}

UncollidedLight::Scattering UncollidedLight::ScatteringOf(const Here& here, size_t source, const glm::dvec3& direction,
                                                          const Medium& medium) const {
  const auto block = static_cast<size_t>(here.blocks[source]);
  const float* values = lines_[block * lines_of_block_].v.data();
  return {lobes_[block].directions[0].data(),
          own_shares_ ? shares_[block * static_cast<size_t>(channels_)].data() : lobes_[block].shares.data(),
          values + kFluence,
          channels_,
          own_shares_,
          here.at - glm::vec3(values[0], values[1], values[2]),
          direction,
          static_cast<float>(medium.g),
          static_cast<float>(medium.isotropic_fraction),
          static_cast<int>(lengths_),
          own_lengths_.data() + block * static_cast<size_t>(own_shares_ ? channels_ : 1) * lengths_ * kGroups};
}

void UncollidedLight::Differentiate(const Here& here, size_t source, const glm::dvec3& direction, int medium,
                                    const float* weights, Scattered& found) const {
  const Scattering s = ScatteringOf(here, source, direction, (*media_)[medium]);
  const size_t kinds = 2 + lengths_;
  found.sums.resize(kinds * static_cast<size_t>(own_shares_ ? channels_ : 1));
  SumScattered(s, found.sums.data());
  const glm::vec4 at(1.0f, s.at.x, s.at.y, s.at.z);
  const size_t layers = media_->size() - 1;
  found.value = Spectrum(channels_, 0.0);
  found.by.assign(layers, {found.value, found.value, found.value});
  for (int c = 0; c < channels_; ++c) {
    const float* sums = found.sums.data() + (own_shares_ ? kinds * static_cast<size_t>(c) : 0);
    const auto weighted = [&](size_t kind, float sum) {
      const float* f = s.fluence + 4 * (kind * static_cast<size_t>(channels_) + static_cast<size_t>(c));
      return static_cast<double>(weights[c] * sum) *
             static_cast<double>(f[0] * at.x + f[1] * at.y + f[2] * at.z + f[3] * at.w);
    };
    found.value[c] = weighted(0, sums[0]);
    found.by[static_cast<size_t>(medium - 1)].asymmetry[c] = weighted(0, sums[1]);
    for (size_t l = 0; l < layers; ++l) {
      const Medium& m = (*media_)[static_cast<int>(l + 1)];
      const auto times_length = [&](size_t kind) { return weighted(1 + kind, sums[0]) + weighted(0, sums[2 + kind]); };
      const double length = times_length(l), textured = lengths_ > layers ? times_length(layers + l) : length;
      found.by[l].scattering[c] -= m.scattering[c] * length;
      found.by[l].absorption[c] -= m.absorption[c] * textured;
      if (is_by_true_media_) found.by[l].asymmetry[c] -= m.ScatteringByAsymmetry() * m.scattering[c] * length;
    }
  }
}

size_t UncollidedLight::bytes() const {
  return 4 * (part_of_.size() + block_of_.size()) + sizeof(Lobe) * lobes_.size() + sizeof(Line) * lines_.size() +
         2 * kGroups * shares_.size() + 4 * own_lengths_.size();
}

}  // namespace crownfit
