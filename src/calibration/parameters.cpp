#include "calibration/parameters.h"

#include <cmath>

namespace crownfit {
namespace {

std::array<double, kChannels> ReadValue(const JsonNode& node, const ParameterRow& row, bool& one_value) {
  std::array<double, kChannels> value{};
  one_value = node.IsNumber();
  if (!one_value && !node.IsArray()) node.Number();  // complains about the type
  if (!one_value && !row.per_channel) node.Fail("this parameter has one value, not one per channel");
  const std::vector<double> numbers =
      one_value ? std::vector<double>(kChannels, node.Number()) : node.Numbers(size_t{kChannels});
  for (int c = 0; c < kChannels; ++c) {
    value[c] = numbers[c];
    // 0 is a meaningful fixed value of these: the white, the clear, the polished limit. Fits move in ln and keep above
    // the lower bound.
    const bool may_vanish = row.quantity == Quantity::kAbsorption || row.quantity == Quantity::kReducedScattering ||
                            row.quantity == Quantity::kRoughness;
    const double low = may_vanish ? 0.0 : row.low;
    if (value[c] < low || value[c] > row.high)
      node.Fail("the value is outside [" + std::to_string(low) + ", " + std::to_string(row.high) + "] " + row.unit);
  }
  return value;
}

}  // namespace

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
  bool one_value = true;
  if (node.IsNumber() || node.IsArray()) {
    spec.value = ReadValue(node, row, one_value);
    if (one_value) spec.sharing = Sharing::kOneValue;
    return spec;
  }
  const JsonObject object(node, {"fixed", "initial", "bounds", "prior", "shared"});
  const auto fixed = object.Find("fixed"), initial = object.Find("initial");
  if (fixed && initial) node.Fail("\"fixed\" and \"initial\" exclude each other", "Keep one of them.");
  if (!fixed && !initial) node.Fail("expected {\"fixed\": v} or {\"initial\": v}");
  spec.fixed = fixed.has_value();
  spec.value = ReadValue(spec.fixed ? *fixed : *initial, row, one_value);
  if (one_value) spec.sharing = Sharing::kOneValue;
  if (const auto shared = object.Find("shared")) {
    const std::string word = shared->OneOf({"channels", "none", "power_law"});
    spec.sharing = word == "channels" ? Sharing::kOneValue : word == "none" ? Sharing::kNone : Sharing::kPowerLaw;
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
    spec.prior_mean = p.Require("mean").Number();
    spec.prior_log_stddev = p.Require("log_stddev").Positive();
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
