// JSON that people write: every value with its line, so that what is wrong can be pointed at.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/base/error.h"
#include "osteo/base/param.h"

namespace osteo {

struct JsonMember;
struct JsonValue {
  enum class Kind { null, flag, number, text, list, object };
  Kind kind = Kind::null;
  std::size_t line = 1;
  bool flag = false;
  double number = 0;
  std::string text;
  std::vector<JsonValue> items;
  std::vector<JsonMember> members;  ///< in their order

  /// Null when the object has no such key.
  [[nodiscard]] const JsonValue* find(std::string_view key) const;
};
struct JsonMember {
  std::string key;
  JsonValue value;
};

/// A file of settings or of things to do, read strictly: a key that is not known, one that is there twice, a value of another kind or out
/// of range is an error with file and line.
class JsonFile {
 public:
  /// `name` as errors call it. Comments as in C++ are taken. Error(usage) with the line.
  JsonFile(std::string_view text, std::string name);

  [[nodiscard]] const JsonValue& root() const { return root_; }
  /// What is wrong with a value: "'s.json' line 7: what".
  [[nodiscard]] Error wrong(const JsonValue& at, const std::string& what, const std::string& advice = {}) const;
  /// Error(usage) unless `object` is one and all its keys are among `known`. `where` goes before what is wrong: "action 2".
  void allow(const JsonValue& object, const std::string& where, std::span<const std::string> known) const;
  /// Gives each field that the object names its value; the others stay as they are, unless they are needed. Keys of `besides` are the
  /// caller's. Error(usage).
  void read(const JsonValue& object, const std::string& where, std::span<const FieldRef> fields,
            std::span<const std::string> besides = {}) const;
  /// The same for one field.
  void read(const JsonValue& value, const std::string& where, const FieldRef& field) const;

 private:
  std::string name_;
  JsonValue root_;
};

/// What a JSON library's exception says, without the library's own names and numbers.
[[nodiscard]] std::string json_complaint(const std::exception& e);

/// JSON schema of a field: its kind, range, choices, default and help.
[[nodiscard]] std::string field_schema(const FieldRef& field);

}  // namespace osteo
