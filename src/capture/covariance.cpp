#include "capture/covariance.h"

#include <cmath>
#include <string>

#include "base/linear_algebra.h"

namespace crownfit {

std::vector<double> ReadCovariance(const JsonNode& node, size_t size) {
  constexpr double kWidest = 1e11;  // mm2: half a turn, seen from 100 m
  constexpr double kOfRounding = 1e-6;
  const auto rows = node.Items();
  if (rows.size() != size) node.Fail("expected " + std::to_string(size) + " rows of as many numbers");
  std::vector<double> covariance;
  for (size_t r = 0; r < size; ++r) {
    const auto row = rows[r].Items();
    if (row.size() != size)
      rows[r].Fail("expected " + std::to_string(size) + " numbers, found " + std::to_string(row.size()));
    for (size_t c = 0; c < size; ++c) covariance.push_back(row[c].Number(r == c ? 0.0 : -kWidest, kWidest));
  }
  Eigen::MatrixXd correlation(size, size);
  for (size_t r = 0; r < size; ++r)
    for (size_t c = 0; c < size; ++c) {
      const double value = covariance[size * r + c], other = covariance[size * c + r];
      const double scale = std::sqrt(covariance[(size + 1) * r]) * std::sqrt(covariance[(size + 1) * c]);
      if (std::abs(value - other) > kOfRounding * scale)
        node.Fail("is not symmetric", "Row " + std::to_string(r + 1) + ", column " + std::to_string(c + 1) + ".");
      correlation(static_cast<int>(r), static_cast<int>(c)) = scale > 0 ? value / scale : r == c ? 1.0 : 0.0;
    }
  if (EigenOfSymmetric(correlation).values[0] < -kOfRounding)
    node.Fail("is not a covariance: a combination of its values has a negative variance");
  return covariance;
}

}  // namespace crownfit
