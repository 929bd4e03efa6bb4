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

void MainView::key(int code, int modifiers, bool repeated) {
  palette_.key(code, modifiers);
  if (!writing_ || repeated) return;
  const Key* const known = find_key(code);
  if (known == nullptr) return;
  if (known->command == Command::perform) note_answer_ = 1;
  if (known->command == Command::put_away) note_answer_ = -1;
}

std::vector<Keyboard::Press> MainView::take_presses() {
  return std::exchange(pressed_.presses, {});
}

bool MainView::holds(Command command) const {
  if (command == Command::suck && latched_.suction) return true;
  if (command == Command::wash && latched_.irrigation) return true;
  return std::find(pressed_.held.begin(), pressed_.held.end(), command) != pressed_.held.end();
}

void MainView::answer(int answer, RehearsalControl& control) {
  if (answer == 0) return;
  asking_ = false;
  if (answer > 0) control.reset();
}

// What lies in front of the bone has the key. True: it was for that.
bool MainView::takes_in_front(Command c, RehearsalControl& control) {
  if (asking_) {
    answer(c == Command::perform ? 1 : c == Command::put_away ? -1 : 0, control);
    return true;
  }
  if (palette_.typing()) return true;  // pressed in the picture in which it was opened
  if (focus_ != Focus::bone) {
    const bool leaves = c == Command::put_away || (c == Command::settings && in_settings());
    if (leaves) {
      focus_ = Focus::bone;
      settings_.close();
    }
    // Arrows, Space and Enter are the focus'; other keys go on.
    if (leaves || c == Command::deeper || c == Command::back || c == Command::drill || c == Command::perform ||
        c == Command::earlier || c == Command::later)
      return true;
  }
  if (!wheel_.open()) return false;
  const bool takes_it = c == Command::wheel || c == Command::perform;
  if (c == Command::deeper || c == Command::back) {
    wheel_.turn(c == Command::deeper ? 1 : -1);
    return true;
  }
  wheel_.close();
  if (takes_it && wheel_.chosen() >= 0) {
    const WheelItem& item = wheel_items()[static_cast<std::size_t>(wheel_.chosen())];
    const Command chosen = item.command;
    // A burr is for the drill.
    const bool burr =
        chosen != Command::saw && chosen != Command::pieces && chosen != Command::plates && chosen != Command::put_away;
    if (burr && control.tools().tool() != HandTools::Tool::drill) pressed_.press(Command::put_away);
    pressed_.press(chosen, item.value);
  }
  return takes_it || c == Command::put_away;
}

void MainView::show_wheel() {
  const ImVec2 m = ImGui::GetIO().MousePos;
  const float edge = ToolWheel::kOuterEm * em();
  const ScreenBox& v = layout_.view;
  const bool inside = v.holds(m.x, m.y);
  const auto kept = [&](float at, float lo, float length) {
    return length < 2 * edge ? lo + length / 2 : std::clamp(at, lo + edge, lo + length - edge);
  };
  wheel_.show(inside ? kept(m.x, v.x, v.width) : v.x + v.width / 2,
              inside ? kept(m.y, v.y, v.height) : v.y + v.height / 2);
}

// The bone, and round the parts of the window again.
void MainView::move_focus(int by) {
  constexpr int kParts = 5;  // the panel is opened by its own key
  const int now = in_settings() ? 0 : static_cast<int>(focus_);
  focus_ = static_cast<Focus>((now + by + kParts) % kParts);
  settings_.close();
  focus_moved_ = true;
}

// Where dust and water fall to: without them it is for a session that has them.
void MainView::lay_patient(Posture posture, RehearsalControl& control) {
  person_.values.position = EnumNames<Posture>::values[static_cast<std::size_t>(posture)];
  bool dust = false;
  control.rehearsal().look([&](const World&, SceneReaders& readers) { dust = readers.dust != nullptr; });
  if (!dust)
    return control.say([&] { return tr("no dust and no water here: start with --dust"); }, Message::Rank::hindrance);
  control.rehearsal().act(SceneAction::posture(down_of(posture, 0)));
  std::string name(EnumNames<Posture>::values[static_cast<std::size_t>(posture)]);
  std::replace(name.begin(), name.end(), '_', ' ');
  control.say([&] { return filled(tr("patient position: {position}"), {{"position", tr(name)}}); });
}

