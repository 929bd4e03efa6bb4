#include "tutor_panel.h"

#include <algorithm>
#include <cmath>

#include "keys.h"
#include "osteo/core/base/translate.h"
#include "state_facts.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {

namespace {

// Who takes part, for the catalogues: the runner of sessions names them.
[[maybe_unused]] constexpr const char* kWho[] = {tr_later("you"), tr_later("trainee"), tr_later("watcher"),
                                                 tr_later("instructor"), tr_later("recorded")};

}  // namespace

std::string shown_who(const std::string& who) {
  // Of several of a kind the number stands behind.
  const std::size_t end = who.find_last_not_of("0123456789");
  if (end == std::string::npos || end + 1 == who.size() || who[end] != ' ') return tr(who);
  return tr(who.substr(0, end)) + who.substr(end);
}

std::string link_text(const TutorNow::Link& link) {
  if (!link.heard) return filled(tr("{who}: not heard"), {{"who", shown_who(link.who)}});
  const auto signed_number = [](double value, int decimals) {
    return (value < 0 ? "" : "+") + shown_number(value, decimals);
  };
  const std::initializer_list<Place> places{{"who", shown_who(link.who)},
                                            {"rtt", shown_number(link.rtt_ms, 1)},
                                            {"lost", shown_number(100 * link.lost, 0)},
                                            {"offset", signed_number(link.offset_ms, 1)},
                                            {"drift", signed_number(link.drift_ppm, 0)}};
  std::string words =
      filled(tr("{who}: there and back {rtt} ms, {lost} % lost, clock {offset} ms, {drift} ppm"), places);
  if (link.behind_s > 0.5)
    words = filled(tr("{link}, {seconds} s behind"), {{"link", words}, {"seconds", shown_number(link.behind_s, 1)}});
  return link.differs ? filled(tr("{link}, its bone differs and is made again"), {{"link", words}}) : words;
}

std::string who_cuts(const std::vector<std::string>& names, const std::vector<TickRecord>& hands) {
  std::string who;
  for (std::size_t h = 0; h < std::min(names.size(), hands.size()); ++h) {
    const TickRecord& t = hands[h];
    if (t.speed_rpm > 0 && (t.immersed > 0 || t.voxels_changed > 0))
      who = who.empty() ? shown_who(names[h])
                        : filled(tr("{one} and {other}"), {{"one", who}, {"other", shown_who(names[h])}});
  }
  return who.empty() ? tr("nobody") : who;
}

std::optional<LocalText> LinkWatch::look(const TutorNow& now) {
  std::optional<LocalText> said;
  std::vector<std::pair<std::string, bool>> heard;
  for (const TutorNow::Link& l : now.links) {
    heard.emplace_back(l.who, l.heard);
    const auto before = std::find_if(heard_.begin(), heard_.end(), [&](const auto& h) { return h.first == l.who; });
    if (before == heard_.end()) {
      if (l.heard) said = LocalText([&] { return filled(tr("{who} has joined"), {{"who", shown_who(l.who)}}); });
    } else if (before->second != l.heard) {
      said = LocalText([&] {
        return filled(l.heard ? tr("the link to the {who} is back")
                              : tr("the link to the {who} has dropped: your hand is let go"),
                      {{"who", shown_who(l.who)}});
      });
    }
  }
  for (const auto& [who, was] : heard_) {
    if (std::none_of(heard.begin(), heard.end(), [&, name = who](const auto& h) { return h.first == name; }))
      said = LocalText([&] { return filled(tr("{who} has left"), {{"who", shown_who(who)}}); });
  }
  heard_ = std::move(heard);
  return said;
}

std::vector<HarmLine> harm_lines(const std::map<std::uint8_t, WorkDone::Harm>& harm, const StructureMap* structures) {
  std::vector<HarmLine> lines;
  if (structures == nullptr) return lines;
  for (const auto& [value, h] : harm) {
    const Nearness nearness = h.violations > 0 ? Nearness::touched : h.contacts > 0 ? Nearness::close : Nearness::near;
    const std::size_t times = h.violations > 0 ? h.violations : h.contacts > 0 ? h.contacts : h.near;
    const char* const text = h.violations > 0 ? tr("{structure}: violation ({n})")
                             : h.contacts > 0 ? tr("{structure}: contact ({n})")
                                              : tr("{structure}: near ({n})");
    const std::string name = structures->name_of(value);
    lines.push_back({nearness, filled(text, {{"structure", tr(name)}, {"n", std::to_string(times)}})});
  }
  std::stable_sort(lines.begin(), lines.end(),
                   [](const HarmLine& a, const HarmLine& b) { return a.nearness > b.nearness; });
  return lines;
}

