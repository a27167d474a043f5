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

/// One sample's readings in the three bands.
struct Sample {
  std::array<RxtRow, kChannels> bands;
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
                                        const std::array<double, kChannels>& wavelengths_nm) {
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
    for (int c = 0; c < kChannels; ++c) sample.bands[c] = RowAt(parts, rows, wavelengths_nm[c]);
    samples.push_back(sample);
  }
  return samples;
}

Sample SampleOfRows(const MeasuredParts& parts, const RxtFile& file) {
  const std::string has = "the file has " + std::to_string(file.rows.size()) + " rows without wavelengths";
  std::vector<int> rows = parts.rows;
  if (rows.empty() && file.rows.size() == 1) rows = {1};
  if (rows.size() != 1 && rows.size() != kChannels)
    throw InputError(parts.file, "--rows", has, "Give --rows N for all bands, or --rows N,N,N for one row each.");
  rows.resize(kChannels, rows[0]);
  Sample sample;
  for (int c = 0; c < kChannels; ++c) {
    if (rows[c] < 1 || rows[c] > static_cast<int>(file.rows.size()))
      throw InputError(parts.file, "--rows", has + ", but " + std::to_string(rows[c]) + " is not one of them");
    sample.bands[c] = file.rows[static_cast<size_t>(rows[c]) - 1];
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
  std::array<double, kChannels> wavelengths_nm = defaults.wavelengths_nm;
  if (!parts.wavelengths_nm.empty()) {
    if (!has_wavelengths)
      throw InputError(parts.file, "--wavelengths", "the file has no wavelengths", "Give --rows instead.");
    if (parts.wavelengths_nm.size() != 1 && parts.wavelengths_nm.size() != kChannels)
      throw InputError("", "--wavelengths", "expected one wavelength, or one for each of the three bands");
    for (size_t c = 0; c < kChannels; ++c)
      wavelengths_nm[c] = parts.wavelengths_nm[parts.wavelengths_nm.size() == 1 ? 0 : c];
  }
  if (has_wavelengths && !parts.rows.empty())
    throw InputError(parts.file, "--rows", "the file has wavelengths", "Give --wavelengths instead.");
  const std::vector<Sample> samples = has_wavelengths ? SamplesByWavelength(parts, file, wavelengths_nm)
                                                      : std::vector<Sample>{SampleOfRows(parts, file)};
  const double ior = TheOne(parts, samples, "the index of refraction", [](const RxtRow& r) { return r.ior; });
  const double asymmetry =
      TheOne(parts, samples, "g", [&](const RxtRow& r) { return r.asymmetry.value_or(parts.asymmetry); });

  JsonValue::Array channels, measurements;
  for (int c = 0; c < kChannels; ++c)
    channels.push_back(Object{{"name", defaults.channel_names[c]}, {"wavelength_nm", wavelengths_nm[c]}});
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
      if (values.size() == kChannels)
        measurement.emplace_back(key, Object{{"value", values}, {"stddev", parts.stddev}});
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
