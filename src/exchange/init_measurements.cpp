#include "exchange/init_measurements.h"

#include <algorithm>
#include <map>
#include <optional>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/text.h"
#include "capture/capture.h"
#include "exchange/rxt_file.h"

namespace crownfit {
namespace {

/// One sample's readings in each band.
struct Sample {
  std::vector<RxtRow> bands;
};

/// Linear interpolation between the neighbours of a wavelength.
RxtRow RowAt(const MeasuredParts& parts, const std::map<double, RxtRow>& rows, double wavelength_nm) {
  const auto above = rows.lower_bound(wavelength_nm);
  if (above != rows.end() && above->first == wavelength_nm) return above->second;
  if (above == rows.begin() || above == rows.end())
    throw InputError(parts.file, "",
                     "the file has no readings at " + Number(wavelength_nm, 6) + " nm, but from " +
                         Number(rows.begin()->first, 6) + " to " + Number(rows.rbegin()->first, 6),
                     "Choose other bands, such as --wavelengths " + Number(rows.rbegin()->first, 6) + "," +
                         Number(rows.rbegin()->first, 6) + "," + Number(rows.begin()->first, 6) + ".");
  const auto below = std::prev(above);
  const double share = (wavelength_nm - below->first) / (above->first - below->first);
  RxtRow row = below->second;
  const auto between = [&](std::optional<double>& to, const std::optional<double>& next) {
    if (to && next) to = *to + share * (*next - *to);
  };
  between(row.reflectance, above->second.reflectance);
  between(row.transmittance, above->second.transmittance);
  return row;
}

std::vector<Sample> SamplesByWavelength(const MeasuredParts& parts, const RxtFile& file,
                                        const std::vector<double>& wavelengths_nm) {
  std::map<double, std::map<double, RxtRow>> by_thickness;
  for (const RxtRow& row : file.rows)
    if (!by_thickness[row.thickness_mm].emplace(*row.wavelength_nm, row).second)
      throw InputError(
          parts.file, "",
          "two rows have " + Number(*row.wavelength_nm, 6) + " nm at " + Number(row.thickness_mm, 6) + " mm",
          "Replace them by their mean, or make one file per sample.");
  std::vector<Sample> samples;
  for (const auto& [mm, rows] : by_thickness) {
    Sample sample;
    for (const double nm : wavelengths_nm) sample.bands.push_back(RowAt(parts, rows, nm));
    samples.push_back(sample);
  }
  return samples;
}

Sample SampleOfRows(const MeasuredParts& parts, const RxtFile& file) {
  const std::string has = "the file has " + std::to_string(file.rows.size()) + " rows without wavelengths";
  std::vector<int> rows = parts.rows;
  if (rows.empty() && file.rows.size() == 1) rows = {1};
  if (rows.empty() || rows.size() > kMostChannels)
    throw InputError(parts.file, "--rows", has, "Give --rows N for all bands, or --rows N,N,N for one row each.");
  if (rows.size() == 1) rows.resize(3, rows[0]);
  Sample sample;
  for (size_t c = 0; c < rows.size(); ++c) {
    if (rows[c] < 1 || rows[c] > static_cast<int>(file.rows.size()))
      throw InputError(parts.file, "--rows", has + ", but " + std::to_string(rows[c]) + " is not one of them");
    sample.bands.push_back(file.rows[static_cast<size_t>(rows[c]) - 1]);
  }
  return sample;
}

/// The value, which must be the same in all bands of all samples.
double TheOne(const MeasuredParts& parts, const std::vector<Sample>& samples, const char* what, auto value) {
  for (const Sample& s : samples)
    for (const RxtRow& row : s.bands)
      if (value(row) != value(samples[0].bands[0]))
        throw InputError(parts.file, "", std::string(what) + " differs between the rows that are used",
                         "Make one file per sample.");
  return value(samples[0].bands[0]);
}

}  // namespace

void InitMeasuredCapture(const MeasuredParts& parts, const std::filesystem::path& folder) {
  using Object = JsonValue::Object;
  const RxtFile file = ReadRxt(parts.file);
  const bool has_wavelengths =
      std::all_of(file.rows.begin(), file.rows.end(), [](const RxtRow& r) { return r.wavelength_nm.has_value(); });
  Capture defaults;
  std::vector<double> wavelengths_nm = defaults.wavelengths_nm;
  if (!parts.wavelengths_nm.empty()) {
    if (!has_wavelengths)
      throw InputError(parts.file, "--wavelengths", "the file has no wavelengths", "Give --rows instead.");
    if (parts.wavelengths_nm.size() > kMostChannels)
      throw InputError("", "--wavelengths", Printed("expected at most %d wavelengths", kMostChannels));
    wavelengths_nm = parts.wavelengths_nm;
    if (wavelengths_nm.size() == 1) wavelengths_nm.resize(3, wavelengths_nm[0]);
  }
  if (has_wavelengths && !parts.rows.empty())
    throw InputError(parts.file, "--rows", "the file has wavelengths", "Give --wavelengths instead.");
  const std::vector<Sample> samples = has_wavelengths ? SamplesByWavelength(parts, file, wavelengths_nm)
                                                      : std::vector<Sample>{SampleOfRows(parts, file)};
  const double ior = TheOne(parts, samples, "the index of refraction", [](const RxtRow& r) { return r.ior; });
  const double asymmetry =
      TheOne(parts, samples, "g", [&](const RxtRow& r) { return r.asymmetry.value_or(parts.asymmetry); });

  JsonValue::Array channels, measurements;
  const size_t bands = samples[0].bands.size();
  for (size_t c = 0; c < bands; ++c) {
    const double nm = c < wavelengths_nm.size() ? wavelengths_nm[c] : 540.0;
    channels.push_back(Object{{"name", bands == 3 ? defaults.channel_names[c] : "band " + std::to_string(c + 1)},
                              {"wavelength_nm", nm}});
  }
  for (const Sample& s : samples) {
    const double mm = TheOne(parts, {s}, "the thickness", [](const RxtRow& r) { return r.thickness_mm; });
    Object measurement{
        {"name", Number(mm, 6) + " mm"}, {"thickness_mm", mm}, {"geometry", "0/d"}, {"specular", "included"}};
    if (file.slide_ior > 1)
      measurement.emplace_back("slide", Object{{"ior", file.slide_ior}, {"thickness_mm", file.slide_thickness_mm}});
    const auto add = [&](const char* key, std::optional<double> RxtRow::*reading) {
      std::vector<double> values;
      for (const RxtRow& row : s.bands)
        if (row.*reading) values.push_back(*(row.*reading));
      if (values.size() == bands) measurement.emplace_back(key, Object{{"value", values}, {"stddev", parts.stddev}});
    };
    add("reflectance", &RxtRow::reflectance);
    add("transmittance", &RxtRow::transmittance);
    measurements.push_back(measurement);
  }
  const Object layer{{"name", parts.layer},
                     {"ior", Object{{"fixed", ior}}},
                     {"g", Object{{"fixed", asymmetry}}},
                     {"reduced_scattering_per_mm", Object{{"initial", 2.0}, {"shared", "none"}}},
                     {"absorption_per_mm", Object{{"initial", 0.05}, {"shared", "none"}}}};
  WriteTextFile(folder / "capture.json", ToJsonText(Object{{"format", "crownfit-capture/1"},
                                                           {"object", Object{{"layers", JsonValue::Array{layer}}}},
                                                           {"channels", channels},
                                                           {"measurements", measurements}}));
}

}  // namespace crownfit
