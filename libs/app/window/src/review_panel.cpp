#include "review_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "osteo/core/base/translate.h"
#include "state_facts.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
namespace {

struct WeightLook {
  Colour colour;
  int corners;
};
WeightLook look_of(ReviewFinding::Weight weight) {
  switch (weight) {
    case ReviewFinding::Weight::good:
      return {palette::kGreen, 0};
    case ReviewFinding::Weight::note:
      return {palette::kSkyBlue, 0};
    case ReviewFinding::Weight::caution:
      return {palette::kYellow, 3};
    case ReviewFinding::Weight::serious:
      return {palette::kVermillion, 8};
  }
  return {theme().text, 0};
}

// The largest (or the least) value of the samples that a pixel stands for; not a number where none is known.
float of_pixel(const std::vector<float>& values, std::size_t from, std::size_t to, bool most) {
  float out = std::nanf("");
  for (std::size_t n = from; n < std::min(to, values.size()); ++n) {
    if (std::isnan(values[n])) continue;
    if (std::isnan(out) || (most ? values[n] > out : values[n] < out)) out = values[n];
  }
  return out;
}

struct Lane {
  const char* name;
  float top, height, full;  // `full`: the value that fills it
};

}  // namespace

namespace {

// A finding with its picture; true: pressed.
bool finding_card(const ReviewFinding& f, const char* id, unsigned picture, bool chosen) {
  const float u = unit(), wide = ImGui::GetContentRegionAvail().x, inset = 8 * u;
  const float shot_wide = 112 * u, shot_high = 80 * u, left = shot_wide + 2 * inset;
  const float text_wide = wide - left - 32 * u;
  const float tall =
      std::max(shot_high + 2 * inset, ImGui::CalcTextSize(f.text.c_str(), nullptr, false, text_wide).y + 2 * inset);
  const ImVec2 lo = ImGui::GetCursorScreenPos(), hi{lo.x + wide, lo.y + tall};
  const bool pressed = ImGui::InvisibleButton(id, {wide, tall});
  const bool hovered = ImGui::IsItemHovered(), focused = ImGui::IsItemFocused() && ImGui::GetIO().NavVisible;
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const Theme& t = theme();
  draw->AddRectFilled(lo, hi, im_colour32(t.raised, chosen || hovered ? 1 : 0.5F), kCardRound * u);
  if (chosen || focused) draw->AddRect(lo, hi, im_colour32(t.accent), kCardRound * u, 0, 2 * u);
  if (chosen) draw->AddRectFilled({lo.x, lo.y + 12 * u}, {lo.x + 4 * u, hi.y - 12 * u}, im_colour32(t.accent), 2 * u);
  const ImVec2 shot{lo.x + inset, lo.y + inset}, shot_end{shot.x + shot_wide, shot.y + shot_high};
  if (picture != 0) {
    draw->AddImageRounded(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(picture)), shot, shot_end, {0, 1},
                          {1, 0}, IM_COL32_WHITE, kRound * u);
    const ImVec2 middle{(shot.x + shot_end.x) / 2, (shot.y + shot_end.y) / 2};
    draw->AddCircle(middle, 16 * u, IM_COL32(0, 0, 0, 200), 32, 4 * u);
    draw->AddCircle(middle, 16 * u, IM_COL32_WHITE, 32, 2 * u);
  } else {
    draw->AddRectFilled(shot, shot_end, im_colour32(t.ground), kRound * u);
    const char* const none = f.at_mm ? "\u2026" : tr("no place");
    const ImVec2 size = ImGui::CalcTextSize(none);
    draw->AddText({(shot.x + shot_end.x - size.x) / 2, (shot.y + shot_end.y - size.y) / 2}, im_colour32(t.quiet), none);
  }
  const WeightLook look = look_of(f.weight);
  draw_sign(draw, {lo.x + left + 10 * u, lo.y + inset + ImGui::GetFontSize() / 2}, 8 * u, look.corners, look.colour);
  draw->AddText(ImGui::GetFont(), ImGui::GetFontSize(), {lo.x + left + 26 * u, lo.y + inset}, im_colour32(t.text),
                f.text.c_str(), nullptr, text_wide);
  return pressed;
}

