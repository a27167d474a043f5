#pragma once
// Derivatives of a path-traced picture: as the paths give them, and pooled for use by a solver.
//
// The score derivative of a single pixel has ten times the noise of its value: a standard deviation of 10 to 15 times
// the value per path, for a signal of 0.05 to 0.4. A solver that uses it takes no step at all. But d ln(pixel) varies
// slowly over an object. So it is fitted by a polynomial in position and brightness, after multiples of the zero-mean
// control variates are subtracted. Cross-validation chooses the degree.

#include <array>
#include <cstddef>
#include <map>
#include <vector>

#include "capture/parameters.h"
#include "path/path_photograph.h"

namespace crownfit {

/// The variable of differentiation: the logarithm of a coefficient or thickness, other quantities themselves.
struct DerivativeParameter {
  size_t layer;  ///< number of layers: the surface
  Quantity quantity;
};

/// Derivatives of the same groups of paths by finite differences of pictures with common random numbers.
struct FiniteDifferences {
  DerivativeParameter parameter;
  SpectrumArray<> values;  ///< index as PathPhotograph::group_values
};

/// d ln(pixel) by every parameter, on the object; d pixel for pixels that see only its rim.
class PooledDerivatives {
 public:
  /// `photo`: rendered with PathOptions::derivatives, at least 4 samples a pixel. Derivatives of a channel without
  /// light are 0.
  explicit PooledDerivatives(const PathPhotograph& photo, const std::vector<FiniteDifferences>& differences = {});

  const std::vector<DerivativeParameter>& parameters() const { return parameters_; }
  int groups() const { return groups_; }
  int channels() const { return channels_; }
  /// 0 off the object.
  double At(size_t parameter, int channel, size_t place) const;
  /// Leave-one-out values, one per group of paths: errors of anything made of derivatives follow from them (jackknife).
  std::vector<double> Without(size_t parameter, int channel, size_t place) const;
  /// Standard deviation of At, by the jackknife.
  double Stddev(size_t parameter, int channel, size_t place) const;
  /// Degree of the polynomial.
  int degree(size_t parameter, int channel) const { return fields_[IndexOf(parameter, channel)].degree; }
  /// Brightness of the neighbourhood without the pixel itself, so that both have independent noise. Pixel derivatives
  /// are brightness times At.
  double brightness(int channel, size_t place) const {
    return IsOnObject(place) ? places_[(*ranks_)[place]].brightness[channel] : 0.0;
  }
  /// d pixel by a parameter, and its error: on the object brightness times At, elsewhere from the pixel's own paths.
  struct OfPixel {
    double value = 0, stddev = 0;
  };
  OfPixel DerivativeOf(size_t parameter, int channel, size_t place) const;

 private:
  static constexpr int kMaxDegree = 5;
  struct Place {  ///< of a pixel, scaled to about [-1, 1]
    double x = 0, y = 0;
    Spectrum log_brightness, brightness, variance;  ///< of the neighbourhood
    bool on_object = false;
  };
  struct Field {
    int degree = 0;
    std::vector<double> coefficients;
    std::vector<std::vector<double>> without;  ///< per left-out group
  };
  void FindPlaces(const PathPhotograph& photo);
  void KeepRim(const PathPhotograph& photo, const std::vector<FiniteDifferences>& differences);
  static constexpr int kMaxTerms = 56;
  std::array<double, kMaxTerms> TermsAt(int degree, int channel, size_t rank) const;
  bool IsOnObject(size_t place) const {
    const uint32_t rank = (*ranks_)[place];
    return rank != PathPhotograph::kNotRendered && places_[rank].on_object;
  }
  size_t IndexOf(size_t parameter, int channel) const {
    return parameter * static_cast<size_t>(channels_) + static_cast<size_t>(channel);
  }
  std::vector<DerivativeParameter> parameters_;
  int groups_ = 0, channels_ = 0;
  std::shared_ptr<const std::vector<uint32_t>> ranks_;  ///< of places in the picture
  std::vector<Place> places_;                           ///< by rank
  std::vector<Field> fields_;                           ///< per parameter and channel
  /// For pixels whose centre is off the object but some of whose paths hit it, by rank: per parameter and channel.
  std::map<size_t, std::vector<OfPixel>> rim_;
};

}  // namespace crownfit
