// Panels drawn into memory: nothing is cut off, nothing lies outside, at any size of window and text. ImGui without a
// screen.
#include "view_panels.h"

#include <gtest/gtest.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "command_palette.h"
#include "imgui_memory.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo {
namespace {

using test::frames;
using Memory = test::ImGuiMemory;

void expect_nothing_outside(const char* window, const ScreenBox& box, bool may_scroll) {
  const ImGuiWindow* const w = ImGui::FindWindowByName(window);
  ASSERT_NE(w, nullptr) << window;
  const ImVec2 pad = w->WindowPadding;
  const float slack = 1.5F + ImGui::GetStyle().WindowBorderSize;  // its own frame, drawn smooth
  EXPECT_LE(w->ContentSize.x + 2 * pad.x, box.width + slack) << window;
  if (!may_scroll) {
    EXPECT_LE(w->ContentSize.y + 2 * pad.y, box.height + slack) << window;
  }
  for (const ImDrawVert& v : w->DrawList->VtxBuffer) {
    EXPECT_GE(v.pos.x, box.x - slack) << window;
    EXPECT_LE(v.pos.x, box.right() + slack) << window;
    if (may_scroll) continue;
    EXPECT_GE(v.pos.y, box.y - slack) << window;
    EXPECT_LE(v.pos.y, box.bottom() + slack) << window;
  }
}

StateFacts longest() {
  StateFacts f;
  f.tool = "diamond cylinder 7 mm";
  f.turning = true;
  f.speed = "120000 rpm";
  f.force = "12.34 N";
  f.force_share = 1;
  f.under = "over 10 mm";
  f.nearness = Nearness::touched;
  f.structure = "superior semicircular canal of the labyrinth, left side";
  f.distance = "10.0 ± 1.2 mm";
  f.removed = "12345.6 mm³";
  f.tissue = "tissue 1234.5";
  f.time = "11:03:07";
  f.warning = "recording has ended: no space is left on the device, and what is drilled from now on is not kept";
  f.alarm = true;
  return f;
}

// At few pictures a second letters and keys come many at a time.
TEST(Palette, LettersAndKeysStayInTheirOrder) {
  constexpr int kBackspace = 259;
  const Memory memory(1280, 800, 16);
  const ViewLayout l = lay_out(Layout::operate, 1280, 800, 16);
  CommandPalette palette;
  const auto draw = [&] { frames([&] { EXPECT_EQ(palette.draw({0, 0, 1280, 800}, l.view), nullptr); }); };
  palette.letter('q');
  draw();
  EXPECT_EQ(palette.shown(), CommandPalette::Shown::nothing) << "a letter alone opens nothing";
  palette.key('K', kWithCtrl);
  for (const char c : {'z', 'a'}) {
    palette.key(c - 'a' + 'A', 0);
    palette.letter(static_cast<char32_t>(c));
  }
  palette.show(CommandPalette::Shown::commands);  // what the key does, in the picture after
  draw();
  EXPECT_EQ(palette.search().text(), "za");
  palette.key(kBackspace, 0);
  palette.key(kBackspace, 0);
  palette.letter('m');
  palette.letter('x');
  palette.key(kBackspace, 0);
  palette.letter('a');
  draw();
  EXPECT_EQ(palette.search().text(), "ma");
  palette.show(CommandPalette::Shown::nothing);
  palette.letter('q');
  palette.show(CommandPalette::Shown::commands);
  draw();
  EXPECT_EQ(palette.search().text(), "");
}

TEST(Panels, NothingIsCutOffAtAnySize) {
  struct Size {
    int width, height;
  };
  for (const Size s : {Size{1024, 700}, {1280, 800}, {1360, 860}, {1920, 1080}, {2560, 1440}, {3840, 2160}}) {
    for (const double by_hand : {0.8, 1.0, 1.5}) {
      const double scale = scale_that_fits(automatic_scale(1, s.width, s.height), by_hand, s.width, s.height);
      const auto em_pixels = static_cast<int>(std::lround(kTextPixels * scale));
      SCOPED_TRACE(std::to_string(s.width) + " text " + std::to_string(em_pixels));
      const Memory memory(s.width, s.height, em_pixels);
      for (const Layout wanted : {Layout::operate, Layout::plan}) {
        const ViewLayout l = lay_out(wanted, s.width, s.height, static_cast<float>(em_pixels));
        const Message told{Message::Rank::harm, longest().warning};
        HandFacts hand;
        hand.second_hand = true;
        Pressed pressed;
        Latched latched;
        bool unfolded = true;
        ScreenBox card;
        frames([&] {
          draw_state(l, longest(), told, pressed);
          draw_tray(l.tray, hand, true, latched, pressed);
          card = draw_burr_card(l.view, l.view.width, hand, unfolded, pressed);
        });
        EXPECT_TRUE(pressed.presses.empty());
        EXPECT_FALSE(latched.suction || latched.irrigation);
        expect_nothing_outside("state", l.state, false);
        expect_nothing_outside("tray", l.tray, false);
        if (card.empty()) continue;  // no room: the keys and the panel have it
        EXPECT_LE(card.right(), l.view.right());
        expect_nothing_outside("burr", card, false);
      }
      // What lies over the picture: within the window, and each command's name and keys whole.
      const ScreenBox whole{0, 0, static_cast<float>(s.width), static_cast<float>(s.height)};
      const ViewLayout l = lay_out(Layout::operate, s.width, s.height, static_cast<float>(em_pixels));
      CommandPalette palette;
      palette.help();
      EXPECT_EQ(palette.shown(), CommandPalette::Shown::ten_keys);
      frames([&] {
        EXPECT_EQ(palette.draw(whole, l.view), nullptr);
        EXPECT_EQ(draw_question(s.width, s.height, "Reset bone?", "This session is saved and ends.", "Reset bone"), 0);
      });
      expect_nothing_outside("Reset bone?", whole, false);
      EXPECT_EQ(palette.shown(), CommandPalette::Shown::ten_keys) << "there is room for it";
      const ImGuiWindow* const ten = ImGui::FindWindowByName("ten keys");
      ASSERT_NE(ten, nullptr);
      const ScreenBox card{ten->Pos.x, ten->Pos.y, ten->Size.x, ten->Size.y};
      EXPECT_TRUE(l.view.holds(card.x, card.y) && l.view.holds(card.right() - 1, card.bottom() - 1));
      expect_nothing_outside("ten keys", card, false);
      palette.help();
      EXPECT_EQ(palette.shown(), CommandPalette::Shown::all);
      frames([&] { EXPECT_EQ(palette.draw(whole, l.view), nullptr); });
      const ImGuiWindow* const list = ImGui::FindWindowByName("commands");
      ASSERT_NE(list, nullptr);
      EXPECT_TRUE(whole.holds(list->Pos.x, list->Pos.y) &&
                  whole.holds(list->Pos.x + list->Size.x - 1, list->Pos.y + list->Size.y - 1));
      for (const CommandRow& row : command_rows()) {
        const float room = list->Size.x - 56 * unit();
        EXPECT_LE(ImGui::CalcTextSize(row.name.c_str()).x, room) << row.name;
        EXPECT_LE(ImGui::CalcTextSize(row.keys.c_str()).x, room) << row.name;
      }
    }
  }
}

// Typed, chosen and done by keys alone; each press counts, however few pictures there are.
TEST(Palette, FindsByTypingAndDoesByEnter) {
  const Memory memory(1280, 800, 16);
  const ScreenBox whole{0, 0, 1280, 800}, view{56, 0, 1224, 736};
  CommandPalette palette;
  palette.show(CommandPalette::Shown::commands);
  const auto picture = [&](const char* letters, const std::vector<int>& keys) {
    for (const char* c = letters; *c != 0; ++c) palette.letter(static_cast<char32_t>(*c));
    for (const int k : keys) palette.key(k, 0);
    ImGui::NewFrame();
    const CommandRow* const done = palette.draw(whole, view);
    ImGui::Render();
    return done;
  };
  EXPECT_EQ(picture("wat", {}), nullptr);
  EXPECT_EQ(palette.search().row()->command, Command::irrigation);
  EXPECT_EQ(picture("", {259, 259, 259}), nullptr);  // Backspace
  EXPECT_EQ(palette.search().text(), "");
  const CommandRow* const done = picture("plate", {257});  // and Enter, in the same picture
  ASSERT_NE(done, nullptr);
  EXPECT_EQ(done->command, Command::plates);
  EXPECT_FALSE(palette.typing());
  palette.show(CommandPalette::Shown::all);
  EXPECT_EQ(picture("", {264, 264, 265, 256}), nullptr);  // Down, Down, Up, Esc
  EXPECT_FALSE(palette.typing());
  // A click does it too.
  palette.show(CommandPalette::Shown::commands);
  picture("full screen", {});
  const ImGuiWindow* const list = ImGui::FindWindowByName("commands");
  ImGui::GetIO().MousePos = {list->Pos.x + 100, list->Pos.y + 56 + 20};
  const CommandRow* clicked_row = nullptr;
  for (const bool down : {false, true, false, false}) {
    ImGui::GetIO().MouseDown[0] = down;
    if (const CommandRow* const row = picture("", {})) clicked_row = row;
  }
  ASSERT_NE(clicked_row, nullptr);
  EXPECT_EQ(clicked_row->command, Command::full_screen);
}

// The card is short because it can be read at a glance.
TEST(Palette, TenKeys) {
  EXPECT_EQ(ten_keys().size(), 10U);
  for (const TenKeysRow& r : ten_keys()) EXPECT_FALSE(r.keys.empty()) << r.text;
}

constexpr Language kLanguages[] = {Language::english, Language::german, Language::spanish, Language::french,
                                   Language::chinese};

TEST(Panels, FitInEveryLanguage) {
  for (const Language language : kLanguages) {
    const InLanguage theirs(language);
    SCOPED_TRACE(std::string(enum_names(language)[static_cast<std::size_t>(language)]));
    constexpr int kWidth = 1024, kHeight = 700;
    const Memory memory(kWidth, kHeight, kTextPixels);
    const ViewLayout l = lay_out(Layout::operate, kWidth, kHeight, static_cast<float>(kTextPixels));
    StateFacts f = longest();
    f.structure = "facial nerve";  // a name of the case's may be cut
    f.warning.clear();
    const std::set<std::string> before = texts_cut();
    Pressed pressed;
    Latched latched;
    bool unfolded = true;
    ScreenBox card;
    CommandPalette palette;
    palette.help();
    const ScreenBox whole{0, 0, kWidth, kHeight};
    const FirstSteps list;
    frames([&] {
      draw_state(l, f, {}, pressed);
      draw_tray(l.tray, {}, true, latched, pressed);
      card = draw_burr_card(l.view, l.view.width, {}, unfolded, pressed);
      static_cast<void>(draw_next_step(l.view, l.free_width(), card, list, unfolded));
      EXPECT_EQ(palette.draw(whole, l.view), nullptr);
      static_cast<void>(draw_question(kWidth, kHeight, tr("Reset bone?"),
                                      tr("This session is saved and ends. A new one begins with the bone of the case."),
                                      tr("Reset bone")));
    });
    for (const std::string& text : texts_cut()) EXPECT_TRUE(before.contains(text)) << text;
    ASSERT_FALSE(card.empty());
    expect_nothing_outside("burr", card, false);
    expect_nothing_outside("state", l.state, false);
    expect_nothing_outside(tr("Reset bone?"), whole, false);
    EXPECT_EQ(palette.shown(), CommandPalette::Shown::ten_keys) << "there is room for it";
    palette.help();
    frames([&] { EXPECT_EQ(palette.draw(whole, l.view), nullptr); });
    for (const std::string& text : texts_cut()) EXPECT_TRUE(before.contains(text)) << text;
    const ImGuiWindow* const commands = ImGui::FindWindowByName("commands");
    ASSERT_NE(commands, nullptr);
    for (const CommandRow& row : command_rows()) {
      const float room = commands->Size.x - 56 * unit();
      EXPECT_LE(ImGui::CalcTextSize(shown_name(row).c_str()).x, room) << shown_name(row);
      EXPECT_LE(ImGui::CalcTextSize(shown_keys(row).c_str()).x, room) << shown_keys(row);
    }
  }
}

TEST(Panels, EveryCharacterHasAGlyph) {
  for (const Language language : kLanguages) {
    const InLanguage theirs(language);
    const Memory memory(1024, 700, kTextPixels);
    frames([] {});
    const std::string_view text = catalogue_text(language);
    for (const char* at = text.data(); at < text.data() + text.size();) {
      unsigned int c = 0;
      at += ImTextCharFromUtf8(&c, at, text.data() + text.size());
      if (c <= ' ') continue;
      EXPECT_NE(ImGui::GetFont()->FindGlyphNoFallback(static_cast<ImWchar>(c)), nullptr) << std::hex << c;
      if (c >= 0x4E00) {
        EXPECT_NE(bold_font()->FindGlyphNoFallback(static_cast<ImWchar>(c)), nullptr) << std::hex << c;
      }
    }
  }
}

// While drilling only letters and bars change: what is drawn where stays.
TEST(Panels, NothingJumpsWhileDrilling) {
  const Memory memory(1280, 800, 16);
  const ViewLayout l = lay_out(Layout::operate, 1280, 800, 16);
  Pressed pressed;
  const auto grounds = [&](const StateFacts& f) {
    frames([&] { draw_state(l, f, {}, pressed); });
    const ImGuiWindow* const w = ImGui::FindWindowByName("state");
    std::vector<ImVec2> fixed;  // of the bars
    for (const ImDrawVert& v : w->DrawList->VtxBuffer) {
      if (v.col == im_colour32(theme().raised)) fixed.push_back(v.pos);
    }
    return fixed;
  };
  StateFacts quiet;
  quiet.tool = "cutting 1 mm";
  quiet.speed = "still";
  quiet.force = "0.00 N";
  quiet.under = "-";
  quiet.structure = "none within 10 mm";
  quiet.nearness = Nearness::far;
  StateFacts near = longest();
  near.nearness = Nearness::near;
  const auto before = grounds(quiet), after = grounds(near);
  ASSERT_GE(before.size(), 8U);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t n = 0; n < before.size(); ++n) {
    EXPECT_EQ(before[n].x, after[n].x);
    EXPECT_EQ(before[n].y, after[n].y);
  }
}

