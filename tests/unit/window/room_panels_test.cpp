// Panels drawn into memory: nothing is cut off, nothing lies outside, at any size of window and text. ImGui without a
// screen.
#include "room_panels.h"

#include <gtest/gtest.h>
#include <imgui_internal.h>

#include <cmath>

#include "help_page.h"
#include "ui_style.h"

namespace osteo {
namespace {

struct Memory {
  Memory(int width, int height, int em_pixels) {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {static_cast<float>(width), static_cast<float>(height)};
    io.DeltaTime = 1 / 60.0F;
    set_ui_style(em_pixels);
    io.Fonts->Build();
  }
  ~Memory() { ImGui::DestroyContext(); }
};

// Of two frames: ImGui knows what a window holds from the one before.
void frames(const std::function<void()>& draw) {
  for (int n = 0; n < 2; ++n) {
    ImGui::NewFrame();
    draw();
    ImGui::Render();
  }
}

void expect_nothing_outside(const char* window, const ScreenBox& box, bool may_scroll) {
  const ImGuiWindow* const w = ImGui::FindWindowByName(window);
  ASSERT_NE(w, nullptr) << window;
  const ImVec2 pad = ImGui::GetStyle().WindowPadding;
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
  f.distance = "10.0 mm";
  f.removed = "12345.6 mm3, tissue 1234.5";
  f.time = "11:03:07";
  f.warning = "recording has ended: no space is left on the device, and what is drilled from now on is not kept";
  f.alarm = true;
  return f;
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
      for (const Layout wanted : {Layout::beside, Layout::operate, Layout::plan}) {
        const RoomLayout l = lay_out(wanted, s.width, s.height, static_cast<float>(em_pixels));
        HandFacts hand;
        hand.second_hand = true;
        Pressed pressed;
        frames([&] {
          draw_state(l.state, longest(), "a message");
          if (!l.tray.empty()) draw_tray(l.tray, hand, pressed);
          if (l.panel.empty()) return;
          begin_fixed("panel", l.panel);
          draw_burr(hand, pressed);
          draw_deeds(hand, pressed);
          draw_apart(pressed);
          ImGui::End();
        });
        EXPECT_TRUE(pressed.presses.empty());
        expect_nothing_outside("state", l.state, false);
        if (!l.tray.empty()) expect_nothing_outside("tray", l.tray, false);
        if (!l.panel.empty()) expect_nothing_outside("panel", l.panel, false);
      }
      // Pages over the picture: within the window.
      HelpPage help;
      help.show(true);
      FirstSteps list;
      StepFacts dusty;
      dusty.dust = true;
      list.see(dusty);
      const auto six_steps = [&] { draw_first_steps(list, true); };
      frames([&] {
        help.draw(s.width, s.height, six_steps);
        EXPECT_EQ(draw_question(s.width, s.height, "Reset bone?", "This session is saved and ends.", "Reset bone"), 0);
      });
      const ScreenBox whole{0, 0, static_cast<float>(s.width), static_cast<float>(s.height)};
      // The help is never scrolled: what one page cannot hold is on the next.
      for (int page = 0; page < help.pages(); ++page) {
        frames([&] { help.draw(s.width, s.height, six_steps); });
        EXPECT_EQ(help.page(), page);
        expect_nothing_outside("Mouse and keys", whole, false);
        EXPECT_EQ(ImGui::FindWindowByName("Mouse and keys")->ScrollMax.y, 0);
        help.turn(1);
      }
      expect_nothing_outside("Reset bone?", whole, false);
      if (s.width >= 1360 && by_hand <= 1) {
        EXPECT_EQ(help.pages(), 1) << "all keys at one look";
      } else if (by_hand <= 1) {
        EXPECT_LE(help.pages(), 2);
      }
    }
  }
}

TEST(Help, RowsStayInTheirOrderAndHeadingsWithTheirs) {
  const std::vector<HelpRow> rows = {{10, true}, {10}, {10}, {10, true}, {10}, {10, true}, {100}, {10}};
  const auto columns = into_columns(rows, 0, 0, 40);
  ASSERT_EQ(columns.size(), 4U);
  EXPECT_EQ(columns[0].to, 3U) << "its fourth row would be a heading";
  EXPECT_EQ(columns[1].from, 3U);
  EXPECT_EQ(columns[1].to, 5U);
  EXPECT_EQ(columns[2].to, 7U) << "a row that is too high still comes";
  EXPECT_EQ(columns[3].to, 8U);
  // The first page's columns may be lower than the others.
  const auto lower = into_columns({{10}, {10}, {10}, {10}, {10}, {10}}, 2, 15, 40);
  ASSERT_EQ(lower.size(), 3U);
  EXPECT_EQ(lower[0].to, 1U);
  EXPECT_EQ(lower[1].to, 2U);
  EXPECT_TRUE(into_columns({}, 3, 10, 40).empty());
}

// While drilling only letters change: what is drawn where stays.
TEST(Panels, NothingJumpsWhileDrilling) {
  const Memory memory(1280, 800, 16);
  const RoomLayout l = lay_out(Layout::beside, 1280, 800, 16);
  const auto first_x = [&](const StateFacts& f) {
    frames([&] { draw_state(l.state, f, ""); });
    const ImGuiWindow* const w = ImGui::FindWindowByName("state");
    std::vector<ImVec2> fixed;  // the bar of the force begins where the field does
    for (const ImDrawVert& v : w->DrawList->VtxBuffer) {
      if (v.col == im_colour32(palette::kRaised)) fixed.push_back(v.pos);
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
  const auto before = first_x(quiet), after = first_x(longest());
  ASSERT_GE(before.size(), 4U);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t n = 0; n < before.size(); ++n) {
    EXPECT_EQ(before[n].x, after[n].x);
    EXPECT_EQ(before[n].y, after[n].y);
  }
}

TEST(Panels, AButtonGivesTheCommandOfItsKey) {
  const Memory memory(1280, 800, 16);
  const ScreenBox box = lay_out(Layout::operate, 1280, 800, 16).tray;
  std::vector<Command> seen;
  // A click on every place of the tray.
  for (float y = 4; y < box.height; y += 10) {
    for (const bool down : {false, true, false}) {
      ImGuiIO& io = ImGui::GetIO();
      io.MousePos = {box.x + box.width / 2, y};
      io.MouseDown[0] = down;
      Pressed pressed;
      ImGui::NewFrame();
      draw_tray(box, {}, pressed);
      ImGui::Render();
      for (const Keyboard::Press& p : pressed.presses) seen.push_back(p.command);
    }
  }
  for (const Command c :
       {Command::help, Command::wheel, Command::bring, Command::lift, Command::saw, Command::undo, Command::quit}) {
    EXPECT_NE(std::find(seen.begin(), seen.end(), c), seen.end()) << key_name(c);
    EXPECT_FALSE(key_name(c).empty());
  }
  // There is no second hand: its buttons do nothing.
  EXPECT_EQ(std::find(seen.begin(), seen.end(), Command::suck), seen.end());
}

}  // namespace
}  // namespace osteo
