#include "exchange/mitsuba_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace crownfit {

std::vector<double> NumbersOf(const MitsubaNode& node, const std::string& text) {
  std::vector<double> numbers;
  for (size_t at = 0; (at = text.find_first_not_of(" ,\t\r\n", at)) != text.npos;) {
    const size_t end = std::min(text.find_first_of(" ,\t\r\n", at), text.size());
    double value = 0;
    const char* first = text.data() + at + (text[at] == '+');
    const auto [stop, error] = std::from_chars(first, text.data() + end, value);
    if (error != std::errc() || stop != text.data() + end || !std::isfinite(value) || std::abs(value) > 1e30)
      node.Fail("'" + text.substr(at, std::min<size_t>(end - at, 40)) + "' is no number");
    numbers.push_back(value);
    at = end;
  }
  return numbers;
}

double NumberOf(const MitsubaNode& node, const std::string& attribute, std::optional<double> otherwise) {
  const std::string* text = node.Find(attribute);
  if (!text && otherwise) return *otherwise;
  if (!text) node.Fail("has no attribute " + attribute);
  const std::vector<double> numbers = NumbersOf(node, *text);
  if (numbers.size() != 1) node.Fail("expected one number in " + attribute);
  return numbers[0];
}

glm::dvec3 VectorOf(const MitsubaNode& node, double otherwise) {
  const std::string* value = node.Find("value");
  if (!value) return {NumberOf(node, "x", otherwise), NumberOf(node, "y", otherwise), NumberOf(node, "z", otherwise)};
  const std::vector<double> v = NumbersOf(node, *value);
  if (v.size() == 1) return glm::dvec3(v[0]);
  if (v.size() != 3) node.Fail("expected three numbers");
  return {v[0], v[1], v[2]};
}

glm::dvec3 VectorOf(const MitsubaNode& node, const char* attribute) {
  const std::string* text = node.Find(attribute);
  if (!text) node.Fail(std::string("has no attribute ") + attribute);
  const std::vector<double> v = NumbersOf(node, *text);
  if (v.size() != 3) node.Fail(std::string("expected three numbers in ") + attribute);
  return {v[0], v[1], v[2]};
}

namespace {

glm::dmat4 LookAt(const MitsubaNode& node) {
  const glm::dvec3 origin = VectorOf(node, "origin"), way = VectorOf(node, "target") - origin,
                   up = VectorOf(node, "up");
  const glm::dvec3 left = glm::cross(up, way);
  if (!(glm::length(left) > 1e-9 * glm::length(up) * glm::length(way)))
    node.Fail("up lies along the line from origin to target", "State another up.");
  const glm::dvec3 z = glm::normalize(way), x = glm::normalize(left);
  return {glm::dvec4(x, 0), glm::dvec4(glm::cross(z, x), 0), glm::dvec4(z, 0), glm::dvec4(origin, 1)};
}

glm::dmat4 MatrixOf(const MitsubaNode& node) {
  const std::string* value = node.Find("value");
  const std::vector<double> v = value ? NumbersOf(node, *value) : std::vector<double>();
  if (v.size() != 16 && v.size() != 9) node.Fail("expected 16 or 9 numbers, row by row");
  const size_t side = v.size() == 16 ? 4 : 3;
  glm::dmat4 matrix(1.0);
  for (size_t r = 0; r < side; ++r)
    for (size_t c = 0; c < side; ++c) matrix[static_cast<int>(c)][static_cast<int>(r)] = v[side * r + c];
  if (matrix[0][3] != 0 || matrix[1][3] != 0 || matrix[2][3] != 0 || matrix[3][3] != 1)
    node.Fail("the last row must be 0 0 0 1");
  return matrix;
}

}  // namespace

glm::dmat4 StepOf(const MitsubaNode& node) {
  if (node.tag == "translate") return glm::translate(glm::dmat4(1.0), VectorOf(node));
  if (node.tag == "scale") return glm::scale(glm::dmat4(1.0), VectorOf(node, 1.0));
  if (node.tag == "matrix") return MatrixOf(node);
  if (node.tag == "lookat") return LookAt(node);
  if (node.tag != "rotate") node.Fail("is no step of a transform", "Known: translate, rotate, scale, lookat, matrix.");
  const glm::dvec3 axis = VectorOf(node);
  if (!(std::abs(glm::length(axis) - 1) < 0.01))
    node.Fail("its axis does not have length 1, which makes Mitsuba 3 shear", "Divide x, y and z by its length.");
  return glm::rotate(glm::dmat4(1.0), glm::radians(NumberOf(node, "angle")), axis);
}

}  // namespace crownfit
