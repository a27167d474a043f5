#include "base/json_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "base/limits.h"

namespace crownfit {
namespace {

constexpr size_t kMaxDepth = 64;
constexpr size_t kMostKeys = 10000;  // of one object: each key is compared with all before it
constexpr size_t kLongestKey = 200, kLongestText = 65536, kLongestName = 100;

bool HasControlCharacter(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

/// Receives the parser's events and builds a JsonValue without recursion on the input's depth.
class Builder {
 public:
  using number_integer_t = nlohmann::json::number_integer_t;
  using number_unsigned_t = nlohmann::json::number_unsigned_t;
  using number_float_t = nlohmann::json::number_float_t;
  using string_t = nlohmann::json::string_t;
  using binary_t = nlohmann::json::binary_t;

  bool null() { return Add(JsonValue()); }
  bool boolean(bool v) { return Add(JsonValue(v)); }
  bool number_integer(number_integer_t v) { return Add(JsonValue(static_cast<double>(v))); }
  bool number_unsigned(number_unsigned_t v) { return Add(JsonValue(static_cast<double>(v))); }
  bool number_float(number_float_t v, const string_t&) { return Add(JsonValue(v)); }
  bool string(string_t& v) {
    if (v.size() > kLongestText) return Refuse("a text is longer than " + std::to_string(kLongestText) + " characters");
    return Add(JsonValue(std::move(v)));
  }
  bool binary(binary_t&) { return false; }
  bool start_object(size_t) { return Open(JsonValue(JsonValue::Object())); }
  bool start_array(size_t) { return Open(JsonValue(JsonValue::Array())); }
  bool end_object() { return Close(); }
  bool end_array() { return Close(); }
  bool key(string_t& k) {
    auto& object = std::get<JsonValue::Object>(open_.back().data);
    if (k.size() > kLongestKey) return Refuse("a key is longer than " + std::to_string(kLongestKey) + " characters");
    if (HasControlCharacter(k)) return Refuse("a key holds a control character");
    if (object.size() >= kMostKeys) return Refuse("an object has more than " + std::to_string(kMostKeys) + " keys");
    for (const auto& [name, value] : object)
      if (name == k) return Refuse("key '" + k + "' occurs twice in one object");
    object.emplace_back(std::move(k), JsonValue());
    return true;
  }
  bool parse_error(size_t, const std::string&, const nlohmann::detail::exception& e) {
    message = e.what();
    const size_t bracket = message.find("] ");
    if (bracket != std::string::npos) message = message.substr(bracket + 2);
    if (message.size() > 300) message = message.substr(0, 200) + " ...";  // the message quotes the input
    return false;
  }

  JsonValue root;
  std::string message;

 private:
  bool Refuse(const std::string& why) {
    message = why;
    return false;
  }
  bool Add(JsonValue v) {
    if (open_.empty()) {
      root = std::move(v);
    } else if (auto* list = std::get_if<JsonValue::Array>(&open_.back().data)) {
      list->push_back(std::move(v));
    } else {
      std::get<JsonValue::Object>(open_.back().data).back().second = std::move(v);
    }
    return true;
  }
  bool Open(JsonValue v) {
    if (open_.size() >= kMaxDepth) return Refuse("nested deeper than " + std::to_string(kMaxDepth) + " levels");
    open_.push_back(std::move(v));
    return true;
  }
  bool Close() {
    JsonValue v = std::move(open_.back());
    open_.pop_back();
    return Add(std::move(v));
  }
  std::vector<JsonValue> open_;
};

size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t change = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
    }
  }
  return row[b.size()];
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string NumberText(double v) {
  if (!std::isfinite(v)) return "null";
  if (v == 0) return std::signbit(v) ? "-0.0" : "0";  // "-0" would be read as an integer, which has no signed zero
  char buffer[40];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, v);
  Check(error == std::errc(), "a double has a decimal form");
  return std::string(buffer, end);
}

