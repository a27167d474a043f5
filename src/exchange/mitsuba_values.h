#pragma once
// Numbers, vectors and transforms in the attributes of a scene of Mitsuba 3. All of them throw InputError, with the
// element's name, for what is none.

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "exchange/mitsuba_xml.h"

namespace crownfit {

/// The numbers of a text, between blanks or commas.
std::vector<double> NumbersOf(const MitsubaNode& node, const std::string& text);
double NumberOf(const MitsubaNode& node, const std::string& attribute, std::optional<double> otherwise = {});
/// Three numbers of `value`, one for all of them, or x, y and z.
glm::dvec3 VectorOf(const MitsubaNode& node, double otherwise = 0.0);
/// Three numbers of an attribute.
glm::dvec3 VectorOf(const MitsubaNode& node, const char* attribute);
/// One step of a <transform>.
glm::dmat4 StepOf(const MitsubaNode& node);

}  // namespace crownfit
