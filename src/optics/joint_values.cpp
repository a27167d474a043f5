#include "optics/joint_values.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/random.h"

namespace crownfit {
namespace {

/// "enamel.absorption_per_mm[R]", "surface.roughness". Absent where the material has no such layer.
std::optional<JointValues::Entry> EntryNamed(const JsonNode& node, const Material& material,
                                             const std::vector<std::string>& channel_names) {
  std::string name = node.String();
  std::optional<int> channel;
  if (const size_t open = name.rfind('['); name.ends_with(']') && open != name.npos) {
    const std::string of = name.substr(open + 1, name.size() - open - 2);
    const auto at = std::find(channel_names.begin(), channel_names.end(), of);
    if (at == channel_names.end()) node.Fail("there is no channel called '" + of + "'");
    channel = static_cast<int>(at - channel_names.begin());
    name.resize(open);
  }
  const size_t dot = name.rfind('.');
  const std::string owner = name.substr(0, dot), key = dot == name.npos ? "" : name.substr(dot + 1);
  const auto row = std::find_if(kParameters.begin(), kParameters.end(), [&](const ParameterRow& r) {
    return r.key == key && (r.owner == Owner::kSurface) == (owner == "surface");
  });
  if (row == kParameters.end()) node.Fail("there is no parameter called '" + name + "'");
  if (row->owner == Owner::kSurface) return JointValues::Entry{0, row->quantity, channel};
  for (size_t l = 0; l < material.layers.size(); ++l)
    if (material.layers[l].name == owner) return JointValues::Entry{l, row->quantity, channel};
  return std::nullopt;
}

/// `count` rows of as many numbers, symmetric, with 1 on the diagonal.
std::vector<std::vector<double>> ReadCorrelation(const JsonNode& node, size_t count) {
  constexpr double kRounding = 1e-6;
  const auto items = node.Items();
  if (items.size() != count) node.Fail("expected a row for each of \"names\"");
  std::vector<std::vector<double>> rows;
  for (size_t i = 0; i < count; ++i) {
    rows.push_back(items[i].Numbers(count));
    if (std::abs(rows[i][i] - 1.0) > kRounding) items[i].Fail("a value's correlation with itself is 1");
    for (size_t j = 0; j < i; ++j)
      if (std::abs(rows[i][j] - rows[j][i]) > kRounding)
        node.Fail("is not symmetric: row " + std::to_string(j + 1) + ", column " + std::to_string(i + 1) +
                      " differs from row " + std::to_string(i + 1) + ", column " + std::to_string(j + 1),
                  "Copy the block from the material.json of the fit.");
  }
  return rows;
}

/// Cholesky factor of a positive semidefinite matrix; a direction without variance has a column of zeros. Absent where
/// the matrix has a negative eigenvalue.
std::optional<std::vector<std::vector<double>>> FactorOf(const std::vector<std::vector<double>>& matrix) {
  constexpr double kRounding = 1e-12, kCutDigits = 1e-5;  // for files of the program, for files shortened by hand
  const size_t n = matrix.size();
  std::vector<std::vector<double>> factor(n, std::vector<double>(n, 0.0));
  for (size_t j = 0; j < n; ++j) {
    double left = matrix[j][j];
    for (size_t k = 0; k < j; ++k) left -= factor[j][k] * factor[j][k];
    if (left < -kCutDigits * matrix[j][j]) return std::nullopt;
    if (left <= kRounding * matrix[j][j]) continue;
    factor[j][j] = std::sqrt(left);
    for (size_t i = j + 1; i < n; ++i) {
      double sum = matrix[i][j];
      for (size_t k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
      factor[i][j] = sum / factor[j][j];
    }
  }
  return factor;
}

}  // namespace

JointValues ReadJointValues(const JsonNode& node, const Material& material,
                            const std::vector<std::string>& channel_names) {
  const JsonObject object(node, {"names", "stddev", "correlation"});
  const auto names = object.Require("names").Items();
  const std::vector<double> stddev = object.Require("stddev").Numbers(names.size());
  std::set<std::string> seen;
  for (const JsonNode& name : names)
    if (!seen.insert(name.String()).second)
      name.Fail("'" + name.String() + "' occurs twice", "Copy the block from the material.json of the fit.");
  const JsonNode correlation = object.Require("correlation");
  const auto rows = ReadCorrelation(correlation, names.size());
  JointValues joint;
  std::vector<size_t> kept;
  for (size_t i = 0; i < names.size(); ++i)
    if (const auto entry = EntryNamed(names[i], material, channel_names)) {
      joint.entries.push_back(*entry);
      kept.push_back(i);
    }
  std::vector<std::vector<double>> covariance(kept.size());
  for (size_t i = 0; i < kept.size(); ++i) {
    if (!(stddev[kept[i]] >= 0)) object.Require("stddev").Fail("a standard deviation can't be negative");
    for (const size_t j : kept) covariance[i].push_back(stddev[kept[i]] * rows[kept[i]][j] * stddev[j]);
  }
  const auto factor = FactorOf(covariance);
  if (!factor)
    correlation.Fail("these correlations contradict each other", "Copy the block from the material.json of the fit.");
  joint.factor = *factor;
  return joint;
}

Material Drawn(const JointValues& joint, Material material, uint64_t key) {
  std::vector<double> normal;
  for (size_t i = 0; i < joint.entries.size(); ++i) {
    normal.push_back(Gaussian(Key(key, i), 0));
    const auto& [layer, quantity, channel] = joint.entries[i];
    if (quantity == Quantity::kThickness || quantity == Quantity::kThicknessScale) continue;
    double off = 0;
    for (size_t j = 0; j <= i; ++j) off += joint.factor[i][j] * normal[j];
    const ParameterRow& row = RowOf(quantity);
    Spectrum& values = (row.owner == Owner::kSurface ? material.surface : material.layers[layer])[quantity];
    for (int c = 0; c < values.size(); ++c)
      if (!channel || *channel == c)
        values[c] = std::clamp(row.scale == Scale::kLog ? values[c] * std::exp(off) : values[c] + off,
                               std::min(row.low, values[c]), std::max(row.high, values[c]));
  }
  return material;
}

}  // namespace crownfit
