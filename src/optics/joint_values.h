#pragma once
// The joint distribution of all fitted values: the block "joint" of material.json, and materials drawn from it.

#include <cstdint>
#include <optional>
#include <vector>

#include "base/json_file.h"
#include "optics/material.h"

namespace crownfit {

/// A normal distribution of values, or of their logarithms where the table's scale says so.
struct JointValues {
  struct Entry {
    size_t layer;  ///< not used for a quantity of the surface
    Quantity quantity;
    std::optional<int> channel;  ///< absent: one value for all
  };
  std::vector<Entry> entries;
  /// Cholesky factor, lower triangle row by row: maps independent standard normal numbers to deviations.
  std::vector<std::vector<double>> factor;
};

/// Reads {"names", "stddev", "correlation"}; entries of layers that `material` lacks are left out. Throws InputError
/// when names are unknown, or the matrix is not a correlation matrix.
JointValues ReadJointValues(const JsonNode& node, const Material& material,
                            const std::vector<std::string>& channel_names);

/// The material with values drawn around it, kept within the table's bounds; the same for the same key. Thicknesses
/// keep their values: they are part of the distribution, but a prediction sets its own.
Material Drawn(const JointValues& joint, Material material, uint64_t key);

}  // namespace crownfit
