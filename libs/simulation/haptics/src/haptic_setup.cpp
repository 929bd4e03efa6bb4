#include "osteo/simulation/haptics/haptic_setup.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation {
namespace {

double value_of(const FieldRef& f) {
  if (const auto* const flag = std::get_if<bool*>(&f.target)) return **flag ? 1 : 0;
  if (const auto* const choice = std::get_if<FieldRef::Choice>(&f.target)) return *choice->index;
  return **std::get_if<double*>(&f.target);
}

std::vector<FieldRef> settings(HapticsParams& params) {
  return fields_of<HapticsParams>(params);
}

}  // namespace

const std::vector<std::string>& setting_names() {
  static const std::vector<std::string> names = [] {
    HapticsParams params;
    std::vector<std::string> all;
    for (const FieldRef& f : settings(params)) all.emplace_back(f.doc.name);
    return all;
  }();
  return names;
}

int setting_number(std::string_view name) {
  const auto& all = setting_names();
  const auto it = std::find(all.begin(), all.end(), name);
  return it == all.end() ? -1 : static_cast<int>(it - all.begin());
}

double setting_value(int number, std::string_view text) {
  HapticsParams params;
  const FieldRef f = settings(params)[static_cast<std::size_t>(number)];
  f.from_text(text, f.doc.name);
  return value_of(f);
}

double setting_value(int number, const HapticsParams& params) {
  HapticsParams copy = params;
  return value_of(settings(copy)[static_cast<std::size_t>(number)]);
}

void change_setting(HapticsParams& params, std::uint32_t number, double value) {
  HapticsParams changed = params;
  const auto fields = settings(changed);
  if (number >= fields.size()) throw Error(ExitCode::usage, "there is no setting " + std::to_string(number));
  const FieldRef& f = fields[number];
  const std::string name(f.doc.name);
  if (const auto* const flag = std::get_if<bool*>(&f.target)) {
    if (value != 0 && value != 1) throw Error(ExitCode::usage, name + " is on (1) or off (0)");
    **flag = value != 0;
  } else if (const auto* const choice = std::get_if<FieldRef::Choice>(&f.target)) {
    if (!(value >= 0 && value < static_cast<double>(choice->names.size()) && value == std::floor(value)))
      throw Error(ExitCode::usage, name + " has no choice " + format_number(value));
    *choice->index = static_cast<int>(value);
  } else {
    f.from_text(format_number(value), f.doc.name);
  }
  params = changed;
}

}  // namespace osteo::inline simulation
