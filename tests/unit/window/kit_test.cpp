// The window's parts: sizes, what they do when pressed, letters. ImGui without a screen.
#include "ui_kit.h"

#include <gtest/gtest.h>
#include <imgui_internal.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <set>
#include <string>

#include "imgui_memory.h"
#include "osteo/core/base/translate.h"
#include "ui_style.h"
#include "view_panels.h"

namespace osteo {
namespace {

using test::frames;
using Memory = test::ImGuiMemory;

TEST(Kit, FiguresHaveOneWidthAndScriptsAreThere) {
  const Memory memory(800, 600, 16);
  for (ImFont* const font : {ImGui::GetIO().Fonts->Fonts[0], bold_font()}) {
    const float zero = font->GetCharAdvance('0');
    for (char c = '1'; c <= '9'; ++c) EXPECT_EQ(font->GetCharAdvance(static_cast<ImWchar>(c)), zero) << c;
  }
  // Latin, accents, signs.
  const ImFont* const font = ImGui::GetIO().Fonts->Fonts[0];
  for (const ImWchar c : {0x41, 0xE9, 0x16F, 0xB3, 0xB0, 0x2026})
    EXPECT_NE(font->FindGlyphNoFallback(c), nullptr) << static_cast<int>(c);
}

// Pixels of the atlas that a text's letters have ink in, each of them.
void expect_drawn(const std::string& text, ImFont* font) {
  unsigned char* pixels = nullptr;
  int wide = 0, high = 0;
  ImGui::GetIO().Fonts->GetTexDataAsAlpha8(&pixels, &wide, &high);
  for (const char* at = text.data(); at < text.data() + text.size();) {
    unsigned int c = 0;
    at += ImTextCharFromUtf8(&c, at, text.data() + text.size());
    if (c <= ' ') continue;
    const ImFontGlyph* const glyph = font->FindGlyphNoFallback(static_cast<ImWchar>(c));
    ASSERT_NE(glyph, nullptr) << std::hex << c;
    int ink = 0;
    for (int y = static_cast<int>(glyph->V0 * static_cast<float>(high));
         y < static_cast<int>(glyph->V1 * static_cast<float>(high)); ++y) {
      for (int x = static_cast<int>(glyph->U0 * static_cast<float>(wide));
           x < static_cast<int>(glyph->U1 * static_cast<float>(wide)); ++x)
        ink += pixels[y * wide + x] > 128 ? 1 : 0;
    }
    EXPECT_GT(ink, 20) << std::hex << c;
  }
}

// A patient's name in letters that the atlas had not: with the picture after the one that drew it they are there, in
// both faces, at twice the size, and the atlas stays one that every graphics card takes.
TEST(Kit, NamesInOtherScriptsAreDrawn) {
  const InLanguage english(Language::english);
  const Memory memory(1280, 800, 32);
  for (const std::string name :
       {"王小明 欧阳娜娜", "Иванова Ольга Сергеевна", "Παπαδόπουλος", "김민준", "さとう 渡辺"}) {
    frames([&] {
      begin_fixed("names", {0, 0, 1280, 800});
      static_cast<void>(list_row(name, {}, false));
      ImGui::End();
    });
    EXPECT_TRUE(letters_missing()) << name << ": none of it has been drawn before";
    const auto began = std::chrono::steady_clock::now();
    set_ui_style(32);
    std::printf("the atlas with %s: %.0f ms\n", name.c_str(),
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count());
    EXPECT_FALSE(letters_missing());
    frames([] {});
    expect_drawn(name, ImGui::GetIO().Fonts->Fonts[0]);
    expect_drawn(name, bold_font());
  }
  // What no font has is asked for once, not with each picture.
  need_letters("\u0645\u0631\u064a\u0645");
  EXPECT_TRUE(letters_missing());
  set_ui_style(32);
  EXPECT_FALSE(letters_missing());
  need_letters("\u0645\u0631\u064a\u0645");
  EXPECT_FALSE(letters_missing());
  // Broken UTF-8 of a folder's name takes nothing with it.
  need_letters("a\xE7\x8E");
  need_letters("\xFF\xFE");
}

// A window that is open for days: of a thousand names the letters that were not drawn for long go, others stay.
TEST(Kit, LettersOfLongAgoAreForgotten) {
  const InLanguage english(Language::english);
  const Memory memory(800, 600, 16);
  const auto known = [](unsigned c) {
    return ImGui::GetIO().Fonts->Fonts[0]->FindGlyphNoFallback(static_cast<ImWchar>(c)) != nullptr;
  };
  std::string many;  // 王 is among them
  for (unsigned c = 0x7000; c < 0x7800; ++c)
    many += {static_cast<char>(0xE0 | c >> 12), static_cast<char>(0x80 | (c >> 6 & 0x3F)),
             static_cast<char>(0x80 | (c & 0x3F))};
  frames([&] { need_letters(many); });
  EXPECT_TRUE(letters_missing());
  set_ui_style(16);
  EXPECT_FALSE(letters_missing());
  EXPECT_TRUE(known(0x738B));
  for (int n = 0; n < 700; ++n) frames([] { need_letters("\u5C0F"); });
  set_ui_style(16);
  EXPECT_FALSE(known(0x738B)) << "not drawn for 700 pictures";
  EXPECT_TRUE(known(0x5C0F)) << "drawn in the last";
  need_letters("\u738B");
  EXPECT_TRUE(letters_missing()) << "and asked for again when it is drawn again";
  set_ui_style(16);
  EXPECT_TRUE(known(0x738B) && known(0x5C0F)) << "few are kept";
}

// Twice the size on the largest screen, in the language with most letters.
TEST(Kit, TheAtlasFitsAGraphicsCard) {
  const InLanguage chinese(Language::chinese);
  const Memory memory(3840, 2160, 64);
  const ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  EXPECT_LE(atlas.TexWidth, 8192);
  EXPECT_LE(atlas.TexHeight, 8192);
}

TEST(Kit, WhatIsTooLongLosesItsMiddle) {
  const Memory memory(800, 600, 16);
  frames([] {
    const std::string name = "superior semicircular canal of the labyrinth, left side";
    EXPECT_EQ(shortened(name, 1000, 16), name);
    const float size = ImGui::GetFontSize();
    const std::string cut = shortened(name, 200, size);
    EXPECT_TRUE(cut.starts_with("super") && cut.ends_with("side")) << cut;
    EXPECT_LE(ImGui::CalcTextSize(cut.c_str()).x, 200);
    const std::string greek = shortened("\u03b1\u03b2\u03b3\u03b4\u03b5\u03b6\u03b7\u03b8", 60, 16);  // whole letters
    for (std::size_t n = 0; n < greek.size(); ++n)
      EXPECT_TRUE((static_cast<unsigned char>(greek[n]) & 0x80) == 0 || n + 1 < greek.size() ||
                  (static_cast<unsigned char>(greek[n]) & 0xC0) == 0x80);
    EXPECT_EQ(shortened("abc", 1, 16), "");
  });
}

TEST(Kit, EveryIconThatIsUsedIsThere) {
  for (const char* const name : {"menu-2",
                                 "drill",
                                 "saw",
                                 "plate",
                                 "fragments",
                                 "suction",
                                 "droplet",
                                 "arrow-bar-to-down",
                                 "arrow-bar-up",
                                 "arrow-back-up",
                                 "versions",
                                 "ruler-measure",
                                 "note",
                                 "camera",
                                 "layout-grid",
                                 "help",
                                 "chevron-down",
                                 "x",
                                 "check",
                                 "settings",
                                 "eye",
                                 "eye-off",
                                 "adjustments-horizontal"})
    EXPECT_TRUE(has_icon(name)) << name;
  EXPECT_FALSE(has_icon("nothing"));
}

TEST(Kit, ComponentsHaveTheirSizes) {
  const Memory memory(800, 600, 16);
  bool on = false;
  frames([&] {
    begin_fixed("kit", {0, 0, 800, 600});
    static_cast<void>(tile("t", "drill", {}));
    EXPECT_EQ(ImGui::GetItemRectSize().x, 40);
    EXPECT_EQ(ImGui::GetItemRectSize().y, 40);
    static_cast<void>(kit_button("Beenden und zur \u00dcbersicht"));
    EXPECT_EQ(ImGui::GetItemRectSize().y, 40);
    EXPECT_GE(ImGui::GetItemRectSize().x, ImGui::CalcTextSize("Beenden und zur \u00dcbersicht").x + 32);
    static_cast<void>(list_row("a row", "3", true));
    EXPECT_EQ(ImGui::GetItemRectSize().y, 36);
    static_cast<void>(kit_switch("Irrigation", on));
    EXPECT_EQ(ImGui::GetItemRectSize().y, 40);
    double mm = 3;
    EXPECT_FALSE(kit_slider("Kerf", "3.0 mm", mm, 0, 10, 0.5));
    EXPECT_EQ(ImGui::GetItemRectSize().y, 48);
    static const std::string kTwo[] = {"One", "Two"};
    EXPECT_EQ(choice("c", kTwo, 0), -1);
    EXPECT_EQ(ImGui::GetItemRectSize().y, 40);
    ImGui::End();
  });
  EXPECT_FALSE(on);
}

// A click on the track goes there by whole steps; name and value never lie on the track.
TEST(Kit, ASliderGoesWhereItIsPressed) {
  const Memory memory(800, 600, 16);
  double mm = 0;
  ImVec2 lo, hi;
  const auto picture = [&] {
    ImGui::NewFrame();
    begin_fixed("kit", {0, 0, 400, 200});
    const bool changed = kit_slider("Length", "75 mm", mm, 0, 150, 10);
    lo = ImGui::GetItemRectMin();
    hi = ImGui::GetItemRectMax();
    ImGui::End();
    ImGui::Render();
    return changed;
  };
  EXPECT_FALSE(picture());
  const float y = hi.y - 14, from = lo.x + 8, wide = hi.x - lo.x - 16;
  ImGui::GetIO().MousePos = {from + 0.51F * wide, y};
  EXPECT_FALSE(picture());
  ImGui::GetIO().MouseDown[0] = true;
  EXPECT_TRUE(picture());
  EXPECT_EQ(mm, 80) << "0.51 of 150, by tens";
  ImGui::GetIO().MousePos = {hi.x + 300, y};
  EXPECT_TRUE(picture());
  EXPECT_EQ(mm, 150);
  ImGui::GetIO().MousePos = {0, y};
  EXPECT_TRUE(picture());
  EXPECT_EQ(mm, 0);
  EXPECT_LT(lo.y + ImGui::GetFontSize(), y - 8) << "words above the knob";
}

// What has no room in one line has several, and loses nothing; controls that have no room beside each other stand
// below.
TEST(Kit, AControlGrowsWhereItsWordsNeedIt) {
  const Memory memory(800, 600, 16);
  const std::set<std::string> before = texts_cut();
  const std::string words = "Haptische Führung durch die lehrende Person";
  static const std::string kThree[] = {"Dunkel", "Hell", "Hoher Kontrast"};
  bool on = false;
  double mm = 3;
  float button_high = 0, switch_high = 0, slider_high = 0, choice_high = 0, row_high = 0, right = 0;
  frames([&] {
    begin_fixed("kit", {0, 0, 200, 600});
    right = ImGui::GetCursorScreenPos().x + ImGui::GetContentRegionAvail().x;
    const auto high = [&](bool) {
      EXPECT_LE(ImGui::GetItemRectMax().x, right + 1);
      return ImGui::GetItemRectSize().y;
    };
    button_high = high(kit_button(words));
    switch_high = high(kit_switch(words, on));
    slider_high = high(kit_slider("Zwischen den Augen", "120,5 mm", mm, 0, 10, 0.5));
    row_high = high(list_row("Suction tube", "mouse 4, pedal 2", false));
    ImGui::BeginGroup();
    static_cast<void>(choice("c", kThree, 0));
    ImGui::EndGroup();
    choice_high = high(true);
    ImGui::End();
  });
  EXPECT_GT(button_high, 2 * 20);
  EXPECT_GT(switch_high, 2 * 20);
  EXPECT_EQ(slider_high, 68);
  EXPECT_EQ(row_high, 60);
  EXPECT_EQ(choice_high, 3 * 40);
  EXPECT_EQ(texts_cut(), before);
}

// One of the answers is pressed where it stands; where they have no room beside each other they stand below.
TEST(Kit, ADialogTakesOneAnswer) {
  for (const int wide : {800, 320}) {
    const Memory memory(wide, 600, 16);
    const std::string texts[] = {"This session is saved and ends.", ""}, answers[] = {"no (Esc)", "Reset bone (Enter)"};
    keep_places();
    const ScreenBox window{0, 0, static_cast<float>(wide), 600};
    const auto picture = [&] {
      ImGui::NewFrame();
      const int pressed = kit_dialog(window, "Reset bone?", texts, answers);
      ImGui::Render();
      return pressed;
    };
    for (int n = 0; n < 3; ++n) EXPECT_EQ(picture(), -1);
    const auto places = kept_places();
    ASSERT_TRUE(places.contains(answers[0]) && places.contains(answers[1]));
    EXPECT_EQ(places.at(answers[0])[1] == places.at(answers[1])[1], wide > 400);
    for (const int answer : {0, 1}) {
      const auto at = places.at(answers[answer]);
      int pressed = -1;
      ImGui::GetIO().MousePos = {at[0], at[1]};
      for (const bool down : {false, true, false, false}) {
        ImGui::GetIO().MouseDown[0] = down;
        if (const int now = picture(); now >= 0) pressed = now;
      }
      EXPECT_EQ(pressed, answer);
    }
  }
}

// A choice that its strip has no room for is one button, of which each click takes the next.
TEST(Kit, ANarrowChoiceTakesTheNext) {
  const Memory memory(400, 300, 16);
  static const std::string kPlanes[] = {"A", "C", "S"};
  for (const bool narrow : {false, true}) {
    int now = 1;
    const auto picture = [&] {
      ImGui::NewFrame();
      begin_fixed("kit", {0, 0, 400, 300});
      if (const int next = narrow_choice("n", kPlanes, now, narrow ? 64.0F : 200.0F); next >= 0) now = next;
      if (narrow) {
        EXPECT_EQ(ImGui::GetItemRectSize().x, 64);
      }
      ImGui::End();
      ImGui::Render();
    };
    picture();
    ImGui::GetIO().MousePos = {ImGui::GetStyle().WindowPadding.x + 8, ImGui::GetStyle().WindowPadding.y + 8};
    for (const bool down : {false, true, false, false}) {
      ImGui::GetIO().MouseDown[0] = down;
      picture();
    }
    EXPECT_EQ(now, narrow ? 2 : 0) << "the next, or the one that was pressed";
  }
}

// What a file says beyond a slider's ends stays until a hand moves the knob.
// Small values have as much of the track as large ones.
TEST(Kit, ARootSliderIsFineWhereValuesAreSmall) {
  const Memory memory(800, 600, 16);
  double at = 1000;
  ImVec2 lo, hi;
  const auto picture = [&] {
    ImGui::NewFrame();
    begin_fixed("kit", {0, 0, 400, 200});
    const bool changed = kit_root_slider("Stiffness", "?", at, 0, 1000);
    lo = ImGui::GetItemRectMin();
    hi = ImGui::GetItemRectMax();
    ImGui::End();
    ImGui::Render();
    return changed;
  };
  EXPECT_FALSE(picture());
  const float from = lo.x + 8, wide = hi.x - lo.x - 16;
  ImGui::GetIO().MousePos = {from + 0.5F * wide, hi.y - 14};
  EXPECT_FALSE(picture());
  ImGui::GetIO().MouseDown[0] = true;
  EXPECT_TRUE(picture());
  EXPECT_NEAR(at, 125, 4) << "half of the track is an eighth of the values";
  ImGui::GetIO().MousePos = {from + 0.1F * wide, hi.y - 14};
  EXPECT_TRUE(picture());
  EXPECT_NEAR(at, 1, 0.2);
}

// A square opens colours and sliders; what is pressed there is the colour at once.
TEST(Kit, AColourIsChosenFromSomeOrMixed) {
  const Memory memory(800, 600, 16);
  keep_places();
  std::array<float, 3> rgb{1, 1, 1};
  int changes = 0;
  const auto picture = [&] {
    ImGui::NewFrame();
    begin_fixed("kit", {0, 0, 400, 200});
    changes += kit_colour("the bone's", rgb) ? 1 : 0;
    ImGui::End();
    ImGui::Render();
  };
  const auto click = [&](const char* what) {
    for (int n = 0; n < 3; ++n) picture();  // where a popup is, is known after its first
    ASSERT_TRUE(kept_places().contains(what)) << what;
    const auto [x, y] = kept_places().at(what);
    ImGui::GetIO().MousePos = {x, y};
    for (const bool down : {false, true, false, false}) {
      ImGui::GetIO().MouseDown[0] = down;
      picture();
    }
  };
  picture();
  EXPECT_FALSE(kept_places().contains("Red"));
  click("colour");
  EXPECT_EQ(changes, 0) << "nothing is chosen yet";
  click("usual");  // the last of them
  EXPECT_EQ(changes, 1);
  EXPECT_EQ(rgb, (std::array<float, 3>{0.75F, 0.75F, 0.78F}));
  click("Red");  // in the middle of its slider
  EXPECT_NEAR(rgb[0], 0.5F, 0.02F);
  EXPECT_EQ(rgb[1], 0.75F);
}

TEST(Kit, ASliderLeavesAValueBeyondItsEnds) {
  const Memory memory(800, 600, 16);
  for (const double given : {-800.0, 3000.0}) {
    double hu = given;
    frames([&] {
      begin_fixed("kit", {0, 0, 400, 200});
      EXPECT_FALSE(kit_slider("from", "?", hu, -500, 2500, 1));
      ImGui::End();
    });
    EXPECT_EQ(hu, given);
  }
}

}  // namespace
}  // namespace osteo
