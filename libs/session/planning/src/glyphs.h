// Characters to engrave, five by seven.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

namespace osteo::inline session::guide {

inline constexpr std::string_view kGlyphNames = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-^v><";
// Rows from the top; the highest of five bits is the left.
inline constexpr std::array<std::array<std::uint8_t, 7>, kGlyphNames.size()> kGlyphs{{
    {14, 17, 17, 31, 17, 17, 17}, {30, 17, 17, 30, 17, 17, 30}, {14, 17, 16, 16, 16, 17, 14},
    {30, 17, 17, 17, 17, 17, 30}, {31, 16, 16, 30, 16, 16, 31}, {31, 16, 16, 30, 16, 16, 16},
    {14, 17, 16, 23, 17, 17, 15}, {17, 17, 17, 31, 17, 17, 17}, {14, 4, 4, 4, 4, 4, 14},
    {1, 1, 1, 1, 17, 17, 14},     {17, 18, 20, 24, 20, 18, 17}, {16, 16, 16, 16, 16, 16, 31},
    {17, 27, 21, 21, 17, 17, 17}, {17, 25, 21, 19, 17, 17, 17}, {14, 17, 17, 17, 17, 17, 14},
    {30, 17, 17, 30, 16, 16, 16}, {14, 17, 17, 17, 21, 18, 13}, {30, 17, 17, 30, 20, 18, 17},
    {15, 16, 16, 14, 1, 1, 30},   {31, 4, 4, 4, 4, 4, 4},       {17, 17, 17, 17, 17, 17, 14},
    {17, 17, 17, 17, 17, 10, 4},  {17, 17, 17, 21, 21, 27, 17}, {17, 17, 10, 4, 10, 17, 17},
    {17, 17, 10, 4, 4, 4, 4},     {31, 1, 2, 4, 8, 16, 31},     {14, 17, 19, 21, 25, 17, 14},
    {4, 12, 4, 4, 4, 4, 14},      {14, 17, 1, 6, 8, 16, 31},    {30, 1, 1, 14, 1, 1, 30},
    {17, 17, 17, 31, 1, 1, 1},    {31, 16, 30, 1, 1, 17, 14},   {14, 16, 16, 30, 17, 17, 14},
    {31, 1, 2, 4, 4, 4, 4},       {14, 17, 17, 14, 17, 17, 14}, {14, 17, 17, 15, 1, 1, 14},
    {0, 0, 0, 31, 0, 0, 0},       {4, 14, 21, 4, 4, 4, 4},      {4, 4, 4, 4, 21, 14, 4},
    {0, 4, 2, 31, 2, 4, 0},       {0, 4, 8, 31, 8, 4, 0},
}};

/// x to the right and y up from the text's lower left corner, in pixels; characters are six wide.
inline bool glyph_at(std::string_view text, double x, double y) {
  if (x < 0 || y < 0 || y >= 7) return false;
  const auto column = static_cast<std::size_t>(x), which = column / 6, within = column % 6;
  if (which >= text.size() || within == 5) return false;
  const auto glyph = kGlyphNames.find(text[which]);
  if (glyph == std::string_view::npos) return false;
  return ((kGlyphs[glyph][6 - static_cast<std::size_t>(y)] >> (4 - within)) & 1U) != 0;
}

}  // namespace osteo::inline session::guide
