#include "exchange/mitsuba_xml.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <pugixml.hpp>

#include "base/error.h"
#include "base/files.h"
#include "base/limits.h"
#include "base/text.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;
using Variables = std::map<std::string, std::string, std::greater<>>;  // the longer of two that begin alike comes first

constexpr int kDeepest = 32;  // elements within elements, and files that include files
constexpr size_t kMostElements = 1000000;

std::string ReadXml(const Path& file) {
  return ReadWholeFile(file, InputLimits().json_MiB * (1 << 20), "A scene names its meshes in files of their own.");
}

/// Fills the tree from files.
class Builder {
 public:
  Builder(std::vector<Path>& folders, MitsubaNode& scene) : folders_(folders), scene_(scene) {}

  void AddFile(const Path& path, int depth, const MitsubaNode* included_by) {
    const std::string text = ReadXml(path);
    const auto file = std::make_shared<const Path>(path);
    pugi::xml_document document;
    const auto parsed = document.load_buffer(text.data(), text.size());
    if (!parsed)
      throw InputError(path, "line " + std::to_string(LineOf(text, parsed.offset)),
                       std::string("is no XML: ") + parsed.description());
    const pugi::xml_node root = document.document_element();
    if (std::string(root.name()) != "scene")
      throw InputError(path, std::string("<") + root.name() + ">",
                       "expected <scene>, the root of a scene of Mitsuba 3");
    const double version = root.attribute("version").as_double();
    if (!(version >= 2.0))
      throw InputError(path, "<scene>", "expected version=\"2.0.0\" or later",
                       "Scenes of Mitsuba 0.6 name things differently: write this one for Mitsuba 3.");
    if (!included_by) scene_ = {"scene", "", "", "", {}, {}, file, 1};
    for (const pugi::xml_node& child : root.children()) AddTop(child, text, file, depth);
  }

 private:
  static int LineOf(const std::string& text, std::ptrdiff_t offset) {
    const auto end = std::min(static_cast<size_t>(std::max<std::ptrdiff_t>(offset, 0)), text.size());
    return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
  }

  void AddTop(const pugi::xml_node& xml, const std::string& text, const std::shared_ptr<const Path>& file, int depth) {
    if (xml.type() != pugi::node_element) return;
    const MitsubaNode node = Converted(xml, text, file, 0);
    const auto attribute = [&](const char* key) {
      const std::string* value = node.Find(key);
      if (!value || value->empty()) node.Fail(std::string("has no attribute ") + key);
      return *value;
    };
    if (node.tag == "default") {
      if (node.name.empty()) node.Fail("has no attribute name");
      variables_.emplace(node.name, attribute("value"));  // the first one counts, as in Mitsuba
    } else if (node.tag == "path") {
      folders_.push_back(file->parent_path() / attribute("value"));
    } else if (node.tag == "include") {
      if (depth > kDeepest) node.Fail("files include each other without an end");
      AddFile(Found(attribute("filename"), *file), depth + 1, &node);
    } else {
      scene_.children.push_back(node);
    }
  }

  Path Found(const std::string& name, const Path& beside) const {
    std::error_code ignored;
    if (const Path path = beside.parent_path() / name; std::filesystem::is_regular_file(path, ignored)) return path;
    for (const Path& folder : folders_)
      if (std::filesystem::is_regular_file(folder / name, ignored)) return folder / name;
    return beside.parent_path() / name;
  }

  MitsubaNode Converted(const pugi::xml_node& xml, const std::string& text, const std::shared_ptr<const Path>& file,
                        int depth) {
    MitsubaNode node;
    node.tag = xml.name();
    node.file = file;
    if (xml.offset_debug() >= last_offset_ && file == last_file_) {
      const auto from = text.begin() + last_offset_, to = text.begin() + xml.offset_debug();
      last_line_ += static_cast<int>(std::count(from, to, '\n'));
    } else {
      last_line_ = LineOf(text, xml.offset_debug());
    }
    last_offset_ = xml.offset_debug(), last_file_ = file;
    node.line = last_line_;
    if (++elements_ > kMostElements) node.Fail("the scene has more than a million elements");
    if (depth > kDeepest) node.Fail("elements are nested too deeply");
    for (const pugi::xml_attribute& attribute : xml.attributes()) {
      const std::string key = attribute.name(), value = Filled(attribute.value(), node);
      if (key == "type")
        node.type = value;
      else if (key == "name")
        node.name = value;
      else if (key == "id" && node.tag != "ref")
        node.id = value;
      else
        node.attributes.emplace_back(key, value);
    }
    for (const pugi::xml_node& child : xml.children())
      if (child.type() == pugi::node_element) node.children.push_back(Converted(child, text, file, depth + 1));
    return node;
  }

