#pragma once
// Predicted instrument readings of flat samples, by the `layered` model.

#include <span>
#include <vector>

#include "capture/measurement.h"
#include "optics/material.h"

namespace crownfit {

/// A reading in one of the camera's bands.
struct BandReading {
  double reflectance = 0, transmittance = 0;
  double edge_loss = 0;  ///< how much more reflectance a wide reading would have
};

/// Whether two measurements differ only in thickness, backing and which of the light counts, so that one solution of
/// the layers serves both.
bool AreAlike(const Capture& capture, const FlatMeasurement& a, const FlatMeasurement& b);

/// A reading for each of several alike measurements.
std::vector<BandReading> ReadBand(const Capture& capture, const std::vector<FlatMeasurement>& alike,
                                  const Material& material, int channel);

/// A small step between materials.
struct MaterialStep {
  Material from, to;
};

/// First-order change of each reading by each step's difference: [measurement][step].
std::vector<std::vector<BandReading>> ReadBandChanges(const Capture& capture, const std::vector<FlatMeasurement>& alike,
                                                      const Material& material, int channel,
                                                      const std::vector<MaterialStep>& steps);

/// What the measurement states, in the order of its fields: reflectance, transmittance, lab.
std::vector<const Reading*> ReadingsOf(const FlatMeasurement& m);

/// Their predictions: one value per channel or three of lab, from the readings in each channel.
std::vector<double> PredictedValues(const FlatMeasurement& m, std::span<const BandReading> bands);

}  // namespace crownfit
