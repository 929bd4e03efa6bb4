#include "palette.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {
namespace {

constexpr Colour hex(unsigned rgb) {
  const auto part = [&](unsigned shift) { return static_cast<float>(rgb >> shift & 255) / 255; };
  return {part(16), part(8), part(0)};
}

constexpr Theme kThemes[] = {
    {hex(0x10151C), hex(0x171E27), hex(0x212A35), hex(0x6C7B8A), hex(0xEDF1F5), hex(0xA9B4C0), hex(0x8C8CFF)},
    {hex(0xF1F4F7), hex(0xFFFFFF), hex(0xE3E8ED), hex(0x75828F), hex(0x141C24), hex(0x47535F), hex(0x4A3FC4)},
    {hex(0x000000), hex(0x000000), hex(0x1A1A1A), hex(0xFFFFFF), hex(0xFFFFFF), hex(0xFFFFFF), hex(0xB9B0FF)}};
ThemeName in_use = ThemeName::dark;

double luminance(Colour c) {
  const auto linear = [](float v) {
    return v <= 0.04045F ? static_cast<double>(v) / 12.92 : std::pow((static_cast<double>(v) + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(c.red) + 0.7152 * linear(c.green) + 0.0722 * linear(c.blue);
}

}  // namespace

const Theme& theme_of(ThemeName name) {
  return kThemes[static_cast<int>(name)];
}
const Theme& theme() {
  return theme_of(in_use);
}
ThemeName theme_name() {
  return in_use;
}
void use_theme(ThemeName name) {
  in_use = name;
}

double contrast(Colour a, Colour b) {
  const double x = luminance(a), y = luminance(b);
  return (std::max(x, y) + 0.05) / (std::min(x, y) + 0.05);
}

Colour ink_of(Colour status) {
  constexpr double kReadable = 4.2;  // vermillion on the dark surface has 4.3
  return contrast(status, theme().surface) >= kReadable ? status : theme().text;
}

const NearnessLook& look_of(Nearness nearness) {
  static constexpr NearnessLook kFar[] = {{kThemes[0].quiet, tr_later("clear"), 0},
                                          {kThemes[1].quiet, tr_later("clear"), 0},
                                          {kThemes[2].quiet, tr_later("clear"), 0}},
                                kUnknown[] = {
                                    {kThemes[0].quiet, "", 0}, {kThemes[1].quiet, "", 0}, {kThemes[2].quiet, "", 0}};
  static constexpr NearnessLook kNear{palette::kYellow, tr_later("near"), 3},
      kClose{palette::kOrange, tr_later("close"), 4}, kTouched{palette::kVermillion, tr_later("contact"), 8};
  switch (nearness) {
    case Nearness::near:
      return kNear;
    case Nearness::close:
      return kClose;
    case Nearness::touched:
      return kTouched;
    case Nearness::far:
      return kFar[static_cast<int>(in_use)];
    case Nearness::unknown:
      break;
  }
  return kUnknown[static_cast<int>(in_use)];
}

}  // namespace osteo::inline app