  /// The text with $NAME replaced.
  std::string Filled(std::string value, const MitsubaNode& node) const {
    for (size_t at = 0; (at = value.find('$', at)) != value.npos;) {
      const auto known = std::find_if(variables_.begin(), variables_.end(), [&](const auto& variable) {
        return value.compare(at + 1, variable.first.size(), variable.first) == 0;
      });
      if (known == variables_.end())
        node.Fail("nothing defines '" + value.substr(at, 40) + "'",
                  "Add <default name=\"...\" value=\"...\"/> to the scene, in front of its use.");
      value.replace(at, known->first.size() + 1, known->second);
      at += known->second.size();
      if (value.size() > 65536) node.Fail("a text is too long");
    }
    return value;
  }

  std::vector<Path>& folders_;
  MitsubaNode& scene_;
  Variables variables_;
  size_t elements_ = 0;
  std::ptrdiff_t last_offset_ = 0;
  std::shared_ptr<const Path> last_file_;
  int last_line_ = 1;
};

void CollectIds(const MitsubaNode& node, std::map<std::string, const MitsubaNode*>& by_id) {
  if (!node.id.empty() && !by_id.emplace(node.id, &node).second)
    node.Fail("two elements have the id '" + node.id + "'", "Give each an id of its own.");
  for (const MitsubaNode& child : node.children) CollectIds(child, by_id);
}

}  // namespace

const std::string* MitsubaNode::Find(const std::string& attribute) const {
  for (const auto& [key, value] : attributes)
    if (key == attribute) return &value;
  return nullptr;
}

std::string MitsubaNode::Title() const {
  std::string title = "<" + tag;
  if (!type.empty()) title += " type=\"" + type + "\"";
  if (!id.empty()) title += " id=\"" + id + "\"";
  if (!name.empty()) title += " name=\"" + name + "\"";
  return title + "> (line " + std::to_string(line) + ")";
}

void MitsubaNode::Fail(const std::string& message, const std::string& remedy) const {
  throw InputError(*file, Title(), message, remedy);
}

MitsubaDocument::MitsubaDocument(const Path& file) : folders_{file.parent_path()} {
  Builder(folders_, scene_).AddFile(file, 0, nullptr);
  std::vector<std::pair<std::string, std::string>> aliases;
  for (const MitsubaNode& child : scene_.children) {
    if (child.tag == "alias") continue;
    CollectIds(child, by_id_);
  }
  for (const MitsubaNode& child : scene_.children) {
    if (child.tag != "alias") continue;
    const std::string* as = child.Find("as");
    const auto of = by_id_.find(child.id);
    if (!as || of == by_id_.end()) child.Fail("names no element", "State id, that of an element before, and as.");
    by_id_.emplace(*as, of->second);
  }
}

const MitsubaNode& MitsubaDocument::Target(const MitsubaNode& node) const {
  if (node.tag != "ref") return node;
  const std::string* id = node.Find("id");
  const auto found = id ? by_id_.find(*id) : by_id_.end();
  if (found == by_id_.end()) node.Fail("no element has the id '" + (id ? *id : "") + "'");
  return *found->second;
}

Path MitsubaDocument::FileOf(const MitsubaNode& node) const {
  const std::string* value = node.Find("value");
  if (!value || value->empty()) node.Fail("names no file");
  std::error_code ignored;
  if (const Path path = node.file->parent_path() / *value; std::filesystem::is_regular_file(path, ignored)) return path;
  for (const Path& folder : folders_)
    if (std::filesystem::is_regular_file(folder / *value, ignored)) return folder / *value;
  node.Fail("there is no file " + (node.file->parent_path() / *value).string());
}

bool IsXmlOf(const Path& file, const std::string& root) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return false;
  const std::string text = ReadXml(file);
  pugi::xml_document document;
  document.load_buffer(text.data(), text.size());
  return document.document_element().name() == root;
}

}  // namespace crownfit
