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

/// The numbers of a text, between blanks or commas.
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

double NumberOf(const MitsubaNode& node, const std::string& attribute, std::optional<double> otherwise = {}) {
  const std::string* text = node.Find(attribute);
  if (!text && otherwise) return *otherwise;
  if (!text) node.Fail("has no attribute " + attribute);
  const std::vector<double> numbers = NumbersOf(node, *text);
  if (numbers.size() != 1) node.Fail("expected one number in " + attribute);
  return numbers[0];
}

/// Three numbers of `value`, one for all of them, or x, y and z.
glm::dvec3 VectorOf(const MitsubaNode& node, double otherwise = 0.0) {
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

/// One step of a <transform>.
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

std::optional<Path> MitsubaPlugin::File() const {
  const MitsubaNode* found = Find("filename");
  if (!found) return std::nullopt;
  return document_.FileOf(*found);
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
