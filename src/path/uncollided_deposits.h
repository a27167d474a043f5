#pragma once
// What rays of light that has not collided yet leave in small cells, and in which layers it collides first.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "path/layer_cells.h"
#include "path/uncollided_rays.h"

namespace crownfit {

/// A piece of a ray in a medium: its transmittance, the integral of exp(-s t) over its length d, and the means of t and
/// t^2 under that weight.
struct Attenuated {
  double passes, integral, middle, square;
  Attenuated(double s, double d) {
    const double x = s * d;
    if (x < 1e-3) {
      passes = 1.0 - x * (1.0 - 0.5 * x);
      integral = d * (1.0 - x * (0.5 - x / 6.0));
      middle = d * (0.5 - x / 12.0);
      square = d * d * (1.0 - 0.25 * x) / 3.0;
      return;
    }
    passes = std::exp(-x);
    integral = (1.0 - passes) / s;
    middle = (1.0 - x * passes / (1.0 - passes)) / s;
    square = (2.0 * middle - d * x * passes / (1.0 - passes)) / s;
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

/// What the rays of one group leave in the cells, per part and source: a direction; the sum of power x length that it
/// was drawn from, all channels together; the drawn ray's power x length of each channel, of all that of the mean
/// channel; per channel power x length and its first moments, in cells, about the cell's middle; the same times every
/// kind of length that the light had gone; the place of the drawn ray and its own lengths there.
class UncollidedDeposits : public UncollidedRays::Receiver {
 public:
  struct Entry {
    size_t home, source;
  };
  /// `entry_of`: work space, -1 for every part of a cell.
  UncollidedDeposits(const Media& media, const LayerCells& cells, size_t lengths, std::vector<int32_t>& entry_of)
      : media_(media), cells_(cells), channels_(media.channels()), lengths_(lengths), entry_of_(entry_of) {
    for (int m = 1; m < static_cast<int>(media_.size()); ++m)
      extinction_.push_back(media_[m].scattering + media_[m].absorption);
  }

  void Begin(size_t source) {
    for (; cleared_ < entries_.size(); ++cleared_) entry_of_[entries_[cleared_].home] = -1;
    source_ = source;
  }
  const std::vector<Entry>& entries() const { return entries_; }
  const double* SumsOf(size_t entry) const { return &sums_[entry * size()]; }
  /// Place and lengths of the drawn ray.
  const double* DrawnOf(size_t entry) const { return SumsOf(entry) + DrawnAt(); }

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
      Spectrum texture(1.0);  // the mean along the piece
      if (m.texture) {
        texture = m.texture->Along(from + gone * direction, direction, piece) / std::max(piece, 1e-12);
        extinction = m.scattering + m.absorption * texture;
      }
      const double stands_for = ray.StandsFor();
      if (stands_for == 0) return false;
      if (cells_.Holds(cell)) Add(stands_for, medium, cell, at, way, direction, piece, extinction, texture, ray);
      ray.length_mm[static_cast<size_t>(medium)] += piece;
      if (media_.has_textures()) ray.textured_mm[static_cast<size_t>(medium)] += piece * texture;
      gone += piece;
      if (is_last) break;
      at += piece * way;
      cell[axis] += way[axis] > 0 ? 1 : -1;
    }
    return true;
  }

 private:
  size_t size() const { return DrawnAt() + (lengths_ > 0 ? 3 + lengths_ : 0); }
  size_t DrawnAt() const { return 4 + (5 + 4 * lengths_) * static_cast<size_t>(channels_); }

  void Add(double stands_for, int medium, const glm::ivec3& cell, const glm::dvec3& at, const glm::dvec3& way,
           const glm::dvec3& direction, double length_mm, const Spectrum& extinction, const Spectrum& texture,
           UncollidedRay& ray) {
    const size_t index = cells_.IndexOf(cell, medium), home = cells_.HomeOf(index);
    int32_t& entry = entry_of_[home];
    if (entry < 0) {
      entry = static_cast<int32_t>(entries_.size());
      entries_.push_back({home, source_});
      sums_.resize(sums_.size() + size(), 0.0);
    }
    double* drawn = &sums_[static_cast<size_t>(entry) * size()];
    double* channel = drawn + 4 + channels_;
    const glm::dvec3 start = at - (glm::dvec3(home == index ? cell : cells_.CellOf(home)) + 0.5);
    double all = 0, middle = 0;
    std::array<double, kMostChannels> lights;
    for (int c = 0; c < channels_; ++c, channel += 4) {
      const Attenuated piece(extinction[c], length_mm);
      const double light = stands_for * ray.power[c] * piece.integral;
      lights[static_cast<size_t>(c)] = light;
      all += light;
      middle += light * piece.middle;
      channel[0] += light;
      for (int k = 0; k < 3; ++k) channel[1 + k] += light * (start[k] + piece.middle * way[k]);
      for (size_t kind = 0; kind < lengths_; ++kind) {
        // Of light at t along the piece: before + gains t.
        const auto [before, gains] = LengthOf(kind, c, medium, texture, ray);
        double* by_length = channel + 4 * (kind + 1) * static_cast<size_t>(channels_);
        by_length[0] += light * (before + gains * piece.middle);
        for (int k = 0; k < 3; ++k)
          by_length[1 + k] += light * (before * (start[k] + piece.middle * way[k]) +
                                       gains * (start[k] * piece.middle + way[k] * piece.square));
      }
      ray.power[c] *= piece.passes;
    }
    drawn[3] += all;
    // By the cell, so that pictures of changed materials draw the same rays.
    if (!(Uniform(ray.random.state(), index) * drawn[3] < all)) return;
    for (int k = 0; k < 3; ++k) drawn[k] = direction[k];
    for (int c = 0; c < channels_; ++c) drawn[4 + c] = lights[static_cast<size_t>(c)] / all;
    if (lengths_ == 0) return;
    double* there = drawn + DrawnAt();
    for (int k = 0; k < 3; ++k) *there++ = start[k] + middle / all * way[k];
    for (size_t kind = 0; kind < lengths_; ++kind) {
      double length = 0;  // the mean over channels
      for (int c = 0; c < channels_; ++c) {
        const auto [before, gains] = LengthOf(kind, c, medium, texture, ray);
        length += (before + gains * middle / all) / channels_;
      }
      *there++ = length;
    }
  }

  /// A kind of length before a piece in `medium`, and what it gains along it.
  std::pair<double, double> LengthOf(size_t kind, int channel, int medium, const Spectrum& texture,
                                     const UncollidedRay& ray) const {
    const size_t layers = media_.size() - 1, of = 1 + kind % layers;
    const double here = of == static_cast<size_t>(medium) ? 1.0 : 0.0;
    if (kind < layers) return {ray.length_mm[of], here};
    return {ray.textured_mm[of][channel], here * texture[channel]};
  }

  const Media& media_;
  const LayerCells& cells_;
  int channels_;
  size_t lengths_;
  std::vector<int32_t>& entry_of_;
  std::vector<Spectrum> extinction_;  ///< per layer
  size_t source_ = 0, cleared_ = 0;
  std::vector<Entry> entries_;
  std::vector<double> sums_;
};

}  // namespace crownfit
