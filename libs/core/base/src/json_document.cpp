#include "osteo/core/base/json_document.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

namespace osteo {
namespace {

using nlohmann::ordered_json;

Json from_library(const ordered_json& j) {
  switch (j.type()) {
    case ordered_json::value_t::boolean:
      return j.get<bool>();
    case ordered_json::value_t::number_integer:
      return j.get<std::int64_t>();
    case ordered_json::value_t::number_unsigned:
      return j.get<std::uint64_t>();
    case ordered_json::value_t::number_float:
      return j.get<double>();
    case ordered_json::value_t::string:
      return j.get<std::string>();
    case ordered_json::value_t::array: {
      Json list = Json::list();
      for (const auto& v : j) list.push_back(from_library(v));
      return list;
    }
    case ordered_json::value_t::object: {
      Json object = Json::object();
      for (const auto& [key, v] : j.items()) object[key] = from_library(v);
      return object;
    }
    default:
      return {};
  }
}

void write_text(std::string& out, const std::string& text) {
  const bool plain =
      std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c < '\x7f' && c != '"' && c != '\\'; });
  if (plain) {
    out.append("\"").append(text).append("\"");
  } else {
    out += ordered_json(text).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  }
}

void write_number(std::string& out, double v) {
  if (!std::isfinite(v)) {
    out += "null";
    return;
  }
  char digits[64];
  out.append(digits, nlohmann::detail::to_chars(digits, digits + sizeof digits, v));
}

}  // namespace

Json::Json() noexcept = default;
Json::Json(std::string text) noexcept : value_(std::move(text)) {}
Json::Json(List list) noexcept : value_(std::move(list)) {}
Json::Json(const Json&) = default;
Json::Json(Json&&) noexcept = default;
Json& Json::operator=(const Json&) = default;
Json& Json::operator=(Json&&) noexcept = default;
Json::~Json() = default;

Json::Json(std::initializer_list<Json> items) {
  const bool pairs = std::all_of(items.begin(), items.end(), [](const Json& i) {
    return i.items().size() == 2 && i.items().front().text() != nullptr;
  });
  if (!pairs) {
    value_ = List(items);
    return;
  }
  value_ = Object();
  for (const Json& i : items) (*this)[*i.items().front().text()] = i.items().back();
}

Json Json::list() {
  return List();
}

Json Json::object() {
  Json j;
  j.value_ = Object();
  return j;
}

std::optional<Json> Json::parse(std::string_view text) {
  const ordered_json j = ordered_json::parse(text, nullptr, false);
  if (j.is_discarded()) return std::nullopt;
  return from_library(j);
}

Json& Json::operator[](std::string_view key) {
  if (is_null()) value_ = Object();
  Object& object = std::get<Object>(value_);
  const auto it = std::find_if(object.begin(), object.end(), [&](const Member& m) { return m.key == key; });
  return it != object.end() ? it->value : object.emplace_back(Member{std::string(key), {}}).value;
}

const Json* Json::find(std::string_view key) const {
  const Object& object = members();
  const auto it = std::find_if(object.begin(), object.end(), [&](const Member& m) { return m.key == key; });
  return it == object.end() ? nullptr : &it->value;
}

void Json::push_back(Json value) {
  if (is_null()) value_ = List();
  std::get<List>(value_).push_back(std::move(value));
}

Json& Json::back() {
  return std::get<List>(value_).back();
}

void Json::erase(std::string_view key) {
  if (auto* const object = std::get_if<Object>(&value_))
    std::erase_if(*object, [&](const Member& m) { return m.key == key; });
}

const Json::List& Json::items() const {
  static const List none;
  const auto* const list = std::get_if<List>(&value_);
  return list == nullptr ? none : *list;
}

const Json::Object& Json::members() const {
  static const Object none;
  const auto* const object = std::get_if<Object>(&value_);
  return object == nullptr ? none : *object;
}

std::optional<double> Json::number() const {
  if (const auto* const v = std::get_if<double>(&value_)) return *v;
  if (const auto* const v = std::get_if<std::int64_t>(&value_)) return static_cast<double>(*v);
  if (const auto* const v = std::get_if<std::uint64_t>(&value_)) return static_cast<double>(*v);
  return std::nullopt;
}

bool operator==(const Json& a, const Json& b) {
  if (a.number() && b.number()) return *a.number() == *b.number();
  return a.value_ == b.value_;
}

namespace {

// The items between brackets, each on a line of its own where there is an indent.
template <class Items, class WriteItem>
void write_all(std::string& out, const Items& items, const char* brackets, int indent, std::size_t level,
               const WriteItem& write_item) {
  out += brackets[0];
  const auto line = [&](std::size_t depth) {
    if (indent >= 0) out.append("\n").append(depth * static_cast<std::size_t>(indent), ' ');
  };
  for (const auto& item : items) {
    if (&item != items.data()) out += ',';
    line(level + 1);
    write_item(item);
  }
  if (!items.empty()) line(level);
  out += brackets[1];
}

}  // namespace

std::string Json::dump(int indent) const {
  std::string out;
  const auto write = [&](const auto& self, const Json& j, std::size_t level) -> void {
    struct Visitor {
      std::string& out;
      int indent;
      std::size_t level;
      const decltype(self)& again;
      void operator()(std::monostate) const { out += "null"; }
      void operator()(bool v) const { out += v ? "true" : "false"; }
      void operator()(std::int64_t v) const { out += std::to_string(v); }
      void operator()(std::uint64_t v) const { out += std::to_string(v); }
      void operator()(double v) const { write_number(out, v); }
      void operator()(const std::string& v) const { write_text(out, v); }
      void operator()(const List& v) const {
        write_all(out, v, "[]", indent, level, [&](const Json& item) { again(again, item, level + 1); });
      }
      void operator()(const Object& v) const {
        write_all(out, v, "{}", indent, level, [&](const Member& m) {
          write_text(out, m.key);
          out += indent >= 0 ? ": " : ":";
          again(again, m.value, level + 1);
        });
      }
    };
    std::visit(Visitor{out, indent, level, self}, j.value_);
  };
  write(write, *this, 0);
  return out;
}

std::ostream& operator<<(std::ostream& out, const Json& json) {
  return out << json.dump();
}

}  // namespace osteo
