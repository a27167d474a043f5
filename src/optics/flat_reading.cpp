#include "optics/flat_reading.h"

#include "optics/adding_doubling.h"
#include "optics/aperture.h"

namespace crownfit {
namespace {

bool IsInContact(const Capture& capture, const FlatMeasurement& m) {
  return m.backing && capture.backings[*m.backing].in_contact;
}

}  // namespace

bool AreAlike(const Capture& capture, const FlatMeasurement& a, const FlatMeasurement& b) {
  const auto glass = [](const FlatMeasurement& m) {
    return m.slide ? std::pair(m.slide->ior, m.slide->thickness_mm) : std::pair(0.0, 0.0);
  };
  return a.geometry == b.geometry && a.aperture_mm == b.aperture_mm && glass(a) == glass(b) &&
         IsInContact(capture, a) == IsInContact(capture, b);
}

std::vector<BandReading> ReadBand(const Capture& capture, const std::vector<FlatMeasurement>& alike,
                                  const Material& material, int channel) {
  constexpr AddingDoublingOptions kFine{24}, kCoarse{12};  // waves of an aperture are known to per cents only
  const FlatMeasurement& first = alike[0];
  Slab slab = SlabOf(material, channel);
  slab.backing_contact = IsInContact(capture, first);
  std::vector<std::vector<double>> thicknesses_mm;
  for (const FlatMeasurement& m : alike) thicknesses_mm.push_back(m.thickness_mm);
  if (first.slide) {
    const SlabLayer glass{first.slide->ior, 0.0, 0.0, 0.0, 0.0, first.slide->thickness_mm};
    slab.layers.insert(slab.layers.begin(), glass);
    slab.layers.push_back(glass);
    for (auto& mm : thicknesses_mm) {
      mm.insert(mm.begin(), glass.thickness_mm);
      mm.push_back(glass.thickness_mm);
    }
  }
  const auto behind = [&](const FlatMeasurement& m) {
    return m.backing ? capture.backings[*m.backing].reflectance[channel] : 0.0;
  };
  const auto wide = ViewSlab(slab, thicknesses_mm, first.geometry, kFine);
  std::vector<BandReading> readings;
  for (size_t i = 0; i < alike.size(); ++i)
    readings.push_back({wide[i].Over(behind(alike[i])) + (alike[i].has_specular ? wide[i].mirrored : 0.0),
                        wide[i].transmittance, 0.0});
  if (!first.aperture_mm) return readings;
  for (size_t i = 0; i < alike.size(); ++i) readings[i].edge_loss = wide[i].Over(behind(alike[i]));
  for (const ApertureWave& wave : ApertureWaves(*first.aperture_mm)) {
    const auto seen = ViewSlab(UnderWave(slab, wave.wave_number_per_mm), thicknesses_mm, first.geometry, kCoarse);
    for (size_t i = 0; i < alike.size(); ++i) readings[i].edge_loss -= wave.weight * seen[i].Over(behind(alike[i]));
  }
  for (BandReading& r : readings) r.reflectance -= r.edge_loss;
  return readings;
}

std::vector<const Reading*> ReadingsOf(const FlatMeasurement& m) {
  std::vector<const Reading*> readings;
  for (const auto* reading : {&m.reflectance, &m.transmittance, &m.lab})
    if (*reading) readings.push_back(&**reading);
  return readings;
}

std::vector<double> PredictedValues(const FlatMeasurement& m, const std::array<BandReading, kChannels>& bands) {
  std::vector<double> values;
  if (m.reflectance)
    for (const BandReading& b : bands) values.push_back(b.reflectance);
  if (m.transmittance)
    for (const BandReading& b : bands) values.push_back(b.transmittance);
  if (m.lab) {
    const glm::dvec3 lab =
        LabFromLinearRgb(m.colour.LinearRgb({bands[0].reflectance, bands[1].reflectance, bands[2].reflectance}));
    for (int c = 0; c < 3; ++c) values.push_back(lab[c]);
  }
  return values;
}

}  // namespace crownfit