void why(const ReviewFinding& f) {
  if (!ImGui::IsItemHovered() || f.why.empty()) return;
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(30 * em());
  ImGui::TextUnformatted(f.why.c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

}  // namespace

void draw_findings(ReviewControl& control, std::span<const unsigned> pictures) {
  switch (control.poll()) {
    case ReviewControl::State::none:
      return;
    case ReviewControl::State::making:
      ImGui::TextDisabled(tr("The session is looked through"));
      ImGui::ProgressBar(static_cast<float>(control.progress()), {-1, 0}, "");
      return;
    case ReviewControl::State::failed:
      ImGui::PushStyleColor(ImGuiCol_Text, im_colour(ink_of(palette::kYellow)));
      ImGui::TextWrapped("! %s", filled(tr("There are no findings: {why}"), {{"why", control.failure()}}).c_str());
      ImGui::PopStyleColor();
      return;
    case ReviewControl::State::ready:
      break;
  }
  const SessionReview& r = control.review();
  if (!serious(r.findings)) {
    ImGui::TextWrapped("%s", tr("Nothing serious was found."));
    for (const std::string& s : r.summary) ImGui::TextWrapped("%s", s.c_str());
    for (const std::string& w : r.words) {
      ImGui::PushStyleColor(ImGuiCol_Text, im_colour(theme().quiet));
      ImGui::TextWrapped("%s", w.c_str());
      ImGui::PopStyleColor();
    }
  }
  std::size_t place = 0;
  for (const std::size_t n : shown_findings(r.findings)) {
    const std::string id = "finding " + std::to_string(n);
    if (finding_card(r.findings[n], id.c_str(), place < pictures.size() ? pictures[place] : 0,
                     control.chosen() == static_cast<int>(n)))
      control.choose(static_cast<int>(n));
    why(r.findings[n]);
    ++place;
  }
}

void draw_all_findings(ReviewControl& control) {
  if (control.state() != ReviewControl::State::ready) return;
  const SessionReview& r = control.review();
  const float e = em(), u = unit();
  if (serious(r.findings)) {
    for (const std::string& s : r.summary) ImGui::TextWrapped("%s", s.c_str());
  }
  for (std::size_t n = 0; n < r.findings.size(); ++n) {
    const ReviewFinding& f = r.findings[n];
    const WeightLook look = look_of(f.weight);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const float wide = ImGui::GetContentRegionAvail().x, left = 1.6F * e;
    const ImVec2 size = ImGui::CalcTextSize(f.text.c_str(), nullptr, false, wide - left);
    ImGui::PushID(static_cast<int>(n));
    if (ImGui::Selectable("##finding", control.chosen() == static_cast<int>(n), 0, {wide, size.y}))
      control.choose(static_cast<int>(n));
    why(f);
    ImGui::PopID();
    draw_sign(ImGui::GetWindowDrawList(), {at.x + 10 * u, at.y + ImGui::GetFontSize() / 2}, 7 * u, look.corners,
              look.colour);
    ImGui::GetWindowDrawList()->AddText(ImGui::GetFont(), ImGui::GetFontSize(), {at.x + left, at.y},
                                        im_colour32(theme().text), f.text.c_str(), nullptr, wide - left);
  }
  if (!serious(r.findings)) return;
  for (const std::string& w : r.words) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(theme().quiet));
    ImGui::TextWrapped("%s", w.c_str());
    ImGui::PopStyleColor();
  }
}

