#pragma once
// The blur of the thesis.

#include "scene/cast_samples.h"

namespace crownfit {

/// Hable's centre and 12 jittered taps (`HableTapX`, `HableTapY`), their weights replaced by the fitted profile's share
/// of each ring. Fixed in millimetres, whatever the material.
TapKernel TwelveTapKernel();

}  // namespace crownfit
