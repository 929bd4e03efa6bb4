#include "osteo/simulation/marker/sheet.h"

#include <cairo-pdf.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <vector>

#include "aruco.h"
#include "osteo/core/base/error.h"
#include "osteo/core/report/cairo_owned.h"

namespace osteo::inline simulation {
namespace {

struct Size {
  double width_mm, height_mm;
};
Size size_of(Paper paper) {
  return paper == Paper::a4 ? Size{210, 297} : Size{215.9, 279.4};
}

// A marker on the page: its upper left corner, mm from the page's.
struct Place {
  int id;
  double x_mm, y_mm, size_mm;
};

// Draws in millimetres.
class Page {
 public:
  Page(cairo_t* cairo, Size size, double dots_per_mm) : cairo_(cairo), size_(size), dots_(dots_per_mm) {}

  void box(double x, double y, double w, double h, double gray = 0) const {
    cairo_set_source_rgb(cairo_, gray, gray, gray);
    cairo_rectangle(cairo_, x * dots_, y * dots_, w * dots_, h * dots_);
    cairo_fill(cairo_);
  }
  void line(double x, double y, double x2, double y2, double gray, bool dashed = false) const {
    const double dash[] = {1.5 * dots_, 1.5 * dots_};
    cairo_set_dash(cairo_, dash, dashed ? 2 : 0, 0);
    cairo_set_source_rgb(cairo_, gray, gray, gray);
    cairo_set_line_width(cairo_, 0.2 * dots_);
    cairo_move_to(cairo_, x * dots_, y * dots_);
    cairo_line_to(cairo_, x2 * dots_, y2 * dots_);
    cairo_stroke(cairo_);
  }
  void circle(double x, double y, double r, double gray) const {
    cairo_set_dash(cairo_, nullptr, 0, 0);
    cairo_set_source_rgb(cairo_, gray, gray, gray);
    cairo_set_line_width(cairo_, 0.2 * dots_);
    cairo_new_path(cairo_);
    cairo_arc(cairo_, x * dots_, y * dots_, r * dots_, 0, 2 * std::numbers::pi);
    cairo_stroke(cairo_);
  }
  // `tag`: what a screen reader of the PDF calls it. What has none is decoration.
  void text(const std::string& what, double x, double y, double width, double size_mm, const char* tag = "P") const {
    cairo_tag_begin(cairo_, tag, nullptr);
    show_text(what, x, y, width, size_mm);
    cairo_tag_end(cairo_, tag);
  }
  void cells(MarkerKind kind, const Place& p) const {
    const int n = marker_cells_across(kind);
    const auto cell = marker_cells(kind, p.id);
    box(p.x_mm, p.y_mm, p.size_mm, p.size_mm);
    const double c = p.size_mm / n;
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        if (cell[static_cast<std::size_t>(y * n + x)] != 0)
          cairo_rectangle(cairo_, (p.x_mm + x * c) * dots_, (p.y_mm + y * c) * dots_, c * dots_, c * dots_);
      }
    }
    // All at once: no hair lines between them.
    cairo_set_source_rgb(cairo_, 1, 1, 1);
    cairo_fill(cairo_);
  }
  void ruler(double x, double y) const {
    line(x, y, x + 100, y, 0);
    for (int mm = 0; mm <= 100; mm += 10) line(x + mm, y - (mm % 50 == 0 ? 2.5 : 1.5), x + mm, y, 0);
    text("100 mm. Hold a ruler to it: print at 100 %, not fitted to the page.", x + 3, y + 0.8, 110, 2.6);
  }
  [[nodiscard]] Size size() const { return size_; }

 private:
  void show_text(const std::string& what, double x, double y, double width, double size_mm) const {
    const CairoOwned<PangoLayout> layout(pango_cairo_create_layout(cairo_));
    PangoFontDescription* const font = pango_font_description_from_string("Liberation Sans, DejaVu Sans, Sans");
    pango_font_description_set_absolute_size(font, size_mm * dots_ * PANGO_SCALE);
    pango_layout_set_font_description(layout.get(), font);
    pango_font_description_free(font);
    pango_layout_set_width(layout.get(), static_cast<int>(width * dots_ * PANGO_SCALE));
    pango_layout_set_text(layout.get(), what.c_str(), -1);
    cairo_set_source_rgb(cairo_, 0.25, 0.25, 0.25);
    cairo_move_to(cairo_, x * dots_, y * dots_);
    pango_cairo_show_layout(cairo_, layout.get());
  }

  cairo_t* cairo_;
  Size size_;
  double dots_;
};

