#pragma once
// Strict JSON: `//` comments are allowed; an unknown, missing or mistyped key names the file, the key and what was
// expected. The JSON library itself is named in json_file.cpp only.

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace crownfit {

/// A JSON value as plain data; objects keep the order of their keys.
struct JsonValue {
  using Array = std::vector<JsonValue>;
  using Object = std::vector<std::pair<std::string, JsonValue>>;
  std::variant<std::monostate, bool, double, std::string, Array, Object> data;

  JsonValue() = default;
  JsonValue(bool v) : data(v) {}
  JsonValue(double v) : data(v) {}
  JsonValue(int v) : data(static_cast<double>(v)) {}
  JsonValue(const char* v) : data(std::string(v)) {}
  JsonValue(std::string v) : data(std::move(v)) {}
  JsonValue(Array v) : data(std::move(v)) {}
  JsonValue(Object v) : data(std::move(v)) {}
  JsonValue(const std::vector<double>& v) : data(Array(v.begin(), v.end())) {}
  JsonValue(const std::vector<std::string>& v) : data(Array(v.begin(), v.end())) {}
};

/// A value with the file and the key path it came from, so that error messages can name them.
class JsonNode {
 public:
  JsonNode(const JsonValue* value, const std::filesystem::path* file, std::string key)
      : value_(value), file_(file), key_(std::move(key)) {}

  double Number() const;                                                ///< finite
  double Number(double low, double high) const;                         ///< finite, low <= value <= high
  double Positive() const;                                              ///< finite, > 0
  double Positive(double most) const;                                   ///< 0 < value <= most
  int Integer(int low, int high) const;                                 ///< whole number in [low, high]
  bool Bool() const;                                                    ///< true or false
  std::string String() const;                                           ///< text without control characters
  std::string Name() const;                                             ///< such a text of 1 to 100 bytes
  std::string OneOf(const std::vector<std::string>& choices) const;     ///< one of the listed words
  std::vector<JsonNode> Items(size_t most = SIZE_MAX) const;            ///< a list of at most `most` items
  std::vector<double> Numbers(std::optional<size_t> count = {}) const;  ///< list of finite numbers, of given length
  std::vector<std::pair<std::string, JsonNode>> Members() const;        ///< an object whose keys are names
  bool IsNumber() const { return std::holds_alternative<double>(value_->data); }
  bool IsArray() const { return std::holds_alternative<JsonValue::Array>(value_->data); }
  bool IsObject() const { return std::holds_alternative<JsonValue::Object>(value_->data); }

  [[noreturn]] void Fail(const std::string& message, const std::string& remedy = "") const;
  const std::string& key() const { return key_; }
  const std::filesystem::path& file() const { return *file_; }

 private:
  friend class JsonObject;
  [[noreturn]] void Expected(const std::string& what) const;
  const JsonValue* value_;
  const std::filesystem::path* file_;
  std::string key_;
};

/// An object whose allowed keys are stated up front; any other key is an error that names it (and the nearest allowed).
class JsonObject {
 public:
  JsonObject(const JsonNode& node, const std::vector<std::string>& allowed_keys);
  JsonNode Require(const std::string& key) const;
  std::optional<JsonNode> Find(const std::string& key) const;
  const JsonNode& node() const { return node_; }

 private:
  JsonNode node_;
};

/// A JSON file held in memory. Throws InputError when it can't be read, is not JSON or exceeds a limit: depth 64, 10000
/// keys per object, keys of 200 and texts of 65536 characters, the file size of base/limits.h.
struct JsonFile {
  explicit JsonFile(const std::filesystem::path& file);
  /// The same from text in memory; error messages call the file `name`.
  JsonFile(const std::filesystem::path& name, const std::string& text);
  JsonNode root() const { return JsonNode(&value, &file, ""); }
  /// Compares the "format" tag with `format` and returns the root object.
  JsonObject RootOfFormat(const std::string& format, std::vector<std::string> allowed_keys) const;
  std::filesystem::path file;
  JsonValue value;
};

/// JSON text, two spaces of indent, short lists on one line, numbers as their shortest round-trip form.
/// A number that is not finite has no JSON form and becomes null.
std::string ToJsonText(const JsonValue& value);

}  // namespace crownfit
