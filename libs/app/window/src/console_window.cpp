#include "osteo/app/window/console_window.h"

#include <imgui.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>

#include "audio_out.h"
#include "drawn_state.h"
#include "monitor_panel.h"
#include "monitor_screen.h"
#include "osteo/app/window/person_settings.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

constexpr int kConsoleEscape = 256, kF11Key = 300;  // GLFW's numbers

// The card plays what the controller sounds like; the controller is exchanged while it is kept out.
class ConsoleSound {
 public:
  explicit ConsoleSound(bool on) {
    if (!on) return;
    try {
      card_.emplace([this](std::span<float> out) {
        std::fill(out.begin(), out.end(), 0.0F);
        if (sound_ != nullptr) sound_->mix(out);
      });
    } catch (const Error& e) {
      failure_ = e.what();
    }
  }
  void follow(MonitorSound* sound) {
    if (!card_) return;
    const AudioOut::Pause pause(*card_);
    sound_ = sound;
  }
  [[nodiscard]] std::string words() const {
    return card_              ? filled(tr("sound through {driver}"), {{"driver", card_->driver()}})
           : failure_.empty() ? tr("no sound")
                              : filled(tr("no sound: {why}"), {{"why", failure_}});
  }

 private:
  MonitorSound* sound_ = nullptr;
  std::string failure_;
  std::optional<AudioOut> card_;
};

void write_state(const std::filesystem::path& file, const ConsoleFacts& facts, MonitorController* controller,
                 bool answers, std::uint64_t pictures) {
  if (file.empty()) return;
  Json j{{"page", "console"},      {"pictures", pictures},     {"connected", facts.connected},
         {"ended", facts.ended},   {"samples", facts.samples}, {"lost", facts.lost},
         {"events", facts.events}, {"trouble", facts.trouble}};
  if (controller != nullptr) {
    j["channels"] = controller->wiring().labels();
    j["answers"] = answers;
    j["seconds"] = controller->screen().view().now_s;
    j["lines"] = controller->screen().events();
    j["alarm"] = controller->screen().alarm();
    j["frozen"] = controller->screen().frozen();
    j["stimulates"] = controller->stimulates();
    if (controller->stimulates()) {
      const StimulatorSetting now = controller->stimulator();
      j["current_ma"] = now.current_ma;
      j["search"] = now.search;
    }
    if (const auto found = controller->screen().threshold_ma()) j["threshold_ma"] = *found;
    j["muted"] = controller->sound().muted();
    j["gains_uv"] = Json::list();
    for (std::size_t ch = 0; ch < controller->wiring().channels.size(); ++ch)
      j["gains_uv"].push_back(controller->screen().gain_uv(ch));
  }
  add_drawn(j);
  const std::filesystem::path beside = file.string() + ".new";
  std::ofstream(beside) << j.dump() << '\n';
  std::error_code ignored;
  std::filesystem::rename(beside, file, ignored);
}

}  // namespace

void run_console_window(WindowShell& shell, const ConsoleOptions& options) {
  const PersonSettings person(PersonSettings::usual_file());
  take_theme(person.values.theme);
  shell.set_scale(person.values.scale);
  shell.set_title("Osteotome nerve monitor - " + options.server);
  if (!options.state_file.empty()) keep_places();
  std::shared_ptr<MonitorController> controller;
  ConsoleSound sound(options.sound);
  MonitorPanel panel;
  bool close = false;
  shell.on_key = [&](int key, int action, int) {
    if (action != 1) return;
    if (key == 'Q' || key == kConsoleEscape) close = true;
    if (key == kF11Key) shell.toggle_full_screen();
    if (key == 'G') panel.show_answers(!panel.answers());
    if (!controller) return;
    if (key == 'F') controller->screen().freeze(!controller->screen().frozen());
    if (key == 'M') controller->sound().mute(!controller->sound().muted());
    if (key == 'S') panel.switch_stimulator(*controller);
    if (key == 'T') panel.find_threshold(*controller);
  };
  std::uint64_t pictures = 0;
  while (!close && !shell.closing() && !(options.stop && options.stop())) {
    if (!shell.poll()) continue;
    if (std::shared_ptr<MonitorController> now = options.controller(); now != controller) {
      sound.follow(now ? &now->sound() : nullptr);
      controller = std::move(now);
    }
    const ConsoleFacts facts = options.facts();
    shell.new_frame();
    const auto w = static_cast<float>(shell.width()), h = static_cast<float>(shell.height());
    // As high as its words need.
    std::string link = facts.ended ? tr("the session has ended") : tr("connected");
    if (facts.lost > 0)
      link = filled(tr("{link}, {n} samples lost on the way"), {{"link", link}, {"n", std::to_string(facts.lost)}});
    const std::string told = !facts.trouble.empty()
                                 ? "! " + facts.trouble
                                 : options.server + "  " + link + "  " + sound.words() + "  " +
                                       (controller && controller->stimulates()
                                            ? tr("F freeze  M mute  G view  S stimulator  T threshold  Q close")
                                            : tr("F freeze  M mute  G view  Q close"));
    const float pad = ImGui::GetStyle().WindowPadding.x;
    const float foot = ImGui::CalcTextSize(told.c_str(), nullptr, false, w - 2 * pad).y + 2 * pad;
    if (controller) {
      panel.fill({0, 0, w, h - foot});
      panel.draw(*controller);
    } else {
      begin_fixed("waiting", {0, 0, w, h - foot});
      kit_text(filled(tr("Waiting for a nerve monitor at {server}: 'osteo rehearse CASE --stream igtl:PORT', or 'osteo "
                         "stream SESSION --to igtl:PORT'."),
                      {{"server", options.server}}),
               theme().text);
      ImGui::End();
    }
    begin_fixed("foot", {0, h - foot, w, foot}, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
    kit_text(told, facts.trouble.empty() ? theme().quiet : ink_of(palette::kYellow));
    ImGui::End();
    shell.show_page();
    write_state(options.state_file, facts, controller.get(), panel.answers(), ++pictures);
  }
  sound.follow(nullptr);
}

}  // namespace osteo::inline app
