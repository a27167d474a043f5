#pragma once
// What photographs contradict of what a capture states, in words.

#include "report/crown_fit.h"

namespace crownfit {

inline constexpr double kFarMoved = 3.0;      ///< standard deviations, root mean square
inline constexpr double kLevelCertain = 3.0;  ///< standard deviations

const char* NameOf(StatementKind kind);  ///< "poses"
/// Whether errors of this kind were taken for larger than stated.
bool IsWidened(const CrownFit& fit, StatementKind kind);
/// "the exposure of 'front' is 10 % less than stated, which is 9.8 stated errors"
std::string FurthestOff(const CrownFit& fit, StatementKind kind);
/// "'front' 0.92, 0.92, 0.91 times"; empty: all are as bright as predicted.
std::string SceneryThatIsOff(const std::vector<SceneryLevel>& levels);
/// "'left', 'right'": lights that all photographs which show their light beside the object deny; empty: there is none.
std::string LightsThatSceneryDenies(const std::vector<SceneryLevel>& levels);
/// "'edge' (patches 4.4), 'back' (sixteenths 2.5)"; empty: noise explains what is left of every one.
std::string PhotographsNotExplained(const std::vector<PhotographResult>& photographs);
/// "'ceramic.reduced_scattering_per_mm' is not one value in all channels: ..."; empty: all that share agree, or are off
/// by less than their intervals hold.
std::string LawsDenied(const CrownFit& fit);
/// "'dentine.thickness_mm' (3.7)"; empty: the photographs alone would put every entry near its prior.
std::string PriorsContradicted(const CrownFit& fit);

}  // namespace crownfit
