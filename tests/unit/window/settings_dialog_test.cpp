// The settings, drawn into memory and used by mouse and keys. ImGui without a screen.
#include "settings_dialog.h"

#include <gtest/gtest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <set>
#include <string>

#include "imgui_memory.h"
#include "osteo/assessment/evidence/hints.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo {
namespace {

// With arrows and keys of its own.
struct Memory : test::ImGuiMemory {
  Memory(int width, int height, int em_pixels) : ImGuiMemory(width, height, em_pixels) {
    ImGuiIO& io = ImGui::GetIO();
    io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
#if IMGUI_VERSION_NUM < 18700
    for (int k = 0; k < ImGuiKey_COUNT; ++k) io.KeyMap[k] = k;
#endif
  }
};

// With something chosen where nothing would leave a row without a choice.
PersonValues begun() {
  PersonValues v;
  v.procedure = "mastoidectomy";
  v.network = "/nets/ear";
  return v;
}

const std::vector<StartProcedure> kProcedures{{"mastoidectomy", "Cortical mastoidectomy with facial recess"},
                                              {"window", "Window into the mastoid"}};

std::string text_of(const FieldRef& field) {
  return field.to_text();
}

TEST(Settings, EachMemberHasOneRow) {
  PersonValues values;
  std::multiset<std::string_view> members;
  for (const SettingRow& r : setting_rows()) members.insert(r.member);
  for (const FieldRef& f : fields_of<PersonValues>(values)) EXPECT_EQ(members.count(f.doc.name), 1U) << f.doc.name;
  EXPECT_EQ(members.size(), fields_of<PersonValues>(values).size());
}

// People choose hints by names in their language, not by what files call them.
TEST(Settings, HintsHaveNames) {
  for (const HintRule& r : usual_hints()) {
    EXPECT_FALSE(r.name.empty()) << r.id;
    EXPECT_NE(r.name, r.id);
    for (const Language language : {Language::german, Language::spanish, Language::french, Language::chinese}) {
      const InLanguage theirs(language);
      EXPECT_NE(tr(r.name), r.name) << r.id;
    }
  }
}

// A click somewhere in a row changes what it is for and nothing else.
TEST(Settings, EachRowChangesItsMember) {
  const Memory memory(1280, 800, 16);
  const ViewLayout layout = lay_out(Layout::operate, 1280, 800, 16);
  const ScreenBox box = SettingsDialog::box_in(layout);
  SettingsParts parts;
  parts.procedures = kProcedures;
  SettingsDialog dialog;
  PersonValues values = begun();
  const auto picture = [&](float x, float y, bool down) {
    ImGuiIO& io = ImGui::GetIO();
    io.MousePos = {x, y};
    io.MouseDown[0] = down;
    ImGui::NewFrame();
    EXPECT_FALSE(dialog.draw(box, values, parts));
    ImGui::Render();
  };
  const auto click = [&](float x, float y) {
    for (const bool down : {false, true, false, false}) picture(x, y, down);
  };
  const auto changed = [&] {
    PersonValues was = begun();
    std::set<std::string_view> names;
    const auto now = fields_of<PersonValues>(values), before = fields_of<PersonValues>(was);
    for (std::size_t n = 0; n < now.size(); ++n) {
      if (text_of(now[n]) != text_of(before[n])) names.insert(now[n].doc.name);
    }
    return names;
  };
  for (const SettingRow& row : setting_rows()) {
    SCOPED_TRACE(std::string(row.member));
    dialog.show(row.page);
    for (int n = 0; n < 4; ++n) picture(-1, -1, false);
    const auto& places = dialog.places();
    const auto at = std::find_if(places.begin(), places.end(), [&](const auto& p) { return p.name == row.member; });
    ASSERT_NE(at, places.end());
    const SettingsDialog::Place place = *at;
    std::set<std::string_view> seen;
    float begin = 24;  // of what a list opens, one and then the next
    for (float y = place.y; seen.empty() && y < place.y + 24; y += 8) {
      for (float x = box.right() - 24; seen.empty() && x > box.x + 230; x -= 40) {
        click(x, y);
        for (float below = begin; GImGui->OpenPopupStack.Size > 0; below += 12) click(x - 60, y + below);
        begin += 24;
        seen = changed();
        values = begun();
      }
    }
    EXPECT_EQ(seen, std::set<std::string_view>{row.member}) << place.x << " " << place.y;
  }
}

// By keys alone: down the list of pages, into one, and a switch by Space.
TEST(Settings, KeysReachEachPageAndItsRows) {
  const Memory memory(1280, 800, 16);
  const ScreenBox box = SettingsDialog::box_in(lay_out(Layout::operate, 1280, 800, 16));
  SettingsDialog dialog;
  PersonValues values = begun();
  SettingsParts parts;
  const auto press = [&](ImGuiKey key) {
    for (const bool down : {true, true, false, false}) {
#if IMGUI_VERSION_NUM < 18700
      ImGui::GetIO().KeysDown[key] = down;
#else
      ImGui::GetIO().AddKeyEvent(key, down);
#endif
      ImGui::NewFrame();
      static_cast<void>(dialog.draw(box, values, parts));
      ImGui::Render();
    }
  };
  const auto rest = [&] {
    for (int n = 0; n < 3; ++n) {
      ImGui::NewFrame();
      static_cast<void>(dialog.draw(box, values, parts));
      ImGui::Render();
    }
  };
  dialog.show(SettingsPage::display);
  rest();
  press(ImGuiKey_DownArrow);
  press(ImGuiKey_Space);
  EXPECT_EQ(dialog.page(), SettingsPage::sound);
  EXPECT_TRUE(values.sound);
  dialog.show(SettingsPage::sound, true);
  rest();
  press(ImGuiKey_Space);
  EXPECT_FALSE(values.sound) << "the first of the page";
  press(ImGuiKey_DownArrow);
  const double before = values.volume;
  press(ImGuiKey_LeftArrow);
  EXPECT_LT(values.volume, before) << "Left is the slider's, and does not leave it";
  press(ImGuiKey_LeftArrow);
  EXPECT_NEAR(values.volume, before - 0.1, 1e-9);
}

TEST(Settings, AnotherSessionIsOfferedWhereOneIsNeeded) {
  PersonValues begun, now;
  EXPECT_FALSE(needs_another_session(begun, now));
  now.hints = now.alarms = now.monitor = now.dust = now.heat = true;
  now.position = "prone";
  now.mirror_procedure = true;  // of none
  EXPECT_FALSE(needs_another_session(begun, now)) << "these change at once";
  now.procedure = "window";
  EXPECT_TRUE(needs_another_session(begun, now));
  begun.procedure = now.procedure;
  EXPECT_TRUE(needs_another_session(begun, now)) << "mirrored";
  // And its button begins it.
  const Memory memory(1280, 800, 16);
  const ScreenBox box = SettingsDialog::box_in(lay_out(Layout::operate, 1280, 800, 16));
  SettingsDialog dialog;
  SettingsParts parts;
  parts.another = true;
  dialog.show(SettingsPage::operation);
  bool pressed = false;
  for (const bool down : {false, false, false, true, false}) {
    for (const auto& p : dialog.places()) {
      if (p.name == "another") ImGui::GetIO().MousePos = {p.x, p.y};
    }
    ImGui::GetIO().MouseDown[0] = down;
    ImGui::NewFrame();
    pressed = dialog.draw(box, now, parts) || pressed;
    ImGui::Render();
  }
  EXPECT_TRUE(pressed);
}

// In each language and size: nothing of the dialog is outside its box, no name loses its middle.
TEST(Settings, FitInEachLanguageAndSize) {
  struct Size {
    int width, height, em;
  };
  for (const Size s : {Size{1024, 700, 16}, {1280, 800, 16}, {1280, 800, 26}, {3840, 2160, 32}}) {
    for (const Language language :
         {Language::english, Language::german, Language::spanish, Language::french, Language::chinese}) {
      const InLanguage theirs(language);
      const Memory memory(s.width, s.height, s.em);
      const ScreenBox box =
          SettingsDialog::box_in(lay_out(Layout::operate, s.width, s.height, static_cast<float>(s.em)));
      EXPECT_LE(box.right(), static_cast<float>(s.width));
      SettingsDialog dialog;
      PersonValues values = begun();
      SettingsParts parts;
      parts.procedures = kProcedures;
      const std::size_t before = texts_cut().size();
      for (std::size_t n = 0; n < enum_names(SettingsPage{}).size(); ++n) {
        dialog.show(static_cast<SettingsPage>(n));
        for (int k = 0; k < 3; ++k) {
          ImGui::NewFrame();
          static_cast<void>(dialog.draw(box, values, parts));
          ImGui::Render();
        }
        const ImGuiWindow* const w = ImGui::FindWindowByName("settings");
        ASSERT_NE(w, nullptr);
        for (const ImGuiWindow* child : w->DC.ChildWindows)
          EXPECT_LE(child->ContentSize.x, child->Size.x + 1) << child->Name << " em " << s.em;
      }
      EXPECT_EQ(texts_cut().size(), before) << *texts_cut().rbegin() << " em " << s.em;
    }
  }
}

}  // namespace
}  // namespace osteo
