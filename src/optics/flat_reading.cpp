#include "optics/flat_reading.h"

#include <optional>

#include "capture/capture.h"
#include "optics/adding_doubling.h"
#include "optics/aperture.h"

namespace crownfit {
namespace {

bool IsInContact(const Capture& capture, const FlatMeasurement& m) {
  return m.backing && capture.backings[*m.backing].in_contact;
}

constexpr AddingDoublingOptions kFine{24}, kCoarse{12};  // waves of an aperture are known to per cents only

/// Alike measurements in one band, between glass slides where they have them.
class Samples {
 public:
  Samples(const Capture& capture, const std::vector<FlatMeasurement>& alike, int channel)
      : channel_(channel), geometry_(alike[0].geometry), is_in_contact_(IsInContact(capture, alike[0])) {
    if (alike[0].slide) slide_ = {alike[0].slide->ior, 0.0, 0.0, 0.0, 0.0, alike[0].slide->thickness_mm};
    for (const FlatMeasurement& m : alike) {
      std::vector<double> mm = m.thickness_mm;
      if (slide_) {
        mm.insert(mm.begin(), slide_->thickness_mm);
        mm.push_back(slide_->thickness_mm);
      }
      thicknesses_mm_.push_back(mm);
      behind_.push_back(m.backing ? capture.backings[*m.backing].reflectance[channel] : 0.0);
    }
  }
  Slab SlabOf(const Material& material) const {
    Slab slab = crownfit::SlabOf(material, channel_);
    slab.backing_contact = is_in_contact_;
    if (slide_) {
      slab.layers.insert(slab.layers.begin(), *slide_);
      slab.layers.push_back(*slide_);
    }
    return slab;
  }
  const std::vector<std::vector<double>>& thicknesses_mm() const { return thicknesses_mm_; }
  double Behind(size_t measurement) const { return behind_[measurement]; }
  std::vector<ViewedSlab> Viewed(const Slab& slab, const AddingDoublingOptions& directions) const {
    return ViewSlab(slab, thicknesses_mm_, geometry_, directions);
  }

 private:
  int channel_;
  MeasuredAt geometry_;
  bool is_in_contact_;
  std::optional<SlabLayer> slide_;
  std::vector<std::vector<double>> thicknesses_mm_;
  std::vector<double> behind_;
};

std::vector<SlabLayer> Difference(const Slab& a, const Slab& b) {
  std::vector<SlabLayer> layers;
  for (size_t l = 0; l < a.layers.size(); ++l) {
    const SlabLayer &to = a.layers[l], &from = b.layers[l];
    layers.push_back({to.ior - from.ior, to.g - from.g, to.isotropic_fraction - from.isotropic_fraction,
                      to.scattering_per_mm - from.scattering_per_mm, to.absorption_per_mm - from.absorption_per_mm,
                      to.thickness_mm - from.thickness_mm});
  }
  return layers;
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
  const Samples samples(capture, alike, channel);
  const Slab slab = samples.SlabOf(material);
  const std::vector<ViewedSlab> wide = samples.Viewed(slab, kFine);
  std::vector<BandReading> readings;
  for (size_t i = 0; i < alike.size(); ++i)
    readings.push_back({wide[i].Over(samples.Behind(i)) + (alike[i].has_specular ? wide[i].mirrored : 0.0),
                        wide[i].transmittance, 0.0});
  if (!alike[0].aperture_mm) return readings;
  for (size_t i = 0; i < alike.size(); ++i) readings[i].edge_loss = wide[i].Over(samples.Behind(i));
  for (const ApertureWave& wave : ApertureWaves(*alike[0].aperture_mm)) {
    const std::vector<ViewedSlab> seen = samples.Viewed(UnderWave(slab, wave.wave_number_per_mm), kCoarse);
    for (size_t i = 0; i < alike.size(); ++i) readings[i].edge_loss -= wave.weight * seen[i].Over(samples.Behind(i));
  }
  for (BandReading& r : readings) r.reflectance -= r.edge_loss;
  return readings;
}

std::vector<std::vector<BandReading>> ReadBandChanges(const Capture& capture, const std::vector<FlatMeasurement>& alike,
                                                      const Material& material, int channel,
                                                      const std::vector<MaterialStep>& steps) {
  const Samples samples(capture, alike, channel);
  const Slab slab = samples.SlabOf(material);
  std::vector<Slab> from, to;
  for (const MaterialStep& step : steps) {
    from.push_back(samples.SlabOf(step.from));
    to.push_back(samples.SlabOf(step.to));
  }
  std::vector<std::vector<BandReading>> readings(alike.size(), std::vector<BandReading>(steps.size()));
  /// Calls `take` with every measurement's view and its change by every step.
  const auto for_every = [&](double wave_number, const AddingDoublingOptions& directions, auto&& take) {
    const Slab here = UnderWave(slab, wave_number);
    std::vector<std::vector<SlabLayer>> changes;
    for (size_t k = 0; k < steps.size(); ++k)
      changes.push_back(Difference(UnderWave(to[k], wave_number), UnderWave(from[k], wave_number)));
    const std::vector<ViewedSlab> seen = samples.Viewed(here, directions);
    const auto more = ViewSlabChanges(here, samples.thicknesses_mm(), alike[0].geometry, changes, directions);
    for (size_t i = 0; i < alike.size(); ++i)
      for (size_t k = 0; k < steps.size(); ++k)
        take(readings[i][k], i, more[i][k], seen[i].ChangeOver(samples.Behind(i), more[i][k]));
  };
  for_every(0.0, kFine, [&](BandReading& r, size_t i, const ViewedSlab& more, double over) {
    r = {over + (alike[i].has_specular ? more.mirrored : 0.0), more.transmittance, alike[i].aperture_mm ? over : 0.0};
  });
  if (!alike[0].aperture_mm) return readings;
  for (const ApertureWave& wave : ApertureWaves(*alike[0].aperture_mm))
    for_every(wave.wave_number_per_mm, kCoarse,
              [&](BandReading& r, size_t, const ViewedSlab&, double over) { r.edge_loss -= wave.weight * over; });
  for (auto& of_measurement : readings)
    for (BandReading& r : of_measurement) r.reflectance -= r.edge_loss;
  return readings;
}

std::vector<const Reading*> ReadingsOf(const FlatMeasurement& m) {
  std::vector<const Reading*> readings;
  for (const auto* reading : {&m.reflectance, &m.transmittance, &m.lab})
    if (*reading) readings.push_back(&**reading);
  return readings;
}

std::vector<double> PredictedValues(const FlatMeasurement& m, std::span<const BandReading> bands) {
  std::vector<double> values;
  if (m.reflectance)
    for (const BandReading& b : bands) values.push_back(b.reflectance);
  if (m.transmittance)
    for (const BandReading& b : bands) values.push_back(b.transmittance);
  if (m.lab) {
    Spectrum reflectance(static_cast<int>(bands.size()), 0.0);
    for (int c = 0; c < reflectance.size(); ++c) reflectance[c] = bands[static_cast<size_t>(c)].reflectance;
    const glm::dvec3 lab = LabFromLinearRgb(m.colour.LinearRgb(reflectance));
    for (int c = 0; c < 3; ++c) values.push_back(lab[c]);
  }
  return values;
}

}  // namespace crownfit