bool MainView::takes(const Keyboard::Press& press, RehearsalControl& control, const std::optional<Vec3>& bone) {
  const Command c = press.command;
  if (takes_in_front(c, control)) return true;
  switch (c) {
    case Command::help:
      palette_.help();
      return true;
    case Command::palette:
      palette_.show(CommandPalette::Shown::commands);
      return true;
    case Command::focus_next:
      move_focus(press.shift ? -1 : 1);
      return true;
    case Command::irrigation:
      if (control.rehearsal().hands() < 2) {
        control.say([&] { return tr("no second hand: start with --dust"); }, Message::Rank::hindrance);
      } else {
        latched_.irrigation = !latched_.irrigation;
      }
      return true;
    case Command::posture:
      lay_patient(static_cast<Posture>(press.value), control);
      return true;
    case Command::colours:
      person_.values.theme = EnumNames<ThemeName>::values[static_cast<std::size_t>(press.value)];
      take_theme(person_.values.theme);
      return true;
    case Command::lift:
      lifting_ = true;
      return false;
    case Command::layout:
      wanted_ = next_layout(wanted_);
      person_.values.layout = EnumNames<Layout>::values[static_cast<std::size_t>(wanted_)];
      if (lay_out(false, 0).why.empty()) {
        control.say([&] { return filled(tr("layout: {name}"), {{"name", tr(person_.values.layout)}}); });
      } else {
        control.say(layout_.why);
      }
      return true;
    case Command::full_screen:
      shell_.toggle_full_screen();
      person_.values.full_screen = shell_.full_screen();
      return true;
    case Command::hand_page:
    case Command::settings:
      focus_ = Focus::settings;
      settings_.show(c == Command::hand_page ? SettingsPage::controls : settings_.page(), c == Command::hand_page);
      return true;

    case Command::wheel:
      show_wheel();
      return true;
    case Command::ruler:
      ruler_.turn(!ruler_.on());
      control.say([&] { return ruler_.on() ? tr("ruler: click two points on the bone") : tr("ruler put away"); });
      return true;
    case Command::mark:
      // Where the mouse is; a button in the panel: where the burr is.
      writing_ = bone ? *bone : from_floats(control.rehearsal().latest().device.position_mm);
      note_text_.clear();
      note_answer_ = 0;
      write_focus_ = true;
      return true;
    case Command::reset:
      asking_ = true;
      return true;
    case Command::undo:
      undone_ = true;
      return false;
    case Command::put_away:
      if (palette_.shown() != CommandPalette::Shown::nothing) {
        palette_.show(CommandPalette::Shown::nothing);
        return true;
      }
      if (ruler_.on()) {
        ruler_.turn(false);
        return true;
      }
      return false;
    default:
      return false;
  }
}