// The bar fills as the structure comes nearer, in its colour; a contact fills the field.
TEST(Panels, TheBarOfTheNearestStructureFills) {
  const Memory memory(1280, 800, 16);
  const ViewLayout l = lay_out(Layout::operate, 1280, 800, 16);
  Pressed pressed;
  const auto painted = [&](Nearness nearness, double share) {
    StateFacts f = longest();
    f.nearness = nearness;
    f.near_share = share;
    frames([&] { draw_state(l, f, {}, pressed); });
    float least = 1e9F, most = 0;
    for (const ImDrawVert& v : ImGui::FindWindowByName("state")->DrawList->VtxBuffer) {
      if (v.col != im_colour32(look_of(nearness).colour) || v.pos.y < l.state.y + 38) continue;
      least = std::min(least, v.pos.x);
      most = std::max(most, v.pos.x);
    }
    return std::max(0.0F, most - least);
  };
  const float half = painted(Nearness::near, 0.5), more = painted(Nearness::close, 0.9);
  EXPECT_GT(half, 50);
  EXPECT_NEAR(more / half, 0.9 / 0.5, 0.1);
  EXPECT_GE(painted(Nearness::touched, 1), more);
}

// A long message at the foot of a small picture is whole, and leaves the scale bar's box free.
TEST(Panels, ALongMessageLeavesTheScaleFree) {
  const Memory memory(1024, 700, 16);
  const ViewLayout l = lay_out(Layout::operate, 1024, 700, 16);
  Pressed pressed;
  const std::string message = "of this picture alone: " + longest().warning;
  float right = 0, top = 1e9F;
  frames([&] {
    draw_state(l, longest(), Message{Message::Rank::harm, message}, pressed);
    right = 0;
    for (const ImDrawVert& v : ImGui::GetBackgroundDrawList()->VtxBuffer) {
      right = std::max(right, v.pos.x);
      top = std::min(top, v.pos.y);
    }
  });
  EXPECT_GT(right, l.view.x + 300);
  EXPECT_LT(right, l.view.right() - 320);
  EXPECT_GE(top, l.view.bottom() - 64) << "below the card of the next step";
  EXPECT_EQ(texts_cut().count(message), 0U);
}