Invitation invitation_of(const std::string& text) {
  static constexpr std::string_view kCode = "\ncode ";
  const std::size_t at = text.find(kCode);
  if (at == std::string::npos) return {text, {}};
  return {text.substr(0, at), text.substr(at + kCode.size())};
}

namespace {

constexpr float kColumn = 304;

// Steps of the built-in procedures, for the catalogues: what their files say is looked up here.
[[maybe_unused]] constexpr const char* kStepNames[] = {tr_later("take the cortex off and find the sinus and the dura"),
                                                       tr_later("open the antrum"),
                                                       tr_later("clear the cells and the angle"),
                                                       tr_later("thin the wall of the canal"),
                                                       tr_later("find the nerve and open the recess"),
                                                       tr_later("open the cortex and the cells"),
                                                       tr_later("leave the sinus whole"),
                                                       tr_later("stay clear of the rest"),
                                                       tr_later("saw and split"),
                                                       tr_later("draw forward and fix")};

// A line behind a sign.
void signed_line(const std::string& words, int corners, Colour colour, bool filled_sign = true) {
  const float u = unit();
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const ImVec2 centre{at.x + 10 * u, at.y + ImGui::GetFontSize() / 2};
  if (filled_sign) {
    draw_sign(draw, centre, 8 * u, corners, colour);
  } else {
    draw->AddCircle(centre, 7 * u, im_colour32(colour), 20, 2 * u);
  }
  ImGui::SetCursorPosX(ImGui::GetCursorPosX() + 28 * u);
  kit_text(words, theme().text);
}

void draw_invitation(const std::string& text) {
  if (text.empty()) return;
  const Invitation invitation = invitation_of(text);
  kit_heading(tr("Invitation code"));
  kit_title(invitation.code, 1.8F);
  // An address in one piece.
  std::string command = invitation.command;
  if (const std::size_t at = command.find(" --join"); at != std::string::npos) command[at] = '\n';
  kit_text(command, theme().quiet);
}

void draw_people(const TutorNow& now, const std::vector<TickRecord>& hands) {
  kit_heading(tr("People"));
  if (hands.size() > 1) {
    for (std::size_t h = 0; h < std::min(now.hands.size(), hands.size()); ++h) {
      std::vector<TickRecord> one(hands.size());
      one[h] = hands[h];
      const bool cuts = who_cuts(now.hands, one) == shown_who(now.hands[h]);
      const bool there = h == 0 || (hands[h].tick != 0 && hands[h].device.age_ms != 255);
      static_cast<void>(list_row(shown_who(now.hands[h]) + "##hand" + std::to_string(h),
                                 cuts    ? tr("cuts")
                                 : there ? ""
                                         : tr("not there"),
                                 false, 30));
    }
  }
  for (const TutorNow::Link& l : now.links) {
    const bool well = l.heard && !l.differs;
    kit_text((well ? "" : "! ") + link_text(l), well ? theme().quiet : ink_of(palette::kYellow));
  }
  if (!now.trouble.empty()) kit_text("! " + now.trouble, ink_of(palette::kYellow));
  if (hands.size() > 1 && now.apart_mm >= 0)
    kit_text(filled(tr("apart {mm} mm"), {{"mm", shown_number(now.apart_mm, 1)}}), theme().text);
}

// A person who is led may let go, and be led again.
void draw_guidance(const TutorNow& now, Pressed& pressed) {
  if (!now.leads) return;
  bool on = now.guiding;
  if (kit_switch(std::string(tr("Haptic guidance")) + "##guidance", on)) pressed.press(Command::lead);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", key_name(Command::lead).c_str());
  ImGui::ProgressBar(static_cast<float>(now.pull), {-1, 8 * unit()}, "");
}

void draw_steps(const TutorNow& now) {
  if (now.procedure.empty()) return;
  kit_heading(tr(now.procedure));
  for (const TutorNow::Step& s : now.steps) {
    const bool done = s.items > 0 && s.passed == s.items;
    const std::string share =
        done || s.items == 0
            ? std::string()
            : " (" + filled(tr("{n} of {all}"), {{"n", std::to_string(s.passed)}, {"all", std::to_string(s.items)}}) +
                  ")";
    signed_line(tr(s.name) + share, 0, done ? palette::kGreen : theme().line, done);
  }
  if (now.steps.empty()) kit_text(tr("The steps are judged where the session runs."), theme().quiet);
}

void draw_harm(const std::vector<HarmLine>& harm) {
  kit_heading(tr("Harm so far"));
  if (std::none_of(harm.begin(), harm.end(), [](const HarmLine& l) { return l.nearness != Nearness::near; }))
    signed_line(tr("no contact, no violation"), 0, palette::kGreen);
  for (const HarmLine& l : harm) signed_line(l.text, look_of(l.nearness).corners, look_of(l.nearness).colour);
}

void draw_moments(Pressed& pressed) {
  const float gap = kGap * unit(), half = std::floor((ImGui::GetContentRegionAvail().x - gap) / 2);
  const bool beside = std::max(button_width(tr("Note")), button_width(tr("Picture"))) <= half;
  const float each = beside ? half : ImGui::GetContentRegionAvail().x;
  if (kit_button(tr("Note"), ButtonLook::usual, each)) pressed.press(Command::mark);
  if (beside) ImGui::SameLine(0, gap);
  if (kit_button(tr("Picture"), ButtonLook::usual, each)) pressed.press(Command::screenshot);
}

// Beside each handle, so that the name is not on what is worked at.
void draw_names(const TutorNow& now, const std::vector<TickRecord>& hands, const ScreenBox& area,
                const TutorPanel::Project& project) {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  for (std::size_t h = 1; h < std::min(now.hands.size(), hands.size()); ++h) {
    if (hands[h].tick == 0 || hands[h].device.age_ms == 255) continue;  // not there
    const Vec3 at = from_floats(hands[h].device.position_mm) + normalized(from_floats(hands[h].device.axis)) * 14;
    const auto p = project(at);
    if (!p || !area.holds((*p)[0], (*p)[1])) continue;
    const std::string name = shown_who(now.hands[h]);
    const ImVec2 size = ImGui::CalcTextSize(name.c_str());
    const ImVec2 from{(*p)[0] + 0.8F * em(), (*p)[1] - size.y / 2};
    list->AddRectFilled({from.x - 0.3F * em(), from.y - 1}, {from.x + size.x + 0.3F * em(), from.y + size.y + 1},
                        im_colour32(theme().ground, 0.75F), 0.2F * em());
    list->AddText(from, im_colour32(kPartnerColour), name.c_str());
  }
}

}  // namespace

