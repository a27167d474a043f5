#include "dental/predict_question.h"

#include <algorithm>
#include <charconv>
#include <numeric>

#include "base/error.h"
#include "base/text.h"
#include "capture/colour_file.h"
#include "dental/shades_file.h"
#include "photo/observer.h"

namespace crownfit {
namespace {

/// Reflectances, in the camera's bands, of what an option names.
Spectrum ReflectanceOf(const std::string& option, const std::string& text, const FlatQuestion& q,
                       const std::optional<std::filesystem::path>& tabs) {
  const int channels = q.material.material.channels();
  if (text == "black" || text == "white") return Spectrum(channels, text == "white" ? 1.0 : 0.0);
  Spectrum bands;
  if (text.starts_with("tab:")) {
    if (!tabs) throw InputError("", option, text + " needs a set of tabs", "Give it with --tabs FILE.");
    const ShadeSet set = ReadShades(*tabs);
    std::string known;
    const ShadeTab* found = nullptr;
    for (const ShadeTab& tab : set.tabs) {
      if (tab.name == text.substr(4)) found = &tab;
      known += (known.empty() ? "" : ", ") + tab.name;
    }
    if (!found) throw InputError(*tabs, "tabs", "there is no tab called '" + text.substr(4) + "'", "Known: " + known);
    bands = q.colour.Reflectance(LinearRgbFromLab(found->lab), channels);
  } else if (const auto rgb = text.starts_with("rgb:") ? ThreeNumbers(text.substr(4)) : std::nullopt) {
    if (channels != 3)
      throw InputError("", option, Printed("rgb: names three bands, but the material has %d", channels),
                       "Write L,a,b, tab:NAME, black or white.");
    bands = *rgb;
  } else if (const auto lab = ThreeNumbers(text)) {
    bands = q.colour.Reflectance(LinearRgbFromLab(*lab), channels);
  } else {
    throw InputError("", option, "'" + text + "' is no colour",
                     "Write L,a,b (as 68,1,18), rgb:R,G,B, tab:NAME, black or white.");
  }
  constexpr double kRounding = 0.02;
  for (int c = 0; c < channels; ++c)
    if (!(bands[c] >= -kRounding && bands[c] <= 1.0 + kRounding))
      throw InputError("", option,
                       "'" + text + "' reflects " + std::to_string(bands[c]) + " in band " +
                           q.channel_names[static_cast<size_t>(c)] + ", outside 0 to 1",
                       "No surface has this colour in these bands. Check that it is L*a*b* under D65.");
  return Min(Max(bands, Spectrum(0.0)), Spectrum(1.0));
}

double Millimetres(const std::string& option, const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0.001 && value <= 20.0))
    throw InputError("", option, "'" + text + "' is not a thickness in mm", "Write a number from 0.001 to 20.");
  return value;
}

std::vector<double> DesignOf(const std::string& text, const MaterialRecord& record, const std::filesystem::path& file) {
  const auto& layers = record.material.layers;
  std::vector<double> mm;
  std::string missing;
  for (size_t l = 0; l < layers.size(); ++l) {
    mm.push_back(layers[l][Quantity::kThickness][0]);
    if (!record.layers[l][static_cast<size_t>(Quantity::kThickness)].is_stated) missing = layers[l].name;
  }
  const bool is_total = !text.empty() && text.find('=') == std::string::npos;
  if (text.empty() || is_total) {
    if (!missing.empty() && !(is_total && layers.size() == 1))
      throw InputError(file, missing + ".thickness_mm", "the file does not state the thickness of this layer",
                       "Give it for each layer: --thickness " + missing + "=1.0,...");
    if (is_total) {
      const double scale = Millimetres("--thickness", text) / std::accumulate(mm.begin(), mm.end(), 0.0);
      for (double& v : mm) v *= scale;
    }
    return mm;
  }
  std::vector<bool> said(layers.size(), false);
  for (size_t at = 0; at <= text.size();) {
    const size_t end = std::min(text.find(',', at), text.size()), equals = std::min(text.find('=', at), end);
    const std::string name = text.substr(at, equals - at);
    const auto layer = std::find_if(layers.begin(), layers.end(), [&](const auto& l) { return l.name == name; });
    if (layer == layers.end() || equals == end) {
      std::string known;
      for (const auto& l : layers) known += (known.empty() ? "" : ", ") + l.name;
      throw InputError("", "--thickness", "'" + text.substr(at, end - at) + "' names no layer of the material",
                       "Write LAYER=MM; layers: " + known + ".");
    }
    const auto index = static_cast<size_t>(layer - layers.begin());
    if (said[index]) throw InputError("", "--thickness", "states the thickness of layer '" + name + "' twice");
    mm[index] = Millimetres("--thickness", text.substr(equals + 1, end - equals - 1));
    said[index] = true;
    at = end + 1;
  }
  for (size_t l = 0; l < layers.size(); ++l)
    if (!said[l])
      throw InputError("", "--thickness", "does not state the thickness of layer '" + layers[l].name + "'",
                       "State it for every layer.");
  return mm;
}

/// Both coefficients determine every figure: no default replaces a missing one.
MaterialRecord ReadOpticalRecord(const std::filesystem::path& file) {
  const MaterialRecord record = ReadMaterialRecord(file);
  for (size_t l = 0; l < record.layers.size(); ++l)
    for (const Quantity q : {Quantity::kReducedScattering, Quantity::kAbsorption, Quantity::kIor})
      if (!record.layers[l][static_cast<size_t>(q)].is_stated)
        throw InputError(file, record.material.layers[l].name + "." + RowOf(q).key,
                         "the file does not state this value", "Fit it, or write it into the file.");
  return record;
}

}  // namespace

