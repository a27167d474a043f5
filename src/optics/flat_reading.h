#pragma once
// What instruments would read of flat samples, by the `layered` model.

#include <vector>

#include "optics/material.h"

namespace crownfit {

/// In one of the camera's bands.
struct BandReading {
  double reflectance = 0, transmittance = 0;
  double edge_loss = 0;  ///< of the reflectance: what a wide reading would have more
};

/// Whether two measurements differ by thickness, backing, and what of the light counts alone: one solution of the
/// layers serves both.
bool AreAlike(const Capture& capture, const FlatMeasurement& a, const FlatMeasurement& b);

/// Of measurements that are alike: a reading of each.
std::vector<BandReading> ReadBand(const Capture& capture, const std::vector<FlatMeasurement>& alike,
                                  const Material& material, int channel);

/// A small step between materials.
struct MaterialStep {
  Material from, to;
};

/// How each of the readings changes, to first order, with each step's difference: [measurement][step].
std::vector<std::vector<BandReading>> ReadBandChanges(const Capture& capture, const std::vector<FlatMeasurement>& alike,
                                                      const Material& material, int channel,
                                                      const std::vector<MaterialStep>& steps);

/// What the measurement states, in the order of its fields: reflectance, transmittance, lab.
std::vector<const Reading*> ReadingsOf(const FlatMeasurement& m);

/// The same predicted: three values of each, given what is read in the three bands.
std::vector<double> PredictedValues(const FlatMeasurement& m, const std::array<BandReading, kChannels>& bands);

}  // namespace crownfit
