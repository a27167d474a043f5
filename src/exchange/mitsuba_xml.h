#pragma once
// Scenes of Mitsuba 3 as a tree of elements, before anything is known of what they mean.

#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crownfit {

/// An element whose $variables are replaced and whose <include> is filled in.
struct MitsubaNode {
  std::string tag, type, name, id;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< all others
  std::vector<MitsubaNode> children;
  std::shared_ptr<const std::filesystem::path> file;
  int line = 0;

  const std::string* Find(const std::string& attribute) const;
  std::string Title() const;  ///< such as <sensor type="perspective"> (line 7)
  /// Throws InputError with the file and the element.
  [[noreturn]] void Fail(const std::string& message, const std::string& remedy = "") const;
};

/// A scene with all that it includes. Throws InputError for what is no scene of Mitsuba 3.
class MitsubaDocument {
 public:
  explicit MitsubaDocument(const std::filesystem::path& file);
  MitsubaDocument(const MitsubaDocument&) = delete;
  MitsubaDocument& operator=(const MitsubaDocument&) = delete;

  const MitsubaNode& scene() const { return scene_; }
  /// The element that a <ref> names; any other is itself.
  const MitsubaNode& Target(const MitsubaNode& node) const;
  /// The file that the value of <string name="filename"> names.
  std::filesystem::path FileOf(const MitsubaNode& node) const;

 private:
  MitsubaNode scene_;
  std::vector<std::filesystem::path> folders_;  ///< in which files are searched
  std::map<std::string, const MitsubaNode*> by_id_;
};

/// An element that stands for a plugin of Mitsuba. What it may hold is stated up front, and anything else is refused by
/// its name: nothing that a scene says gets lost.
class MitsubaPlugin {
 public:
  /// `known`: names of properties, and tags of nested plugins without a name as "<bsdf>".
  MitsubaPlugin(const MitsubaDocument& document, const MitsubaNode& node, const std::vector<std::string>& known);

  const MitsubaNode* Find(const std::string& name) const;                ///< a property, or a nested plugin by name
  std::vector<const MitsubaNode*> Nested(const std::string& tag) const;  ///< plugins without a name
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

/// Whether the file is XML with a root called `root`.
bool IsXmlOf(const std::filesystem::path& file, const std::string& root);

}  // namespace crownfit