bool MainView::click(std::optional<Vec3> bone, RehearsalControl& control) {
  if (!ruler_.on()) return false;
  if (!bone) {
    control.say([&] { return tr("no bone under the mouse"); }, Message::Rank::hindrance);
    return true;
  }
  if (const auto note = ruler_.click(*bone)) {
    control.rehearsal().note("ruler", *note);
    control.say([&] { return shown_number(*ruler_.length_mm(), 1) + " mm"; });
  }
  return true;
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
  f.second_hand = control.rehearsal().hands() > 1;
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

void MainView::draw_palette(RehearsalControl& control) {
  const ScreenBox window{0, 0, static_cast<float>(shell_.width()), static_cast<float>(shell_.height())};
  const CommandRow* const row = palette_.draw(window, layout_.view);
  if (row == nullptr) return;
  if (row->command == Command::suck) {
    if (control.rehearsal().hands() > 1)
      latched_.suction = !latched_.suction;
    else
      control.say([&] { return tr("no second hand: start with --dust"); }, Message::Rank::hindrance);
  } else if (!row->command || row->held) {
    control.say([&] {
      const std::string name = shown_name(*row), keys = shown_keys(*row);
      if (keys.empty()) return name;
      return filled(row->held ? tr("{command}: {keys}, held") : tr("{command}: {keys}"),
                    {{"command", name}, {"keys", keys}});
    });
  } else {
    pressed_.presses.push_back({*row->command, row->value, row->shift});
  }
}

// After what is drawn, so that the part is there.
void MainView::give_focus() {
  if (!std::exchange(focus_moved_, false)) return;
  if (focus_ == Focus::bone) return ImGui::SetWindowFocus(nullptr);
  const bool drill = ImGui::FindWindowByName("burr") != nullptr && ImGui::FindWindowByName("burr")->WasActive;
  const char* const names[] = {"", "tray", drill ? "burr" : "instrument", "cuts' foot", "state"};
  ImGuiWindow* const part = ImGui::FindWindowByName(names[static_cast<std::size_t>(focus_)]);
  if (part == nullptr || !part->Active) return;  // no room for it
  ImGui::FocusWindow(part);
  ImGui::NavInitWindow(part, true);
  GImGui->NavDisableHighlight = false;
  GImGui->NavDisableMouseHover = true;
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
    if (rehearsal.hands() < 2 || !scene.alone) return;
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

void MainView::draw_note_field(RehearsalControl& control) {
  const float e = em(), wide = std::min(layout_.view.width - e, 26 * e);
  ImGui::SetNextWindowPos({layout_.view.x + (layout_.view.width - wide) / 2, layout_.view.y + e});
  ImGui::SetNextWindowSize({wide, 0});
  ImGui::Begin(tr("Note (without names)"), nullptr,
               ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse);
  if (write_focus_) ImGui::SetKeyboardFocusHere();
  write_focus_ = false;
  static_cast<void>(kit_field("##note", {}, note_text_));
  kit_text(tr("Enter keeps it; empty: marks this moment; Esc: nothing"), theme().quiet);
  ImGui::End();
  const int answer = std::exchange(note_answer_, 0);
  if (answer > 0) {
    if (const auto note = notes_.pin(*writing_, note_text_)) {
      control.rehearsal().note("note", *note);
      control.say([&] {
        return filled(tr("note {n} is pinned"), {{"n", std::to_string(notes_.all().back().number)}});
      });
    } else {
      control.rehearsal().note("mark", "{}");
      control.say([&] { return tr("marked"); });
    }
  }
  if (answer != 0) writing_.reset();
}

void MainView::draw_marks(const ViewScene& scene) {
  ImDrawList* const draw = ImGui::GetBackgroundDrawList();
  const float e = em();
  const ScreenBox& v = layout_.view;
  draw->PushClipRect({v.x, v.y}, {v.right(), v.bottom()});
  const auto words = [&](float x, float y, const std::string& text, Colour colour) {
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    x = std::clamp(x, v.x, std::max(v.x, v.right() - size.x - e / 2));
    y = std::clamp(y, v.y, std::max(v.y, v.bottom() - size.y));
    draw->AddRectFilled({x - e / 4, y}, {x + size.x + e / 4, y + size.y}, im_colour32(theme().ground, 0.8F));
    draw->AddText({x, y}, im_colour32(colour), text.c_str());
  };
  for (const PinnedNote& note : notes_.all()) {
    const auto at = scene.project(note.at_mm);
    if (!at) continue;
    const float x = (*at)[0], y = (*at)[1];
    draw->AddLine({x, y}, {x, y - 2 * e}, im_colour32(palette::kYellow), e / 8);
    draw->AddRectFilled({x, y - 2 * e}, {x + 1.4F * e, y - e}, im_colour32(palette::kYellow));
    const std::string number = std::to_string(note.number);
    draw->AddText({x + 0.35F * e, y - 2.1F * e}, IM_COL32(0, 0, 0, 255), number.c_str());
    words(x + 1.7F * e, y - 2 * e, note.text.size() > 40 ? note.text.substr(0, 40) + "..." : note.text, theme().text);
  }
  std::vector<std::array<float, 2>> ends;
  for (const Vec3 p : ruler_.points_mm()) {
    if (const auto at = scene.project(p)) {
      ends.push_back(*at);
      draw->AddCircle({(*at)[0], (*at)[1]}, e * 0.35F, im_colour32(palette::kSkyBlue), 16, e / 8);
    }
  }
  if (ends.size() == 2 && ruler_.length_mm()) {
    draw->AddLine({ends[0][0], ends[0][1]}, {ends[1][0], ends[1][1]}, im_colour32(palette::kSkyBlue), e / 8);
    const std::string text = shown_number(*ruler_.length_mm(), 1) + " mm";
    words((ends[0][0] + ends[1][0]) / 2 + e / 2, (ends[0][1] + ends[1][1]) / 2, text, palette::kSkyBlue);
  }
  if (before_) words(v.x + e, v.y + e / 2, tr("BONE AT THE START (W goes back)"), palette::kYellow);
  draw->PopClipRect();
}

void MainView::draw_caption(const ViewScene& scene) {
  ImDrawList* const draw = ImGui::GetForegroundDrawList();
  const float e = em();
  const ScreenBox& v = layout_.view;
  const double bar_mm = scale_bar_mm(scene.pixels_per_mm, static_cast<double>(v.width) / 4);
  const StateFacts state = state_of_tick(scene.tick, nullptr, scene.control.rehearsal().rate_hz());
  char length[32];
  std::snprintf(length, sizeof length, "%.4g", bar_mm);
  const std::string text =
      filled(tr("case {case}, {tool}, {time}, {mm} mm"), {{"case", scene.machine.case_hash.substr(0, 8)},
                                                          {"tool", state.tool},
                                                          {"time", state.time},
                                                          {"mm", shown_figures(length)}});
  const float bar = static_cast<float>(bar_mm * scene.pixels_per_mm), y = v.bottom() - 2 * e;
  draw->AddRectFilled({v.x, y}, {v.right(), v.bottom()}, im_colour32(theme().ground, 0.85F));
  const float x = v.right() - bar - e;
  draw->AddRectFilled({x, y + e * 0.8F}, {x + bar, y + e * 1.2F}, im_colour32(theme().text));
  fitted_text(draw, {v.x + e / 2, y, v.width - bar - 2.5F * e, 2 * e}, e, theme().text, text);
}

namespace {

void draw_figures(const std::vector<EndLine>& lines) {
  if (!ImGui::BeginTable("done", 2)) return;
  const float u = unit();
  ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch, 0.45F);
  ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthStretch, 0.55F);
  for (const EndLine& line : lines) {
    ImGui::TableNextRow();
    ImGui::TableSetColumnIndex(0);
    ImGui::TextWrapped("%s", line.what.c_str());
    ImGui::TableSetColumnIndex(1);
    if (line.nearness != Nearness::unknown) {
      const NearnessLook& look = look_of(line.nearness);
      const ImVec2 at = ImGui::GetCursorScreenPos();
      draw_sign(ImGui::GetWindowDrawList(), {at.x + 8 * u, at.y + ImGui::GetFontSize() / 2}, 7 * u, look.corners,
                look.colour);
      ImGui::SetCursorPosX(ImGui::GetCursorPosX() + 20 * u);
    }
    ImGui::TextWrapped("%s", line.value.c_str());
  }
  ImGui::EndTable();
}

}  // namespace

