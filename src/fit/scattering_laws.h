#pragma once
// Laws that a layer's scattering keeps over the channels, each with a number less than the next (one value; a power
// law; a value in each channel): what a law would do to a fit, and whether photographs deny the one that they were
// fitted by.

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "fit/uncertainty.h"

namespace crownfit {

struct Capture;

/// Of one law beside the next. Departures are shares of the value, in the channel that departs most. Every fitted value
/// has the smaller mean square error under the law where the material departs from it by less than `told`
/// (Toro-Vizcarrondo and Wallace 1968, of one restriction on a linear regression).
struct SharedScattering {
  std::string parameter;  ///< "dentine.reduced_scattering_per_mm"
  Sharing law;
  bool is_stated;        ///< the capture states it; else what has a number more
  double told;           ///< a departure's standard deviation, where it is left free; infinite: nothing would tell it
  double published;      ///< by how much published teeth depart
  double narrows;        ///< under the law the interval of `narrowed` is narrower by this factor, the largest of all
  std::string narrowed;  ///< empty: none that is known
  bool IsAdvised() const { return told > published; }
};

/// At the capture's start values. Of absorptions no law is known, so they are not asked about. `foresee`: what would be
/// known of the free entries of such a capture.
std::vector<SharedScattering> ScatteringThatMayBeShared(
    const Capture& capture, const std::function<DataEstimate(const Capture&, const FreeParameters&)>& foresee);

/// Where scattering would go, were every law of the material's lifted: by its logarithms.
struct LawDeparture {
  std::string parameter;
  Sharing law;
  std::array<double, kChannels> moved{};          ///< in all
  std::array<double, kChannels> off{}, stddev{};  ///< of it, what the law can't follow
  double chi2 = 0;                                ///< of `off`, over its covariance
  int freedom = 0;
};

bool KeepsALaw(const Capture& capture);  ///< whether scattering that is fitted does

/// The capture at a fit's material, with scattering and absorption free in every channel where they are fitted: what
/// absorption's law denies is not taken for scattering's.
Capture WithoutLaws(Capture capture, const Material& material);

/// `freed`: of WithoutLaws; `step`: by how much its entries go from there where they are free, with its covariance.
std::vector<LawDeparture> DeparturesFromLaws(const Capture& fitted, const FreeParameters& freed,
                                             const Eigen::VectorXd& step, const Eigen::MatrixXd& covariance);
/// `knowledge`: where such a fit ended.
std::vector<LawDeparture> DeparturesFromLaws(const Capture& fitted, const FreeParameters& freed,
                                             const DataEstimate& knowledge);

}  // namespace crownfit
