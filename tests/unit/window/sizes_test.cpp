// Text of up to twice the size in each size of window and in each language: everything is inside the window, nothing
// lies on something else, no text is cut, and every command can be reached. ImGui without a screen.
#include <gtest/gtest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "command_palette.h"
#include "imgui_memory.h"
#include "osteo/core/base/translate.h"
#include "scope_panel.h"
#include "scratch.h"
#include "settings_dialog.h"
#include "start_view.h"
#include "tutor_panel.h"
#include "ui_kit.h"
#include "ui_style.h"
#include "view_panels.h"

namespace osteo {
namespace {

struct Size {
  int width, height;
};
constexpr Size kSizes[] = {{1024, 700}, {1280, 800}, {1920, 1080}, {3840, 2160}};
constexpr double kScales[] = {1, 1.25, 1.5, 2};
constexpr Language kLanguages[] = {Language::english, Language::german, Language::spanish, Language::french,
                                   Language::chinese};

int em_of(Size s, double by_hand) {
  return static_cast<int>(
      std::lround(kTextPixels * scale_that_fits(automatic_scale(1, s.width, s.height), by_hand, s.width, s.height)));
}

// One screen in memory, of a size of window and of text.
class Screen {
 public:
  Screen(Size size, double by_hand) : size_(size), em_(em_of(size, by_hand)), memory_(size.width, size.height, em_) {
    test::frames([] {}, 1);  // ImGui has its font from the first on
  }

  [[nodiscard]] ViewLayout lay_out(Layout wanted) const {
    return osteo::lay_out(wanted, size_.width, size_.height, static_cast<float>(em_));
  }
  [[nodiscard]] ScreenBox whole() const {
    return {0, 0, static_cast<float>(size_.width), static_cast<float>(size_.height)};
  }
  // Three pictures: ImGui knows what a window holds from the one before. What lost a part for want of room in them.
  std::set<std::string> draw(const std::function<void()>& content) {
    forget_texts_cut();
    test::frames(content, 3);
    return texts_cut();
  }
  // Windows of the last picture: each within the screen, and what it holds within it, but downwards where it scrolls.
  std::map<std::string, ScreenBox> windows() const {
    std::map<std::string, ScreenBox> all;
    for (const ImGuiWindow* const w : GImGui->Windows) {
      if (!w->Active || w->Hidden || std::string(w->Name) == "Debug##Default") continue;
      const float slack = 2 + ImGui::GetStyle().WindowBorderSize;
      const ScreenBox box{w->Pos.x, w->Pos.y, w->Size.x, w->Size.y};
      EXPECT_LE(w->ContentSize.x + 2 * w->WindowPadding.x, box.width - w->ScrollbarSizes.x + slack) << w->Name;
      const bool scrolls = (w->Flags & ImGuiWindowFlags_NoScrollWithMouse) == 0;
      if (!scrolls) {
        EXPECT_LE(w->ContentSize.y + 2 * w->WindowPadding.y, box.height + slack) << w->Name;
      }
      if ((w->Flags & ImGuiWindowFlags_ChildWindow) != 0) continue;
      EXPECT_GE(box.x, -1) << w->Name;
      EXPECT_GE(box.y, -1) << w->Name;
      EXPECT_LE(box.right(), whole().right() + 1) << w->Name;
      EXPECT_LE(box.bottom(), whole().bottom() + 1) << w->Name;
      all[w->Name] = box;
    }
    return all;
  }

