#include "osteo/core/base/param.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

template <class... Ts>
struct Overload : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overload(Ts...) -> Overload<Ts...>;

std::string with_unit(double value, std::string_view unit) {
  std::string text = format_number(value);
  if (!unit.empty()) text.append(" ").append(unit);
  return text;
}

void check_range(const FieldRef& field, std::string_view name, double value) {
  const FieldDoc& d = field.doc;
  if (value >= d.lo && value <= d.hi) return;
  std::string range;
  if (std::isfinite(d.lo) && std::isfinite(d.hi)) {
    range = "between " + with_unit(d.lo, d.unit) + " and " + with_unit(d.hi, d.unit);
  } else if (std::isfinite(d.lo)) {
    range = "at least " + with_unit(d.lo, d.unit);
  } else {
    range = "at most " + with_unit(d.hi, d.unit);
  }
  throw Error(ExitCode::usage, std::string(name) + " is " + format_number(value) + " but must be " + range);
}

constexpr std::array<OldName, 12> kOldCommands = {{{"console", "nerve-console"},
                                                   {"curve", "virtual-fixture"},
                                                   {"guide", "suggest-threshold"},
                                                   {"hand-over", "export-slicer"},
                                                   {"monitor", "nerve-monitor"},
                                                   {"pieces", "separate-fragments"},
                                                   {"plan", "export-result"},
                                                   {"scene", "estimate-cost"},
                                                   {"series", "list-series"},
                                                   {"skin", "embed-surface"},
                                                   {"take-back", "import-slicer"},
                                                   {"watch", "watch-folder"}}};

constexpr std::array<OldName, 17> kOldFields = {{{"anybody", "allow_all"},
                                                 {"attend", "min_trainees"},
                                                 {"by_place", "match_by_position"},
                                                 {"content_hu", "lumen_hu"},
                                                 {"keep_loose", "keep_floating"},
                                                 {"leash_mm", "tolerance_radius_mm"},
                                                 {"least_mm2", "min_area_mm2"},
                                                 {"least_mm3", "min_volume_mm3"},
                                                 {"least_mpa", "min_mpa"},
                                                 {"least_quality", "min_quality"},
                                                 {"least_step_ms", "min_step_ms"},
                                                 {"max_unsure_mm", "max_uncertain_mm"},
                                                 {"most_mpa", "max_mpa"},
                                                 {"most_n", "max_force_n"},
                                                 {"most_points", "max_points"},
                                                 {"patience_s", "silence_s"},
                                                 {"pieces", "fragments"}}};

}  // namespace

std::span<const OldName> old_command_names() {
  return kOldCommands;
}

std::span<const OldName> old_field_names() {
  return kOldFields;
}

std::string_view current_command(std::string_view name) {
  const auto it =
      std::find_if(kOldCommands.begin(), kOldCommands.end(), [&](const OldName& n) { return n.old == name; });
  return it == kOldCommands.end() ? name : it->current;
}

std::string renamed_text(std::string_view old, std::string_view current) {
  return "'" + std::string(old) + "' is now called '" + std::string(current) +
         "'; the old name is accepted until version 0.3";
}

const FieldRef* find_field(std::span<const FieldRef> fields, std::string_view name) {
  const auto of = [&](std::string_view wanted) -> const FieldRef* {
    const auto it = std::find_if(fields.begin(), fields.end(), [&](const FieldRef& f) { return f.doc.name == wanted; });
    return it == fields.end() ? nullptr : &*it;
  };
  if (const FieldRef* const field = of(name); field != nullptr) return field;
  const auto old = std::find_if(kOldFields.begin(), kOldFields.end(), [&](const OldName& n) { return n.old == name; });
  return old == kOldFields.end() ? nullptr : of(old->current);
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string_view trimmed(std::string_view text, std::string_view blanks) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string format_number(double value) {
  std::array<char, 32> buffer{};
  const auto [end, ec] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end};
}

double parse_number(std::string_view text, std::string_view what) {
  double value = 0;
  const char* const last = text.data() + text.size();
  const auto [end, ec] = std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), last, value);
  if (ec != std::errc() || end != last || !std::isfinite(value)) {
    throw Error(ExitCode::usage, std::string(what) + ": '" + std::string(text) + "' is not a number");
  }
  return value;
}

std::string FieldRef::flag() const {
  std::string text = "--";
  for (const char c : doc.name) text += c == '_' ? '-' : c;
  return text;
}

