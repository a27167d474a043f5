#pragma once
// The optimiser's parameter vector, and the meaning of its entries.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "optics/material.h"
#include "shader/predict.h"

namespace crownfit {

/// One entry of the vector: ln(value) or value of one channel or of all; or the two numbers of a power law.
struct FreeEntry {
  enum class Role { kOneChannel, kAllChannels, kPowerLevel, kPowerExponent };
  std::string name;  ///< "dentine.absorption_per_mm[B]"
  size_t layer;      ///< kSurfaceOwner for the surface
  Quantity quantity;
  Role role;
  int channel;  ///< for kOneChannel
  Scale scale;
  double start, low, high;  ///< in the entry's own scale
  double prior_mean, prior_stddev;
  bool moves_surface = false;  ///< a thickness that shapes the next layer's surface: geometry is cast again for it
};

/// Whether random walks give a derivative by this entry. They give none by a film, the neck's reflectance, the
/// isotropic share, and depths that come from a mesh.
bool HasWalkDerivative(const FreeEntry& entry);

/// Entries that a path-traced fit holds at their start: neither walks nor readings of flat samples identify them.
std::vector<int> HeldByWalks(const Capture& capture, const std::vector<FreeEntry>& entries);

struct FreeParameters {
  std::vector<FreeEntry> entries;
  Material start;
  std::vector<double> wavelengths_nm;
  int channels() const { return start.channels(); }
  int count() const { return static_cast<int>(entries.size()); }
};

struct FitOverrides {
  std::vector<std::pair<std::string, std::vector<double>>> fix;  ///< "layer.key" or "surface.key"; one value, or one
                                                                 ///< per channel
  std::vector<std::string> free;
  std::vector<std::pair<std::string, Sharing>> share;
};

/// Applies --fix, --free and --share to the capture. Throws InputError naming the option.
void ApplyOverrides(Capture& capture, const FitOverrides& overrides);

/// Throws InputError where a power law has but one wavelength.
FreeParameters FreeParametersOf(const Capture& capture);

/// ln value = level - exponent ln(wavelength / 540 nm): the weights of the channels' logarithms in the level and the
/// exponent of the least-squares line. Infinite where all wavelengths are the same.
struct PowerLawWeights {
  Spectrum level, exponent;
};
PowerLawWeights WeightsOfPowerLaw(std::span<const double> wavelengths_nm);

/// Whether all channels have the same wavelength, so that no law of wavelength can be known.
bool HaveOneWavelength(std::span<const double> wavelengths_nm);

Eigen::VectorXd StartVector(const FreeParameters& free);

/// Sets the start of fits to x, as far as bounds allow; priors stay unchanged.
void StartFrom(const Eigen::VectorXd& x, FreeParameters& free);

/// The material at x.
Material MaterialAt(const FreeParameters& free, const Eigen::VectorXd& x);

/// d(value of one parameter in one channel) / d(x), a row of length count().
Eigen::RowVectorXd ValueGradient(const FreeParameters& free, const Eigen::VectorXd& x, size_t layer, Quantity quantity,
                                 int channel);

}  // namespace crownfit
