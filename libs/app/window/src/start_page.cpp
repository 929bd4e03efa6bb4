#include "osteo/app/window/start_page.h"

#include <imgui.h>

#include <utility>

#include "file_dialog.h"
#include "osteo/core/base/translate.h"
#include "start_view.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

// GLFW's numbers.
enum : int {
  kKeyEscape = 256,
  kEnter = 257,
  kBackspace = 259,
  kRight = 262,
  kLeft = 263,
  kDown = 264,
  kUp = 265,
  kPageUp = 266,
  kPageDown = 267,
  kF11 = 300,
  kKeypadEnter = 335
};

// Names of the built-in procedures, for the catalogues: what their files say is looked up here.
[[maybe_unused]] constexpr const char* kProcedureNames[] = {tr_later("Cortical mastoidectomy with facial recess"),
                                                            tr_later("Window into the mastoid"),
                                                            tr_later("Mandible sawn on both sides and drawn forward")};

}  // namespace

std::optional<StartChoice> run_start_page(WindowShell& shell, PersonSettings& person, const StartOptions& options) {
  take_theme(person.values.theme);
  use_language(language_named(person.values.language));
  shell.set_title("Osteotome");
  if (!options.state_file.empty()) keep_places();
  StartPage page(person, options);
  StartList& list = page.list();
  std::optional<StartChoice> choice;
  shell.mirror_mouse = person.values.mirror_mouse;
  FileDialog dialog;
  shell.on_key = [&](int key, int action, int) {
    if (action == 0) return;
    if (key == kDown || key == kRight) list.move(1);
    if (key == kUp || key == kLeft) list.move(-1);
    if (key == kPageDown || key == kPageUp) list.move(key == kPageDown ? 10 : -10);
    if (key == kBackspace) list.up();
    if (key == kEnter || key == kKeypadEnter) page.open = true;
    if (key == kF11) {
      shell.toggle_full_screen();
      person.values.full_screen = shell.full_screen();
    }
    if (key == 'O' && page.dialogs) page.ask = true;
    if (key == 'Q' || key == kKeyEscape) page.close = true;
    page.follow = true;
  };
  ImGui::GetIO().ConfigFlags &= ~ImGuiConfigFlags_NavEnableKeyboard;
  std::uint64_t pictures = 0;
  while (!choice && !page.close && !shell.closing() && !(options.stop && options.stop())) {
    if (!shell.poll()) continue;
    page.poll();
    if (const auto dropped = shell.take_dropped(); !dropped.empty()) choice = list.take(dropped);
    if (std::exchange(page.ask, false)) list.say(dialog.is_open() ? list.message() : dialog.open(list.folder()));
    if (const auto answer = dialog.poll()) {
      list.say(answer->why);
      if (answer->chosen) choice = list.take({*answer->chosen});
    }
    shell.new_frame();
    page.draw(static_cast<float>(shell.width()), static_cast<float>(shell.height()));
    if (std::exchange(page.open, false)) choice = list.open();
    if (const bool teach = std::exchange(page.teach, false); choice) choice->teach = teach;
    shell.show_page();
    page.write_state(++pictures, shell.em_pixels());
  }
  shell.on_key = nullptr;
  return choice;
}

}  // namespace osteo::inline app
