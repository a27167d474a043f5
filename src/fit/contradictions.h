#pragma once
// What photographs contradict of what a capture states.

#include <vector>

#include "fit/fit_result.h"

namespace crownfit {

inline constexpr double kFarMoved = 3.0;      ///< standard deviations, root mean square
inline constexpr double kLevelCertain = 3.0;  ///< standard deviations

/// Whether errors of this kind were taken for larger than stated.
bool IsInflated(const CrownFit& fit, CalibrationKind kind);

/// As kErrorsInflated and kStatementContradicted have it; `factor`: the number after the kind.
Finding FurthestOff(const CrownFit& fit, CalibrationKind kind, FindingKind as, double factor);

/// kSceneryOff; no names: tile and scenery are as bright as predicted everywhere.
Finding SceneryThatIsOff(const std::vector<SceneryLevel>& levels);

/// Lights that all photographs which show their light beside the object deny.
std::vector<std::string> LightsThatSceneryDenies(const std::vector<SceneryLevel>& levels);

/// kPhotographsNotExplained; no names: noise explains what is left of every one.
Finding PhotographsNotExplained(const std::vector<PhotographResult>& photographs);

/// kSharingRejected, for every parameter whose channels are further from the law they share than its intervals hold.
/// `source`: what rejects it.
std::vector<Finding> LawsDenied(const CrownFit& fit, const char* source);

/// kPriorsContradicted; no names: the photographs alone would put every entry near its prior.
Finding PriorsContradicted(const CrownFit& fit);

}  // namespace crownfit
