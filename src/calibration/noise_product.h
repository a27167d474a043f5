#pragma once
// noise.json from photon transfer (estimate_noise.h).

#include <utility>
#include <vector>

#include "calibration/product.h"

namespace crownfit {

/// noise.json with its figures, gates and picture. Grey pictures and unprocessed mosaics count for all channels alike.
Product NoiseProduct(const std::vector<std::pair<const Image*, const Image*>>& pairs,
                     const std::vector<const Image*>& darks);

}  // namespace crownfit
