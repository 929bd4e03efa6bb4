#include "osteo/core/base/json.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "osteo/core/base/json_document.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

// Which line the parser has come to. Numbers end where the next character is not theirs, so the last one read does not
// count.
struct Lines {
  std::size_t before_last = 1, now = 1;
};

class Characters {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;
  Characters(const char* at, Lines* lines) : at_(at), lines_(lines) {}
  reference operator*() const { return *at_; }
  Characters& operator++() {
    lines_->before_last = lines_->now;
    if (*at_ == '\n') ++lines_->now;
    ++at_;
    return *this;
  }
  Characters operator++(int) {
    const Characters before = *this;
    ++*this;
    return before;
  }
  friend bool operator==(const Characters& a, const Characters& b) { return a.at_ == b.at_; }
  friend bool operator!=(const Characters& a, const Characters& b) { return a.at_ != b.at_; }

 private:
  const char* at_;
  Lines* lines_;
};

class Builder : public nlohmann::json_sax<ordered_json> {
 public:
  Builder(const Lines& lines, JsonValue& root) : lines_(lines), root_(root) {}
  std::string complaint;

  bool null() override { return put({}); }
  bool boolean(bool v) override {
    JsonValue value;
    value.kind = JsonValue::Kind::flag;
    value.flag = v;
    return put(std::move(value));
  }
  bool number_integer(number_integer_t v) override { return number(static_cast<double>(v), true); }
  bool number_unsigned(number_unsigned_t v) override { return number(static_cast<double>(v), true); }
  bool number_float(number_float_t v, const string_t&) override { return number(v, false); }
  bool string(string_t& v) override {
    JsonValue value;
    value.kind = JsonValue::Kind::text;
    value.text = v;
    return put(std::move(value));
  }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(JsonValue::Kind::object); }
  bool start_array(std::size_t) override { return open(JsonValue::Kind::list); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& v) override {
    if (open_.back()->find(v) != nullptr) {
      complaint = "the key \"" + v + "\" is there twice";
      return false;
    }
    open_.back()->members.push_back({v, {}});
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& e) override {
    complaint = "this is not valid JSON: " + json_complaint(e);
    return false;
  }

 private:
  static constexpr std::size_t kDeepest = 64;
  bool number(double v, bool whole) {
    JsonValue value;
    value.kind = JsonValue::Kind::number;
    value.number = v;
    value.whole = whole;
    return put(std::move(value));
  }
  JsonValue* add(JsonValue value) {
    value.line = lines_.before_last;
    if (open_.empty()) return &(root_ = std::move(value));
    JsonValue& in = *open_.back();
    if (in.kind == JsonValue::Kind::object) return &(in.members.back().value = std::move(value));
    return &in.items.emplace_back(std::move(value));
  }
  bool put(JsonValue value) {
    add(std::move(value));
    return true;
  }
  bool open(JsonValue::Kind kind) {
    if (open_.size() == kDeepest) {
      complaint = "this is nested more than " + std::to_string(kDeepest) + " deep";
      return false;
    }
    JsonValue value;
    value.kind = kind;
    open_.push_back(add(std::move(value)));
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  const Lines& lines_;
  JsonValue& root_;
  std::vector<JsonValue*> open_;  // while one is open nothing is added beside it, so these stay where they are
};

// What was meant: the same word with or without its unit, or a slip of the pen.
std::string meant(const std::string& key, std::span<const std::string> known) {
  const auto stem = [](const std::string& k) { return k.substr(0, k.find('_')); };
  for (const std::string& k : known) {
    if (k.starts_with(key + "_") || key.starts_with(k + "_")) return k;
  }
  std::string same_stem;
  for (const std::string& k : known) {
    if (stem(k) == stem(key)) same_stem = same_stem.empty() ? k : "-";
  }
  return same_stem.empty() || same_stem == "-" ? nearest_name(key, known) : same_stem;
}

std::string list_of(std::span<const std::string> names) {
  std::string text;
  for (const std::string& n : names) text.append(text.empty() ? "" : ", ").append(n);
  return text;
}

std::string_view wanted(std::string_view kind) {
  if (kind == "flag") return "true or false";
  if (kind == "int") return "a whole number";
  if (kind == "number") return "a number";
  if (kind == "triple") return "three numbers, as in [1, 2, 3]";
  if (kind == "list") return "whole numbers, as in [1, 2]";
  return "a text in quotes";
}

}  // namespace

