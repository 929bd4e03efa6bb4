// The hand's part of the settings.
#include <imgui.h>

#include "hand_controller.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

// By the table, unless that key was given something else.
std::string key_of(HandFunction function, const HandButtons& buttons) {
  const ButtonCommand does = command_of(function);
  for (const Key& key : key_table()) {
    if (key.command == does.command && key.value == does.value && !buttons.function(key.code))
      return key_word(key.code);
  }
  return {};
}

}  // namespace

void HandController::draw(RehearsalControl& control) {
  row_.clear();
  ImGui::TextWrapped("%s", filled(tr("handle tilted {angle} deg"),
                                  {{"angle", shown_number(control.handle().tilted_rad() * 57.29577951308232, 0)}})
                               .c_str());
  if (kit_button(tr("as the view holds it (Insert)"), ButtonLook::usual, ImGui::GetContentRegionAvail().x))
    control.handle().straight();
  draw_buttons();
  give(control);
}

// What each thing is done by. One row for each; a press on it, then the button.
void HandController::draw_buttons() {
  ImGui::TextDisabled(tr("pedals, buttons, keys"));
  if (assign_.listens()) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(ink_of(palette::kYellow)));
    ImGui::TextWrapped("%s", filled(tr("Press what is to do it: {function}. Esc: nothing; Delete: none."),
                                    {{"function", words_of(*assign_.listens())}})
                                 .c_str());
    ImGui::PopStyleColor();
  } else {
    ImGui::TextWrapped("%s", said_.empty() ? tr("Choose a row, then press pedal, button or key.") : said_.c_str());
  }
  for (std::size_t n = 0; n < EnumNames<HandFunction>::values.size(); ++n) {
    const auto function = static_cast<HandFunction>(n);
    // What can be pressed now; of the rest only that there is more.
    std::string by, all;
    int absent = 0;
    const auto add = [](std::string& list, const std::string& name) { list += (list.empty() ? "" : ", ") + name; };
    if (const std::string key = key_of(function, person_.buttons); !key.empty()) add(by, key);
    all = by;
    for (const int b : person_.buttons.buttons_of(function)) {
      absent += there(b) ? 0 : 1;
      if (there(b)) add(by, button_name(b));
      add(all, there(b) ? button_name(b) : filled(tr("{button} (not plugged in)"), {{"button", button_name(b)}}));
    }
    if (by.empty()) by = absent > 0 ? filled(tr("{n} not plugged in"), {{"n", std::to_string(absent)}}) : "-";
    if (list_row(words_of(function) + "##" + std::to_string(n), by, assign_.listens() == function))
      assign_.listen(function);
    if (ImGui::IsItemFocused()) row_ = words_of(function);
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s: %s", words_of(function).c_str(), all.empty() ? tr("no button") : all.c_str());
  }
  if (kit_button(tr("all as usual"), ButtonLook::usual, ImGui::GetContentRegionAvail().x)) {
    person_.buttons = HandButtons::usual();
    said_ = tr("pedals, buttons and keys are as usual");
    assign_.cancel();
  }
}

}  // namespace osteo::inline app
