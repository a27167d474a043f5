#pragma once
// Plugins of a scene of Mitsuba 3 and their properties.

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "exchange/mitsuba_xml.h"

namespace crownfit {

/// An element that stands for a plugin of Mitsuba. What it may hold is stated up front, and anything else is refused by
/// its name: nothing that a scene says gets lost.
class MitsubaPlugin {
 public:
  /// `known`: names of properties, and tags of nested plugins without a name as "<bsdf>".
  MitsubaPlugin(const MitsubaDocument& document, const MitsubaNode& node, const std::vector<std::string>& known);

  const MitsubaNode* Find(const std::string& name) const;                ///< a property, or a nested plugin by name
  std::vector<const MitsubaNode*> Nested(const std::string& tag) const;  ///< plugins without a name
  const MitsubaNode* OnlyNested(const std::string& tag) const;           ///< the one plugin without a name; null: none
  std::optional<double> Number(const std::string& name, double low, double high) const;
  int Integer(const std::string& name, int otherwise, int low, int high) const;
  bool Flag(const std::string& name, bool otherwise) const;
  std::optional<std::string> Text(const std::string& name) const;
  std::optional<glm::dvec3> Vector(const std::string& name) const;
  std::optional<glm::dvec3> Rgb(const std::string& name, double most) const;  ///< a colour, or one value for all
  glm::dmat4 ToWorld() const;                                                 ///< of to_world; identity where absent
  std::optional<std::filesystem::path> File() const;                          ///< of filename
  const MitsubaNode& node() const { return node_; }
  const MitsubaDocument& document() const { return document_; }

 private:
  const MitsubaDocument& document_;
  const MitsubaNode& node_;
};

}  // namespace crownfit