// A click on every place of a strip.
std::vector<Keyboard::Press> clicked(const ScreenBox& box, float x, const std::function<void(Pressed&)>& draw) {
  std::vector<Keyboard::Press> seen;
  for (float y = box.y + 4; y < box.bottom(); y += 10) {
    for (const bool down : {false, true, false}) {
      ImGuiIO& io = ImGui::GetIO();
      io.MousePos = {x, y};
      io.MouseDown[0] = down;
      Pressed pressed;
      ImGui::NewFrame();
      draw(pressed);
      ImGui::Render();
      seen.insert(seen.end(), pressed.presses.begin(), pressed.presses.end());
    }
  }
  return seen;
}

TEST(Panels, AButtonGivesTheCommandOfItsKey) {
  const Memory memory(1024, 700, 16);
  const ViewLayout l = lay_out(Layout::operate, 1024, 700, 16);
  const auto has = [](const std::vector<Keyboard::Press>& all, Command c) {
    return std::any_of(all.begin(), all.end(), [&](const Keyboard::Press& p) { return p.command == c; });
  };
  HandFacts hand;
  hand.undo_steps = 1;
  Latched latched;
  const float middle = l.tray.x + l.tray.width / 2;
  auto seen = clicked(l.tray, middle, [&](Pressed& p) { draw_tray(l.tray, hand, false, latched, p); });
  for (const Command c : {Command::help, Command::palette, Command::settings, Command::bring, Command::lift,
                          Command::saw, Command::plates, Command::pieces, Command::undo, Command::before,
                          Command::ruler, Command::mark, Command::screenshot, Command::layout}) {
    EXPECT_TRUE(has(seen, c)) << key_name(c);
    EXPECT_FALSE(key_name(c).empty());
  }
  // There is no second hand: its tiles do nothing. With one a click leaves them on, and the next off.
  EXPECT_FALSE(latched.suction || latched.irrigation);
  hand.second_hand = true;
  hand.undo_steps = 0;
  seen = clicked(l.tray, middle, [&](Pressed& p) {
    draw_tray(l.tray, hand, false, latched, p);
    latched.suction = false;  // each place is clicked several times: each turns it on
  });
  EXPECT_FALSE(has(seen, Command::suck));
  EXPECT_FALSE(has(seen, Command::undo)) << "nothing to take back";
  // What ends the session is in the state; sizes and kinds on the burr's card.
  seen = clicked(l.state, l.state.right() - 40, [&](Pressed& p) { draw_state(l, longest(), {}, p); });
  EXPECT_TRUE(has(seen, Command::quit));
  bool unfolded = false;
  ScreenBox card;
  std::vector<int> sizes;
  for (float x = l.view.x; x < l.view.x + 560; x += 20) {
    for (const Keyboard::Press& p :
         clicked({x, 40, 1, 8}, x, [&](Pressed& q) { card = draw_burr_card(l.view, l.view.width, hand, unfolded, q); }))
      if (p.command == Command::diameter) sizes.push_back(p.value);
  }
  for (int d = 1; d <= 7; ++d) EXPECT_NE(std::find(sizes.begin(), sizes.end(), d), sizes.end()) << d;
}

}  // namespace
}  // namespace osteo
