#include "grey_choice.h"

#include <imgui.h>

#include "osteo/core/base/translate.h"
#include "osteo/display/view/slices.h"

namespace osteo::inline app {

int grey_choice(int selected, float high, int first_key, const std::string& more) {
  const std::string names[] = {tr("Bone"), tr("Soft"), tr("Temporal")};
  ImGui::BeginGroup();
  const int pressed = choice("greys", names, selected, high);
  ImGui::EndGroup();
  if (!ImGui::IsItemHovered()) return pressed;
  std::string help;
  for (std::size_t n = 0; n < grey_presets().size(); ++n) {
    const HuWindow& hu = grey_presets()[n].hu;
    help += (n > 0 ? "\n" : "") + filled(first_key > 0 ? tr("{name}: window {window}, level {level} (F{key})")
                                                       : tr("{name}: window {window}, level {level}"),
                                         {{"name", names[n]},
                                          {"window", shown_number(hu.width, 0)},
                                          {"level", shown_number(hu.level, 0)},
                                          {"key", std::to_string(first_key + static_cast<int>(n))}});
  }
  ImGui::SetTooltip("%s%s%s", help.c_str(), more.empty() ? "" : "\n", more.c_str());
  return pressed;
}

}  // namespace osteo::inline app
