// Colours of the window that people with any colour vision distinguish. Private to libs/app/window; no ImGui.
// Okabe and Ito, "Color universal design", 2008: eight colours chosen for that. State is never told by colour alone: a
// word and a sign too.
#pragma once
#include <array>
#include <cstdint>

namespace osteo::inline app {

struct Colour {
  float red, green, blue;
  friend bool operator==(const Colour&, const Colour&) = default;
};
namespace palette {
inline constexpr Colour kOrange{0.902F, 0.624F, 0}, kSkyBlue{0.337F, 0.706F, 0.914F}, kGreen{0, 0.620F, 0.451F},
    kYellow{0.941F, 0.894F, 0.259F}, kBlue{0, 0.447F, 0.698F}, kVermillion{0.835F, 0.369F, 0},
    kPurple{0.800F, 0.475F, 0.655F};
inline constexpr Colour kText{0.93F, 0.94F, 0.95F}, kFaint{0.66F, 0.70F, 0.74F}, kGround{0.065F, 0.075F, 0.09F},
    kRaised{0.14F, 0.17F, 0.21F};
}  // namespace palette

/// How near the burr is to what must not be touched.
enum class Nearness { unknown, far, near, close, touched };
struct NearnessLook {
  Colour colour;
  const char* word;
  int corners;  ///< of the sign beside it: 0 a disc, 3 a triangle, 4 a square on its corner, 8 an octagon
};
[[nodiscard]] const NearnessLook& look_of(Nearness nearness);

}  // namespace osteo::inline app
