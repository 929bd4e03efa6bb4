#include "main_view.h"

#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/posture.h"
#include "status_panel.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

Layout layout_named(const std::string& name) {
  return name == "plan" ? Layout::plan : Layout::operate;
}

// What belongs to saw, fragments or plate; of fragments soft tissue, too.
void draw_tools(const ViewScene& scene, const HandFacts& hand) {
  scene.draw_tools();
  if (hand.tool == 2) draw_tissue(scene.control.rehearsal());
}

// Of the case, the device and the machine.
void draw_information(const ViewScene& scene) {
  const Rehearsal& rehearsal = scene.control.rehearsal();
  draw_approval(scene.machine.approval, scene.machine.approval_ended);
  if (scene.machine.scan != nullptr) draw_scan(*scene.machine.scan);
  ImGui::TextWrapped("%s", filled(tr("hand: {device}"), {{"device", scene.machine.device}}).c_str());
  ImGui::TextWrapped("%s",
                     rehearsal.realtime()
                         ? tr("real-time priority: yes")
                         : tr("real-time priority: NOT GRANTED. The force may stutter: allow rtprio in limits.conf."));
  ImGui::TextWrapped("%s", filled(tr("servo {work} us a tick, late {late} us"),
                                  {{"work", shown_number(static_cast<double>(scene.tick.work_us), 0)},
                                   {"late", shown_number(static_cast<double>(scene.tick.lateness_us), 0)}})
                               .c_str());
  ImGui::TextWrapped(
      "%s", filled(tr("{drawn} of {all} M triangles"), {{"drawn", shown_number(scene.machine.drawn_millions, 2)},
                                                        {"all", shown_number(scene.machine.triangles_millions, 2)}})
                .c_str());
  ImGui::TextWrapped("%s", scene.machine.pictures.c_str());
}

}  // namespace

MainView::MainView(WindowShell& shell, PersonSettings& person)
    : shell_(shell), person_(person), wanted_(layout_named(person.values.layout)), begun_(person.values) {
  use_language(language_named(person.values.language));
  take_theme(person.values.theme);
  lay_out(false, 0);
}

const ViewLayout& MainView::lay_out(bool over, float cut_side) {
  layout_ = osteo::lay_out(over ? Layout::review : wanted_, shell_.width(), shell_.height(),
                           static_cast<float>(shell_.em_pixels()), cut_side);
  // Where both have no room the settings are in front.
  if (in_settings() && SettingsDialog::box_in(layout_).right() > layout_.over[0].x) layout_.over = {};
  return layout_;
}

void MainView::renew() {
  notes_.clear();
  ruler_.turn(false);
  steps_.renew();
  before_ = asking_ = false;
  writing_.reset();
  wheel_.close();
  latched_ = {};
  felt_then_.reset();
}

HandFacts MainView::hand_facts(const RehearsalControl& control, const SoundOut& sound, std::size_t undo_steps) const {
  HandFacts f;
  f.burr = control.tool();
  f.tool = static_cast<int>(control.tools().tool());
  f.saw = control.tools().saw_in_hand();
  f.latched = control.latched();
  f.sucking = control.sucking();
  f.washing = control.washing();
  f.sound = sound.on();
  f.before = before_;
  f.ruler = ruler_.on();
  f.second_hand = second_hand_;
  f.burr_share = control.burr_share;
  f.undo_steps = undo_steps;
  return f;
}

void MainView::see(const ViewScene& scene) {
  StepFacts facts;
  std::uint64_t undone = 0;
  Rehearsal& rehearsal = scene.control.rehearsal();
  facts.removed_mm3 = rehearsal.removed_mm3();
  rehearsal.look([&](const World& world, SceneReaders& readers) {
    facts.sawn_mm3 = readers.tools.sawn_mm3();
    facts.undo_steps = world.undo_steps();
    undone = readers.tools.undone();
    facts.fixtures = world.fixtures().size();
    facts.dust = readers.dust != nullptr;
    if (facts.dust) facts.sucked_mm3 = readers.dust->dust().totals().sucked_mm3;
  });
  // Asked for, and then done. Not told by the steps there are: a burr that runs out in bone given back makes another at
  // once.
  facts.undone = undone_ && undone > times_undone_;
  times_undone_ = undone;
  if (facts.undone) {
    undone_ = false;
    scene.control.say([&] { return tr("taken back"); });
  }
  undo_steps_ = facts.undo_steps;
  // Led away and there, not only asked for.
  lifted_ = lifting_ && (lifted_ || scene.control.leading());
  if (lifting_ && !scene.control.leading()) {
    facts.retracted = std::exchange(lifted_, false);
    lifting_ = false;
  }
  facts.pictured = std::exchange(pictured_, false);
  facts.tilted_rad = scene.control.handle().tilted_rad();
  facts.measured_mm = ruler_.length_mm().value_or(0);
  facts.magnification = scene.magnification;
  steps_.see(seen_ = facts);
}

