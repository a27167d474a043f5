#include "capture/colour_file.h"

#include <cmath>

#include "base/json_file.h"
#include "capture/parameters.h"

namespace crownfit {

namespace {

/// Refuses rows that are not linearly independent: they would show different colours as one.
void RequireIndependent(const JsonNode& node, const std::array<std::vector<double>, 3>& rows) {
  constexpr double kLeast = 1e-6;  // determinant of rows of length 1: real cameras are above 0.01
  glm::dmat3 products(0.0);
  for (int r = 0; r < 3; ++r)
    for (int q = 0; q < 3; ++q) {
      double product = 0, square_r = 0, square_q = 0;
      for (size_t c = 0; c < rows[r].size(); ++c) {
        product += rows[r][c] * rows[q][c];
        square_r += rows[r][c] * rows[r][c], square_q += rows[q][c] * rows[q][c];
      }
      products[r][q] = product / (std::sqrt(square_r) * std::sqrt(square_q));
    }
  if (!(glm::determinant(products) > kLeast * kLeast))  // also where a row is 0
    node.Fail("is singular: a row is zero, or follows from the others",
              "Make the file with crownfit calibrate colour.");
}

/// Three channels are called rgb in the keys.
const char* MatrixKey(int channels) { return channels == 3 ? "linear_rgb_from_sensor_rgb" : "linear_rgb_from_sensor"; }
const char* WhiteKey(int channels) { return channels == 3 ? "white_sensor_rgb" : "white_sensor"; }

JsonObject RootOf(const JsonFile& file, int channels) {
  return file.RootOfFormat("crownfit-colour/1", {MatrixKey(channels), WhiteKey(channels), "polynomial", "residual",
                                                 "quality", "provenance"});
}

}  // namespace

Spectrum ReadSensorWhite(const std::filesystem::path& path, int channels) {
  const JsonFile file(path);
  const JsonNode node = RootOf(file, channels).Require(WhiteKey(channels));
  const auto white = node.Items();
  if (static_cast<int>(white.size()) != channels) node.Fail("expected one value per channel");
  std::vector<double> values;
  for (const JsonNode& value : white) values.push_back(value.Positive());
  return Spectrum(values);
}

ColourTransform ReadColourTransform(const std::filesystem::path& path, int channels) {
  const JsonFile file(path);
  const JsonObject root = RootOf(file, channels);
  const auto rows_of = [](const JsonNode& node, size_t columns) {
    const auto rows = node.Items();
    if (rows.size() != 3) node.Fail("expected 3 rows of " + std::to_string(columns) + " numbers");
    std::array<std::vector<double>, 3> values;
    for (int r = 0; r < 3; ++r) values[r] = rows[r].Numbers(columns);
    return values;
  };
  ColourTransform transform;
  const JsonNode node = root.Require(MatrixKey(channels));
  const auto matrix = rows_of(node, static_cast<size_t>(channels));
  transform.columns.resize(static_cast<size_t>(channels));
  for (int r = 0; r < 3; ++r)
    for (size_t c = 0; c < transform.columns.size(); ++c) transform.columns[c][r] = matrix[r][c];
  if (channels >= 3) RequireIndependent(node, matrix);
  const auto polynomial = root.Find("polynomial");
  if (polynomial && channels != 3) polynomial->Fail("a root polynomial has three channels", "Remove the key.");
  if (polynomial) {
    const JsonObject spec(*polynomial, {"terms", "coefficients"});
    spec.Require("terms").OneOf({"root2"});
    const auto rows = rows_of(spec.Require("coefficients"), 6);
    RequireIndependent(spec.Require("coefficients"), rows);
    transform.root_polynomial.emplace();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 6; ++c) (*transform.root_polynomial)[c][r] = rows[r][c];
  }
  return transform;
}

BandColour ReadBandColour(const std::filesystem::path& file, int channels) {
  return {ReadColourTransform(file, channels), ReadSensorWhite(file, channels)};
}

JsonValue::Object ColourContent(const BandColour& colour) {
  const auto rows = [](const auto& columns) {
    JsonValue::Array all;
    for (int r = 0; r < 3; ++r) {
      std::vector<double> row;
      for (const glm::dvec3& column : columns) row.push_back(column[r]);
      all.emplace_back(row);
    }
    return all;
  };
  const ColourTransform& transform = colour.rgb_from_sensor;
  std::vector<glm::dvec3> columns = transform.columns;
  if (columns.empty()) columns = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const int channels = static_cast<int>(columns.size());
  JsonValue::Object content{{MatrixKey(channels), rows(columns)},
                            {WhiteKey(channels), SpectrumJson(colour.white_sensor.Expanded(channels))}};
  if (transform.root_polynomial)
    content.emplace_back("polynomial",
                         JsonValue::Object{{"terms", "root2"}, {"coefficients", rows(*transform.root_polynomial)}});
  return content;
}

}  // namespace crownfit
