#include "capture/parameters.h"

#include "base/text.h"

namespace crownfit {
namespace {

using Range = std::array<double, 2>;
constexpr double kNarrowest = 1e-6;  // of a prior

Range PhysicalRange(const ParameterRow& row) { return {row.least, row.most}; }

/// One number, or one per channel, inside the range.
Spectrum ReadValues(const JsonNode& node, const ParameterRow& row, const Range& range, int channels) {
  const Spectrum values =
      node.IsArray() ? Spectrum(node.Numbers(static_cast<size_t>(channels))) : Spectrum(channels, node.Number());
  for (const double value : values) {
    if (value >= range[0] && value <= range[1]) continue;
    node.Fail(Printed("%g is outside [%g, %g]", value, range[0], range[1]) +
                  (std::string(row.unit) == "1" ? "" : std::string(" ") + row.unit),
              "Check the sign, the decimal point and the unit.");
  }
  return values;
}

}  // namespace

const char* Word(Sharing sharing) {
  switch (sharing) {
    case Sharing::kOneValue:
      return "channels";
    case Sharing::kNone:
      return "none";
    case Sharing::kPowerLaw:
      return "power_law";
  }
  return "";
}

std::optional<Sharing> SharingOf(const std::string& word) {
  for (const Sharing s : {Sharing::kOneValue, Sharing::kNone, Sharing::kPowerLaw})
    if (word == Word(s)) return s;
  return std::nullopt;
}

Spectrum ReadPhysicalValues(const JsonNode& node, const ParameterRow& row, int channels) {
  const Spectrum values = ReadValues(node, row, PhysicalRange(row), channels);
  if (!row.per_channel && !values.IsGrey()) node.Fail("this parameter has one value, not one per channel");
  return values;
}

Spectrum ReadSpectrum(const JsonNode& node, double most, int channels) {
  if (node.IsNumber())
    return channels > 0 ? Spectrum(channels, node.Number(0.0, most)) : Spectrum(node.Number(0.0, most));
  const auto items = node.Items();
  if (items.empty() || items.size() > kMostChannels || (channels > 0 && static_cast<int>(items.size()) != channels))
    node.Fail(channels > 0 ? Printed("expected %d numbers, found %zu", channels, items.size())
                           : Printed("expected one number per channel, found %zu", items.size()));
  std::vector<double> values;
  for (const JsonNode& item : items) values.push_back(item.Number(0.0, most));
  return Spectrum(values);
}

JsonValue SpectrumJson(const Spectrum& values) {
  if (values.size() == 0) return values[0];
  return values.list();
}

ParameterSpec DefaultSpec(const ParameterRow& row, int channels) {
  ParameterSpec spec;
  spec.value = Spectrum(channels, row.initial);
  spec.low = row.low;
  spec.high = row.high;
  spec.sharing = row.per_channel ? Sharing::kNone : Sharing::kOneValue;
  return spec;
}

ParameterSpec ReadParameterSpec(const JsonNode& node, const ParameterRow& row, int channels) {
  ParameterSpec spec = DefaultSpec(row, channels);
  spec.stated = true;
  const auto read = [&](const JsonNode& stated, const Range& range) {
    if (stated.IsArray() && !row.per_channel) stated.Fail("this parameter has one value, not one per channel");
    spec.value = ReadValues(stated, row, range, channels);
    if (stated.IsNumber()) spec.sharing = Sharing::kOneValue;
  };
  if (!node.IsObject()) {
    read(node, PhysicalRange(row));
    return spec;
  }
  const JsonObject object(node, {"fixed", "initial", "bounds", "prior", "shared"});
  const auto fixed = object.Find("fixed"), initial = object.Find("initial");
  if (fixed && initial) node.Fail("\"fixed\" and \"initial\" exclude each other", "Keep one of them.");
  if (!fixed && !initial) node.Fail("expected {\"fixed\": v} or {\"initial\": v}");
  spec.fixed = fixed.has_value();
  if (fixed) read(*fixed, PhysicalRange(row));
  if (initial) read(*initial, {row.low, row.high});
  if (const auto shared = object.Find("shared")) {
    spec.sharing =
        *SharingOf(shared->OneOf({Word(Sharing::kOneValue), Word(Sharing::kNone), Word(Sharing::kPowerLaw)}));
    if (!row.per_channel && spec.sharing != Sharing::kOneValue)
      shared->Fail("this parameter has one value for all channels");
  }
  if (const auto bounds = object.Find("bounds")) {
    const auto v = bounds->Numbers(2);
    if (!(v[0] < v[1])) bounds->Fail("the lower bound must be smaller than the upper bound");
    if (v[0] < row.low || v[1] > row.high)
      bounds->Fail("the bounds reach outside [" + std::to_string(row.low) + ", " + std::to_string(row.high) + "] " +
                   row.unit);
    spec.low = v[0];
    spec.high = v[1];
    for (double value : spec.value) {
      if (!spec.fixed && (value < spec.low || value > spec.high))
        bounds->Fail("the initial value lies outside the bounds");
    }
  }
  if (const auto prior = object.Find("prior")) {
    const JsonObject p(*prior, {"mean", "log_stddev"});
    const auto [low, high] = PhysicalRange(row);
    spec.prior_mean = p.Require("mean").Number(low, high);
    spec.prior_log_stddev = p.Require("log_stddev").Number(kNarrowest, 1.0 / kNarrowest);
    if (row.scale == Scale::kLog) p.Require("mean").Positive();
  }
  return spec;
}

std::vector<std::string> ParameterKeys(Owner owner) {
  std::vector<std::string> keys;
  for (const auto& row : kParameters)
    if (row.owner == owner) keys.emplace_back(row.key);
  return keys;
}

}  // namespace crownfit