std::string QuotedText(const std::string& s) {
  return nlohmann::json(s).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void Append(const JsonValue& v, int indent, std::string& out) {
  const std::string pad(2 * (indent + 1), ' '), end_pad(2 * indent, ' ');
  if (std::holds_alternative<std::monostate>(v.data)) {
    out += "null";
  } else if (const auto* b = std::get_if<bool>(&v.data)) {
    out += *b ? "true" : "false";
  } else if (const auto* d = std::get_if<double>(&v.data)) {
    out += NumberText(*d);
  } else if (const auto* s = std::get_if<std::string>(&v.data)) {
    out += QuotedText(*s);
  } else if (const auto* list = std::get_if<JsonValue::Array>(&v.data)) {
    const bool flat = std::all_of(list->begin(), list->end(), [](const JsonValue& item) {
      return !std::holds_alternative<JsonValue::Object>(item.data) && !std::holds_alternative<std::string>(item.data);
    });
    out += "[";
    for (size_t i = 0; i < list->size(); ++i) {
      out += flat ? (i ? ", " : "") : (i ? ",\n" + pad : "\n" + pad);
      Append((*list)[i], indent + 1, out);
    }
    out += flat || list->empty() ? "]" : "\n" + end_pad + "]";
  } else {
    const auto& object = std::get<JsonValue::Object>(v.data);
    out += "{";
    for (size_t i = 0; i < object.size(); ++i) {
      out += (i ? ",\n" : "\n") + pad + QuotedText(object[i].first) + ": ";
      Append(object[i].second, indent + 1, out);
    }
    out += object.empty() ? "}" : "\n" + end_pad + "}";
  }
}

}  // namespace

void JsonNode::Fail(const std::string& message, const std::string& remedy) const {
  throw InputError(*file_, key_, message, remedy);
}

void JsonNode::Expected(const std::string& what) const {
  static constexpr const char* kNames[] = {"null", "true or false", "a number", "a text", "a list", "an object"};
  Fail("expected " + what + ", found " + kNames[value_->data.index()]);
}

double JsonNode::Number() const {
  const auto* v = std::get_if<double>(&value_->data);
  if (!v) Expected("a number");
  if (!std::isfinite(*v)) Fail("the number is not finite");
  return *v;
}

double JsonNode::Number(double low, double high) const {
  const double v = Number();
  if (v < low || v > high) Fail(NumberText(v) + " is outside [" + NumberText(low) + ", " + NumberText(high) + "]");
  return v;
}

double JsonNode::Positive() const {
  const double v = Number();
  if (v <= 0) Fail(NumberText(v) + " must be greater than 0");
  return v;
}

double JsonNode::Positive(double most) const {
  const double v = Positive();
  if (v > most) Fail(NumberText(v) + " is more than " + NumberText(most));
  return v;
}

int JsonNode::Integer(int low, int high) const {
  const double v = Number(low, high);
  if (v != std::floor(v)) Fail(NumberText(v) + " must be a whole number");
  return static_cast<int>(v);
}

bool JsonNode::Bool() const {
  const auto* v = std::get_if<bool>(&value_->data);
  if (!v) Expected("true or false");
  return *v;
}

std::string JsonNode::String() const {
  const auto* v = std::get_if<std::string>(&value_->data);
  if (!v) Expected("a text");
  if (HasControlCharacter(*v))
    Fail("the text holds a control character", "Write the name or path without NUL, tab or line end.");
  return *v;
}

std::string JsonNode::Name() const {
  const std::string v = String();
  if (v.empty()) Fail("the name is empty");
  if (v.size() > kLongestName)
    Fail("the name is longer than " + std::to_string(kLongestName) + " bytes", "Names become parts of file names.");
  return v;
}

std::string JsonNode::OneOf(const std::vector<std::string>& choices) const {
  const std::string v = String();
  if (std::find(choices.begin(), choices.end(), v) == choices.end())
    Fail("'" + v.substr(0, 80) + "' is not known", "Known: " + Joined(choices) + ".");
  return v;
}

std::vector<JsonNode> JsonNode::Items(size_t most) const {
  const auto* list = std::get_if<JsonValue::Array>(&value_->data);
  if (!list) Expected("a list");
  if (list->size() > most)
    Fail("the list has " + std::to_string(list->size()) + " entries, more than " + std::to_string(most));
  std::vector<JsonNode> items;
  for (size_t i = 0; i < list->size(); ++i)
    items.emplace_back(&(*list)[i], file_, key_ + "[" + std::to_string(i) + "]");
  return items;
}