// Where the strip's upper left corner is.
double strip_left(Size s) {
  return (s.width_mm - 6 * PenBody::kFaceMm - 8) / 2;
}
constexpr double kStripTop = 78;

std::vector<Place> places_of_pen(Size s, int pen) {
  std::vector<Place> all;
  const double left = strip_left(s), cell = PenBody::kFaceMm;
  const auto markers = pen_markers(pen);
  const double margin = (cell - PenBody::kMarkerMm) / 2;
  for (int i = 0; i < 12; ++i)
    all.push_back({markers[static_cast<std::size_t>(i)].id, left + (i % 6) * cell + margin,
                   kStripTop + (i / 6) * cell + margin, PenBody::kMarkerMm});
  const double m = PenBody::kCapMarkerMm;
  all.push_back({markers[12].id, left + 1.5 * cell - m / 2, kStripTop - PenBody::kApothemMm - m / 2, m});
  return all;
}

void hexagon(const Page& page, double x, double y, double gray) {
  // Two sides lie flat: one is the fold to the strip.
  for (int i = 0; i < 6; ++i) {
    const auto corner = [&](int k) {
      const double a = k * std::numbers::pi / 3;
      return std::pair{x + PenBody::kFaceMm * std::cos(a), y + PenBody::kFaceMm * std::sin(a)};
    };
    const auto a = corner(i), b = corner(i + 1);
    page.line(a.first, a.second, b.first, b.second, gray);
  }
}

void draw_pen(const Page& page, int pen) {
  const Size s = page.size();
  const double left = strip_left(s), w = PenBody::kFaceMm, h = PenBody::kHeightMm, a = PenBody::kApothemMm;
  page.text("Osteotome: markers of pen " + std::to_string(pen), left, 9, 120, 4.5, "H1");
  page.text(
      "Stiff paper. Cut along the outline, fold along the dashed lines, glue the flap under the first face: a prism of "
      "six sides. Fold "
      "the lid with the marker over the upper end, the lid with the circle under the lower one; tape both. The pen "
      "goes in through the "
      "circle, its tip down, as far as it stands firmly in the middle; glue it. Nothing may bend or shine.",
      left + 76, 17, s.width_mm - 2 * left - 76, 2.9);
  const double bottom = kStripTop + h;
  page.line(left, kStripTop, left + 6 * w + 8, kStripTop, 0.75);
  page.line(left, bottom, left + 6 * w + 8, bottom, 0.75);
  page.line(left, kStripTop, left, bottom, 0.75);
  page.line(left + 6 * w + 8, kStripTop, left + 6 * w + 8, bottom, 0.75);
  for (int i = 1; i <= 6; ++i) page.line(left + i * w, kStripTop, left + i * w, bottom, 0.75, true);
  hexagon(page, left + 1.5 * w, kStripTop - a, 0.75);
  hexagon(page, left + 3.5 * w, bottom + a, 0.75);
  page.circle(left + 3.5 * w, bottom + a, 4.5, 0.4);
  page.text("pen", left + 3.5 * w + 6, bottom + a - 1.5, 20, 2.9);
  for (const Place& p : places_of_pen(s, pen)) page.cells(MarkerKind::pen, p);
  page.ruler(left, s.height_mm - 18);
}

std::vector<Place> places_of_plate(Size s) {
  const double left = (s.width_mm - PlateBody::kAcross * PlateBody::kSquareMm) / 2;
  std::vector<Place> all;
  for (const MarkerPatch& m : plate_markers()) {
    const Vec3 corner = m.corner_mm(0);
    all.push_back({m.id, left + corner.x, 10 + corner.y, m.size_mm});
  }
  return all;
}

void draw_plate(const Page& page) {
  const Size s = page.size();
  const double left = (s.width_mm - PlateBody::kAcross * PlateBody::kSquareMm) / 2;
  for (int y = 0; y < PlateBody::kDown; ++y) {
    for (int x = 0; x < PlateBody::kAcross; ++x) {
      if (plate_square_is_black(x, y))
        page.box(left + x * PlateBody::kSquareMm, 10 + y * PlateBody::kSquareMm, PlateBody::kSquareMm,
                 PlateBody::kSquareMm);
    }
  }
  for (const Place& p : places_of_plate(s)) page.cells(MarkerKind::plate, p);
  const double below = 10 + PlateBody::kDown * PlateBody::kSquareMm;
  page.ruler(left, below + 8);
  page.text("Osteotome: plate to calibrate a camera by. Glue it to a flat board.", left, below + 13.5, 170, 2.9, "H2");
}

void draw_page(const Page& page, int pen, int number) {
  page.box(0, 0, page.size().width_mm, page.size().height_mm, 1);
  if (number == 0) {
    draw_pen(page, pen);
  } else {
    draw_plate(page);
  }
}

}  // namespace

