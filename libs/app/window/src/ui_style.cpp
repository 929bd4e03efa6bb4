#include "ui_style.h"

#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>
#include <vector>

#include "osteo/core/base/translate.h"
#include "window_fonts.h"

namespace osteo::inline app {

namespace {

// Of what is always there: Western Europe's letters and signs.
constexpr ImWchar kAlways[] = {0x20,   0x17F,  0x2010, 0x205E, 0x2070, 0x209F, 0x20AC, 0x20AC, 0x2190,
                               0x2193, 0x2212, 0x2212, 0x2248, 0x2248, 0x2264, 0x2265, 0};
constexpr unsigned kFirstChinese = 0x2E80;  // radicals; before come the scripts that Noto Sans has itself

// What texts need beyond them. A window that is open for days sees many names: of more letters than kKept those are
// forgotten at the next making that were not drawn for so many pictures.
constexpr std::size_t kKept = 1000;
constexpr int kForgottenAfter = 600;

struct Letters {
  std::vector<bool> made = std::vector<bool>(IM_UNICODE_CODEPOINT_MAX + 1);  // what the atlas was asked for
  std::unordered_map<unsigned, int> needed;                                  // the picture in which it was drawn last
  bool missing = false;
  Language language = Language::english;
};
Letters& letters() {
  static Letters all;
  return all;
}

// Each character of a text, as UTF-8.
template <typename Take>
void each_letter(std::string_view text, const Take& take) {
  for (const char *at = text.data(), *const end = at + text.size(); at < end;) {
    unsigned int c = static_cast<unsigned char>(*at);
    if (c < 0x80) {
      ++at;
      continue;
    }
    at += std::max(1, ImTextCharFromUtf8(&c, at, end));
    if (c <= IM_UNICODE_CODEPOINT_MAX) take(c);
  }
}

// What a font is asked for: of `wanted` from `first` to before `behind`.
ImVector<ImWchar> ranges_of(const std::vector<bool>& wanted, unsigned first, unsigned behind) {
  ImFontGlyphRangesBuilder builder;
  for (unsigned c = first; c < std::min<unsigned>(behind, static_cast<unsigned>(wanted.size())); ++c) {
    if (wanted[c]) builder.AddChar(static_cast<ImWchar>(c));
  }
  ImVector<ImWchar> out;
  builder.BuildRanges(&out);
  return out;
}

}  // namespace

void need_letters(std::string_view text) {
  each_letter(text, [](unsigned c) { need_letter(c); });
}

void need_letter(char32_t letter) {
  if (letter <= kAlways[1] || letter > IM_UNICODE_CODEPOINT_MAX) return;
  Letters& l = letters();
  l.needed[letter] = ImGui::GetCurrentContext() != nullptr ? ImGui::GetFrameCount() : 0;
  l.missing = l.missing || !l.made[letter];
}

bool letters_missing() {
  return letters().missing || letters().language != language();
}

void set_ui_style(int em_pixels) {
  ImGuiIO& io = ImGui::GetIO();
  io.Fonts->Clear();
  io.FontGlobalScale = 1;
  const auto size = static_cast<float>(em_pixels);
  Letters& l = letters();
  l.language = language();
  l.missing = false;
  const int now = ImGui::GetFrameCount();
  // Another context counts its own pictures.
  if (l.needed.size() > kKept)
    std::erase_if(l.needed, [&](const auto& n) { return n.second > now || n.second < now - kForgottenAfter; });
  l.made.assign(l.made.size(), false);
  for (const ImWchar* range = kAlways; *range != 0; range += 2) {
    for (unsigned c = range[0]; c <= range[1]; ++c) l.made[c] = true;
  }
  each_letter(catalogue_text(l.language), [&](unsigned c) { l.made[c] = true; });
  for (const auto& [c, picture] : l.needed) l.made[c] = true;
  // They live until the atlas is made.
  const ImVector<ImWchar> western = ranges_of(l.made, 0x20, kFirstChinese),
                          chinese = ranges_of(l.made, kFirstChinese, IM_UNICODE_CODEPOINT_MAX + 1);
  ImFontConfig config;
  config.FontDataOwnedByAtlas = false;
  // Large letters are sharp without, and their atlas is half as large.
  constexpr int kLargeEm = 28;
  config.OversampleH = em_pixels < kLargeEm ? 2 : 1;
  // ImGui's size is from the highest ascender to the lowest descender, which Noto Sans has 1.362 em apart; lines are
  // nearer to each other than that.
  constexpr float kTallEm = 1.362F;
  // From ascender to descender Noto Sans CJK is 1.448 em high: letters of one line are as large as each other.
  constexpr float kChineseLarger = 1.448F / 1.362F;
  const auto add = [&](const unsigned char* font, std::size_t bytes, float high, const ImVector<ImWchar>& wanted) {
    // ImGui asks for a pointer to what it may own; this it does not, and does not write to.
    config.GlyphOffset.y = -std::round((kTallEm - kLineEm) * high / 2);
    io.Fonts->AddFontFromMemoryTTF(const_cast<unsigned char*>(font), static_cast<int>(bytes),
                                   std::round(kTallEm * high), &config, wanted.Data);
  };
  const auto add_chinese = [&](float high) {
    if (chinese.Size < 2) return;  // its end alone
    config.MergeMode = true;
    add(kNotoSansSc, sizeof kNotoSansSc, high * kChineseLarger, chinese);
    config.MergeMode = false;
  };
  add(kNotoSans, sizeof kNotoSans, size, western);
  add_chinese(size);
  add(kNotoSansBold, sizeof kNotoSansBold, std::round(kBoldEm * size), western);
  add_chinese(std::round(kBoldEm * size));
  io.Fonts->Build();
  io.Fonts->Fonts[0]->FontSize = kLineEm * size;
  io.Fonts->Fonts[1]->FontSize = kLineEm * kBoldEm * size;
  ImGuiStyle style;
  style.WindowRounding = 0;
  style.ChildRounding = 0;
  style.FrameRounding = style.PopupRounding = style.GrabRounding = 8;
  style.ScrollbarRounding = 8;
  style.FramePadding = {8, 5};
  style.ItemSpacing = {8, 8};
  style.WindowPadding = {12, 12};
  style.ScaleAllSizes(size / 16);
  style.WindowBorderSize = style.FrameBorderSize = std::max(1.0F, std::round(size / 16));
  ImGui::GetStyle() = style;
  set_ui_colours();
}

void set_ui_colours() {
  ImGuiStyle& style = ImGui::GetStyle();
  const Theme& t = theme();
  if (theme_name() == ThemeName::light) {
    ImGui::StyleColorsLight(&style);
  } else {
    ImGui::StyleColorsDark(&style);
  }
  const ImVec4 hovered = im_colour(t.line, 0.35F), chosen = im_colour(t.accent, 0.45F);
  style.Colors[ImGuiCol_Text] = im_colour(t.text);
  style.Colors[ImGuiCol_TextDisabled] = im_colour(t.quiet);
  style.Colors[ImGuiCol_WindowBg] = style.Colors[ImGuiCol_ChildBg] = im_colour(t.surface);
  style.Colors[ImGuiCol_TitleBg] = style.Colors[ImGuiCol_TitleBgActive] = im_colour(t.raised);
  style.Colors[ImGuiCol_PopupBg] = style.Colors[ImGuiCol_FrameBg] = style.Colors[ImGuiCol_Button] = im_colour(t.raised);
  style.Colors[ImGuiCol_Border] = style.Colors[ImGuiCol_Separator] =
      im_colour(t.line, theme_name() == ThemeName::high_contrast ? 1.0F : 0.5F);
  style.Colors[ImGuiCol_ButtonHovered] = style.Colors[ImGuiCol_FrameBgHovered] = style.Colors[ImGuiCol_HeaderHovered] =
      hovered;
  style.Colors[ImGuiCol_ButtonActive] = style.Colors[ImGuiCol_FrameBgActive] = chosen;
  // What is chosen stands out, not the mouse.
  style.Colors[ImGuiCol_Header] = style.Colors[ImGuiCol_HeaderActive] = chosen;
  style.Colors[ImGuiCol_CheckMark] = style.Colors[ImGuiCol_SliderGrab] = style.Colors[ImGuiCol_SliderGrabActive] =
      im_colour(t.text);
  style.Colors[ImGuiCol_ScrollbarBg] = im_colour(t.surface);
  style.Colors[ImGuiCol_ScrollbarGrab] = im_colour(t.line, 0.6F);
  style.Colors[ImGuiCol_NavHighlight] = im_colour(t.accent);
  style.Colors[ImGuiCol_PlotHistogram] = im_colour(t.accent);
}

void take_theme(const std::string& name) {
  const auto& all = EnumNames<ThemeName>::values;
  const auto* const at = std::find(all.begin(), all.end(), name);
  use_theme(at == all.end() ? ThemeName::dark : static_cast<ThemeName>(at - all.begin()));
  set_ui_colours();
}

ImFont* bold_font() {
  const ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  return atlas.Fonts.size() > 1 ? atlas.Fonts[1] : ImGui::GetFont();
}

void begin_fixed(const char* name, const ScreenBox& box, ImGuiWindowFlags more) {
  ImGui::SetNextWindowPos({box.x, box.y});
  ImGui::SetNextWindowSize({box.width, box.height});
  ImGui::Begin(name, nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoBringToFrontOnFocus | more);
}

namespace {

std::set<std::string>& cut() {
  static std::set<std::string> all;
  return all;
}

}  // namespace

const std::set<std::string>& texts_cut() {
  return cut();
}

void forget_texts_cut() {
  cut().clear();
}

std::string shortened(const std::string& text, float width, float size, ImFont* font) {
  need_letters(text);
  if (font == nullptr) font = ImGui::GetFont();
  const auto wide = [&](const std::string& s) { return font->CalcTextSizeA(size, FLT_MAX, 0, s.c_str()).x; };
  if (wide(text) <= width) return text;
  constexpr std::size_t kMost = 1000;  // a window that is open for days
  if (cut().size() < kMost) cut().insert(text);
  // Whole characters: bytes that go on with one are not where it is parted.
  const auto whole = [&](std::size_t n) {
    while (n > 0 && n < text.size() && (static_cast<unsigned char>(text[n]) & 0xC0) == 0x80) --n;
    return n;
  };
  for (std::size_t kept = text.size(); kept > 1; --kept) {
    const std::size_t head = whole((kept + 1) / 2), tail = whole(text.size() - kept / 2);
    std::string out = text.substr(0, head) + "\u2026" + text.substr(std::max(head, tail));
    if (wide(out) <= width) return out;
  }
  return wide("\u2026") <= width ? "\u2026" : "";
}

void fitted_text(ImDrawList* draw, const ScreenBox& box, float em_pixels, Colour colour, const std::string& text,
                 bool middle, bool bold) {
  if (text.empty() || box.empty()) return;
  ImFont* const font = bold ? bold_font() : ImGui::GetFont();
  float size = kLineEm * std::min(em_pixels, box.height);
  const float width = font->CalcTextSizeA(size, FLT_MAX, 0, text.c_str()).x;
  const float least = std::min(size, kLineEm * kLabelEm * em());
  constexpr float kSurely = 0.999F;  // as the width is rounded
  if (width > box.width) size = std::max(least, kSurely * size * box.width / width);
  const std::string shown = shortened(text, box.width, size, font);
  if (shown != text && ImGui::IsMouseHoveringRect({box.x, box.y}, {box.right(), box.bottom()}, false))
    ImGui::SetTooltip("%s", text.c_str());
  const ImVec2 taken = font->CalcTextSizeA(size, FLT_MAX, 0, shown.c_str());
  const float x = middle ? box.x + (box.width - taken.x) / 2 : box.x;
  draw->AddText(font, size, {std::floor(x), std::floor(box.y + (box.height - taken.y) / 2)},
                im_colour32(colour, ImGui::GetStyle().Alpha), shown.c_str());
}

void draw_sign(ImDrawList* draw, ImVec2 centre, float radius, int corners, Colour colour) {
  const ImU32 paint = im_colour32(colour);
  if (corners < 3) {
    draw->AddCircleFilled(centre, radius * 0.7F, paint, 24);
    return;
  }
  for (int k = 0; k < corners; ++k) {
    const float angle = std::numbers::pi_v<float> *
                        (2 * static_cast<float>(k) / static_cast<float>(corners) - 0.5F + (corners == 8 ? 0.125F : 0));
    draw->PathLineTo({centre.x + radius * std::cos(angle), centre.y + radius * std::sin(angle)});
  }
  draw->PathFillConvex(paint);
}

}  // namespace osteo::inline app
