#include "ui_style.h"

#include <fontconfig/fontconfig.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteo::inline app {
namespace {

UiFont find_font() {
  UiFont found;
  FcPattern* const wanted = FcNameParse(reinterpret_cast<const FcChar8*>("DejaVu Sans:scalable=true"));
  if (wanted != nullptr && FcConfigSubstitute(nullptr, wanted, FcMatchPattern) == FcTrue) {
    FcDefaultSubstitute(wanted);
    FcResult result = FcResultNoMatch;
    if (FcPattern* const match = FcFontMatch(nullptr, wanted, &result)) {
      FcChar8* file = nullptr;
      if (FcPatternGetString(match, FC_FILE, 0, &file) == FcResultMatch) {
        const std::string name = reinterpret_cast<const char*>(file);
        // ImGui reads outlines of TrueType alone.
        if (name.ends_with(".ttf") || name.ends_with(".ttc")) found.file = name;
      }
      FcPatternDestroy(match);
    }
  }
  if (wanted != nullptr) FcPatternDestroy(wanted);
  if (found.file.empty()) found.missing = "no TrueType font was found, so text is coarse; fonts-dejavu-core brings one";
  return found;
}

}  // namespace

const UiFont& ui_font() {
  static const UiFont font = find_font();
  return font;
}

void set_ui_style(int em_pixels) {
  ImGuiIO& io = ImGui::GetIO();
  io.Fonts->Clear();
  io.FontGlobalScale = 1;
  const auto size = static_cast<float>(em_pixels);
  // Latin with its accents, for folders and names, and Greek.
  static constexpr ImWchar kLetters[] = {0x20, 0x17F, 0x370, 0x3FF, 0x2013, 0x2026, 0};
  if (ui_font().file.empty() ||
      io.Fonts->AddFontFromFileTTF(ui_font().file.c_str(), size, nullptr, kLetters) == nullptr) {
    ImFontConfig config;
    config.SizePixels = size;
    io.Fonts->AddFontDefault(&config);
  }
  ImGuiStyle style;
  ImGui::StyleColorsDark(&style);
  style.WindowRounding = 0;
  style.FrameRounding = 3;
  style.WindowBorderSize = 1;
  style.ScaleAllSizes(size / 16);
  style.WindowBorderSize = style.FrameBorderSize = std::max(1.0F, std::round(size / 16));
  using namespace palette;
  style.Colors[ImGuiCol_Text] = im_colour(kText);
  style.Colors[ImGuiCol_TextDisabled] = im_colour(kFaint);
  style.Colors[ImGuiCol_WindowBg] = style.Colors[ImGuiCol_ChildBg] = im_colour(kGround);
  style.Colors[ImGuiCol_PopupBg] = im_colour(kRaised);
  style.Colors[ImGuiCol_FrameBg] = style.Colors[ImGuiCol_Button] = im_colour(kRaised);
  style.Colors[ImGuiCol_Border] = {0.25F, 0.29F, 0.34F, 1};
  style.Colors[ImGuiCol_ButtonHovered] = style.Colors[ImGuiCol_FrameBgHovered] = {0.20F, 0.27F, 0.35F, 1};
  style.Colors[ImGuiCol_ButtonActive] = style.Colors[ImGuiCol_FrameBgActive] = im_colour(kBlue);
  style.Colors[ImGuiCol_Header] = style.Colors[ImGuiCol_HeaderActive] =
      im_colour(kBlue);  // what is chosen stands out, not the mouse
  style.Colors[ImGuiCol_HeaderHovered] = {0.20F, 0.27F, 0.35F, 1};
  style.Colors[ImGuiCol_CheckMark] = style.Colors[ImGuiCol_SliderGrab] = im_colour(kSkyBlue);
  style.Colors[ImGuiCol_NavHighlight] = im_colour(kYellow);
  style.Colors[ImGuiCol_PlotHistogram] = im_colour(kSkyBlue);
  ImGui::GetStyle() = style;
}

void begin_fixed(const char* name, const ScreenBox& box, ImGuiWindowFlags more) {
  ImGui::SetNextWindowPos({box.x, box.y});
  ImGui::SetNextWindowSize({box.width, box.height});
  ImGui::Begin(name, nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoBringToFrontOnFocus | more);
}

void fitted_text(ImDrawList* draw, const ScreenBox& box, float em_pixels, Colour colour, const std::string& text,
                 bool middle) {
  if (text.empty() || box.empty()) return;
  ImFont* const font = ImGui::GetFont();
  float size = std::min(em_pixels, box.height);
  const float width = font->CalcTextSizeA(size, FLT_MAX, 0, text.c_str()).x;
  if (width > box.width) size *= box.width / width;
  const ImVec2 taken = font->CalcTextSizeA(size, FLT_MAX, 0, text.c_str());
  const float x = middle ? box.x + (box.width - taken.x) / 2 : box.x;
  draw->AddText(font, size, {std::floor(x), std::floor(box.y + (box.height - taken.y) / 2)},
                im_colour32(colour, ImGui::GetStyle().Alpha), text.c_str());
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
