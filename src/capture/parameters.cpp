#include "capture/parameters.h"

#include "base/text.h"

namespace crownfit {
namespace {

using Range = std::array<double, 2>;
constexpr double kNarrowest = 1e-6;  // of a prior

Range PhysicalRange(const ParameterRow& row) { return {row.least, row.most}; }

/// One number, or one per channel, inside the range.
std::array<double, kChannels> ReadValues(const JsonNode& node, const ParameterRow& row, const Range& range) {
  const std::vector<double> numbers =
      node.IsArray() ? node.Numbers(size_t{kChannels}) : std::vector<double>(kChannels, node.Number());
  std::array<double, kChannels> values{};
  for (int c = 0; c < kChannels; ++c) {
    values[c] = numbers[c];
    if (values[c] >= range[0] && values[c] <= range[1]) continue;
    node.Fail(Printed("%g is outside [%g, %g]", values[c], range[0], range[1]) +
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

std::array<double, kChannels> ReadPhysicalValues(const JsonNode& node, const ParameterRow& row) {
  const std::array<double, kChannels> values = ReadValues(node, row, PhysicalRange(row));
  if (!row.per_channel && (values[1] != values[0] || values[2] != values[0]))
    node.Fail("this parameter has one value, not one per channel");
  return values;
}

ParameterSpec DefaultSpec(const ParameterRow& row) {
  ParameterSpec spec;
  spec.value.fill(row.initial);
  spec.low = row.low;
  spec.high = row.high;
  spec.sharing = row.per_channel ? Sharing::kNone : Sharing::kOneValue;
  return spec;
}

ParameterSpec ReadParameterSpec(const JsonNode& node, const ParameterRow& row) {
  ParameterSpec spec = DefaultSpec(row);
  spec.stated = true;
  const auto read = [&](const JsonNode& stated, const Range& range) {
    if (stated.IsArray() && !row.per_channel) stated.Fail("this parameter has one value, not one per channel");
    spec.value = ReadValues(stated, row, range);
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
