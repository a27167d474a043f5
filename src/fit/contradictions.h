#pragma once
// Contradictions between photographs and what a capture states.

#include <vector>

#include "fit/fit_result.h"

namespace crownfit {

inline constexpr double kFarMoved = 3.0;      ///< standard deviations, root mean square
inline constexpr double kLevelCertain = 3.0;  ///< standard deviations

/// Whether the stated errors of this kind were inflated.
bool IsInflated(const CrownFit& fit, CalibrationKind kind);

/// The value of this kind that moved furthest, as kErrorsInflated and kStatementContradicted list it; `factor`: the
/// number after the kind.
Finding FurthestOff(const CrownFit& fit, CalibrationKind kind, FindingKind as, double factor);

/// kSceneryOff; without names where tile and scenery are as bright as predicted everywhere.
Finding SceneryThatIsOff(const std::vector<SceneryLevel>& levels);

/// Lights contradicted by all photographs that show their light beside the object.
std::vector<std::string> LightsThatSceneryDenies(const std::vector<SceneryLevel>& levels);

/// kPhotographsNotExplained; without names where noise explains the residuals of every one.
Finding PhotographsNotExplained(const std::vector<PhotographResult>& photographs);

/// kSharingRejected, for every parameter whose channels depart from their shared law by more than its intervals.
/// `source`: the data that reject it.
std::vector<Finding> LawsDenied(const CrownFit& fit, const char* source);

/// kPriorsContradicted; without names where the photographs alone put every entry near its prior.
Finding PriorsContradicted(const CrownFit& fit);

}  // namespace crownfit
