#include "capture/colour_file.h"

#include <cmath>

#include "base/json_file.h"

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

JsonObject RootOf(const JsonFile& file) {
  return file.RootOfFormat("crownfit-colour/1", {"linear_rgb_from_sensor_rgb", "white_sensor_rgb", "polynomial",
                                                 "residual", "quality", "provenance"});
}

}  // namespace

glm::dvec3 ReadSensorWhite(const std::filesystem::path& path) {
  const JsonFile file(path);
  const auto white = RootOf(file).Require("white_sensor_rgb").Items();
  if (white.size() != 3) RootOf(file).Require("white_sensor_rgb").Fail("expected one value per channel");
  return {white[0].Positive(), white[1].Positive(), white[2].Positive()};
}

ColourTransform ReadColourTransform(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root = RootOf(file);
  const auto rows_of = [](const JsonNode& node, size_t columns) {
    const auto rows = node.Items();
    if (rows.size() != 3) node.Fail("expected 3 rows of " + std::to_string(columns) + " numbers");
    std::array<std::vector<double>, 3> values;
    for (int r = 0; r < 3; ++r) values[r] = rows[r].Numbers(columns);
    return values;
  };
  ColourTransform transform;
  const auto matrix = rows_of(root.Require("linear_rgb_from_sensor_rgb"), 3);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) transform.matrix[c][r] = matrix[r][c];
  RequireIndependent(root.Require("linear_rgb_from_sensor_rgb"), matrix);
  if (const auto polynomial = root.Find("polynomial")) {
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

BandColour ReadBandColour(const std::filesystem::path& file) {
  return {ReadColourTransform(file), ReadSensorWhite(file)};
}

JsonValue::Object ColourContent(const BandColour& colour) {
  const auto rows = [](auto column_of, int columns) {
    JsonValue::Array all;
    for (int r = 0; r < 3; ++r) {
      std::vector<double> row;
      for (int c = 0; c < columns; ++c) row.push_back(column_of(c)[r]);
      all.emplace_back(row);
    }
    return all;
  };
  const ColourTransform& transform = colour.rgb_from_sensor;
  const glm::dvec3& white = colour.white_sensor;
  JsonValue::Object content{{"linear_rgb_from_sensor_rgb", rows([&](int c) { return transform.matrix[c]; }, 3)},
                            {"white_sensor_rgb", std::vector<double>{white.x, white.y, white.z}}};
  if (transform.root_polynomial)
    content.emplace_back(
        "polynomial",
        JsonValue::Object{{"terms", "root2"},
                          {"coefficients", rows([&](int c) { return (*transform.root_polynomial)[c]; }, 6)}});
  return content;
}

}  // namespace crownfit
