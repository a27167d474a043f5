#pragma once
// Derivatives of a walked picture: as they come from the paths, and pooled into something a solver can use.
//
// A single pixel's score derivative has ten times the noise of its value (standard deviation of 10 to 15 times the
// value per path, for a signal of 0.05 to 0.4), and a solver that is given it takes no step at all. But d ln(pixel)
// changes slowly over an object. So it is fitted by a polynomial in place and brightness whose degree cross-validation
// chooses, after multiples of the zero-mean controls have been taken off.

#include <array>
#include <cstddef>
#include <map>
#include <vector>

#include "capture/parameters.h"
#include "path/path_photograph.h"

namespace crownfit {

/// What the picture is differentiated by: the logarithm of a coefficient or thickness, other quantities themselves.
struct DerivativeParameter {
  size_t layer;  ///< the surface's: number of layers
  Quantity quantity;
};

/// Slopes of the same groups of paths that were found by differences of pictures with common random numbers.
struct FiniteDifferences {
  DerivativeParameter parameter;
  std::vector<glm::vec3> values;  ///< index as PathPhotograph::group_values
};

/// d ln(pixel) by every parameter, on the object; of pixels that see but its rim, d pixel.
class PooledDerivatives {
 public:
  /// `photo`: rendered with PathOptions::derivatives, at least 4 samples a pixel. Slopes of a channel without light are
  /// 0.
  explicit PooledDerivatives(const PathPhotograph& photo, const std::vector<FiniteDifferences>& differences = {});

  const std::vector<DerivativeParameter>& parameters() const { return parameters_; }
  int groups() const { return groups_; }
  /// 0 off the object.
  double At(size_t parameter, int channel, size_t place) const;
  /// From all paths but one group's, for every group: what the errors of anything made of derivatives are found from
  /// (jackknife).
  std::vector<double> Without(size_t parameter, int channel, size_t place) const;
  /// Of At, by the jackknife.
  double Stddev(size_t parameter, int channel, size_t place) const;
  /// Degree of the polynomial.
  int degree(size_t parameter, int channel) const { return fields_[parameter * kChannels + channel].degree; }
  /// Brightness of the neighbourhood without the pixel itself, so that it shares no noise with it: pixel derivatives
  /// are brightness times At.
  double brightness(int channel, size_t place) const {
    return IsOnObject(place) ? places_[(*ranks_)[place]].brightness[channel] : 0.0;
  }
  /// d pixel by a parameter, and its error: on the object brightness times At, elsewhere what the pixel's own paths
  /// say.
  struct OfPixel {
    double value = 0, stddev = 0;
  };
  OfPixel DerivativeOf(size_t parameter, int channel, size_t place) const;

 private:
  static constexpr int kMaxDegree = 5;
  struct Place {  ///< of a pixel, scaled to about [-1, 1]
    double x = 0, y = 0;
    glm::dvec3 log_brightness{0.0}, brightness{0.0}, variance{0.0};  ///< of the neighbourhood
    bool on_object = false;
  };
  struct Field {
    int degree = 0;
    std::vector<double> coefficients;
    std::vector<std::vector<double>> without;  ///< per group
  };
  void FindPlaces(const PathPhotograph& photo);
  void KeepRim(const PathPhotograph& photo, const std::vector<FiniteDifferences>& differences);
  static constexpr int kMaxTerms = 56;
  std::array<double, kMaxTerms> TermsAt(int degree, int channel, size_t rank) const;
  bool IsOnObject(size_t place) const {
    const uint32_t rank = (*ranks_)[place];
    return rank != PathPhotograph::kNotRendered && places_[rank].on_object;
  }
  std::vector<DerivativeParameter> parameters_;
  int groups_ = 0;
  std::shared_ptr<const std::vector<uint32_t>> ranks_;  ///< of places in the picture
  std::vector<Place> places_;                           ///< by rank
  std::vector<Field> fields_;                           ///< per parameter and channel
  /// Of pixels whose centre is off the object and some of whose paths meet it, by rank: per parameter and channel.
  std::map<size_t, std::vector<OfPixel>> rim_;
};

}  // namespace crownfit