 private:
  Size size_;
  int em_;
  test::ImGuiMemory memory_;
};

void for_each(const std::function<void(Size, double)>& test) {
  for (const Size s : kSizes) {
    for (const double by_hand : kScales) {
      SCOPED_TRACE(std::to_string(s.width) + " x " + std::to_string(s.height) + ", text " + std::to_string(by_hand));
      test(s, by_hand);
    }
  }
}

void expect_apart(const std::map<std::string, ScreenBox>& boxes) {
  for (auto a = boxes.begin(); a != boxes.end(); ++a) {
    for (auto b = boxes.begin(); b != a; ++b) {
      const ScreenBox &one = a->second, &other = b->second;
      if (one.empty() || other.empty()) continue;
      const bool apart = one.right() <= other.x + 1 || other.right() <= one.x + 1 || one.bottom() <= other.y + 1 ||
                         other.bottom() <= one.y + 1;
      EXPECT_TRUE(apart) << a->first << " (" << one.x << ", " << one.y << " to " << one.right() << ", " << one.bottom()
                         << ") lies on " << b->first << " (" << other.x << ", " << other.y << " to " << other.right()
                         << ", " << other.bottom() << ")";
    }
  }
}

// What was drawn onto the picture itself in the last picture.
ScreenBox on_picture(bool front = false) {
  ScreenBox box{1e9F, 1e9F, 0, 0};
  float right = 0, bottom = 0;
  const ImDrawList& list = front ? *ImGui::GetForegroundDrawList() : *ImGui::GetBackgroundDrawList();
  for (const ImDrawVert& v : list.VtxBuffer) {
    box.x = std::min(box.x, v.pos.x);
    box.y = std::min(box.y, v.pos.y);
    right = std::max(right, v.pos.x);
    bottom = std::max(bottom, v.pos.y);
  }
  if (list.VtxBuffer.empty()) return {};
  box.width = right - box.x;
  box.height = bottom - box.y;
  return box;
}

// The longest that the program itself says; names of structures are those of its own phantoms.
StateFacts drilling(Nearness nearness) {
  StateFacts f;
  f.turning = true;
  f.speed = "120000 rpm";
  f.force = shown_number(12.34, 2) + " N";
  f.force_share = 1;
  f.under = tr("over 10 mm");
  f.nearness = nearness;
  f.structure = tr("semicircular canals");
  f.distance = nearness == Nearness::far ? std::string() : shown_number(1.2, 1) + " ± " + shown_number(0.6, 1) + " mm";
  f.near_share = 0.9;
  f.removed = shown_number(12345.6, 1) + " mm³";
  f.tissue = filled(tr("tissue {mm3}"), {{"mm3", shown_number(1234.5, 1)}});
  f.time = "11:03:07";
  return f;
}

// While one drills: strips, card, cuts with their foot, message, step and scale bar beside each other.
void expect_a_place_for_everything(bool monitor) {
  for (const Language language : kLanguages) {
    const InLanguage theirs(language);
    for_each([&](Size s, double by_hand) {
      SCOPED_TRACE(std::string(enum_names(language)[static_cast<std::size_t>(language)]));
      Screen screen(s, by_hand);
      EXPECT_EQ(
          ImGui::GetIO().Fonts->Fonts[0]->FontSize,
          kLineEm * static_cast<float>(std::lround(kTextPixels * by_hand * automatic_scale(1, s.width, s.height))))
          << "as large as it was asked for";
      ViewLayout l = screen.lay_out(Layout::operate);
      // What the nerve monitor takes of the pictures.
      const float e = static_cast<float>(em_of(s, by_hand));
      if (monitor) static_cast<void>(take_strip(l, std::clamp(l.view.height * 0.28F, 15 * e, 21 * e)));
      const Message told{Message::Rank::harm,
                         tr("no room for four pictures: a larger window or smaller text (Ctrl -) shows them")};
      FirstSteps steps;
      Pressed pressed;
      Latched latched;
      HandFacts hand;
      hand.second_hand = true;
      bool burr_unfolded = false, step_unfolded = false;
      const auto state = [&](const std::optional<Message>& message, Nearness nearness) {
        draw_state(l, drilling(nearness), message, pressed);
      };
      const auto all = [&](const std::optional<Message>& message, Nearness nearness) {
        state(message, nearness);
        draw_tray(l.tray, hand, false, latched, pressed);
        const ScreenBox card = draw_burr_card(l.view, l.free_width(), hand, burr_unfolded, pressed);
        if (!l.over[0].empty()) static_cast<void>(draw_cuts_foot(cuts_foot_box(l), l.over[1].empty(), 0, false, {}));
        draw_cut_tile(l.cut_tile, false, pressed);
        static_cast<void>(draw_next_step(l.view, l.free_width(), card, steps, step_unfolded));
      };
      for (const Nearness n : {Nearness::near, Nearness::close, Nearness::touched, Nearness::far}) {
        for (const std::string& text : screen.draw([&] { all({}, n); })) ADD_FAILURE() << "cut: " << text;
      }
      std::map<std::string, ScreenBox> boxes = screen.windows();
      for (const char* const name : {"state", "tray", "burr", "first steps"})
        EXPECT_TRUE(boxes.contains(name)) << name << " has vanished";
      for (std::size_t c = 0; c < 3; ++c) {
        if (!l.over[c].empty()) boxes["cut " + std::to_string(c)] = l.over[c];
      }
      EXPECT_NE(boxes.contains("cut"), boxes.contains("cut 0")) << "a cut, or what brings one";
      if (!monitor) {
        EXPECT_TRUE(boxes.contains("cuts' foot"));
        EXPECT_FALSE(l.over[0].empty());
      }
      // Alone, so that its place is known.
      for (const std::string& text : screen.draw([&] { state(told, Nearness::near); }))
        ADD_FAILURE() << "cut: " << text;
      // Where the strip of state has no room for it; in a very low picture it lies in front of all else.
      if (const ScreenBox message = on_picture(); !message.empty()) boxes["message"] = message;
      const PictureArea area{static_cast<double>(l.view.x), static_cast<double>(l.view.y),
                             static_cast<double>(l.view.width), static_cast<double>(l.view.height)};
      ScopeView view;
      view.magnification = 12.5;
      screen.draw([&] {
        state({}, Nearness::near);
        draw_scope(view, area, StereoMode::off);
      });
      boxes["scale"] = on_picture();
      EXPECT_FALSE(boxes["scale"].empty());
      if (l.view.height < 200 * unit()) boxes.erase("scale");  // in a very low picture the step may lie on its edge
      expect_apart(boxes);
    });
  }
}

TEST(Sizes, OperateHasAPlaceForEverything) {
  expect_a_place_for_everything(false);
}

// The monitor takes up to half of the picture: then the cuts may be a key away, and nothing else.
TEST(Sizes, OperateWithTheNerveMonitorToo) {
  expect_a_place_for_everything(true);
}

// Who teaches: people, links, steps and harm have a column beside the picture, and what operating needs has its place
// in the rest. Who is taught has a card.
TEST(Sizes, TeachIsWhole) {
  for (const Language language : kLanguages) {
    const InLanguage theirs(language);
    for_each([&](Size s, double by_hand) {
      SCOPED_TRACE(std::string(enum_names(language)[static_cast<std::size_t>(language)]));
      Screen screen(s, by_hand);
      TutorNow now;
      now.title = tr("You teach; the trainee's hand is led by yours");
      now.teaches = true;
      now.procedure = "Cortical mastoidectomy with facial recess";
      now.steps = {{"take the cortex off and find the sinus and the dura", 3, 3},
                   {"find the nerve and open the recess", 4, 1},
                   {"clear the cells and the angle", 2, 0}};
      now.invitation = "osteo rehearse CASE --join 192.168.100.100:41234\ncode K7MX-2QPA";
      now.trouble = tr("three wrong codes: nobody else can join this session");
      now.links = {{"trainee", true, 112.3, -13.2, 120, 0.05, 0.1, true}, {"watcher", false}};
      now.hands = {"instructor", "trainee"};
      now.leads = now.guiding = true;
      now.apart_mm = 12.3;
      std::vector<TickRecord> hands(2);
      hands[1].speed_rpm = 60000;
      hands[1].immersed = 4;
      const std::vector<HarmLine> harm{
          {Nearness::touched,
           filled(tr("{structure}: violation ({n})"), {{"structure", tr("semicircular canals")}, {"n", "12"}})}};
      ViewLayout l = screen.lay_out(Layout::operate);
      TutorPanel panel;
      panel.lay_out(l, now, 0);
      FirstSteps steps;
      Pressed pressed;
      Latched latched;
      HandFacts hand;
      bool burr_unfolded = false, step_unfolded = false;
      const auto nowhere = [](Vec3) { return std::optional<std::array<float, 2>>(); };
      const auto all = [&] {
        draw_state(l, drilling(Nearness::close), {}, pressed);
        draw_tray(l.tray, hand, false, latched, pressed);
        const ScreenBox card = draw_burr_card(l.view, l.free_width(), hand, burr_unfolded, pressed);
        if (!l.over[0].empty()) static_cast<void>(draw_cuts_foot(cuts_foot_box(l), l.over[1].empty(), 0, false, {}));
        draw_cut_tile(l.cut_tile, false, pressed);
        static_cast<void>(draw_next_step(l.view, l.free_width(), card, steps, step_unfolded));
        panel.draw(now, hands, harm, l.view, nowhere, pressed);
      };
      for (const std::string& text : screen.draw(all)) ADD_FAILURE() << "cut: " << text;
      std::map<std::string, ScreenBox> boxes = screen.windows();
      for (const char* const name : {"state", "tray", "burr", "tutoring"})
        EXPECT_TRUE(boxes.contains(name)) << name << " has vanished";
      for (std::size_t c = 0; c < 3; ++c) {
        if (!l.over[c].empty()) boxes["cut " + std::to_string(c)] = l.over[c];
      }
      EXPECT_NE(boxes.contains("cut"), boxes.contains("cut 0")) << "a cut, or what brings one";
      expect_apart(boxes);
      const Message told{Message::Rank::harm, tr("the drill is on its way: change the burr when it has arrived")};
      screen.draw([&] { draw_state(l, drilling(Nearness::close), told, pressed); });
      // For a while it may lie on what is a key away and on the step, never on the burr, the cut or the people.
      const ScreenBox behind = on_picture(), front = on_picture(true), message = behind.empty() ? front : behind;
      if (!message.empty()) {
        EXPECT_GE(message.x, l.view.x);
        EXPECT_LE(message.right(), l.view.right());
        if (l.view.height >= 200 * unit()) boxes["message"] = message;
      }
      if (!front.empty()) boxes.erase("cut");
      boxes.erase("first steps");
      expect_apart(boxes);
      now.teaches = false;
      const ViewLayout taught = screen.lay_out(Layout::operate);
      TutorPanel card;
      for (const std::string& text : screen.draw([&] { card.draw(now, hands, harm, taught.view, nowhere, pressed); }))
        ADD_FAILURE() << "cut of the card: " << text;
      EXPECT_TRUE(screen.windows().contains("tutoring"));
    });
  }
}

// Every page of the settings, at its upper end; what it holds is never wider than it.
TEST(Sizes, SettingsAreWhole) {
  const std::vector<StartProcedure> procedures{{"mastoidectomy", tr("Cortical mastoidectomy with facial recess")}};
  for (const Language language : kLanguages) {
    const InLanguage theirs(language);
    for_each([&](Size s, double by_hand) {
      SCOPED_TRACE(std::string(enum_names(language)[static_cast<std::size_t>(language)]));
      Screen screen(s, by_hand);
      const ViewLayout l = screen.lay_out(Layout::operate);
      SettingsParts parts;
      parts.procedures = procedures;
      Pressed pressed;
      parts.foot = [&] { draw_apart(pressed); };
      parts.foot_wide = apart_width();
      parts.another = true;
      PersonValues values;
      SettingsDialog dialog;
      for (std::size_t page = 0; page < EnumNames<SettingsPage>::values.size(); ++page) {
        dialog.show(static_cast<SettingsPage>(page));
        for (const std::string& text :
             screen.draw([&] { EXPECT_FALSE(dialog.draw(SettingsDialog::box_in(l), values, parts)); }))
          ADD_FAILURE() << "cut on page " << page << ": " << text;
        EXPECT_TRUE(screen.windows().contains("settings"));
      }
    });
  }
}

// What lies over the picture for a while.
TEST(Sizes, ListsAndQuestionsAreWhole) {
  for (const Language language : kLanguages) {
    const InLanguage theirs(language);
    for_each([&](Size s, double by_hand) {
      SCOPED_TRACE(std::string(enum_names(language)[static_cast<std::size_t>(language)]));
      Screen screen(s, by_hand);
      const ViewLayout l = screen.lay_out(Layout::operate);
      CommandPalette palette;
      palette.help();
      for (const std::string& text : screen.draw([&] { EXPECT_EQ(palette.draw(screen.whole(), l.view), nullptr); }))
        ADD_FAILURE() << "cut: " << text;
      static_cast<void>(screen.windows());
      palette.show(CommandPalette::Shown::all);
      for (const std::string& text : screen.draw([&] { EXPECT_EQ(palette.draw(screen.whole(), l.view), nullptr); }))
        ADD_FAILURE() << "cut: " << text;
      const ScreenBox list = screen.windows()["commands"];
      EXPECT_GE(list.height, (56 + 36 + 60) * unit()) << "a row of two lines can be seen";
      for (const std::string& text : screen.draw([&] {
             EXPECT_EQ(draw_question(s.width, s.height, tr("Reset bone?"),
                                     tr("This session is saved and ends. A new one begins with the bone of the case."),
                                     tr("Reset bone")),
                       0);
           }))
        ADD_FAILURE() << "cut: " << text;
      EXPECT_TRUE(screen.windows().contains(tr("Reset bone?")));
    });
  }
}

// The page that a case is chosen on: a case, a session, a CT, a network and a folder, each chosen in turn. Where it has
// no room beside the list its panel is below, by scrolling.
TEST(Sizes, TheStartPageIsWhole) {
  const test::ScratchFolder scratch;
  const std::filesystem::path cases = scratch / "cases";
  const auto write = [](const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
  };
  write(cases / "left ear/manifest.json", "{}");
  write(cases / "left ear/sessions/1/session.json", "{}");
  write(cases / "3d_fullres/network.json", R"({"osteotome_network": 1})");
  write(cases / "series/1.dcm", std::string(128, '\0') + "DICM");
  std::filesystem::create_directories(cases / "empty");
  StartOptions options;
  options.folder = cases;
  options.procedures = {{"mastoidectomy", "Cortical mastoidectomy with facial recess"},
                        {"mandible-split", "Mandible sawn on both sides and drawn forward"}};
  for (const Language language : kLanguages) {
    const InLanguage theirs(language);
    for_each([&](Size s, double by_hand) {
      SCOPED_TRACE(std::string(enum_names(language)[static_cast<std::size_t>(language)]));
      Screen screen(s, by_hand);
      PersonSettings person(scratch / "settings.json");
      person.values.remember_cases = true;
      person.opened(cases / "left ear");
      person.values.procedure = "mandible-split";
      options.message = tr("no room for four pictures: a larger window or smaller text (Ctrl -) shows them");
      StartPage page(person, options);
      ASSERT_GE(page.list().entries().size(), 5U);
      for (int n = 0; n < static_cast<int>(page.list().entries().size()); ++n) {
        page.list().select(n);
        SCOPED_TRACE(page.list().entries()[static_cast<std::size_t>(n)].words);
        for (const std::string& text : screen.draw([&] { page.draw(screen.whole().width, screen.whole().height); }))
          ADD_FAILURE() << "cut: " << text;
        const std::map<std::string, ScreenBox> boxes = screen.windows();
        EXPECT_TRUE(boxes.contains("start"));
        expect_apart(boxes);
      }
    });
  }
}

// By a tool of the strip, or by the list of commands, which is opened by one and by its key: all of them, whatever the
// size.
TEST(Sizes, EveryCommandIsReached) {
  const InLanguage english(Language::english);
  for_each([&](Size s, double by_hand) {
    Screen screen(s, by_hand);
    const ViewLayout l = screen.lay_out(Layout::operate);
    HandFacts hand;
    hand.undo_steps = 1;
    hand.second_hand = true;
    std::set<Command> by_strip;
    bool suction = false, irrigation = false;
    for (const float share : {0.25F, 0.5F, 0.75F}) {
      for (float y = l.tray.y + 4; y < l.tray.bottom(); y += 6 * l.unit) {
        for (const bool down : {false, true, false}) {
          ImGuiIO& io = ImGui::GetIO();
          io.MousePos = {l.tray.x + share * l.tray.width, y};
          io.MouseDown[0] = down;
          Pressed pressed;
          Latched latched;
          ImGui::NewFrame();
          draw_tray(l.tray, hand, false, latched, pressed);
          ImGui::Render();
          for (const Keyboard::Press& p : pressed.presses) by_strip.insert(p.command);
          suction |= latched.suction;
          irrigation |= latched.irrigation;
        }
      }
    }
    EXPECT_TRUE(suction && irrigation);
    for (const Command c : {Command::help, Command::palette, Command::settings, Command::bring, Command::lift,
                            Command::saw, Command::plates, Command::pieces, Command::undo, Command::before,
                            Command::ruler, Command::mark, Command::screenshot, Command::layout})
      EXPECT_TRUE(by_strip.contains(c)) << key_name(c);
    // Each row of the list is found by its name, is chosen with it and seen whole, and does its command.
    ImGui::GetIO().MousePos = {-1, -1};
    for (const CommandRow& row : command_rows()) {
      CommandPalette palette;
      palette.show(CommandPalette::Shown::commands);
      for (const char c : row.name) palette.letter(static_cast<char32_t>(static_cast<unsigned char>(c)));
      const CommandRow* done = nullptr;
      for (int n = 0; n < 2; ++n) {
        ImGui::NewFrame();
        done = palette.draw(screen.whole(), l.view);
        ImGui::Render();
      }
      ASSERT_EQ(done, nullptr);
      ASSERT_NE(palette.search().row(), nullptr) << row.name;
      EXPECT_EQ(palette.search().row()->name, row.name);
      constexpr int kEnterKey = 257;
      palette.key(kEnterKey, 0);
      ImGui::NewFrame();
      done = palette.draw(screen.whole(), l.view);
      ImGui::Render();
      ASSERT_NE(done, nullptr) << row.name;
      EXPECT_EQ(done->name, row.name);
    }
  });
}

}  // namespace
}  // namespace osteo
