// Colours of the window that people with any colour vision distinguish. Private to libs/app/window; no ImGui.
// Status: Okabe and Ito, "Color universal design", 2008: eight colours chosen for that. State is never told by colour
// alone: a word and a sign too. Themes: docs/design/window.md, where their contrast is.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

namespace osteo::inline app {

struct Colour {
  float red, green, blue;
  friend bool operator==(const Colour&, const Colour&) = default;
};
namespace palette {
inline constexpr Colour kOrange{0.902F, 0.624F, 0}, kSkyBlue{0.337F, 0.706F, 0.914F}, kGreen{0, 0.620F, 0.451F},
    kYellow{0.941F, 0.894F, 0.259F}, kBlue{0, 0.447F, 0.698F}, kVermillion{0.835F, 0.369F, 0},
    kPurple{0.800F, 0.475F, 0.655F};
}  // namespace palette

struct Theme {
  Colour ground;   ///< behind all
  Colour surface;  ///< strips and cards
  Colour raised;   ///< controls
  Colour line;     ///< edges of controls
  Colour text;
  Colour quiet;   ///< labels
  Colour accent;  ///< selection and focus, nothing else
};
enum class ThemeName : int { dark, light, high_contrast };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(ThemeName) {
  return {"dark", "light", "high_contrast"};
}
[[nodiscard]] const Theme& theme_of(ThemeName name);
/// The one in use, of the whole program; one thread.
[[nodiscard]] const Theme& theme();
[[nodiscard]] ThemeName theme_name();
void use_theme(ThemeName name);
/// For words in a status' colour: that itself where it can be read on the surface, else the colour of text.
[[nodiscard]] Colour ink_of(Colour status);
/// Of relative luminances, 1 to 21: WCAG 2.2.
[[nodiscard]] double contrast(Colour a, Colour b);

/// How near the burr is to what must not be touched.
enum class Nearness { unknown, far, near, close, touched };
struct NearnessLook {
  Colour colour;
  const char* word;
  int corners;  ///< of the sign beside it: 0 a disc, 3 a triangle, 4 a square on its corner, 8 an octagon
};
[[nodiscard]] const NearnessLook& look_of(Nearness nearness);

}  // namespace osteo::inline app
