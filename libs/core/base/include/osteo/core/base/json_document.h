// JSON that the program writes: a tree of values, built in place, and its text. What people write is read by json.h,
// with lines.
#pragma once
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <iosfwd>
#include <map>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace osteo {

/// One value: null, flag, whole number, number, text, list, or object whose members keep the order in which they came.
///   Json j{{"osteotome_case", 1}, {"names", names}};   j["size_mm"] = {1.5, 2.5};   j["steps"].push_back({{"id",
///   id}});
/// In braces, pairs that all begin with a text make an object, everything else a list. Numbers keep whether they are
/// whole; others are written with as few digits as give the same double back, NaN and infinity as null. Bytes that are
/// not UTF-8 are written as U+FFFD.
class Json {
 public:
  struct Member;
  using List = std::vector<Json>;
  using Object = std::vector<Member>;

  // What these hold is made where a member is known: clang asks for all of it.
  Json() noexcept;  ///< null
  Json(std::nullptr_t) noexcept : Json() {}
  Json(std::same_as<bool> auto flag) noexcept : value_(flag) {}
  Json(std::signed_integral auto whole) noexcept : value_(std::in_place_type<std::int64_t>, whole) {}
  Json(std::unsigned_integral auto whole) noexcept requires(!std::same_as<decltype(whole), bool>)
      : value_(std::in_place_type<std::uint64_t>, whole) {}
  Json(std::floating_point auto number) noexcept : value_(std::in_place_type<double>, number) {}
  Json(const char* text) : Json(std::string(text)) {}
  Json(std::string_view text) : Json(std::string(text)) {}
  Json(std::string text) noexcept;
  Json(List list) noexcept;
  Json(std::initializer_list<Json> items);
  /// A list of what else Json is made from.
  template <std::ranges::input_range R>
  requires(!std::convertible_to<R, std::string_view> && !std::same_as<std::remove_cvref_t<R>, List> &&
           !std::same_as<std::remove_cvref_t<R>, Json> && std::constructible_from<Json, std::ranges::range_value_t<R>>)
      Json(const R& range)
      : Json(List()) {
    for (const auto& v : range) push_back(Json(v));
  }
  /// An object, in the map's order.
  template <class T>
  Json(const std::map<std::string, T>& map) : Json(object()) {
    for (const auto& [key, v] : map) (*this)[key] = Json(v);
  }
  Json(const Json&);
  Json(Json&&) noexcept;
  Json& operator=(const Json&);
  Json& operator=(Json&&) noexcept;
  ~Json();

  [[nodiscard]] static Json list();
  [[nodiscard]] static Json object();
  /// Nothing when the text is not JSON.
  [[nodiscard]] static std::optional<Json> parse(std::string_view text);

  /// A member, made where there is none; null becomes an object.
  Json& operator[](std::string_view key);
  /// Null where there is none.
  [[nodiscard]] const Json* find(std::string_view key) const;
  /// To the end of a list; null becomes one.
  void push_back(Json value);
  [[nodiscard]] Json& back();
  /// No-op where there is none.
  void erase(std::string_view key);

  // What it holds; an empty list, an empty object, or nothing.
  [[nodiscard]] const List& items() const;
  [[nodiscard]] const Object& members() const;
  [[nodiscard]] const bool* flag() const { return std::get_if<bool>(&value_); }
  [[nodiscard]] std::optional<double> number() const;
  [[nodiscard]] const std::string* text() const { return std::get_if<std::string>(&value_); }
  [[nodiscard]] bool is_null() const { return std::holds_alternative<std::monostate>(value_); }
  [[nodiscard]] bool empty() const { return items().empty() && members().empty(); }

  friend bool operator==(const Json&, const Json&);

  /// On one line, or `indent` blanks a level.
  [[nodiscard]] std::string dump(int indent = -1) const;

 private:
  std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string, List, Object> value_;
};

struct Json::Member {
  std::string key;
  Json value;
  friend bool operator==(const Member&, const Member&) = default;
};

/// As dump() has it.
std::ostream& operator<<(std::ostream& out, const Json& json);

}  // namespace osteo
