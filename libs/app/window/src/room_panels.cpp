#include "room_panels.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "ui_style.h"

namespace osteo::inline app {
namespace {

std::string with_key(const char* word, Command command, std::optional<int> value = {}) {
  return std::string(word) + " (" + key_name(command, value) + ")";
}

// A button that shows that its tool is in use: filled, and with a bar at its side, so not by colour alone.
bool tool_button(const std::string& text, ImVec2 size, bool used) {
  if (used) ImGui::PushStyleColor(ImGuiCol_Button, im_colour(palette::kBlue));
  const bool pressed = ImGui::Button(("##" + text).c_str(), size);
  // Words that are too long for a narrow panel become smaller; ImGui would cut them off.
  const ImVec2 at = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
  const float inset = em() * 0.3F;
  if (!text.starts_with("##"))
    fitted_text(ImGui::GetWindowDrawList(), {at.x + inset, at.y, to.x - at.x - 2 * inset, to.y - at.y}, em(),
                palette::kText, text, true);
  if (used) {
    ImGui::PopStyleColor();
    const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax();
    ImGui::GetWindowDrawList()->AddRectFilled(lo, {lo.x + std::max(3.0F, em() / 5), hi.y},
                                              im_colour32(palette::kYellow));
  }
  return pressed;
}

// Of so many buttons in a row, each.
float share_of_row(int buttons) {
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  return std::floor((ImGui::GetContentRegionAvail().x - gap * static_cast<float>(buttons - 1)) /
                    static_cast<float>(buttons));
}

}  // namespace

void draw_state(const ScreenBox& box, const StateFacts& f, const std::string& message) {
  begin_fixed("state", box, ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoNav | ImGuiWindowFlags_NoInputs);
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const float e = em(), pad = e * 0.5F, label = e * 0.8F, row = e * 1.9F;
  const float top = box.y + pad * 0.6F, big_top = top + label + 1, line = big_top + row + 2;
  // Shares of the width: a name of a structure is the longest.
  static constexpr float kShares[] = {0.25F, 0.17F, 0.19F, 0.39F};
  float x = box.x + pad;
  const float all = box.width - 2 * pad;
  const auto column = [&](int n) {
    const ScreenBox b{x, big_top, all * kShares[n] - pad, row};
    x += all * kShares[n];
    return b;
  };
  const auto head = [&](const ScreenBox& b, const std::string& text) {
    fitted_text(draw, {b.x, top, b.width, label}, label, palette::kFaint, text);
  };

  const ScreenBox tool = column(0);
  head(tool, f.tool);
  draw_sign(draw, {tool.x + e * 0.5F, tool.y + row / 2}, e * 0.5F, f.turning ? 3 : 4,
            f.turning ? palette::kYellow : palette::kFaint);
  fitted_text(draw, {tool.x + e * 1.3F, tool.y, tool.width - e * 1.3F, row}, row * 0.85F, palette::kText, f.speed);

  const ScreenBox force = column(1);
  head(force, "force");
  fitted_text(draw, {force.x, force.y, force.width, row * 0.8F}, row * 0.8F, palette::kText, f.force);
  const float bar = std::max(3.0F, e * 0.25F);
  draw->AddRectFilled({force.x, force.bottom() - bar}, {force.right(), force.bottom()}, im_colour32(palette::kRaised));
  draw->AddRectFilled({force.x, force.bottom() - bar},
                      {force.x + force.width * static_cast<float>(f.force_share), force.bottom()},
                      im_colour32(f.force_share < 0.5 ? palette::kSkyBlue
                                  : f.force_share < 1 ? palette::kYellow
                                                      : palette::kVermillion));

  const ScreenBox under = column(2);
  head(under, "bone under it");
  fitted_text(draw, under, row * 0.85F, palette::kText, f.under);

  const ScreenBox near = column(3);
  const NearnessLook& look = look_of(f.nearness);
  head(near, (f.distance.empty() ? std::string("critical structures") : f.structure) +
                 (f.warmth.empty() ? "" : ", " + f.warmth));
  if (f.nearness == Nearness::touched)  // as large as it can be
    draw->AddRectFilled({near.x - pad / 2, near.y}, {near.right(), near.bottom()}, im_colour32(look.colour));
  const Colour ink = f.nearness == Nearness::touched ? Colour{0, 0, 0} : look.colour;
  draw_sign(draw, {near.x + e * 0.5F, near.y + row / 2}, e * 0.5F, look.corners, ink);
  const std::string words = f.distance.empty() ? f.structure : f.distance + "  " + look.word;
  fitted_text(draw, {near.x + e * 1.3F, near.y, near.width - e * 1.3F, row}, f.distance.empty() ? e : row * 0.85F, ink,
              words);

  // The line below.
  const float below = box.bottom() - line - pad * 0.4F, small = std::min(e, below);
  const float time = all * 0.3F;
  fitted_text(draw, {box.x + pad, line, time - pad, below}, small, palette::kText, f.time + "   " + f.removed);
  const bool warns = warning_is_reported(f, message);
  const std::string& reported = warns ? f.warning : message;
  const float at = box.x + pad + time;
  if (warns)
    draw_sign(draw, {at + small * 0.5F, line + below / 2}, small * 0.45F, f.alarm ? 8 : 3,
              f.alarm ? palette::kVermillion : palette::kYellow);
  fitted_text(draw, {at + small * 1.3F, line, box.right() - at - small * 1.3F - pad, below}, small,
              warns ? (f.alarm ? palette::kVermillion : palette::kYellow) : palette::kText, reported);
  ImGui::End();
}

void draw_tray(const ScreenBox& box, const HandFacts& hand, Pressed& pressed) {
  begin_fixed("tray", box);
  struct Row {
    const char* word;
    Command command;
    bool used, held;
    std::optional<int> value = {};  // where one command has several buttons
  };
  const Burr& burr = burr_library()[static_cast<std::size_t>(hand.burr)];
  std::vector<Row> rows{{"Help", Command::help, false, false},
                        {"Tools", Command::wheel, false, false},
                        {"Approach", Command::bring, false, false},
                        {"Retract", Command::lift, false, false},
                        {"Drill", Command::drill, hand.latched, false}};
  for (std::size_t n = 0; n < kBurrKinds.size(); ++n)
    rows.push_back({kBurrKinds[n].name.data(), Command::burr_kind,
                    hand.tool == 0 && !hand.saw && static_cast<std::size_t>(burr.kind) == n, false,
                    static_cast<int>(n)});
  rows.insert(rows.end(), {{"Saw", Command::saw, hand.tool == 1 || hand.saw, false},
                           {"Fragments", Command::pieces, hand.tool == 2, false},
                           {"Plate", Command::plates, hand.tool == 3, false},
                           {"Suction", Command::suck, hand.sucking, true},
                           {"Irrigate", Command::wash, hand.washing, true},
                           {"Undo", Command::undo, false, false},
                           {"Compare", Command::before, hand.before, false},
                           {"Ruler", Command::ruler, hand.ruler, false},
                           {"Note", Command::mark, false, false},
                           {"Layout", Command::layout, false, false},
                           {"End", Command::quit, false, false}});
  const float gap = ImGui::GetStyle().ItemSpacing.y;
  const auto count = static_cast<float>(rows.size());
  const float high = std::clamp(std::floor(ImGui::GetContentRegionAvail().y / count - gap), em() * 1.05F, em() * 2.5F);
  const float wide = ImGui::GetContentRegionAvail().x;
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  for (const Row& r : rows) {
    const bool off = r.held && !hand.second_hand;
    if (off) ImGui::BeginDisabled();
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const bool clicked = tool_button("##" + std::string(r.word), {wide, high}, r.used);
    if (r.held && ImGui::IsItemActive()) pressed.held.push_back(r.command);
    if (clicked && !r.held) pressed.press(r.command, r.value.value_or(0));
    if (off) ImGui::EndDisabled();
    const Colour ink = off ? palette::kFaint : palette::kText;
    const std::string key = key_name(r.command, r.value);
    const float inner = wide - em() * 0.5F;
    if (high >= em() * 1.9F) {
      fitted_text(draw, {at.x + em() * 0.25F, at.y, inner, high * 0.56F}, em(), ink, r.word, true);
      fitted_text(draw, {at.x + em() * 0.25F, at.y + high * 0.52F, inner, high * 0.46F}, em() * 0.8F, palette::kFaint,
                  key, true);
    } else {
      fitted_text(draw, {at.x + em() * 0.25F, at.y, inner, high}, em() * 0.85F, ink, std::string(r.word) + " " + key,
                  true);
    }
  }
  ImGui::End();
}

void draw_burr(const HandFacts& hand, Pressed& pressed) {
  const Burr& burr = burr_library()[static_cast<std::size_t>(hand.burr)];
  const auto choice = [&](const char* word, Command command, bool used, float wide, std::optional<int> value = {}) {
    if (tool_button(with_key(word, command, value), {wide, 0}, used)) pressed.press(command, value.value_or(0));
  };
  for (std::size_t n = 0; n < kBurrKinds.size(); ++n) {
    if (n % 2 == 1) ImGui::SameLine();
    choice(kBurrKinds[n].name.data(), Command::burr_kind, static_cast<std::size_t>(burr.kind) == n, share_of_row(2),
           static_cast<int>(n));
  }
  const float third = share_of_row(3);
  choice("ball", Command::ball, burr.shape == BurrShape::ball, third);
  ImGui::SameLine();
  choice("cyl.", Command::cylinder, burr.shape == BurrShape::cylinder, third);
  ImGui::SameLine();
  choice("taper", Command::taper, burr.shape == BurrShape::taper, third);
  int diameter = static_cast<int>(burr.diameter_mm);
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
  if (ImGui::SliderInt("##diameter", &diameter, 1, 7, "%d mm (1 to 7)")) pressed.press(Command::diameter, diameter);
  bool on = hand.latched;
  if (ImGui::Checkbox("Drill on (left button, Space)", &on)) pressed.press(Command::drill);
}

void draw_deeds(const HandFacts& hand, Pressed& pressed) {
  const float half = share_of_row(2);
  const auto deed = [&](const char* word, Command command, bool possible = true, bool used = false) {
    ImGui::BeginDisabled(!possible);
    if (tool_button(with_key(word, command), {half, 0}, used)) pressed.press(command);
    ImGui::EndDisabled();
  };
  deed("Approach", Command::bring);
  ImGui::SameLine();
  deed("Retract", Command::lift);
  deed("Undo", Command::undo, hand.undo_steps > 0);
  ImGui::SameLine();
  deed("Compare", Command::before, true, hand.before);
  deed("Ruler", Command::ruler, true, hand.ruler);
  ImGui::SameLine();
  deed("Note", Command::mark);
  deed("Picture", Command::screenshot);
  ImGui::SameLine();
  deed("Tool wheel", Command::wheel);
  deed("Layout", Command::layout);
  ImGui::SameLine();
  deed("Help", Command::help);
}

void draw_apart(Pressed& pressed) {
  ImGui::Separator();
  if (ImGui::Button(with_key("Save and continue", Command::save).c_str(), {-1, 0})) pressed.press(Command::save);
  ImGui::PushStyleColor(ImGuiCol_Border, im_colour(palette::kVermillion));
  ImGui::PushStyleVar(ImGuiStyleVar_FrameBorderSize, std::max(1.0F, std::round(em() / 10)));
  if (ImGui::Button(with_key("Reset bone ...", Command::reset).c_str(), {-1, 0})) pressed.press(Command::reset);
  if (ImGui::Button(with_key("End session", Command::quit).c_str(), {-1, 0})) pressed.press(Command::quit);
  ImGui::PopStyleVar();
  ImGui::PopStyleColor();
}

void draw_first_steps(const FirstSteps& steps, bool all_in_full) {
  ImGui::TextDisabled("the first five minutes");
  const int next = steps.next();
  const bool beside = ImGui::GetContentRegionAvail().x > 70 * em();
  if (beside && !ImGui::BeginTable("steps", 2)) return;
  ImDrawList* const draw = ImGui::GetWindowDrawList();
  const float e = em();
  for (int n = 0; n < static_cast<int>(steps.steps().size()); ++n) {
    const Step& step = steps.steps()[static_cast<std::size_t>(n)];
    if (!step.possible) continue;  // is not asked for
    if (beside) ImGui::TableNextColumn();
    const ImVec2 at = ImGui::GetCursorScreenPos();
    // A ticked box, or an empty one.
    draw->AddRect({at.x + e * 0.1F, at.y + e * 0.15F}, {at.x + e * 0.8F, at.y + e * 0.85F},
                  im_colour32(palette::kFaint), 0, 0, e / 12);
    if (step.done) {
      draw->AddLine({at.x + e * 0.2F, at.y + e * 0.5F}, {at.x + e * 0.4F, at.y + e * 0.75F},
                    im_colour32(palette::kYellow), e / 6);
      draw->AddLine({at.x + e * 0.4F, at.y + e * 0.75F}, {at.x + e * 0.85F, at.y + e * 0.1F},
                    im_colour32(palette::kYellow), e / 6);
    }
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + e * 1.2F);
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(n == next ? palette::kText : palette::kFaint));
    ImGui::TextWrapped("%s", (n == next || all_in_full ? step.words : step.name()).c_str());
    ImGui::PopStyleColor();
  }
  if (beside) ImGui::EndTable();
}