const JsonValue* JsonValue::find(std::string_view key) const {
  const auto it = std::find_if(members.begin(), members.end(), [&](const JsonMember& m) { return m.key == key; });
  return it == members.end() ? nullptr : &it->value;
}

JsonFile::JsonFile(std::string_view text, std::string name, ExitCode code) : name_(std::move(name)), code_(code) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  Lines lines;
  Builder builder(lines, root_);
  if (ordered_json::sax_parse(Characters(text.data(), &lines), Characters(text.data() + text.size(), &lines), &builder,
                              ordered_json::input_format_t::json, true, true))
    return;
  JsonValue at;
  at.line = lines.before_last;
  throw wrong(at, builder.complaint);
}

Error JsonFile::wrong(const JsonValue& at, const std::string& what, const std::string& advice) const {
  return {code_, "'" + name_ + "' line " + std::to_string(at.line) + ": " + what, advice};
}

void JsonFile::allow(const JsonValue& object, const std::string& where, std::span<const std::string> known) const {
  const std::string at = where.empty() ? "" : where + ": ";
  if (object.kind != JsonValue::Kind::object) throw wrong(object, at + "this must be an object in braces");
  for (const JsonMember& m : object.members) {
    if (std::find(known.begin(), known.end(), m.key) != known.end()) continue;
    const std::string near = meant(m.key, known);
    throw wrong(
        m.value,
        at + "the key \"" + m.key + "\" is not known" + (near.empty() ? "" : ": did you mean \"" + near + "\"?"),
        known.empty() ? "there are none here" : "known are " + list_of(known));
  }
}

void JsonFile::read(const JsonValue& object, const std::string& where, std::span<const FieldRef> fields,
                    std::span<const std::string> besides) const {
  std::vector<std::string> known;
  for (const FieldRef& f : fields) known.emplace_back(f.doc.name);
  known.insert(known.end(), besides.begin(), besides.end());
  // A field's name of before stands for it, unless both are there.
  std::map<const FieldRef*, const JsonValue*> by_old_name;
  std::vector<std::string> allowed = known;
  for (const JsonMember& m : object.members) {
    if (std::find(known.begin(), known.end(), m.key) != known.end()) continue;
    const FieldRef* const field = find_field(fields, m.key);
    if (field == nullptr || object.find(field->doc.name) != nullptr) continue;
    by_old_name.emplace(field, &m.value);
    allowed.push_back(m.key);
  }
  allow(object, where, allowed);
  for (const FieldRef& f : fields) {
    const auto old = by_old_name.find(&f);
    const JsonValue* const value = old != by_old_name.end() ? old->second : object.find(f.doc.name);
    if (value != nullptr) {
      read(*value, where, f);
    } else if (f.doc.needed) {
      throw wrong(object, (where.empty() ? "" : where + ": ") + "\"" + std::string(f.doc.name) + "\" is missing: " +
                              std::string(f.doc.help) + (f.doc.unit.empty() ? "" : ", " + std::string(f.doc.unit)));
    }
  }
}

void JsonFile::read(const JsonValue& value, const std::string& where, const FieldRef& field) const {
  using Kind = JsonValue::Kind;
  const std::string_view kind = field.kind();
  const std::string called = (where.empty() ? "" : where + ": ") + "\"" + std::string(field.doc.name) + "\"";
  const auto numbers = [&](std::size_t least, std::size_t most) {
    return value.kind == Kind::list && value.items.size() >= least && value.items.size() <= most &&
           std::all_of(value.items.begin(), value.items.end(),
                       [](const JsonValue& v) { return v.kind == Kind::number; });
  };
  std::string text;
  bool right = false;
  if (kind == "flag") {
    right = value.kind == Kind::flag;
    text = value.flag ? "true" : "false";
  } else if (kind == "int" || kind == "number") {
    right = value.kind == Kind::number;
    text = format_number(value.number);
  } else if (kind == "triple" || kind == "list") {
    right = kind == "triple" ? numbers(3, 3) : numbers(0, 1000);
    for (const JsonValue& v : value.items) text += (text.empty() ? "" : ",") + format_number(v.number);
  } else {
    right = value.kind == Kind::text;
    text = value.text;
  }
  if (!right) throw wrong(value, called + " must be " + std::string(wanted(kind)));
  try {
    field.from_text(text, called);
  } catch (const Error& e) {
    throw wrong(value, e.what(), e.advice());
  }
}