EndChoice MainView::end_choice(Command command) {
  switch (command) {
    case Command::reset:
      return EndChoice::again;
    case Command::save:
      return EndChoice::resume;
    case Command::home:
      return EndChoice::another;
    case Command::quit:
      return EndChoice::close;
    default:
      return EndChoice::none;
  }
}

EndChoice MainView::draw_end(const EndFacts& facts, const EndParts& parts) {
  ImGuiIO& io = ImGui::GetIO();
  io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  begin_fixed("end", layout_.page);
  const float u = unit();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float wide = ImGui::GetContentRegionAvail().x;
  fitted_text(ImGui::GetWindowDrawList(), {corner.x, corner.y, wide, 32 * u}, kBoldEm * em(), theme().text,
              facts.past ? tr("A session, looked at again") : tr("Session saved"), false, true);
  ImGui::Dummy({0, 32 * u});
  ImGui::PushStyleColor(ImGuiCol_Text, im_colour(theme().quiet));
  ImGui::TextWrapped("%s", facts.summary.c_str());
  ImGui::PopStyleColor();
  for (const std::string& w : facts.warnings) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(ink_of(palette::kYellow)));
    ImGui::TextWrapped("! %s", w.c_str());
    ImGui::PopStyleColor();
  }
  parts.findings();
  ImGui::Dummy({0, 4 * u});
  ImGui::TextDisabled("%s", tr("Next"));
  EndChoice choice = EndChoice::none;
  const float half = std::floor((wide - ImGui::GetStyle().ItemSpacing.x) / 2);
  const auto button = [&](const char* words, EndChoice of, ButtonLook look, float width) {
    if (kit_button(words, look, width)) choice = of;
  };
  // What was found serious is tried again on a whole bone; else one goes on.
  if (facts.past) {
    button(tr("Another case (Home)"), EndChoice::another, ButtonLook::main, wide);
    button(tr("Close (Q)"), EndChoice::close, ButtonLook::usual, half);
  } else {
    const bool again = parts.try_again;
    button(again ? tr("Try it again: bone reset (R)") : tr("Continue from here (F5)"),
           again ? EndChoice::again : EndChoice::resume, ButtonLook::main, wide);
    button(again ? tr("Continue (F5)") : tr("Reset bone (R)"), again ? EndChoice::resume : EndChoice::again,
           ButtonLook::usual, half);
    ImGui::SameLine();
    button(tr("Another case (Home)"), EndChoice::another, ButtonLook::usual, half);
    button(tr("Close (Q)"), EndChoice::close, ButtonLook::usual, half);
  }
  parts.course();
  if (fold(tr("All figures"))) draw_figures(facts.lines);
  if (fold(tr("All findings"))) parts.all_findings();
  if (fold(tr("Files"))) {
    ImGui::TextWrapped("%s", facts.folder.string().c_str());
    ImGui::TextWrapped("%s", tr("summary.json has the numbers, stream.oss every tick: osteo replay SESSION"));
  }
  ImGui::End();
  return choice;
}

}  // namespace osteo::inline app
