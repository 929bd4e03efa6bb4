// The sheet on paper: Pango lays out the text, cairo draws it and tags what it is, for those who have it read aloud.
#include <cairo-pdf.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "layout.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/translate.h"
#include "osteo/core/report/cairo_owned.h"
#include "pdf_tags.h"
#include "plot.h"

namespace osteo {
namespace report {
namespace {

constexpr double kMm = 72 / 25.4;                     // points in a millimetre; here all lengths are points
constexpr double kGap = 1.6 * kMm, kPad = 0.9 * kMm;  // between blocks, columns and pictures; within bands and cells
constexpr double kSmallest = 0.7;

struct Style {
  double pt = kTextPt;
  bool bold = false;
  Rgb colour = ink(Tone::plain);
  PangoAlignment align = PANGO_ALIGN_LEFT;
  int lines = 0;  // at most so many, then "…"; 0: as many as it takes
};

// Draws, or only measures: both go the same way, so both agree.
class Pen {
 public:
  // Takes down what each figure shows, in the order in which they are drawn.
  Pen(cairo_t* cairo, std::vector<std::string>* shown) : cairo_(cairo), shown_(shown) {}
  bool on = false;

  // PDF's name for what is drawn next, until end of the same name. What is drawn outside of all is decoration.
  void begin(const char* tag) const {
    if (on) cairo_tag_begin(cairo_, tag, nullptr);
  }
  void end(const char* tag) const {
    if (on) cairo_tag_end(cairo_, tag);
  }
  template <class Draw>
  auto as(const char* tag, const Draw& draw) const {
    begin(tag);
    const auto result = draw();
    end(tag);
    return result;
  }
  double text_as(const char* tag, const std::string& what, double x, double y, double width, const Style& style) const {
    return as(tag, [&] { return text(what, x, y, width, style); });
  }
  // Without words it is decoration, as on a page with an empty alt.
  template <class Draw>
  void figure(const std::string& shows, const Draw& draw) const {
    if (shows.empty()) return static_cast<void>(draw());
    if (on) shown_->push_back(shows);
    begin("Figure");
    draw();
    end("Figure");
  }

