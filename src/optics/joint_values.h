#pragma once
// What a fit knows of all its values at once: the block "joint" of material.json, and materials drawn from it.

#include <cstdint>
#include <optional>
#include <vector>

#include "base/json_file.h"
#include "optics/material.h"

namespace crownfit {

/// A normal distribution of values, of their logarithms where the table's scale says so.
struct JointValues {
  struct Entry {
    size_t layer;  ///< not used for a quantity of the surface
    Quantity quantity;
    std::optional<int> channel;  ///< nothing: one value for all
  };
  std::vector<Entry> entries;
  /// Row by row, lower triangle: times independent standard normal numbers it makes deviations with the covariance.
  std::vector<std::vector<double>> factor;
};

/// Reads {"names", "stddev", "correlation"}; entries of layers that `material` lacks are left out. Throws InputError
/// when names are unknown, or the matrix is no correlation.
JointValues ReadJointValues(const JsonNode& node, const Material& material,
                            const std::array<std::string, kChannels>& channel_names);

/// The material with values drawn around it, kept within the table's bounds; the same for the same key. Thicknesses
/// keep their values: they are part of the drawn distribution, but what is predicted has thicknesses of its own.
Material Drawn(const JointValues& joint, Material material, uint64_t key);

}  // namespace crownfit