GrayPicture marker_page(Paper paper, int pen, int number, double dots_per_inch) {
  if (number < 0 || number >= kMarkerPages)
    throw Error(ExitCode::usage, "there is no page " + std::to_string(number + 1));
  const Size s = size_of(paper);
  const double dots = dots_per_inch / 25.4;
  const int w = static_cast<int>(std::ceil(s.width_mm * dots)), h = static_cast<int>(std::ceil(s.height_mm * dots));
  const CairoOwned<cairo_surface_t> surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, w, h));
  {
    const CairoOwned<cairo_t> cairo(cairo_create(surface.get()));
    draw_page(Page(cairo.get(), s, dots), pen, number);
  }
  cairo_surface_flush(surface.get());
  if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS)
    throw Error(ExitCode::resources, "the page cannot be drawn");
  GrayPicture p{w, h, std::vector<std::uint8_t>(static_cast<std::size_t>(w) * static_cast<std::size_t>(h))};
  const unsigned char* const data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x)
      p.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] =
          data[y * stride + 4 * x];
  }
  return p;
}

PageCheck check_page(Paper paper, int pen, int number) {
  constexpr double kInch = 120, kDots = kInch / 25.4;
  const Size s = size_of(paper);
  const GrayPicture page = marker_page(paper, pen, number, kInch);
  const auto places = number == 0 ? places_of_pen(s, pen) : places_of_plate(s);
  const MarkerKind kind = number == 0 ? MarkerKind::pen : MarkerKind::plate;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::DetectorParameters params;
  params.cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  params.cornerRefinementWinSize = 4;
  params.minMarkerDistanceRate = 0.02;  // the white squares around the plate's markers are no rivals
  marker::find_markers(marker::view_of(page), kind, params, corners, ids);
  PageCheck check;
  check.expected = static_cast<int>(places.size());
  for (const Place& p : places) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (ids[i] != p.id) continue;
      ++check.markers;
      // A pixel's middle is half a pixel from its border.
      const double want[4][2] = {{p.x_mm, p.y_mm},
                                 {p.x_mm + p.size_mm, p.y_mm},
                                 {p.x_mm + p.size_mm, p.y_mm + p.size_mm},
                                 {p.x_mm, p.y_mm + p.size_mm}};
      for (std::size_t c = 0; c < 4; ++c)
        check.worst_mm =
            std::max(check.worst_mm, std::hypot((static_cast<double>(corners[i][c].x) + 0.5) / kDots - want[c][0],
                                                (static_cast<double>(corners[i][c].y) + 0.5) / kDots - want[c][1]));
    }
  }
  return check;
}

std::string marker_pages_pdf(Paper paper, int pen) {
  for (int p = 0; p < kMarkerPages; ++p) {
    const PageCheck check = check_page(paper, pen, p);
    if (check.markers != check.expected || !(check.worst_mm < 0.1))
      throw Error(ExitCode::failed,
                  "page " + std::to_string(p + 1) + " does not read as it should: " + std::to_string(check.markers) +
                      " of " + std::to_string(check.expected) + " markers, off by up to " +
                      std::to_string(check.worst_mm) + " mm",
                  "this is a defect of the program or of its libraries; please report it");
  }
  std::string pdf;
  const Size s = size_of(paper);
  constexpr double kPoints = 72 / 25.4;
  const auto take = [](void* closure, const unsigned char* data, unsigned int length) {
    static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
    return CAIRO_STATUS_SUCCESS;
  };
  const CairoOwned<cairo_surface_t> surface(
      cairo_pdf_surface_create_for_stream(take, &pdf, s.width_mm * kPoints, s.height_mm * kPoints));
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, "Osteotome: markers");
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
  {
    const CairoOwned<cairo_t> cairo(cairo_create(surface.get()));
    cairo_tag_begin(cairo.get(), "Document", nullptr);
    for (int p = 0; p < kMarkerPages; ++p) {
      draw_page(Page(cairo.get(), s, kPoints), pen, p);
      cairo_show_page(cairo.get());
    }
    cairo_tag_end(cairo.get(), "Document");
  }
  cairo_surface_finish(surface.get());
  if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS)
    throw Error(ExitCode::failed, "the pages cannot be drawn");
  // Blanks for a date that is not true: no offset moves.
  if (const auto at = pdf.find("/CreationDate ("); at != std::string::npos) {
    if (const auto end = pdf.find(')', at); end != std::string::npos) pdf.replace(at, end - at + 1, end - at + 1, ' ');
  }
  return pdf;
}

}  // namespace osteo::inline simulation