  double text(const std::string& what, double x, double y, double width, const Style& style) const {
    const CairoOwned<PangoLayout> layout(pango_cairo_create_layout(cairo_));
    cairo_font_options_t* const options = cairo_font_options_create();
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    PangoContext* const context = pango_layout_get_context(layout.get());
    pango_cairo_context_set_font_options(context, options);
    pango_context_set_round_glyph_positions(context, 0);
    cairo_font_options_destroy(options);
    PangoFontDescription* const font = pango_font_description_from_string("Liberation Sans, DejaVu Sans, Sans");
    pango_font_description_set_absolute_size(font, style.pt * PANGO_SCALE);
    if (style.bold) pango_font_description_set_weight(font, PANGO_WEIGHT_BOLD);
    pango_layout_set_font_description(layout.get(), font);
    pango_font_description_free(font);
    const std::string valid = valid_utf8(what);
    pango_layout_set_text(layout.get(), valid.c_str(), static_cast<int>(valid.size()));
    pango_layout_set_width(layout.get(), static_cast<int>(width * PANGO_SCALE));
    pango_layout_set_wrap(layout.get(), PANGO_WRAP_WORD_CHAR);
    pango_layout_set_alignment(layout.get(), style.align);
    if (style.lines > 0) {
      pango_layout_set_height(layout.get(), -style.lines);
      pango_layout_set_ellipsize(layout.get(), PANGO_ELLIPSIZE_END);
    }
    int height = 0;
    pango_layout_get_size(layout.get(), nullptr, &height);
    if (on) {
      cairo_set_source_rgb(cairo_, style.colour.r, style.colour.g, style.colour.b);
      cairo_move_to(cairo_, x, y);
      pango_cairo_show_layout(cairo_, layout.get());
    }
    return static_cast<double>(height) / PANGO_SCALE;
  }
  void box(double x, double y, double w, double h, Rgb c) const {
    if (!on) return;
    cairo_set_source_rgb(cairo_, c.r, c.g, c.b);
    cairo_rectangle(cairo_, x, y, w, h);
    cairo_fill(cairo_);
  }
  void line(double x0, double y0, double x1, double y1, Rgb c, double width = 0.5) const {
    if (!on) return;
    cairo_set_source_rgb(cairo_, c.r, c.g, c.b);
    cairo_set_line_width(cairo_, width);
    cairo_move_to(cairo_, x0, y0);
    cairo_line_to(cairo_, x1, y1);
    cairo_stroke(cairo_);
  }
  void dot(double x, double y, double radius, Rgb c, bool hollow) const {
    if (!on) return;
    cairo_new_path(cairo_);
    cairo_arc(cairo_, x, y, radius, 0, 2 * 3.14159265358979323846);
    if (hollow) {
      cairo_set_source_rgb(cairo_, 1, 1, 1);
      cairo_fill_preserve(cairo_);
    }
    cairo_set_source_rgb(cairo_, c.r, c.g, c.b);
    cairo_set_line_width(cairo_, 0.7);
    if (!hollow) cairo_fill_preserve(cairo_);
    cairo_stroke(cairo_);
  }
  void picture(const Picture& p, double x, double y, double w, double h) const {
    if (!on || p.width == 0) return;
    std::vector<unsigned char> pixels;
    const CairoOwned<cairo_surface_t> image(surface_of(p, pixels));
    cairo_save(cairo_);
    cairo_translate(cairo_, x, y);
    cairo_scale(cairo_, w / p.width, h / p.height);
    cairo_set_source_surface(cairo_, image.get(), 0, 0);
    cairo_paint(cairo_);
    cairo_restore(cairo_);
  }
  void drawing(const sheet::Drawing& d, double x, double y, double scale) const {
    if (!on) return;
    for (const auto& mark : d.marks) {
      if (const auto* const t = std::get_if<sheet::Drawing::Text>(&mark)) {
        // Texts are placed by their baselines: a line of Pango's is as high as ascent and descent together, of which
        // the ascent is 0.8.
        const double size = t->size * scale, wide = 400;
        const PangoAlignment align = t->align < 0    ? PANGO_ALIGN_LEFT
                                     : t->align == 0 ? PANGO_ALIGN_CENTER
                                                     : PANGO_ALIGN_RIGHT;
        const double left = x + t->x * scale - (t->align < 0 ? 0 : t->align == 0 ? wide / 2 : wide);
        text(t->text, left, y + t->y * scale - 0.905 * size, wide,
             {size, t->bold, {t->colour[0] / 255.0, t->colour[1] / 255.0, t->colour[2] / 255.0}, align, 1});
        continue;
      }
      if (const auto* const spot = std::get_if<sheet::Drawing::Dot>(&mark)) {
        const auto& c = spot->colour;
        dot(x + spot->x * scale, y + spot->y * scale, spot->radius * scale, {c[0] / 255.0, c[1] / 255.0, c[2] / 255.0},
            spot->hollow);
        continue;
      }
      const auto& p = std::get<sheet::Drawing::Path>(mark);
      if (p.points.empty()) continue;
      cairo_save(cairo_);
      cairo_translate(cairo_, x, y);
      cairo_scale(cairo_, scale, scale);
      cairo_new_path(cairo_);
      for (const auto& at : p.points) cairo_line_to(cairo_, at[0], at[1]);
      if (p.fill) {
        cairo_path_t* const path = cairo_copy_path(cairo_);
        cairo_close_path(cairo_);
        const auto& c = *p.fill;
        cairo_set_source_rgba(cairo_, c[0] / 255.0, c[1] / 255.0, c[2] / 255.0, p.opacity);
        cairo_fill(cairo_);
        cairo_append_path(cairo_, path);
        cairo_path_destroy(path);
      }
      if (p.stroke) {
        const auto& c = *p.stroke;
        cairo_set_source_rgba(cairo_, c[0] / 255.0, c[1] / 255.0, c[2] / 255.0, p.opacity);
        cairo_set_line_width(cairo_, p.width);
        cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
        const double dash[2] = {4 * p.width, 3 * p.width};
        cairo_set_dash(cairo_, dash, p.dashed ? 2 : 0, 0);
        cairo_stroke(cairo_);
      }
      cairo_restore(cairo_);
    }
  }

