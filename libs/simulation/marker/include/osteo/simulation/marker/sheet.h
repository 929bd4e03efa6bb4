// Pages to print: a pen's markers to fold, a plate to calibrate by.
#pragma once
#include <string>

#include "osteo/core/base/param.h"
#include "osteo/simulation/marker/detail/picture.h"

namespace osteo::inline simulation {

enum class Paper : int { a4, letter };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(Paper) {
  return {"a4", "letter"};
}

/// Pages: first the pen's net, then the plate. Both have a line of 100 mm to hold a ruler to.
inline constexpr int kMarkerPages = 2;
/// Of the right size when it is printed at 100 %. Error(failed) where the machine has no font, or where the page, drawn
/// and looked at as a camera would, does not show each marker once, at its place, to a tenth of a millimetre.
[[nodiscard]] std::string marker_pages_pdf(Paper paper, int pen);
/// One page, from 0, as a picture.
[[nodiscard]] GrayPicture marker_page(Paper paper, int pen, int page, double dots_per_inch = 300);

/// What reading a page back found.
struct PageCheck {
  int markers = 0, expected = 0;
  double worst_mm = 0;  ///< an edge of a marker against what it should be
};
[[nodiscard]] PageCheck check_page(Paper paper, int pen, int page);

}  // namespace osteo::inline simulation