FlatQuestion FlatQuestionOf(const LayUp& lay_up, const std::filesystem::path& material) {
  FlatQuestion q;
  q.material = ReadOpticalRecord(material);
  q.design_mm = DesignOf(lay_up.thickness, q.material, material);
  q.other_totals_mm = {0.5, 1.0, 1.5, 2.0};
  const int channels = q.material.material.channels();
  if (q.material.channel_names) q.channel_names = *q.material.channel_names;
  if (channels == 3) q.channel_names = {"R", "G", "B"};  // as the figures are named
  if (const auto& nm = q.material.wavelengths_nm) q.colour.rgb_from_sensor = ColourOfChannels(*nm);
  if (lay_up.colour) q.colour = ReadBandColour(*lay_up.colour, channels);
  q.black = ReflectanceOf("--black", lay_up.black, q, lay_up.tabs);
  q.white = ReflectanceOf("--white", lay_up.white, q, lay_up.tabs);
  q.stump = ReflectanceOf("--stump", lay_up.stump.empty() ? "black" : lay_up.stump, q, lay_up.tabs);
  q.target = ReflectanceOf("--target", lay_up.target, q, lay_up.tabs);
  for (int c = 0; c < channels; ++c)
    if (q.black[c] >= q.white[c]) throw InputError("", "--black", "is not darker than --white in every band");
  q.is_cemented = lay_up.cement != "air";
  q.stump_ior = lay_up.stump_ior;
  if (lay_up.cement_mm && (!q.is_cemented || lay_up.cement == "clear"))
    throw InputError("", "--cement-mm", "needs a cement with a material", "Give its material with --cement FILE.");
  q.cement_mm = lay_up.cement_mm.value_or(q.cement_mm);
  if (q.is_cemented && lay_up.cement != "clear") {
    q.cement = ReadOpticalRecord(lay_up.cement);
    if (q.cement->layers.size() != 1)
      throw InputError(lay_up.cement, "layers", "a cement must have one layer",
                       "Give the material.json of a cement, or clear, or air.");
    if (const auto& its = q.cement->wavelengths_nm, &nm = q.material.wavelengths_nm;
        its && nm && !AreSameBands(*its, *nm))
      throw InputError(lay_up.cement, "channels",
                       "its bands are " + BandsText(*its) + ", but those of the crown are " + BandsText(*nm),
                       "Give a cement's material of the same bands in the same order.");
  }
  if (lay_up.geometry == "d/8") {
    q.geometry = MeasuredAt::kD_8;
  } else if (lay_up.geometry != "45/0" && lay_up.geometry != "0/45") {
    throw InputError("", "--geometry", "'" + lay_up.geometry + "' is not known", "Known: 45/0, 0/45, d/8.");
  }
  q.aperture_mm = lay_up.aperture_mm;
  q.draws = lay_up.draws;
  q.seed = lay_up.seed;
  q.threads = lay_up.threads;
  return q;
}

std::vector<std::string> AssumptionsOf(const LayUp& lay_up, const FlatQuestion& q) {
  std::vector<std::string> said;
  said.push_back(
      lay_up.colour ? "colours from " + lay_up.colour->filename().string() + ", D65, 2 degrees"
      : q.material.material.channels() != 3
          ? (q.colour.rgb_from_sensor.columns.empty()
                 ? "the channels have no colour: L*a*b* is that of their mean, as grey"
                 : "colours of the spectrum by the CIE 1931 observer, D65, 2 degrees")
          : "the camera's bands are taken as linear sRGB (D65, 2 degrees); give --colour FILE for its true colours");
  if (const auto& nm = q.material.wavelengths_nm; nm && !lay_up.colour && nm->size() == 3 && !AreRedGreenBlue(*nm))
    said.push_back("the bands are not red, green and blue in this order (" + BandsText(*nm) +
                   "), so L*a*b*, differences and shades are in false colours");
  said.push_back(
      "measured at " + lay_up.geometry + ", without gloss, " +
      (q.aperture_mm ? "through an aperture, past whose edge light is lost" : "with the whole piece lit evenly"));
  if (!q.material.is_usable) said.push_back("the fit of this material is not usable");
  said.push_back(lay_up.stump.empty() ? "no --stump is given, so it is black" : "stump " + lay_up.stump);
  said.push_back(q.cement        ? "cemented with " + lay_up.cement
                 : q.is_cemented ? "cemented with clear cement, without air below"
                                 : "not cemented, with air below");
  said.push_back("black and white cards behind a gap of air");
  const bool is_uncertain = IsUncertain(q.material) || (q.cement && IsUncertain(*q.cement));
  const std::string edge = q.aperture_mm ? "5 % of the light lost past the aperture's edge" : "";
  if (!is_uncertain)
    said.push_back("the material states no standard deviations: " +
                   (edge.empty() ? "there are no intervals" : "intervals include " + edge + " only"));
  if (is_uncertain)
    said.push_back("intervals from " + std::to_string(q.draws) +
                   (q.material.joint ? " materials drawn from the joint distribution of the fit"
                                     : " materials drawn from the standard deviations, each parameter independently") +
                   (edge.empty() ? "" : ", and " + edge));
  return said;
}

}  // namespace crownfit
