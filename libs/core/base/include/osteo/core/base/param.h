// One declaration per parameter. A Params struct keeps its defaults in place and names each field once in
//   static void describe(Params& p, auto& visit) { visit({"lower", "keep voxels at or above", "HU", -1024, 3071},
//   p.lower); }
// From the list of FieldRef made of that come flags, help, pipeline keys, schema, reference pages and provenance.
#pragma once
#include <array>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace osteo {

struct FieldDoc {
  std::string_view name;       ///< snake_case; `half_width` is the flag `--half-width` and the JSON key `half_width`
  std::string_view help;       ///< one phrase, no full stop
  std::string_view unit = {};  ///< "HU", "mm", ... or empty
  double lo = -std::numeric_limits<double>::infinity();
  double hi = std::numeric_limits<double>::infinity();
  bool needed = false;  ///< in files: there is no default
};

/// The names of an enum that parameters use, in enum order. Beside each such enum, in its namespace, stands
/// `constexpr std::array<std::string_view, N> enum_names(E)`.
template <class E>
struct EnumNames {
  static constexpr auto values = enum_names(E{});
};

/// A reference to one field of a Params struct, its type erased to the few kinds that parameters may have.
/// Borrowed: valid as long as the struct it points into.
struct FieldRef {
  struct Choice {
    int* index;  ///< enum with int as underlying type
    std::span<const std::string_view> names;
  };
  using Target = std::variant<bool*, int*, double*, std::string*, std::array<double, 3>*, std::vector<int>*, Choice>;

  FieldDoc doc;
  Target target;

  [[nodiscard]] std::string_view kind() const;  ///< "flag", "int", "number", "text", "triple", "list" or "choice"
  [[nodiscard]] std::string to_text() const;    ///< round-trips through from_text
  /// Throws Error(usage) that names the field (as its flag, unless it is `called` otherwise), the range and the
  /// choices.
  void from_text(std::string_view text, std::string_view called = {}) const;
  [[nodiscard]] std::string flag() const;  ///< "--half-width"
};

namespace detail {
struct FieldCollector {
  std::vector<FieldRef> fields;
  template <class T>
  void operator()(FieldDoc doc, T& member) {
    if constexpr (std::is_enum_v<T>) {
      static_assert(std::is_same_v<std::underlying_type_t<T>, int>);
      fields.push_back({doc, FieldRef::Choice{reinterpret_cast<int*>(&member), EnumNames<T>::values}});
    } else {
      fields.push_back({doc, &member});
    }
  }
};
}  // namespace detail

/// Fields of `params` in declaration order. `S` has `static void describe(Params&, auto& visit)`.
template <class S>
[[nodiscard]] std::vector<FieldRef> fields_of(typename S::Params& params) {
  detail::FieldCollector collect;
  S::describe(params, collect);
  return std::move(collect.fields);
}

/// A name that a command, stage or field had in version 0.1, and the one that it has now. The old one is accepted
/// until version 0.3.
struct OldName {
  std::string_view old, current;
};
[[nodiscard]] std::span<const OldName> old_command_names();
[[nodiscard]] std::span<const OldName> old_field_names();
/// The current name of a command or stage: `name` itself when that is not an old one.
[[nodiscard]] std::string_view current_command(std::string_view name);
/// "'series' is now called 'list-series'; the old name is accepted until version 0.3".
[[nodiscard]] std::string renamed_text(std::string_view old, std::string_view current);
/// The field of this name, or of this old name; null when there is none.
[[nodiscard]] const FieldRef* find_field(std::span<const FieldRef> fields, std::string_view name);

/// The entry of `known` nearest to `word` by edit distance, or empty when nothing is near.
[[nodiscard]] std::string nearest_name(std::string_view word, std::span<const std::string> known);

/// ASCII letters in lower case.
[[nodiscard]] std::string lower_case(std::string text);
/// Without the blanks (those characters) at both ends: a part of the same text, which must outlive it.
[[nodiscard]] std::string_view trimmed(std::string_view text, std::string_view blanks = " \t");
/// Shortest text that reads back to the same double; no locale.
[[nodiscard]] std::string format_number(double value);
/// Strict: the whole text must be a finite number. Throws Error(usage) naming `what`.
[[nodiscard]] double parse_number(std::string_view text, std::string_view what);

}  // namespace osteo