namespace {

// The next moment that something happened, or the one before; the ends, where there is none.
double event_beside(const ReviewControl& control, bool later) {
  constexpr double kHereS = 0.2;  // while it plays the one before is the one before this
  double best = later ? control.review().player->end_s() : 0;
  for (const ReviewCourse::Event& event : control.review().course.events) {
    if (later ? event.t_s > control.now_s() + kHereS : event.t_s < control.now_s() - kHereS)
      best = later ? std::min(best, event.t_s) : std::max(best, event.t_s);
  }
  return best;
}

void draw_player(ReviewControl& control) {
  const float u = unit();
  if (tile("before", "player-track-prev", {false, false, true, tr("event before")}))
    control.go_to(event_beside(control, false));
  ImGui::SameLine(0, 0);
  const bool playing = control.playing();
  if (tile("play", playing ? "player-pause" : "player-play",
           {false, playing, true, playing ? tr("pause (Space)") : tr("play (Space)")}))
    control.play(!playing);
  ImGui::SameLine(0, 0);
  if (tile("after", "player-track-next", {false, false, true, tr("next event")}))
    control.go_to(event_beside(control, true));
  ImGui::SameLine(0, kGap * u);
  const std::string time = clock_text(control.now_s()) + " / " + clock_text(control.review().player->end_s());
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float time_wide = 7 * em();
  fitted_text(ImGui::GetWindowDrawList(), {at.x, at.y, time_wide, kTile * u}, em(), theme().text, time);
  ImGui::Dummy({time_wide, kTile * u});
  ImGui::SameLine(0, kGap * u);
  // All speeds where they have room, else the one that is on: a click takes the next.
  std::vector<std::string> speeds;
  for (const double s : ReviewControl::kSpeeds) speeds.push_back(shown_number(s, s < 1 ? 1 : 0) + "x");
  const int count = static_cast<int>(speeds.size());
  const int now =
      static_cast<int>(std::find(ReviewControl::kSpeeds.begin(), ReviewControl::kSpeeds.end(), control.speed()) -
                       ReviewControl::kSpeeds.begin());
  const float view_wide = ImGui::CalcTextSize(tr("surgeon's view")).x + 64 * u;
  if (choice_width(speeds) + view_wide + 2 * kGap * u <= ImGui::GetContentRegionAvail().x) {
    if (const int chosen = choice("speed", speeds, now); chosen >= 0) control.change_speed(chosen - now);
  } else if (kit_button(speeds[static_cast<std::size_t>(now)] + "##speed")) {
    control.change_speed(now + 1 < count ? 1 : -now);
  }
  ImGui::SameLine(0, kGap * u);
  if (view_wide <= ImGui::GetContentRegionAvail().x) {
    static_cast<void>(kit_switch(tr("surgeon's view"), control.surgeons_view, view_wide));
  } else if (tile("surgeon's view", "eye", {false, control.surgeons_view, true, tr("surgeon's view")})) {
    control.surgeons_view = !control.surgeons_view;
  }
}

}  // namespace

