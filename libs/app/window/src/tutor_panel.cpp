#include "tutor_panel.h"

#include <algorithm>
#include <cmath>

#include "keys.h"
#include "osteo/core/base/translate.h"
#include "ui_style.h"

namespace osteo::inline app {

std::string link_text(const TutorNow::Link& link) {
  if (!link.heard) return filled(tr("{who}: not heard"), {{"who", link.who}});
  const auto signed_number = [](double value, int decimals) {
    return (value < 0 ? "" : "+") + shown_number(value, decimals);
  };
  const std::initializer_list<Place> places{{"who", link.who},
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
      who = who.empty() ? names[h] : filled(tr("{one} and {other}"), {{"one", who}, {"other", names[h]}});
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
      if (l.heard) said = LocalText([&] { return filled(tr("{who} has joined"), {{"who", l.who}}); });
    } else if (before->second != l.heard) {
      said = LocalText([&] {
        return filled(l.heard ? tr("the link to the {who} is back")
                              : tr("the link to the {who} has dropped: your hand is let go"),
                      {{"who", l.who}});
      });
    }
  }
  for (const auto& [who, was] : heard_) {
    if (std::none_of(heard.begin(), heard.end(), [&, name = who](const auto& h) { return h.first == name; }))
      said = LocalText([&] { return filled(tr("{who} has left"), {{"who", who}}); });
  }
  heard_ = std::move(heard);
  return said;
}

void TutorPanel::draw(const TutorNow& now, const std::vector<TickRecord>& hands, const ScreenBox& area,
                      const Project& project) {
  if (now.title.empty()) return;
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  for (std::size_t h = 1; h < std::min(now.hands.size(), hands.size()); ++h) {
    if (hands[h].tick == 0 || hands[h].device.age_ms == 255) continue;  // not there
    // Beside the handle, so that the name is not on what is worked at.
    const Vec3 at = from_floats(hands[h].device.position_mm) + normalized(from_floats(hands[h].device.axis)) * 14;
    const auto p = project(at);
    if (!p || !area.holds((*p)[0], (*p)[1])) continue;
    const ImVec2 size = ImGui::CalcTextSize(now.hands[h].c_str());
    const ImVec2 from{(*p)[0] + 0.8F * em(), (*p)[1] - size.y / 2};
    list->AddRectFilled({from.x - 0.3F * em(), from.y - 1}, {from.x + size.x + 0.3F * em(), from.y + size.y + 1},
                        im_colour32(theme().ground, 0.75F), 0.2F * em());
    list->AddText(from, im_colour32(kPartnerColour), now.hands[h].c_str());
  }
  const float e = em(), wide = std::min(24 * e, area.width - e);
  ImGui::SetNextWindowPos({area.right() - wide - e / 2, area.y + e / 2}, ImGuiCond_Always);
  ImGui::SetNextWindowSize({wide, 0}, ImGuiCond_Always);
  ImGui::SetNextWindowBgAlpha(0.82F);
  ImGui::Begin("tutoring", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
  ImGui::TextWrapped("%s", now.title.c_str());
  if (!now.invitation.empty()) ImGui::TextWrapped("%s", now.invitation.c_str());
  if (!now.trouble.empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(ink_of(palette::kYellow)));
    ImGui::TextWrapped("! %s", now.trouble.c_str());
    ImGui::PopStyleColor();
  }
  for (const TutorNow::Link& l : now.links) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(l.heard && !l.differs ? theme().text : ink_of(palette::kYellow)));
    ImGui::TextWrapped("%s%s", l.heard ? "" : "! ", link_text(l).c_str());
    ImGui::PopStyleColor();
  }
  if (hands.size() > 1) {
    ImGui::TextUnformatted(filled(tr("cuts: {who}"), {{"who", who_cuts(now.hands, hands)}}).c_str());
    if (now.apart_mm >= 0)
      ImGui::TextUnformatted(filled(tr("apart {mm} mm"), {{"mm", shown_number(now.apart_mm, 1)}}).c_str());
  }
  if (now.leads) {
    const std::string key = key_name(Command::lead);
    ImGui::Text("%s (%s)", now.guiding ? tr("your hand is led") : tr("your hand is free"), key.c_str());
    ImGui::ProgressBar(static_cast<float>(now.pull), {-1, 0.5F * e}, "");
  }
  ImGui::End();
}

}  // namespace osteo::inline app