std::vector<double> JsonNode::Numbers(std::optional<size_t> count) const {
  std::vector<double> numbers;
  for (const auto& item : Items()) numbers.push_back(item.Number());
  if (count && numbers.size() != *count)
    Fail("expected " + std::to_string(*count) + " numbers, found " + std::to_string(numbers.size()));
  return numbers;
}

std::vector<std::pair<std::string, JsonNode>> JsonNode::Members() const {
  const auto* object = std::get_if<JsonValue::Object>(&value_->data);
  if (!object) Expected("an object");
  std::vector<std::pair<std::string, JsonNode>> members;
  for (const auto& [name, value] : *object) members.emplace_back(name, JsonNode(&value, file_, key_ + "." + name));
  return members;
}

JsonObject::JsonObject(const JsonNode& node, const std::vector<std::string>& allowed_keys) : node_(node) {
  const auto* object = std::get_if<JsonValue::Object>(&node.value_->data);
  if (!object) node.Expected("an object");
  for (const auto& member : *object) {
    const std::string& key = member.first;
    if (std::find(allowed_keys.begin(), allowed_keys.end(), key) != allowed_keys.end()) continue;
    const auto nearest = std::min_element(allowed_keys.begin(), allowed_keys.end(), [&](const auto& a, const auto& b) {
      return EditDistance(a, key) < EditDistance(b, key);
    });
    const bool close = nearest != allowed_keys.end() && EditDistance(*nearest, key) <= 1 + key.size() / 3;
    throw InputError(node.file(), node.key().empty() ? key : node.key() + "." + key, "unknown key",
                     close ? "Did you mean '" + *nearest + "'?" : "Known keys here: " + Joined(allowed_keys) + ".");
  }
}

std::optional<JsonNode> JsonObject::Find(const std::string& key) const {
  for (const auto& [name, value] : std::get<JsonValue::Object>(node_.value_->data)) {
    if (name == key) return JsonNode(&value, node_.file_, node_.key_.empty() ? key : node_.key_ + "." + key);
  }
  return std::nullopt;
}

JsonNode JsonObject::Require(const std::string& key) const {
  if (auto found = Find(key)) return *found;
  throw InputError(node_.file(), node_.key().empty() ? key : node_.key() + "." + key, "this required key is missing");
}

namespace {

std::string TextOf(const std::filesystem::path& file) {
  return ReadWholeFile(file, std::ldexp(InputLimits().json_MiB, 20),
                       "Keep pictures and meshes in files of their own, or raise CROWNFIT_MAX_JSON_MIB.");
}

}  // namespace

JsonFile::JsonFile(const std::filesystem::path& path) : JsonFile(path, TextOf(path)) {}

JsonFile::JsonFile(const std::filesystem::path& name, const std::string& text) : file(name) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF") || text.substr(0, 2).find('\0') != text.npos)
    throw InputError(file, "", "is not a UTF-8 text; it may be UTF-16",
                     "Save it as UTF-8: in an editor as its encoding, in PowerShell by -Encoding utf8.");
  Builder builder;
  if (!nlohmann::json::sax_parse(text, &builder, nlohmann::json::input_format_t::json, true, true))
    throw InputError(file, "", "not valid JSON: " + builder.message);
  value = std::move(builder.root);
}

JsonObject JsonFile::RootOfFormat(const std::string& format, std::vector<std::string> allowed_keys) const {
  if (!root().IsObject()) throw InputError(file, "", "expected a JSON object with \"format\": \"" + format + "\"");
  // The tag is compared first: in a file of another kind every key would be unknown.
  for (const auto& [key, tag] : std::get<JsonValue::Object>(value.data)) {
    if (key != "format") continue;
    const std::string found = JsonNode(&tag, &file, "format").String();
    if (found != format) throw InputError(file, "format", "expected \"" + format + "\", found \"" + found + "\"");
    allowed_keys.push_back("format");
    return JsonObject(root(), allowed_keys);
  }
  throw InputError(file, "format", "this required key is missing", "Expected \"format\": \"" + format + "\".");
}

std::string ToJsonText(const JsonValue& value) {
  std::string out;
  Append(value, 0, out);
  return out + "\n";
}

}  // namespace crownfit
