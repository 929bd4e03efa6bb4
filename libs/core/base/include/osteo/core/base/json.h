// JSON that people write: every value with its line, so that what is wrong can be pointed at.
#pragma once
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

namespace osteo {

class Json;
struct JsonMember;
struct JsonValue {
  enum class Kind { null, flag, number, text, list, object };
  Kind kind = Kind::null;
  std::size_t line = 1;
  bool flag = false;
  double number = 0;
  bool whole = false;  ///< a number written without point and exponent
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

/// A file of settings or of things to do, read strictly: a key that is not known, one that is there twice, a value of
/// another kind or out of range is an error with file and line.
class JsonFile {
 public:
  /// `name` as errors call it. Comments as in C++ are taken. All errors are of `code`: usage for what people write,
  /// corrupt for what the program wrote itself; and with the line.
  JsonFile(std::string_view text, std::string name, ExitCode code = ExitCode::usage);

  [[nodiscard]] const JsonValue& root() const { return root_; }
  /// What is wrong with a value: "'s.json' line 7: what".
  [[nodiscard]] Error wrong(const JsonValue& at, const std::string& what, const std::string& advice = {}) const;
  /// An error unless `object` is one and all its keys are among `known`. `where` goes before what is wrong: "action 2".
  void allow(const JsonValue& object, const std::string& where, std::span<const std::string> known) const;
  /// Gives each field that the object names its value; the others stay as they are, unless they are needed. Keys of
  /// `besides` are the caller's.
  void read(const JsonValue& object, const std::string& where, std::span<const FieldRef> fields,
            std::span<const std::string> besides = {}) const;
  /// The same for one field.
  void read(const JsonValue& value, const std::string& where, const FieldRef& field) const;

  // What is no field of a struct. An error when it is missing, of another kind or out of range.
  [[nodiscard]] const JsonValue& need(const JsonValue& object, const std::string& where, std::string_view key) const;
  /// `called` as in "band_hz"; NaN and infinity cannot be written in JSON.
  [[nodiscard]] double number(const JsonValue& value, const std::string& called,
                              double lo = -std::numeric_limits<double>::max(),
                              double hi = std::numeric_limits<double>::max()) const;
  [[nodiscard]] const std::string& text(const JsonValue& value, const std::string& called) const;
  /// Of `count` items, when that is not 0.
  [[nodiscard]] const std::vector<JsonValue>& list(const JsonValue& value, const std::string& called,
                                                   std::size_t count = 0) const;
  /// The file must say "`format`": 1.
  void require_format(std::string_view format) const;

 private:
  std::string name_;
  ExitCode code_;
  JsonValue root_;
};

/// What a JSON library's exception says, without the library's own names and numbers.
[[nodiscard]] std::string json_complaint(const std::exception& e);

/// JSON schema of a field: its kind, range, choices, default and help.
[[nodiscard]] Json field_schema(const FieldRef& field);

}  // namespace osteo
