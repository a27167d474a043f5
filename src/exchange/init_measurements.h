#pragma once
// Makes a capture of measurements alone from a file of iad.

#include <filesystem>
#include <string>
#include <vector>

namespace crownfit {

struct MeasuredParts {
  std::filesystem::path file;               ///< .rxt
  std::vector<double> wavelengths_nm = {};  ///< of the three bands, or one for all; empty: 600, 540, 450
  std::vector<int> rows = {};               ///< for a file without wavelengths: one per band, or one for all, from 1
  std::string layer = "sample";
  double stddev = 0.005;   ///< of every reading
  double asymmetry = 0.8;  ///< where the file has none
};

/// Writes capture.json: readings in three bands, linearly interpolated between the file's wavelengths; one measurement
/// per thickness; scattering and absorption free. Throws InputError.
void InitMeasuredCapture(const MeasuredParts& parts, const std::filesystem::path& folder);

}  // namespace crownfit