const JsonValue& JsonFile::need(const JsonValue& object, const std::string& where, std::string_view key) const {
  const std::string at = where.empty() ? "" : where + ": ";
  if (object.kind != JsonValue::Kind::object) throw wrong(object, at + "this must be an object in braces");
  const JsonValue* const value = object.find(key);
  if (value == nullptr) throw wrong(object, at + "\"" + std::string(key) + "\" is missing");
  return *value;
}

double JsonFile::number(const JsonValue& value, const std::string& called, double lo, double hi) const {
  if (value.kind != JsonValue::Kind::number) throw wrong(value, called + " must be a number");
  if (value.number >= lo && value.number <= hi) return value.number;
  const std::string from = lo > -std::numeric_limits<double>::max() ? format_number(lo) : "",
                    to = hi < 1e300 ? format_number(hi) : "";
  throw wrong(value, called + " is " + format_number(value.number) + " and must be " +
                         (from.empty() ? "at most " + to
                          : to.empty() ? "at least " + from
                                       : "from " + from + " to " + to));
}

const std::string& JsonFile::text(const JsonValue& value, const std::string& called) const {
  if (value.kind != JsonValue::Kind::text) throw wrong(value, called + " must be a text in quotes");
  return value.text;
}

const std::vector<JsonValue>& JsonFile::list(const JsonValue& value, const std::string& called,
                                             std::size_t count) const {
  if (value.kind != JsonValue::Kind::list) throw wrong(value, called + " must be a list in brackets");
  if (count > 0 && value.items.size() != count)
    throw wrong(value, called + " must have " + std::to_string(count) + " items");
  return value.items;
}

void JsonFile::require_format(std::string_view format) const {
  const JsonValue* const version = root_.kind == JsonValue::Kind::object ? root_.find(format) : nullptr;
  if (version == nullptr)
    throw wrong(root_, "\"" + std::string(format) + "\": 1 is missing", "it says which format the file has");
  if (version->kind != JsonValue::Kind::number || version->number != 1)
    throw wrong(*version, "\"" + std::string(format) + "\" must be 1",
                "a file of another version wants another program");
}

std::string json_complaint(const std::exception& e) {
  std::string_view text = e.what();
  if (text.starts_with('[')) {
    const std::size_t end = text.find("] ");
    if (end != std::string_view::npos) text.remove_prefix(end + 2);
  }
  // The line is reported by who knows the file.
  if (text.starts_with("parse error")) {
    const std::size_t colon = text.find(": ");
    if (colon != std::string_view::npos) text.remove_prefix(colon + 2);
  }
  return std::string(text);
}

Json field_schema(const FieldRef& f) {
  Json s;
  const std::string_view kind = f.kind();
  const std::string text = f.to_text();
  const auto range = [&](Json& of) {
    if (std::isfinite(f.doc.lo)) of["minimum"] = f.doc.lo;
    if (std::isfinite(f.doc.hi)) of["maximum"] = f.doc.hi;
  };
  if (kind == "flag") {
    s["type"] = "boolean";
    s["default"] = text == "true";
  } else if (kind == "int" || kind == "number") {
    s["type"] = kind == "int" ? "integer" : "number";
    range(s);
    s["default"] = parse_number(text, f.doc.name);
  } else if (kind == "triple" || kind == "list") {
    s["type"] = "array";
    s["items"] = {{"type", kind == "triple" ? "number" : "integer"}};
    if (kind == "list") range(s["items"]);
    if (kind == "triple") s["minItems"] = 3;
    if (kind == "triple") s["maxItems"] = 3;
  } else if (kind == "choice") {
    s["enum"] = std::get<FieldRef::Choice>(f.target).names;
    s["default"] = text;
  } else {
    s["type"] = "string";
    s["default"] = text;
  }
  if (f.doc.needed) s.erase("default");
  s["description"] = std::string(f.doc.help) + (f.doc.unit.empty() ? "" : " [" + std::string(f.doc.unit) + "]");
  return s;
}

}  // namespace osteo
