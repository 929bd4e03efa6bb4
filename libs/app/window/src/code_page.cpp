#include "osteo/app/window/code_page.h"

#include <cmath>

#include "osteo/core/base/files.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {

std::optional<std::string> ask_for_code(WindowShell& shell, const std::string& host, const std::function<bool()>& stop,
                                        const std::filesystem::path& state_file) {
  constexpr int kEscapeKey = 256;
  shell.set_title("Osteotome");
  std::string typed;
  bool close = false, done = false, reported = false;
  shell.on_key = [&](int key, int action, int) { close = close || (action != 0 && key == kEscapeKey); };
  while (!done && !close && !shell.closing() && !(stop && stop())) {
    if (!shell.poll()) continue;
    shell.new_frame();
    const auto w = static_cast<float>(shell.width()), h = static_cast<float>(shell.height());
    const float e = em(), wide = std::min(w, 30 * e), high = std::min(h, 20 * e);
    begin_fixed("code", {std::floor((w - wide) / 2), std::floor((h - high) / 2), wide, high});
    kit_text(filled(tr("Join the session at {host}"), {{"host", host}}), theme().text);
    kit_text(tr("Type the code that it shows there: eight characters."), theme().quiet);
    ImGui::Dummy({0, 0.4F * e});
    if (!reported) ImGui::SetKeyboardFocusHere();
    done = kit_field("##code", {}, typed, 0, ImGuiInputTextFlags_CharsUppercase);
    const float all = ImGui::GetContentRegionAvail().x;
    done = kit_button(tr("join (Enter)"), ButtonLook::main, all) || done;
    if (kit_button(tr("close (Esc)"), ButtonLook::usual, all)) close = true;
    ImGui::End();
    shell.show_page();
    if (!reported && !state_file.empty())
      write_atomically(state_file, [](const std::filesystem::path& to) { write_file(to, "{\"code_page\": true}"); });
    reported = true;
  }
  shell.on_key = nullptr;
  return done ? std::optional(typed) : std::nullopt;
}

}  // namespace osteo::inline app
