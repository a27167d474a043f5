#pragma once
// Scenes of Mitsuba 3 as a tree of elements, before anything is known of what they mean.

#include <filesystem>
#include <map>
#include <memory>
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

/// Whether the file is XML with a root called `root`.
bool IsXmlOf(const std::filesystem::path& file, const std::string& root);

}  // namespace crownfit
