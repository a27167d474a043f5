#pragma once
// The thesis's blur kernel.

#include "scene/cast_samples.h"

namespace crownfit {

/// Hable's centre and 12 jittered taps (`HableTapX`, `HableTapY`), their weights replaced by the fitted profile's share
/// of each ring. Their distances are fixed in millimetres, independent of the material.
TapKernel TwelveTapKernel();

}  // namespace crownfit
