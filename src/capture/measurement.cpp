#include "capture/measurement.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "capture/colour_file.h"
#include "photo/observer.h"

namespace crownfit {
namespace {

/// One number for all, or one for each.
Spectrum ReadValues(const JsonNode& node, int count) {
  return node.IsNumber() ? Spectrum(count, node.Number()) : Spectrum(node.Numbers(static_cast<size_t>(count)));
}

/// `count`: channels, or 3 of L*, a* and b*.
std::optional<Reading> ReadReading(const JsonObject& o, const char* key, int count, double low, double high) {
  const auto node = o.Find(key);
  if (!node) return std::nullopt;
  const JsonObject object(*node, {"value", "stddev"});
  const Reading reading{ReadValues(object.Require("value"), count), ReadValues(object.Require("stddev"), count)};
  for (int c = 0; c < count; ++c) {
    if (!(reading.value[c] >= low && reading.value[c] <= high))
      object.Require("value").Fail("the value is outside [" + std::to_string(low) + ", " + std::to_string(high) + "]",
                                   low < -1 ? "State L*, a*, b*." : "State shares of the light, not per cent.");
    if (!(reading.stddev[c] > 0))
      object.Require("stddev").Fail("a reading's standard deviation must be positive",
                                    "State its repeatability and calibration together; 0.005 is usual for a sphere.");
  }
  return reading;
}

/// No more light may leave than arrives.
void CheckEnergy(const FlatMeasurement& m, const JsonObject& o) {
  if (!m.reflectance || !m.transmittance || m.aperture_mm) return;
  constexpr double kSure = 3.0;
  for (int c = 0; c < m.reflectance->value.size(); ++c) {
    const double sum = m.reflectance->value[c] + m.transmittance->value[c],
                 stddev = std::hypot(m.reflectance->stddev[c], m.transmittance->stddev[c]);
    if (sum > 1.0 + kSure * stddev)
      o.Require("reflectance")
          .Fail("reflectance and transmittance of '" + m.name + "' add up to " + std::to_string(sum) +
                    ", more than all light",
                "Check the standard, the correction of the sphere and the 100 % reading, or state larger errors.");
  }
}

}  // namespace

FlatMeasurement ReadFlatMeasurement(const JsonNode& node, const MeasurementContext& context) {
  const JsonObject o(node, {"name", "sample", "thickness_mm", "thickness_stddev_mm", "geometry", "specular", "backing",
                            "aperture_mm", "slide", "reflectance", "transmittance", "lab", "colour", "use"});
  FlatMeasurement m;
  const int channels = static_cast<int>(context.wavelengths_nm.size());
  m.colour.rgb_from_sensor = ColourOfChannels(context.wavelengths_nm);
  m.name = o.Require("name").String();
  if (const auto sample = o.Find("sample")) m.sample = sample->String();
  const JsonNode thickness = o.Require("thickness_mm");
  m.thickness_mm = thickness.IsNumber() ? std::vector<double>{thickness.Number()} : thickness.Numbers();
  if (m.thickness_mm.size() != context.layers)
    thickness.Fail("expected the thickness of each of " + std::to_string(context.layers) + " layers, outermost first");
  for (const double mm : m.thickness_mm)
    if (!(mm >= 1e-3 && mm <= 100.0)) thickness.Fail("a sample's thickness must lie in [0.001, 100] mm");
  if (const auto stddev = o.Find("thickness_stddev_mm")) {
    m.thickness_stddev_mm = stddev->Number(0.0, 10.0);
    if (m.thickness_stddev_mm > 0.3 * *std::min_element(m.thickness_mm.begin(), m.thickness_mm.end()))
      stddev->Fail("a thickness that is not known within 30 % is of no use", "Measure it with a micrometer.");
  }
  const std::map<std::string, MeasuredAt> geometries{
      {"0/d", MeasuredAt::k0_D}, {"d/0", MeasuredAt::k0_D}, {"45/0", MeasuredAt::k45_0}, {"0/45", MeasuredAt::k45_0},
      {"d/8", MeasuredAt::kD_8}, {"8/d", MeasuredAt::kD_8}, {"d/d", MeasuredAt::kD_D}};
  std::vector<std::string> words;
  for (const auto& [word, geometry] : geometries) words.push_back(word);
  const JsonNode geometry = o.Require("geometry");
  m.geometry = geometries.at(geometry.OneOf(words));
  if (const auto specular = o.Find("specular")) {
    m.has_specular = specular->OneOf({"included", "excluded"}) == "included";
    if (m.has_specular && m.geometry == MeasuredAt::k45_0)
      specular->Fail("a 45/0 instrument does not see the surface's reflection", "Remove the key.");
  }
  if (const auto backing = o.Find("backing"); backing && backing->String() != "none")
    m.backing = context.backing(*backing);
  if (const auto aperture = o.Find("aperture_mm")) m.aperture_mm = aperture->Number(0.5, 1000.0);
  if (const auto slide = o.Find("slide")) {
    const JsonObject glass(*slide, {"ior", "thickness_mm"});
    m.slide = Slide{glass.Require("ior").Number(1.0, 3.0), glass.Require("thickness_mm").Number(0.0, 20.0)};
    if (m.aperture_mm)
      slide->Fail("slides together with an aperture are not modelled", "Remove \"slide\" or \"aperture_mm\".");
  }
  m.reflectance = ReadReading(o, "reflectance", channels, -0.05, 1.2);
  m.transmittance = ReadReading(o, "transmittance", channels, -0.05, 1.2);
  m.lab = ReadReading(o, "lab", 3, -150, 150);
  if (!m.reflectance && !m.transmittance && !m.lab)
    node.Fail("'" + m.name + "' has no reading", "State \"reflectance\", \"transmittance\" or \"lab\".");
  if (m.lab && m.reflectance)
    o.Require("lab").Fail("reflectance and lab of one reading would count twice", "Keep one.");
  if (m.transmittance) {
    const JsonNode t = o.Require("transmittance");
    if (m.backing)
      t.Fail("a transmittance can't be measured over a backing",
             "Make it a measurement of its own, without a backing.");
    if (m.aperture_mm)
      t.Fail("the light lost past an aperture is modelled for reflectance only",
             "Make it a measurement of its own, without aperture_mm.");
    if (m.geometry != MeasuredAt::k0_D && m.geometry != MeasuredAt::kD_D)
      t.Fail("the geometry of a transmittance must be 0/d or d/d",
             "Make it a measurement of its own with \"geometry\": \"0/d\".");
  }
  CheckEnergy(m, o);
  if (const auto colour = o.Find("colour")) {
    if (!m.lab) colour->Fail("colour is only used with lab", "Remove the key.");
    m.colour = ReadBandColour(context.file(*colour), channels);
  }
  if (const auto use = o.Find("use")) m.is_holdout = use->OneOf({"fit", "holdout"}) == "holdout";
  return m;
}

}  // namespace crownfit