void MainView::draw(const ViewScene& scene) {
  ImGuiIO& io = ImGui::GetIO();
  // ImGui moves its own cursor only while the keys are a part's of the window.
  if (focus_ != Focus::bone) {
    io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  } else {
    io.ConfigFlags &= ~ImGuiConfigFlags_NavEnableKeyboard;
  }
  see(scene);
  // In a lesson it is another person's.
  second_hand_ = scene.alone && scene.control.rehearsal().hands() > 1;
  pressed_.held.clear();
  RehearsalControl& control = scene.control;
  const HandFacts hand = hand_facts(control, scene.sound, undo_steps_);
  draw_tray(layout_.tray, hand, in_settings(), latched_, pressed_);
  const StateFacts facts = state_facts(control.rehearsal(), scene.tick, scene.warmth ? &*scene.warmth : nullptr);
  draw_state(layout_, facts, control.reported(causes_of(facts)), pressed_);
  card_ = {};
  if (in_settings()) {
    draw_settings(scene);
  } else {
    draw_cards(scene, hand);
    draw_cut_tile(layout_.cut_tile, scene.cut_over, pressed_);
  }
  draw_marks(scene);
  if (writing_) draw_note_field(control);
  draw_palette(control);
  if (wheel_.open()) {
    const float e = em();
    if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0)
      wheel_.point((io.MousePos.x - wheel_.x()) / e, (io.MousePos.y - wheel_.y()) / e);
    if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) pressed_.press(Command::wheel);
    draw_wheel(wheel_);
  }
  give_focus();
  if (asking_) {
    // As if it were a key, at the next frame: what the answer begins shows pictures of its own.
    const int said = draw_question(shell_.width(), shell_.height(), tr("Reset bone?"),
                                   tr("This session is saved and ends. A new one begins with the bone of the case."),
                                   tr("Reset bone"));
    if (said != 0) pressed_.press(said > 0 ? Command::perform : Command::put_away);
  }
}

void MainView::session_ended() {
  seen_.ended = true;
  steps_.see(seen_);
  seen_ = {};
}

ScreenBox MainView::free_room() const {
  const ScreenBox& v = layout_.view;
  const ScreenBox all{v.x, v.y, layout_.free_width(), v.height};
  if (card_.empty()) return all;
  if (card_.bottom() < v.y + v.height / 2) return {all.x, card_.bottom(), all.width, v.bottom() - card_.bottom()};
  return {card_.right(), all.y, std::max(0.0F, all.right() - card_.right()), all.height};
}

// What belongs to the instrument in hand, and what comes next for a new user.
void MainView::draw_cards(const ViewScene& scene, const HandFacts& hand) {
  if (!scene.side.empty()) return draw_side(scene, hand);
  const ScreenBox& view = layout_.view;
  const float free = layout_.free_width();
  const char* const titles[] = {tr("Drill"), tr("Saw"), tr("Fragments"), tr("Plate")};
  if (hand.tool == 0 && !hand.saw) {
    card_ = draw_burr_card(view, free, hand, burr_unfolded_, pressed_);
  } else {
    card_ = draw_tool_card(view, free, "instrument", hand.saw ? tr("Saw in the hand") : titles[hand.tool],
                           [&] { draw_tools(scene, hand); });
  }
  RehearsalControl& control = scene.control;
  const bool water = latched_.suction || latched_.irrigation || control.second().holds() > 0;
  const float below = card_.bottom();
  if (const float left = view.bottom() - below; hand.second_hand && water && left > 320 * unit()) {
    draw_tool_card({view.x, below - 8 * unit(), view.width, left}, free, "second hand", tr("Second hand"), [&] {
      draw_second_hand(control.rehearsal(), control.second(), [&](const LocalText& said) { control.say(said); });
    });
  }
  if (!person_.values.first_steps) return;
  const bool card = palette_.shown() == CommandPalette::Shown::ten_keys;
  const float beside = card ? CommandPalette::card_width() + 16 * unit() : 0;
  person_.values.first_steps = draw_next_step({view.x + beside, view.y, view.width - beside, view.height},
                                              free - beside, card_, steps_, step_unfolded_);
}