void draw_course(const ScreenBox& box, ReviewControl& control) {
  // Arrows and Space are the course's own keys: as steps from button to button they would press one as well.
  begin_fixed("course", box, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoNav);
  const ReviewCourse& course = control.review().course;
  const float e = em();
  draw_player(control);
  const ImVec2 at = ImGui::GetCursorScreenPos(), room = ImGui::GetContentRegionAvail();
  const float names = 9 * e, left = at.x + names, wide = std::max(1.0F, room.x - names), high = std::max(1.0F, room.y);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const double end_s = std::max(control.review().player->end_s(), 1e-3);
  const auto x_of = [&](double t_s) { return left + wide * static_cast<float>(std::clamp(t_s / end_s, 0.0, 1.0)); };
  const float lane = high / 3;
  const float full_n = of_pixel(course.force_n, 0, course.size(), true) > 2 ? 8.0F : 2.0F;
  const Lane lanes[] = {{full_n > 2 ? tr("force, to 8 N") : tr("force, to 2 N"), at.y, lane, full_n},
                        {tr("near, from 5 mm"), at.y + lane, lane, 5},
                        {tr("bone: seen, unseen"), at.y + 2 * lane, lane, 0}};
  for (const Lane& l : lanes) {
    draw->AddRectFilled({left, l.top + 1}, {left + wide, l.top + l.height - 1}, im_colour32(theme().raised));
    fitted_text(draw, {at.x, l.top, names - 0.5F * e, l.height}, kLabelEm * e, theme().quiet, l.name);
  }
  float most_mm3 = 0;
  for (std::size_t n = 0; n < course.size(); ++n)
    most_mm3 = std::max(most_mm3, course.seen_mm3[n] + course.hidden_mm3[n]);
  const auto samples = static_cast<double>(course.size());
  for (int px = 0; px < static_cast<int>(wide); ++px) {
    const auto sample = [&](int p) {
      return static_cast<std::size_t>(
          std::min(samples, std::floor(p / static_cast<double>(wide) * end_s * ReviewCourse::kRateHz)));
    };
    const std::size_t from = sample(px), to = std::max(from + 1, sample(px + 1));
    const float x = left + static_cast<float>(px);
    const auto bar = [&](const Lane& l, float value, float full, Colour colour, float begin = 0) {
      const float share = std::min(value / full, 1.0F), first = std::min(begin / full, 1.0F);
      if (share <= first) return;
      const float bottom = l.top + l.height - 1, tall = l.height - 2;
      draw->AddRectFilled({x, bottom - share * tall}, {x + 1, bottom - first * tall}, im_colour32(colour));
    };
    if (const float f = of_pixel(course.force_n, from, to, true); f > 0)
      bar(lanes[0], f, lanes[0].full, palette::kSkyBlue);
    // The nearer, the higher.
    if (const float d = of_pixel(course.distance_mm, from, to, false); d < lanes[1].full)
      bar(lanes[1], lanes[1].full - std::max(d, 0.0F), lanes[1].full,
          d < 0.5F ? palette::kVermillion : palette::kYellow);
    const float hidden = of_pixel(course.hidden_mm3, from, to, true), seen = of_pixel(course.seen_mm3, from, to, true);
    if (most_mm3 > 0) {
      const float below = std::isnan(hidden) ? 0 : hidden;
      bar(lanes[2], below, most_mm3, palette::kOrange);
      if (!std::isnan(seen)) bar(lanes[2], below + seen, most_mm3, palette::kGreen, below);
    }
  }
  for (const ReviewCourse::Event& event : course.events)
    draw->AddLine({x_of(event.t_s), at.y}, {x_of(event.t_s), at.y + high},
                  im_colour32(event.grave ? palette::kVermillion : theme().quiet, event.grave ? 1.0F : 0.5F));
  if (control.chosen() >= 0) {
    for (const double t : control.review().findings[static_cast<std::size_t>(control.chosen())].times_s)
      draw->AddTriangleFilled({x_of(t) - 0.3F * e, at.y}, {x_of(t) + 0.3F * e, at.y}, {x_of(t), at.y + 0.5F * e},
                              im_colour32(theme().text));
  }
  const float now = x_of(control.now_s());
  draw->AddLine({now, at.y}, {now, at.y + high}, im_colour32(theme().text), 2);
  ImGui::SetCursorScreenPos({left, at.y});
  ImGui::InvisibleButton("time", {wide, high});
  const double under_s =
      (static_cast<double>(ImGui::GetIO().MousePos.x) - static_cast<double>(left)) / static_cast<double>(wide) * end_s;
  if (ImGui::IsItemActive()) {
    control.play(false);
    control.go_to(under_s);
  }
  if (ImGui::IsItemHovered()) {
    std::string said = clock_text(std::clamp(under_s, 0.0, end_s));
    for (const ReviewCourse::Event& event : course.events) {
      if (std::abs(x_of(event.t_s) - ImGui::GetIO().MousePos.x) < 3) said += "\n" + event.what;
    }
    ImGui::SetTooltip("%s", said.c_str());
  }
  ImGui::End();
}

}  // namespace osteo::inline app