 private:
  cairo_t* cairo_;
  std::vector<std::string>* shown_;
};

double draw(const Pen& pen, const SheetBlocks& blocks, double x, double y, double w);

double draw_row(const Pen& pen, const sheet::Table& t, const std::vector<sheet::Cell>& cells, bool head, double x,
                double y, double w) {
  double all = 0, height = 0;
  const auto share = [&](std::size_t c) { return c < t.widths.size() ? t.widths[c] : 1.0; };
  const std::size_t n = std::max(t.head.size(), cells.size());
  for (std::size_t c = 0; c < n; ++c) all += share(c);
  double at = x;
  pen.begin("TR");
  for (std::size_t c = 0; c < n; ++c) {
    const double width = w * share(c) / all;
    if (c < cells.size()) {
      const Style style{kTextPt - 0.6, head, head ? ink(Tone::quiet) : ink(cells[c].tone)};
      height = std::max(height, pen.text_as(head ? "TH" : "TD", std::string(sign(cells[c].tone)) + cells[c].text, at,
                                            y + 0.35 * kPad, width - kPad, style));
    }
    at += width;
  }
  pen.end("TR");
  height += 0.7 * kPad;
  pen.line(x, y + height, x + w, y + height, {0.82, 0.84, 0.87}, head ? 0.9 : 0.4);
  return height;
}

std::vector<sheet::Cell> head_of(const sheet::Table& t) {
  std::vector<sheet::Cell> cells;
  for (const std::string& h : t.head) cells.push_back({h, Tone::plain});
  return cells;
}

double draw_bars(const Pen& pen, const sheet::Bars& b, double x, double y, double w) {
  const double marks = 8.5 * static_cast<double>(b.marks.size()), h = b.height_mm * kMm, base = y + marks + h;
  const double most = b.heights.empty() ? 0 : *std::max_element(b.heights.begin(), b.heights.end());
  const double step = w / static_cast<double>(std::max<std::size_t>(1, b.heights.size()));
  for (std::size_t i = 0; i < b.heights.size(); ++i) {
    const double height = most > 0 ? h * b.heights[i] / most : 0;
    if (height > 0) pen.box(x + step * static_cast<double>(i), base - height, step * 0.92, height, {0.58, 0.62, 0.69});
  }
  pen.line(x, base, x + w, base, ink(Tone::quiet));
  const auto at = [&](double v) { return x + w * (v - b.from) / (b.to - b.from); };
  for (double v = std::ceil(b.from / b.tick) * b.tick; v <= b.to; v += b.tick) {
    pen.line(at(v), base, at(v), base + 2, ink(Tone::quiet));
    pen.text(tick_text(v), at(v) - 30, base + 2.5, 60, {kTextPt - 1.8, false, ink(Tone::quiet), PANGO_ALIGN_CENTER});
  }
  for (std::size_t m = 0; m < b.marks.size(); ++m) {
    const double px = std::clamp(at(b.marks[m].at), x, x + w), py = y + 8.5 * static_cast<double>(m);
    const Rgb c = ink(b.marks[m].tone);
    pen.line(px, py, px, base, c, 0.8);
    const bool left = px > x + 0.6 * w;
    pen.text(b.marks[m].text, left ? x : px + 2, py - 1, left ? px - 2 - x : x + w - px - 2,
             {kTextPt - 1.4, false, c, left ? PANGO_ALIGN_RIGHT : PANGO_ALIGN_LEFT, 1});
  }
  return marks + h + 11 +
         pen.text(b.axis, x, base + 10.5, w, {kTextPt - 1.4, false, ink(Tone::quiet), PANGO_ALIGN_CENTER, 1});
}

double draw_signature(const Pen& pen, const sheet::Signature& s, double x, double y, double w) {
  const double h = 19.5 * kMm, third = w / 3;
  pen.box(x, y, w, h, wash(s.tone));
  pen.text_as("P", std::string(sign(s.tone)) + s.state, x + 2 * kPad, y + kPad, w - 4 * kPad,
              {kTextPt + 1, true, ink(s.tone), PANGO_ALIGN_LEFT, 1});
  const double base = y + h - 4.2 * kMm;
  const auto field = [&](const char* name, const std::string& text, double from, double width, int lines) {
    pen.line(from, base, from + width, base, ink(Tone::quiet));
    pen.begin("LI");
    pen.text_as("Lbl", name, from, base + 1.5, width, {kTextPt - 1.6, false, ink(Tone::quiet), PANGO_ALIGN_LEFT, 1});
    if (!text.empty()) {
      const Style style{kTextPt, false, ink(Tone::plain), PANGO_ALIGN_LEFT, lines};
      Pen measure = pen;
      measure.on = false;
      pen.text_as("LBody", text, from, base - measure.text(text, from, base, width, style) - 1, width, style);
    }
    pen.end("LI");
  };
  pen.begin("L");
  field(tr("approved by"), s.by, x + 2 * kPad, third - 4 * kPad, 2);
  field(tr("date"), s.date, x + third, third * 0.5 - 2 * kPad, 1);
  field(tr("note"), s.note, x + 1.5 * third, 1.5 * third - 2 * kPad, 2);
  pen.end("L");
  return h;
}

double draw(const Pen& pen, const SheetBlock& block, double x, double y, double w) {
  struct Visit {
    const Pen& pen;
    double x, y, w;
    double operator()(const sheet::Heading& h) const {
      const double height = pen.text_as("H2", h.text, x, y + 0.8 * kMm, w, {kTextPt + 1.5, true, {0.10, 0.25, 0.42}});
      return height + 0.8 * kMm;
    }
    double operator()(const sheet::Paragraph& p) const {
      return pen.text_as("P", std::string(sign(p.tone)) + p.text, x, y, w,
                         {p.tone == Tone::quiet ? kTextPt - 1 : kTextPt, false, ink(p.tone)});
    }
    double operator()(const sheet::Band& b) const {
      const Style word{kTextPt + 2.5, true, ink(b.tone)}, text{kTextPt + 0.5, false, ink(Tone::plain)};
      const double left = 0.21 * w;
      Pen measure = pen;
      measure.on = false;
      const double height = std::max(measure.text(std::string(sign(b.tone)) + b.word, x, y, left - 3 * kPad, word),
                                     measure.text(b.text, x, y, w - left - 2 * kPad, text));
      pen.box(x, y, w, height + 3 * kPad, wash(b.tone));
      pen.box(x, y, 0.8 * kMm, height + 3 * kPad, ink(b.tone));
      pen.text_as("P", std::string(sign(b.tone)) + b.word, x + 2.2 * kPad, y + 1.2 * kPad, left - 3 * kPad, word);
      pen.text_as("P", b.text, x + left, y + 1.5 * kPad, w - left - 2 * kPad, text);
      return height + 3 * kPad;
    }
    double operator()(const sheet::Facts& f) const {
      const auto n = static_cast<std::size_t>(std::max(1, f.columns));
      const std::size_t each = (f.rows.size() + n - 1) / n;
      const double width = (w - kGap * 2 * static_cast<double>(n - 1)) / static_cast<double>(n),
                   name = (n > 1 ? 0.30 : 0.34) * width;
      double height = 0;
      pen.begin("L");
      for (std::size_t c = 0; c < n; ++c) {
        double at = y;
        const double left = x + static_cast<double>(c) * (width + 2 * kGap);
        for (std::size_t r = c * each; r < std::min(f.rows.size(), (c + 1) * each); ++r) {
          const Style quiet{kTextPt - 0.3, false, ink(Tone::quiet)}, plain{kTextPt - 0.3, false, ink(Tone::plain)};
          pen.begin("LI");
          const double a = pen.text_as("Lbl", f.rows[r].first, left, at, name - kPad, quiet);
          const double b = pen.text_as("LBody", f.rows[r].second, left + name, at, width - name, plain);
          pen.end("LI");
          at += std::max(a, b) + 0.5 * kPad;
        }
        height = std::max(height, at - y);
      }
      pen.end("L");
      return height;
    }
    double operator()(const sheet::Table& t) const {
      pen.begin("Table");
      double height = t.head.empty() ? 0 : draw_row(pen, t, head_of(t), true, x, y, w);
      for (const auto& row : t.rows) height += draw_row(pen, t, row, false, x, y + height, w);
      pen.end("Table");
      return height;
    }
    double operator()(const sheet::Pictures& p) const {
      const double gap = kGap / 2, h = row_height_mm(p, w, gap);  // a ratio: so any unit
      const double height = std::min(h, p.height_mm * kMm);
      sheet::Pictures wished = p;
      wished.height_mm = p.height_mm * kMm;
      const double real = std::min(height > 0 ? row_height_mm(wished, w, gap) : 0, p.height_mm * kMm);
      double at = x, caption = 0;
      for (const sheet::Image& i : p.row) {
        const double width = i.picture.height > 0 ? real * i.picture.width / i.picture.height : real;
        pen.figure(i.caption, [&] { pen.picture(i.picture, at, y, width, real); });
        if (!i.caption.empty())
          caption = std::max(caption, pen.text_as("Caption", i.caption, at, y + real + 0.8, width - gap,
                                                  {kTextPt - 1.4, false, ink(Tone::quiet)}));
        at += width + gap;
      }
      return real + (caption > 0 ? caption + 1.2 : 0);
    }
    double operator()(const sheet::Bars& b) const {
      std::string shows = b.axis;
      for (const sheet::Bars::Mark& mark : b.marks) shows += "; " + mark.text;
      double height = 0;
      pen.figure(shows, [&] { height = draw_bars(pen, b, x, y, w); });
      return height;
    }
    double operator()(const sheet::Drawing& d) const {
      const double height = w * d.height / d.width;
      pen.figure(d.alt, [&] { pen.drawing(d, x, y, w / d.width); });
      if (d.caption.empty()) return height;
      return height + 1 +
             pen.text_as("Caption", d.caption, x, y + height + 1, w, {kTextPt - 1.4, false, ink(Tone::quiet)});
    }
    double operator()(const sheet::Plot& p) const {
      const sheet::Drawing d = drawing_of(p, w);
      pen.figure(p.title, [&] { pen.drawing(d, x, y, 1); });
      return d.height;
    }
    double operator()(const sheet::Signature& s) const { return draw_signature(pen, s, x, y, w); }
    double operator()(const sheet::Columns& c) const {
      double all = 0, height = 0, at = x;
      const auto share = [&](std::size_t i) { return i < c.widths.size() ? c.widths[i] : 1.0; };
      for (std::size_t i = 0; i < c.columns.size(); ++i) all += share(i);
      const double room = w - 2 * kGap * static_cast<double>(c.columns.empty() ? 0 : c.columns.size() - 1);
      for (std::size_t i = 0; i < c.columns.size(); ++i) {
        const double width = room * share(i) / all;
        height = std::max(height, draw(pen, c.columns[i], at, y, width));
        at += width + 2 * kGap;
      }
      return height;
    }
    double operator()(const sheet::PageBreak&) const { return 0; }
  };
  return std::visit(Visit{pen, x, y, w}, block.is);
}

double draw(const Pen& pen, const SheetBlocks& blocks, double x, double y, double w) {
  double height = 0;
  for (const SheetBlock& b : blocks) height += draw(pen, b, x, y + height, w) + kGap;
  return blocks.empty() ? 0 : height - kGap;
}

// What is not cut by the end of a page.
struct Unit {
  std::function<double(const Pen&, double x, double y, double w)> draw;
  bool keep_with_next = false, new_page = false;
  double after = kGap;
  bool begins_table = false, ends_table = false;  // a table's rows are units of their own, but one table
};

Unit new_page() {
  return {[](const Pen&, double, double, double) { return 0.0; }, false, true, 0};
}

void add_units(std::vector<Unit>& units, const SheetBlocks& blocks) {
  for (const SheetBlock& block : blocks) {
    if (std::holds_alternative<sheet::PageBreak>(block.is)) {
      units.push_back(new_page());
    } else if (const auto* t = std::get_if<sheet::Table>(&block.is); t != nullptr && t->rows.size() > 3) {
      if (!t->head.empty())
        units.push_back(
            {[t](const Pen& p, double x, double y, double w) { return draw_row(p, *t, head_of(*t), true, x, y, w); },
             true, false, 0});
      const std::size_t first = units.size() - (t->head.empty() ? 0 : 1);
      for (const auto& row : t->rows)
        units.push_back(
            {[t, &row](const Pen& p, double x, double y, double w) { return draw_row(p, *t, row, false, x, y, w); },
             false, false, 0});
      units.back().after = kGap;
      units[first].begins_table = units.back().ends_table = true;
    } else {
      units.push_back({[&block](const Pen& p, double x, double y, double w) { return draw(p, block, x, y, w); },
                       std::holds_alternative<sheet::Heading>(block.is)});
    }
  }
}

// Goes over all pages; returns how many. `total`: to show, 0 while they are counted. `shown`: by each figure.
int go(cairo_t* cairo, const Sheet& s, double scale, int total, bool with_after, std::vector<std::string>& shown) {
  const double width = (kPageWidth - 2 * kMargin) * kMm / scale, left = kMargin * kMm / scale,
               top = kMargin * kMm / scale;
  const double bottom = (kPageHeight - kMargin - kFoot) * kMm / scale;
  Pen pen(cairo, &shown);
  Pen measure(cairo, &shown);
  pen.on = total > 0;
  int page = 0;
  double y = 0;
  const auto begin_page = [&] {
    ++page;
    const Style title{kTextPt + (page == 1 ? 7 : 3), true, {0.10, 0.25, 0.42}, PANGO_ALIGN_LEFT, 1},
        code{title.pt, true, ink(Tone::plain), PANGO_ALIGN_RIGHT, 1};
    const auto head = [&](const char* tag, const std::string& what, double x, double w, const Style& style) {
      // Read once, not on every page.
      return page == 1 ? pen.text_as(tag, what, x, top, w, style) : pen.text(what, x, top, w, style);
    };
    const double a = head("H1", s.title, left, 0.72 * width, title);
    const double b = head("P", s.code, left + 0.6 * width, 0.4 * width, code);
    y = top + std::max(a, b) + 1;
    pen.line(left, y, left + width, y, {0.10, 0.25, 0.42}, 1);
    y += 1.2 * kGap;
  };
  const auto end_page = [&] {
    const double foot = (kPageHeight - kMargin) * kMm / scale - kTextPt;
    const Style quiet{kTextPt - 1.6, false, ink(Tone::quiet), PANGO_ALIGN_LEFT, 1};
    page == total ? pen.text_as("P", s.footer, left, foot, 0.85 * width, quiet)
                  : pen.text(s.footer, left, foot, 0.85 * width, quiet);
    pen.text(std::to_string(page) + " / " + std::to_string(total), left + 0.85 * width, foot, 0.15 * width,
             {kTextPt - 1.2, false, ink(Tone::quiet), PANGO_ALIGN_RIGHT, 1});
    if (total > 0) cairo_show_page(cairo);
  };
  if (scale != 1) cairo_scale(cairo, scale, scale);
  pen.begin("Document");
  begin_page();
  std::vector<Unit> units;
  add_units(units, s.blocks);
  if (with_after && !s.after.empty()) {
    units.push_back(new_page());
    add_units(units, s.after);
  }
  double first = y;
  for (std::size_t u = 0; u < units.size(); ++u) {
    double need = measure.on ? 0 : units[u].draw(measure, left, y, width);
    if (units[u].keep_with_next && u + 1 < units.size())
      need += units[u].after + units[u + 1].draw(measure, left, y, width);
    if ((units[u].new_page || y + need > bottom) && y > first) {
      end_page();
      begin_page();
      first = y;
    }
    if (units[u].new_page) continue;
    if (units[u].begins_table) pen.begin("Table");
    y += units[u].draw(pen, left, y, width) + units[u].after;
    if (units[u].ends_table) pen.end("Table");
  }
  end_page();
  pen.end("Document");
  return page;
}

cairo_status_t append(void* sink, const unsigned char* bytes, unsigned n) {
  static_cast<std::string*>(sink)->append(reinterpret_cast<const char*>(bytes), n);
  return CAIRO_STATUS_SUCCESS;
}

struct Paper {
  std::string bytes;
  CairoOwned<cairo_surface_t> surface{
      cairo_pdf_surface_create_for_stream(&append, &bytes, kPageWidth* kMm, kPageHeight* kMm)};
  CairoOwned<cairo_t> cairo{cairo_create(surface.get())};
};

void require_a_font() {
  PangoFontFamily** families = nullptr;
  int n = 0;
  pango_font_map_list_families(pango_cairo_font_map_get_default(), &families, &n);
  g_free(families);
  if (n == 0)
    throw Error(ExitCode::failed, "there is no font on this machine to write a report with",
                "install fonts-liberation");
  // Boxes in place of characters would be no report.
  if (language() != Language::chinese) return;
  Paper paper;
  const CairoOwned<PangoLayout> layout(pango_cairo_create_layout(paper.cairo.get()));
  pango_layout_set_text(layout.get(), tr("Bone"), -1);
  if (pango_layout_get_unknown_glyphs_count(layout.get()) > 0)
    throw Error(ExitCode::failed, "there is no font on this machine that has Chinese characters, for the PDF",
                "install fonts-noto-cjk, or set LANGUAGE=en");
}

}  // namespace

double fitting_scale(const Sheet& s) {
  for (double scale = 1; scale > kSmallest + 0.01; scale -= 0.03) {
    Paper paper;
    std::vector<std::string> none;
    if (go(paper.cairo.get(), s, scale, 0, false, none) <= s.pages) return scale;
  }
  return 0.85;  // longer then, but readable
}

}  // namespace report

std::string sheet_pdf(const Sheet& s) {
  using namespace report;
  require_a_font();
  const double scale = fitting_scale(s);
  std::vector<std::string> shown;
  int pages = 0;
  {
    Paper counted;
    pages = go(counted.cairo.get(), s, scale, 0, true, shown);
  }
  Paper paper;
  // Later versions may pack the dictionaries that `describe` adds to.
  cairo_pdf_surface_restrict_to_version(paper.surface.get(), CAIRO_PDF_VERSION_1_4);
  cairo_pdf_surface_set_metadata(paper.surface.get(), CAIRO_PDF_METADATA_TITLE,
                                 valid_utf8(s.title + " " + s.code).c_str());
  cairo_pdf_surface_set_metadata(paper.surface.get(), CAIRO_PDF_METADATA_CREATOR, "Osteotome");
  cairo_pdf_surface_set_metadata(paper.surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
  go(paper.cairo.get(), s, scale, pages, true, shown);
  cairo_surface_finish(paper.surface.get());
  const cairo_status_t status = cairo_surface_status(paper.surface.get());
  if (status != CAIRO_STATUS_SUCCESS)
    throw Error(ExitCode::failed, std::string("cannot make the PDF: ") + cairo_status_to_string(status));
  // A date that is not true is worse than none: blanks in its place, so that no offset moves.
  if (const auto at = paper.bytes.find("/CreationDate ("); at != std::string::npos) {
    const auto end = paper.bytes.find(')', at);
    if (end != std::string::npos) paper.bytes.replace(at, end - at + 1, end - at + 1, ' ');
  }
  describe(paper.bytes, shown);
  return std::move(paper.bytes);
}

}  // namespace osteo
