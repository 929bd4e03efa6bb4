#include "osteo/app/window/code_page.h"

#include <array>
#include <cmath>

#include "osteo/core/base/files.h"
#include "osteo/core/base/translate.h"
#include "ui_style.h"

namespace osteo::inline app {

std::optional<std::string> ask_for_code(WindowShell& shell, const std::string& host, const std::function<bool()>& stop,
                                        const std::filesystem::path& state_file) {
  constexpr int kEscapeKey = 256;
  shell.set_title("Osteotome");
  std::array<char, 32> typed{};
  bool close = false, done = false, reported = false;
  shell.on_key = [&](int key, int action, int) { close = close || (action != 0 && key == kEscapeKey); };
  while (!done && !close && !shell.closing() && !(stop && stop())) {
    if (!shell.poll()) continue;
    shell.new_frame();
    const auto w = static_cast<float>(shell.width()), h = static_cast<float>(shell.height());
    const float e = em(), wide = std::min(w, 30 * e), high = std::min(h, 14 * e);
    begin_fixed("code", {std::floor((w - wide) / 2), std::floor((h - high) / 2), wide, high},
                ImGuiWindowFlags_NoScrollbar);
    ImGui::TextWrapped("%s", filled(tr("Join the session at {host}"), {{"host", host}}).c_str());
    ImGui::TextWrapped("%s", tr("Type the code that it shows there: eight characters."));
    ImGui::Dummy({0, 0.4F * e});
    if (!reported) ImGui::SetKeyboardFocusHere();
    ImGui::SetNextItemWidth(16 * e);
    done = ImGui::InputText("##code", typed.data(), typed.size(),
                            ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_CharsUppercase);
    ImGui::SameLine();
    done = ImGui::Button(tr("join (Enter)")) || done;
    ImGui::Dummy({0, 0.4F * e});
    if (ImGui::Button(tr("close (Esc)"))) close = true;
    ImGui::End();
    shell.show_page();
    if (!reported && !state_file.empty())
      write_atomically(state_file, [](const std::filesystem::path& to) { write_file(to, "{\"code_page\": true}"); });
    reported = true;
  }
  shell.on_key = nullptr;
  return done ? std::optional(std::string(typed.data())) : std::nullopt;
}

}  // namespace osteo::inline app