std::string_view FieldRef::kind() const {
  return std::visit(
      Overload{[](bool*) { return std::string_view("flag"); }, [](int*) { return std::string_view("int"); },
               [](double*) { return std::string_view("number"); },
               [](std::string*) { return std::string_view("text"); },
               [](std::array<double, 3>*) { return std::string_view("triple"); },
               [](std::vector<int>*) { return std::string_view("list"); },
               [](Choice) { return std::string_view("choice"); }},
      target);
}

std::string FieldRef::to_text() const {
  return std::visit(
      Overload{[](bool* p) { return std::string(*p ? "true" : "false"); }, [](int* p) { return std::to_string(*p); },
               [](double* p) { return format_number(*p); }, [](std::string* p) { return *p; },
               [](std::array<double, 3>* p) {
                 return format_number((*p)[0]) + "," + format_number((*p)[1]) + "," + format_number((*p)[2]);
               },
               [](std::vector<int>* p) {
                 std::string text;
                 for (const int v : *p) text += (text.empty() ? "" : ",") + std::to_string(v);
                 return text;
               },
               [](Choice c) { return std::string(c.names[static_cast<std::size_t>(*c.index)]); }},
      target);
}

void FieldRef::from_text(std::string_view text, std::string_view called) const {
  const std::string name = called.empty() ? flag() : std::string(called);
  std::visit(Overload{[&](bool* p) {
                        if (text == "true" || text == "1" || text == "yes" || text.empty()) {
                          *p = true;
                        } else if (text == "false" || text == "0" || text == "no") {
                          *p = false;
                        } else {
                          throw Error(ExitCode::usage,
                                      name + ": '" + std::string(text) + "' is neither true nor false");
                        }
                      },
                      [&](int* p) {
                        const double value = parse_number(text, name);
                        if (value != std::floor(value) || std::abs(value) > 2e9) {
                          throw Error(ExitCode::usage, name + ": '" + std::string(text) + "' is not a whole number");
                        }
                        check_range(*this, name, value);
                        *p = static_cast<int>(value);
                      },
                      [&](double* p) {
                        const double value = parse_number(text, name);
                        check_range(*this, name, value);
                        *p = value;
                      },
                      [&](std::string* p) { *p = text; },
                      [&](std::array<double, 3>* p) {
                        std::array<double, 3> value{};
                        std::string_view rest = text;
                        for (std::size_t i = 0; i < 3; ++i) {
                          const std::size_t comma = rest.find(',');
                          if ((comma == std::string_view::npos) != (i == 2)) {
                            throw Error(ExitCode::usage,
                                        name + ": '" + std::string(text) + "' is not three numbers like 1,2,3");
                          }
                          value[i] = parse_number(rest.substr(0, comma), name);
                          check_range(*this, name, value[i]);
                          rest = i == 2 ? std::string_view() : rest.substr(comma + 1);
                        }
                        *p = value;
                      },
                      [&](std::vector<int>* p) {
                        std::vector<int> values;
                        for (std::string_view rest = text; !rest.empty();) {
                          const std::size_t comma = rest.find(',');
                          const double value = parse_number(rest.substr(0, comma), name);
                          if (value != std::floor(value) || std::abs(value) > 2e9)
                            throw Error(ExitCode::usage,
                                        name + ": '" + std::string(rest.substr(0, comma)) + "' is not a whole number");
                          check_range(*this, name, value);
                          values.push_back(static_cast<int>(value));
                          rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
                        }
                        *p = std::move(values);
                      },
                      [&](Choice c) {
                        for (std::size_t i = 0; i < c.names.size(); ++i) {
                          if (c.names[i] == text) {
                            *c.index = static_cast<int>(i);
                            return;
                          }
                        }
                        std::string list;
                        for (const auto choice : c.names) list.append(list.empty() ? "" : ", ").append(choice);
                        throw Error(ExitCode::usage, name + ": '" + std::string(text) + "' is not one of " + list);
                      }},
             target);
}

std::string nearest_name(std::string_view word, std::span<const std::string> known) {
  std::string best;
  std::size_t best_cost = std::max<std::size_t>(2, word.size() / 3) + 1;
  std::vector<std::size_t> row;
  for (const std::string& name : known) {
    row.resize(name.size() + 1);
    for (std::size_t j = 0; j < row.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= word.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i;
      for (std::size_t j = 1; j <= name.size(); ++j) {
        const std::size_t substitute = diagonal + (word[i - 1] == name[j - 1] ? 0 : 1);
        diagonal = row[j];
        row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitute});
      }
    }
    if (row.back() < best_cost) {
      best_cost = row.back();
      best = name;
    }
  }
  return best;
}

}  // namespace osteo
