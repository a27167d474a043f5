#include "exchange/mitsuba_plugin.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "exchange/mitsuba_values.h"

namespace crownfit {

MitsubaPlugin::MitsubaPlugin(const MitsubaDocument& document, const MitsubaNode& node,
                             const std::vector<std::string>& known)
    : document_(document), node_(node) {
  const auto is_known = [&](const std::string& word) {
    return std::find(known.begin(), known.end(), word) != known.end();
  };
  for (const MitsubaNode& child : node.children) {
    const std::string tag = "<" + document.Target(child).tag + ">";
    if (is_known(child.name.empty() ? tag : child.name) || is_known(tag)) continue;
    child.Fail("has no equivalent in a capture, as part of " + node.Title(),
               tag == "<texture>" ? "State one colour in its place: <rgb name=\"" + child.name + "\" value=\"...\"/>."
                                  : "Remove it, if the photographs do not depend on it.");
  }
}

const MitsubaNode* MitsubaPlugin::Find(const std::string& name) const {
  const MitsubaNode* found = nullptr;
  for (const MitsubaNode& child : node_.children) {
    if (child.name != name) continue;
    if (found) child.Fail("is stated twice");
    found = &child;
  }
  return found ? &document_.Target(*found) : nullptr;
}

std::vector<const MitsubaNode*> MitsubaPlugin::Nested(const std::string& tag) const {
  std::vector<const MitsubaNode*> nested;
  for (const MitsubaNode& child : node_.children)
    if (const MitsubaNode& target = document_.Target(child); target.tag == tag) nested.push_back(&target);
  return nested;
}

const MitsubaNode* MitsubaPlugin::OnlyNested(const std::string& tag) const {
  const auto nested = Nested(tag);
  if (nested.size() > 1) nested[1]->Fail("is a second <" + tag + "> of " + node_.Title(), "Keep one.");
  return nested.empty() ? nullptr : nested[0];
}

std::optional<double> MitsubaPlugin::Number(const std::string& name, double low, double high) const {
  const MitsubaNode* found = Find(name);
  if (!found) return std::nullopt;
  if (found->tag != "float" && found->tag != "integer")
    found->Fail("expected a <float>", found->tag == "texture" ? "State one value for the whole surface." : "");
  const double value = NumberOf(*found, "value");
  if (!(value >= low && value <= high))
    found->Fail("must lie between " + crownfit::Number(low) + " and " + crownfit::Number(high));
  return value;
}

int MitsubaPlugin::Integer(const std::string& name, int otherwise, int low, int high) const {
  const auto value = Number(name, low, high);
  if (value && *value != std::floor(*value)) Find(name)->Fail("expected a whole number");
  return value ? static_cast<int>(*value) : otherwise;
}

bool MitsubaPlugin::Flag(const std::string& name, bool otherwise) const {
  const auto text = Text(name);
  if (text && *text != "true" && *text != "false") Find(name)->Fail("expected true or false");
  return text ? *text == "true" : otherwise;
}

std::optional<std::string> MitsubaPlugin::Text(const std::string& name) const {
  const MitsubaNode* found = Find(name);
  if (!found) return std::nullopt;
  const std::string* value = found->Find("value");
  if (!value) found->Fail("has no attribute value");
  return *value;
}

std::optional<glm::dvec3> MitsubaPlugin::Vector(const std::string& name) const {
  const MitsubaNode* found = Find(name);
  if (!found) return std::nullopt;
  if (found->tag != "point" && found->tag != "vector") found->Fail("expected a <point> or a <vector>");
  return VectorOf(*found);
}

std::optional<glm::dvec3> MitsubaPlugin::Rgb(const std::string& name, double most) const {
  const MitsubaNode* found = Find(name);
  if (!found) return std::nullopt;
  const std::string remedy = "State <rgb name=\"" + name + "\" value=\"R, G, B\"/>, one number per channel.";
  const bool is_colour = found->tag == "rgb" || found->tag == "spectrum" || found->tag == "float";
  const std::string* value = found->Find("value");
  if (!is_colour || !value) found->Fail("has no equivalent in a capture", remedy);
  if (value->find_first_of(":#") != value->npos) found->Fail("a spectrum over wavelengths can't be read", remedy);
  const std::vector<double> v = NumbersOf(*found, *value);
  if (v.size() != 1 && (v.size() != 3 || found->tag != "rgb")) found->Fail("expected one number, or three", remedy);
  const glm::dvec3 rgb = v.size() == 1 ? glm::dvec3(v[0]) : glm::dvec3(v[0], v[1], v[2]);
  for (int c = 0; c < 3; ++c)
    if (!(rgb[c] >= 0 && rgb[c] <= most)) found->Fail("values must lie between 0 and " + crownfit::Number(most));
  return rgb;
}

glm::dmat4 MitsubaPlugin::ToWorld() const {
  const MitsubaNode* found = Find("to_world");
  glm::dmat4 product(1.0);
  if (!found) return product;
  if (found->tag != "transform")
    found->Fail("expected a <transform>",
                found->tag == "animation" ? "What moves has no equivalent: state where it stood." : "");
  for (const MitsubaNode& step : found->children) product = StepOf(step) * product;
  return product;
}

std::optional<std::filesystem::path> MitsubaPlugin::File() const {
  const MitsubaNode* found = Find("filename");
  if (!found) return std::nullopt;
  return document_.FileOf(*found);
}

}  // namespace crownfit