// In plan the card is beside the pictures, and with the drill the planned cuts are there.
void MainView::draw_side(const ViewScene& scene, const HandFacts& hand) {
  HandTools& tools = scene.control.tools();
  const float u = unit();
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
  begin_fixed(hand.tool != 0 || hand.saw ? "instrument" : "planned cuts", scene.side);
  ImGui::PopStyleVar();
  if (hand.tool != 0 || hand.saw) {
    if (wanted_cut_ && tools.tool() == HandTools::Tool::saw) tools.choose_planned(*wanted_cut_);
    wanted_cut_.reset();
    const char* const titles[] = {tr("Drill"), tr("Saw"), tr("Fragments"), tr("Plate")};
    ImGui::TextDisabled("%s", hand.saw ? tr("Saw in the hand") : titles[hand.tool]);
    draw_tools(scene, hand);
    ImGui::End();
    return;
  }
  ImGui::TextDisabled("%s", tr("Planned cuts"));
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {0, 4 * u});
  for (std::size_t n = 0; n < tools.planned().size(); ++n) {
    const PlannedCut& cut = tools.planned()[n];
    if (!list_row(cut.name + "##" + std::to_string(n), shown_number(cut.cut.kerf_mm, 1) + " mm", false)) continue;
    wanted_cut_ = n;  // once the saw is there, which is put before the bone first
    pressed_.press(Command::saw);
  }
  ImGui::PopStyleVar();
  if (tools.planned().empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(theme().quiet));
    ImGui::TextWrapped("%s", tr("A cut that is placed with the saw and named is kept here."));
    ImGui::PopStyleColor();
  }
  if (kit_button(tr("Place a cut"), ButtonLook::usual, ImGui::GetContentRegionAvail().x)) pressed_.press(Command::saw);
  ImGui::End();
}

void MainView::draw_settings(const ViewScene& scene) {
  Rehearsal& rehearsal = scene.control.rehearsal();
  PersonValues& values = person_.values;
  // What keys have changed meanwhile.
  values.sound = scene.sound.on();
  values.volume = scene.sound.volume();
  values.alarms = scene.sound.alarms();
  values.scale = shell_.by_hand();
  values.full_screen = shell_.full_screen();
  const PersonValues before = values;
  if (!felt_then_) felt_then_ = rehearsal.settings();
  SettingsParts parts;
  const auto more = [&](SettingsPage page) -> std::function<void()>& {
    return parts.more[static_cast<std::size_t>(page)];
  };
  more(SettingsPage::view) = scene.draw_camera;
  if (scene.sound.on()) more(SettingsPage::sound) = [&] { ImGui::TextWrapped("%s", scene.sound.status().c_str()); };
  // In a low window the second hand's card has no room.
  more(SettingsPage::operation) = [&] {
    draw_head_turned(rehearsal);
    if (!second_hand_) return;
    ImGui::TextDisabled("%s", tr("Second hand"));
    draw_second_hand(rehearsal, scene.control.second(), [&](const LocalText& said) { scene.control.say(said); });
  };
  more(SettingsPage::controls) = scene.draw_hand;
  more(SettingsPage::haptics) = [&] { draw_haptics(rehearsal, *felt_then_); };
  more(SettingsPage::information) = [&] { draw_information(scene); };
  parts.foot = [&] { draw_apart(pressed_); };
  parts.foot_wide = apart_width();
  parts.procedures = scene.procedures;
  parts.another = scene.alone && needs_another_session(begun_, values);
  another_session_ = settings_.draw(SettingsDialog::box_in(layout_), values, parts);
  if (!settings_.open()) focus_ = Focus::bone;
  take_settings(before, scene);
}

// What was changed, where it has its effect. Hints and the monitor look for themselves.
void MainView::take_settings(const PersonValues& before, const ViewScene& scene) {
  const PersonValues& now = person_.values;
  if (now.theme != before.theme) take_theme(now.theme);
  if (now.language != before.language) use_language(language_named(now.language));
  if (now.scale != before.scale) shell_.set_scale(now.scale);
  if (now.full_screen != before.full_screen) shell_.toggle_full_screen();
  if (now.layout != before.layout) wanted_ = layout_named(now.layout);
  if (now.sound != before.sound) scene.sound.turn(now.sound);
  if (now.volume != before.volume) scene.sound.set_volume(now.volume);
  if (now.alarms != before.alarms) scene.sound.set_alarms(now.alarms);
  constexpr auto kPositions = enum_names(Posture{});
  if (now.position != before.position)
    lay_patient(
        static_cast<Posture>(std::find(kPositions.begin(), kPositions.end(), now.position) - kPositions.begin()),
        scene.control);
}

}  // namespace osteo::inline app