void TutorPanel::lay_out(ViewLayout& layout, const TutorNow& now, float from) {
  box_ = {};
  if (!now.teaches) return;
  ViewLayout left = layout;
  const ScreenBox column = take_column(left, std::round(kColumn * layout.unit));
  if (column.empty() || column.x < from) return;
  box_ = column;
  layout = left;
}

void TutorPanel::draw(const TutorNow& now, const std::vector<TickRecord>& hands, const std::vector<HarmLine>& harm,
                      const ScreenBox& area, const Project& project, Pressed& pressed) const {
  if (now.title.empty()) return;
  draw_names(now, hands, area, project);
  const float u = unit();
  if (!box_.empty()) {
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0);
    begin_fixed("tutoring", box_);
    ImGui::PopStyleVar();
    kit_title(now.title, kBoldEm);
    draw_invitation(now.invitation);
    draw_people(now, hands);
    draw_guidance(now, pressed);
    draw_steps(now);
    draw_harm(harm);
    ImGui::Dummy({0, 4 * u});
    draw_moments(pressed);
    ImGui::End();
    return;
  }
  if (now.teaches) return;  // no room now
  // Who is taught sees who leads, and lets go.
  const float wide = std::min(kColumn * u, area.width - 32 * u);
  if (wide < 120 * u) return;
  ImGui::SetNextWindowPos({area.x + (area.width - wide) / 2, area.y + 16 * u}, ImGuiCond_Always);
  ImGui::SetNextWindowSize({wide, 0}, ImGuiCond_Always);
  // As high as what it says, and no higher than the picture: then it is scrolled.
  ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, std::max(64 * u, area.height - 32 * u)});
  ImGui::SetNextWindowBgAlpha(0.94F);
  ImGui::Begin("tutoring", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
  kit_text(now.title, theme().text);
  draw_people(now, hands);
  draw_guidance(now, pressed);
  ImGui::End();
}

}  // namespace osteo::inline app
