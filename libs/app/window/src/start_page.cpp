#include "osteo/app/window/start_page.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

#include "file_dialog.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"
#include "start_list.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

// GLFW's numbers.
enum : int {
  kKeyEscape = 256,
  kEnter = 257,
  kBackspace = 259,
  kDown = 264,
  kUp = 265,
  kPageUp = 266,
  kPageDown = 267,
  kF11 = 300,
  kKeypadEnter = 335
};

void write_state(const StartList& list, std::uint64_t pictures, int em_pixels, const std::filesystem::path& file) {
  if (file.empty()) return;
  Json entries = Json::list();
  for (const StartEntry& e : list.entries()) entries.push_back(e.words);
  const Json j{{"page", "start"},
               {"pictures", pictures},
               {"entries", entries},
               {"selected", list.selected()},
               {"message", list.message()},
               {"tick", 0},
               {"em_pixels", em_pixels},
               {"folder", list.folder().string()},
               {"language", enum_names(Language{})[static_cast<std::size_t>(language())]}};
  const std::filesystem::path beside = file.string() + ".new";
  std::ofstream(beside) << j.dump() << '\n';
  std::error_code ignored;
  std::filesystem::rename(beside, file, ignored);
}

// True when an entry was double-clicked.
bool draw_entries(StartList& list, bool follow) {
  bool opened = false;
  StartEntry::Group group{};
  bool first = true;
  int n = 0;
  for (const StartEntry& e : list.entries()) {
    if (first || e.group != group) {
      if (!first) ImGui::Dummy({0, em() * 0.4F});
      const char* const groups[] = {tr("opened last"), tr("sessions"), tr("folders in {folder}")};
      ImGui::TextDisabled("%s",
                          filled(groups[static_cast<int>(e.group)], {{"folder", list.folder().string()}}).c_str());
      group = e.group;
      first = false;
    }
    ImGui::PushID(n);
    const bool dull = e.kind == FolderKind::nothing || e.kind == FolderKind::folder;
    const bool selected = n == list.selected();
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(dull ? theme().quiet : theme().text));
    if (ImGui::Selectable(((selected ? "> " : "   ") + e.words).c_str(), selected,
                          ImGuiSelectableFlags_AllowDoubleClick)) {
      list.select(n);
      opened = opened || ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
    }
    ImGui::PopStyleColor();
    if (selected && follow) ImGui::SetScrollHereY();
    ImGui::PopID();
    ++n;
  }
  return opened;
}

}  // namespace

std::optional<StartChoice> run_start_page(WindowShell& shell, PersonSettings& person, const StartOptions& options) {
  take_theme(person.values.theme);
  use_language(language_named(person.values.language));
  shell.set_title("Osteotome");
  StartList list(person.cases(), options.folder.empty() ? std::filesystem::current_path() : options.folder);
  list.say(options.message);
  std::optional<StartChoice> choice;
  shell.mirror_mouse = person.values.mirror_mouse;
  bool open = false, close = false, follow = true, ask = false;
  FileDialog dialog;
  const bool dialogs = FileDialog::there();
  shell.on_key = [&](int key, int action, int) {
    if (action == 0) return;
    if (key == kDown || key == kUp) list.move(key == kDown ? 1 : -1);
    if (key == kPageDown || key == kPageUp) list.move(key == kPageDown ? 10 : -10);
    if (key == kBackspace) list.up();
    if (key == kEnter || key == kKeypadEnter) open = true;
    if (key == kF11) {
      shell.toggle_full_screen();
      person.values.full_screen = shell.full_screen();
    }
    if (key == 'O' && dialogs) ask = true;
    if (key == 'Q' || key == kKeyEscape) close = true;
    follow = true;
  };
  ImGui::GetIO().ConfigFlags &= ~ImGuiConfigFlags_NavEnableKeyboard;
  std::uint64_t pictures = 0;
  while (!choice && !close && !shell.closing() && !(options.stop && options.stop())) {
    if (!shell.poll()) continue;
    if (const auto dropped = shell.take_dropped(); !dropped.empty()) choice = list.take(dropped);
    if (std::exchange(ask, false)) list.say(dialog.is_open() ? list.message() : dialog.open(list.folder()));
    if (const auto answer = dialog.poll()) {
      list.say(answer->why);
      if (answer->chosen) choice = list.take({*answer->chosen});
    }
    shell.new_frame();
    const auto w = static_cast<float>(shell.width()), h = static_cast<float>(shell.height());
    const float e = em(), wide = std::min(w, 60 * e);
    begin_fixed("start", {std::floor((w - wide) / 2), 0, wide, h}, ImGuiWindowFlags_NoScrollbar);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    fitted_text(ImGui::GetWindowDrawList(), {at.x, at.y, wide - 2 * e, 2.2F * e}, 2.2F * e, theme().text, "Osteotome");
    ImGui::Dummy({0, 2.4F * e});
    ImGui::TextWrapped(
        "%s",
        tr("Choose a case: a folder made by 'osteo prepare', or drop one here. Up, Down and Enter; Backspace: the "
           "folder above; Q: close."));
    if (!list.message().empty()) {
      ImGui::PushStyleColor(ImGuiCol_Text, im_colour(ink_of(palette::kYellow)));
      ImGui::TextWrapped("! %s", list.message().c_str());
      ImGui::PopStyleColor();
    }
    const float below = ImGui::GetFrameHeightWithSpacing() * 2 + e * 1.2F;
    ImGui::BeginChild("list", {0, std::max(4 * e, ImGui::GetContentRegionAvail().y - below)}, true);
    open = draw_entries(list, std::exchange(follow, false)) || open;
    ImGui::EndChild();
    if (ImGui::Button(tr("open (Enter)"))) open = true;
    ImGui::SameLine();
    if (ImGui::Button(tr("the folder above (Backspace)"))) list.up();
    if (dialogs) {
      ImGui::SameLine();
      if (ImGui::Button(tr("dialog (O)"))) ask = true;
    }
    ImGui::SameLine();
    if (ImGui::Button(tr("close (Q)"))) close = true;
    ImGui::Checkbox(tr("remember cases"), &person.values.remember_cases);
    ImGui::SameLine();
    if (ImGui::Button(tr("forget them"))) {
      person.forget_cases();
      list.forget_recent();
    }
    ImGui::SameLine();
    ImGui::TextDisabled("%s", tr("text: Ctrl +, Ctrl -"));
    ImGui::End();
    if (std::exchange(open, false)) choice = list.open();
    shell.show_page();
    write_state(list, ++pictures, shell.em_pixels(), options.state_file);
  }
  shell.on_key = nullptr;
  return choice;
}

}  // namespace osteo::inline app