void draw_wheel(const ToolWheel& wheel) {
  if (!wheel.open()) return;
  ImDrawList* const draw = ImGui::GetForegroundDrawList();
  const float e = em(), inner = ToolWheel::kInnerEm * e, outer = ToolWheel::kOuterEm * e;
  const ImVec2 middle{wheel.x(), wheel.y()};
  const auto items = wheel_items();
  const float step = 2 * std::numbers::pi_v<float> / static_cast<float>(items.size());
  draw->AddCircleFilled(middle, outer, im_colour32(palette::kGround, 0.92F), 64);
  for (std::size_t n = 0; n < items.size(); ++n) {
    const float angle = step * static_cast<float>(n) - std::numbers::pi_v<float> / 2;
    const bool chosen = static_cast<int>(n) == wheel.chosen();
    if (chosen) {
      draw->PathArcTo(middle, (inner + outer) / 2, angle - step / 2, angle + step / 2, 24);
      draw->PathStroke(im_colour32(palette::kBlue), ImDrawFlags_None, outer - inner);
    }
    const float edge = angle + step / 2;
    draw->AddLine({middle.x + inner * std::cos(edge), middle.y + inner * std::sin(edge)},
                  {middle.x + outer * std::cos(edge), middle.y + outer * std::sin(edge)}, im_colour32(palette::kFaint),
                  1);
    const float r = outer * 0.68F, wide = 4.4F * e;
    const ScreenBox box{middle.x + r * std::cos(angle) - wide / 2, middle.y + r * std::sin(angle) - e * 1.1F, wide,
                        e * 1.2F};
    fitted_text(draw, box, e * (chosen ? 1.15F : 1), palette::kText, items[n].word, true);
    fitted_text(draw, {box.x, box.bottom(), wide, e * 0.9F}, e * 0.8F, palette::kFaint,
                key_name(items[n].command, items[n].value), true);
  }
  draw->AddCircle(middle, outer, im_colour32(palette::kFaint), 64, 1.5F);
  draw->AddCircleFilled(middle, inner, im_colour32(palette::kRaised), 32);
}

int draw_question(int width, int height, const std::string& title, const std::string& text, const std::string& yes) {
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float wide = std::min(w - em(), 28 * em());
  ImGui::SetNextWindowPos({std::floor((w - wide) / 2), std::floor(h / 3)});
  ImGui::SetNextWindowSize({wide, 0});
  ImGui::Begin(title.c_str(), nullptr,
               ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse);
  ImGui::TextWrapped("%s", text.c_str());
  ImGui::Dummy({0, em() * 0.4F});
  int answer = 0;
  const float half = share_of_row(2);
  if (ImGui::Button("no (Esc)", {half, 0})) answer = -1;
  ImGui::SameLine();
  ImGui::PushStyleColor(ImGuiCol_Border, im_colour(palette::kVermillion));
  if (ImGui::Button((yes + " (Enter)").c_str(), {half, 0})) answer = 1;
  ImGui::PopStyleColor();
  ImGui::End();
  return answer;
}

}  // namespace osteo::inline app
