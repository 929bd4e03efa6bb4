// Where things lie on a page. Private to libs/core/report; millimetres from the upper left corner unless it says
// otherwise.
#pragma once
#include <vector>

#include "osteo/core/report/sheet.h"

using cairo_surface_t = struct _cairo_surface;  // as cairo.h has it, which not all who include this need

namespace osteo::report {

inline constexpr double kPageWidth = 210, kPageHeight = 297, kMargin = 13, kFoot = 8;
inline constexpr double kTextPt = 8, kPtMm = 25.4 / 72;

/// How much smaller than drawn the sheet has to be to fit on its pages: 1 to 0.7.
[[nodiscard]] double fitting_scale(const Sheet& sheet);

/// The height that a row of pictures gets: as wished, or what the width allows. `gap_mm` between them.
[[nodiscard]] double row_height_mm(const sheet::Pictures& pictures, double width_mm, double gap_mm);

struct Rgb {
  double r, g, b;
};
[[nodiscard]] Rgb ink(Tone tone);
[[nodiscard]] Rgb wash(Tone tone);  ///< behind text
[[nodiscard]] std::string css(Rgb c);
/// "✓ " and the like before the text of a tone, so that it can be told in black and white; empty for plain.
[[nodiscard]] std::string_view sign(Tone tone);

/// For cairo, in `pixels`, which must outlive it.
[[nodiscard]] cairo_surface_t* surface_of(const Picture& picture, std::vector<unsigned char>& pixels);
[[nodiscard]] std::string png_of(const Picture& picture);
[[nodiscard]] Picture picture_of_png(std::string_view png);  ///< empty when it is none
[[nodiscard]] std::string valid_utf8(std::string_view text);
[[nodiscard]] std::string tick_text(double value);

}  // namespace osteo::report
