#pragma once
// Predictions for dental technicians: a material's colour at other thicknesses and over other backgrounds, with
// intervals.
// Formulas and sources: docs/dental.md.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "optics/adding_doubling.h"
#include "optics/material_file.h"
#include "photo/colour.h"

namespace crownfit {

struct FlatQuestion {
  MaterialRecord material;
  std::vector<std::string> channel_names{"R", "G", "B"};
  std::vector<double> design_mm;        ///< of its layers
  std::vector<double> other_totals_mm;  ///< total thicknesses, the layers in the design's proportions
  /// Reflectances in the camera's bands. Black and white cards lie behind a thin gap of air.
  Spectrum black = Spectrum(0.0), white = Spectrum(1.0), stump = black, target = white;
  bool is_cemented = true;  ///< stump and target are cemented; false: they lie behind a gap of air too
  double stump_ior = 1.54;  ///< of stump and target under cement; 1: their colour has no surface of its own
  std::optional<MaterialRecord> cement;  ///< absent: clear, of the stump's index (1.54 where that is 1)
  double cement_mm = 0.05;
  MeasuredAt geometry = MeasuredAt::k45_0;
  std::optional<double> aperture_mm;  ///< diameter that is lit and seen; absent: everything is
  BandColour colour;
  int draws = 400;
  uint64_t seed = 1;
  int threads = 0;
};

/// A printed figure, with a 95 % interval and a standard deviation where the material has any.
struct FlatFigure {
  std::string name, unit;
  double value = 0;
  std::optional<double> stddev, low95, high95;
};
struct FlatGroup {
  std::string name;  ///< "design", "at_1.00_mm"
  std::vector<double> thickness_mm;
  std::vector<FlatFigure> figures;
  const FlatFigure& operator[](const std::string& name) const;
};
struct FlatPrediction {
  std::vector<FlatGroup> groups;         ///< the design first
  std::vector<glm::dvec3> lab_of_draws;  ///< for the design over the stump; empty where nothing is uncertain
  glm::dvec3 lab{0.0};                   ///< the same at the material's own values
};

/// Stump and target are searched for a masking thickness up to here.
inline constexpr double kThickest_mm = 8.0;

/// Whether the material states any standard deviation.
bool IsUncertain(const MaterialRecord& material);

FlatPrediction PredictFlat(const FlatQuestion& question, const std::function<void(double)>& progress);

}  // namespace crownfit
