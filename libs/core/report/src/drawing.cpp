#include "osteo/core/report/sheet.h"

namespace osteo::sheet {

void Drawing::line(std::vector<std::array<double, 2>> points, Colour colour, double stroke_width, bool dashed) {
  marks.emplace_back(Path{std::move(points), colour, std::nullopt, stroke_width, 1, dashed});
}

void Drawing::area(std::vector<std::array<double, 2>> points, Colour colour, double opacity) {
  marks.emplace_back(Path{std::move(points), std::nullopt, colour, 0, opacity, false});
}

void Drawing::box(double x, double y, double w, double h, Colour colour, double opacity) {
  area({{x, y}, {x + w, y}, {x + w, y + h}, {x, y + h}}, colour, opacity);
}

void Drawing::text(double x, double y, std::string what, double size, Colour colour, int align, bool bold) {
  marks.emplace_back(Text{x, y, std::move(what), size, colour, align, bold});
}

}  // namespace osteo::sheet
