#pragma once
// Laws of a layer's scattering over the channels: one value; a power law; a value in each channel. Each has one
// parameter fewer than the next. Predicts the effect of a law on a fit, and tests whether photographs reject the law
// that they were fitted with.

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "fit/uncertainty.h"

namespace crownfit {

struct Capture;

/// One law compared with the next. Departures are relative, in the channel that departs most. Every fitted value has
/// the smaller mean square error under the law if the material departs from it by less than `told` (Toro-Vizcarrondo
/// and Wallace 1968, of one restriction on a linear regression).
struct SharedScattering {
  std::string parameter;  ///< "dentine.reduced_scattering_per_mm"
  Sharing law;
  bool is_stated;        ///< the capture states this law; else the next one
  double told;           ///< standard deviation of a departure, where it is free; infinite: not identified
  double published;      ///< departure of published teeth
  double narrows;        ///< the law narrows the interval of `narrowed` by this factor, the largest of all
  std::string narrowed;  ///< empty: none is identified
  bool IsAdvised() const { return told > published; }
};

/// At the capture's start values. No law is known for absorption, so it is left out. `foresee`: expected information on
/// the free entries of such a capture.
std::vector<SharedScattering> ScatteringThatMayBeShared(
    const Capture& capture, const std::function<DataEstimate(const Capture&, const FreeParameters&)>& foresee);

/// Change of scattering, in its logarithms, if all laws of the material were lifted.
struct LawDeparture {
  std::string parameter;
  Sharing law;
  Spectrum moved{};          ///< total change
  Spectrum off{}, stddev{};  ///< the part that the law cannot follow
  double chi2 = 0;           ///< of `off`, over its covariance
  int freedom = 0;
};

bool KeepsALaw(const Capture& capture);  ///< whether fitted scattering follows a law

/// The capture at a fit's material, with fitted scattering and absorption free in every channel. So a wrong law of
/// absorption is not taken for one of scattering.
Capture WithoutLaws(Capture capture, const Material& material);

/// `freed`: of WithoutLaws; `step`: the change of its entries when they are free, with its covariance.
std::vector<LawDeparture> DeparturesFromLaws(const Capture& fitted, const FreeParameters& freed,
                                             const Eigen::VectorXd& step, const Eigen::MatrixXd& covariance);
/// `knowledge`: the result of such a fit.
std::vector<LawDeparture> DeparturesFromLaws(const Capture& fitted, const FreeParameters& freed,
                                             const DataEstimate& knowledge);

}  // namespace crownfit
