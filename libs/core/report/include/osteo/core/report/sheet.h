// A printed report as plain values: what it says, in the order in which it is read. Written once as HTML and once as
// PDF.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "osteo/core/data/data.h"

namespace osteo {

/// How a line or a cell is meant; colour is never the only sign of it.
enum class Tone : int { plain, quiet, good, caution, bad };

struct SheetBlock;
using SheetBlocks = std::vector<SheetBlock>;

namespace sheet {

struct Heading {
  std::string text;
};
struct Paragraph {
  std::string text;
  Tone tone = Tone::plain;
};
/// A band across the page: one word that stands out, and a sentence.
struct Band {
  std::string word, text;
  Tone tone = Tone::plain;
};
/// Names and values, read down; in so many columns side by side.
struct Facts {
  std::vector<std::pair<std::string, std::string>> rows;
  int columns = 1;
};
struct Cell {
  std::string text;
  Tone tone = Tone::plain;
};
/// `widths` are shares of the whole; empty: all alike.
struct Table {
  std::vector<std::string> head;
  std::vector<std::vector<Cell>> rows;
  std::vector<double> widths;
};
struct Image {
  std::string id;  ///< of a letter and then letters, digits, '-': by it pictures_of_html finds the picture again
  Picture picture;
  std::string caption;  ///< also what is read aloud
};
/// Pictures side by side, all of the height `height_mm`, or lower where the page is too narrow for them.
struct Pictures {
  std::vector<Image> row;
  double height_mm = 50;
};
/// Bars from `from` to `to` on the horizontal axis, equally wide; heights are shares of the highest.
struct Bars {
  struct Mark {
    double at = 0;
    std::string text;
    Tone tone = Tone::plain;
  };
  std::string id;
  double from = 0, to = 1, tick = 1;
  std::vector<double> heights;
  std::vector<Mark> marks;
  std::string axis;
  double height_mm = 34;
};
/// Points, lines, bands and boxes over two axes, which become a Drawing. What lies outside the axes is not drawn.
struct Plot {
  using At = std::array<double, 2>;
  struct Axis {
    double from = 0, to = 1, tick = 0.5;
    std::string name;
    std::vector<std::pair<double, std::string>> named;  ///< in place of numbers: where, and what
  };
  struct Points {
    std::vector<At> at;
    Tone tone = Tone::plain;
    bool hollow = false;
  };
  struct Line {
    std::vector<At> at;
    Tone tone = Tone::plain;
    bool dashed = false;
  };
  struct Area {
    std::vector<At> at;  ///< its corners
    Tone tone = Tone::quiet;
  };
  /// Upright: whiskers from `lo` to `hi`, a box from `q1` to `q3`.
  struct Box {
    double x = 0, width = 0.5, lo = 0, q1 = 0, median = 0, q3 = 0, hi = 0;
  };
  std::string id, title;  ///< the title is also what is read aloud
  Axis x, y;
  std::vector<Area> areas;
  std::vector<Box> boxes;
  std::vector<Line> lines;
  std::vector<Points> points;
  double height_mm = 48;
};
/// The line to sign: empty texts are lines to write on. Always of the same height, so that what is signed looks as
/// before.
struct Signature {
  std::string by, date, note;
  std::string state;  ///< "not approved", "approved", "approved before the last change: no longer valid"
  Tone tone = Tone::plain;
};
/// Lines, areas and words on a plane of `width` by `height` units, drawn as wide as there is room; y downwards.
struct Drawing {
  using Colour = std::array<std::uint8_t, 3>;
  struct Path {
    std::vector<std::array<double, 2>> points;
    std::optional<Colour> stroke, fill;  ///< an area is closed by itself
    double width = 1;                    ///< of the stroke
    double opacity = 1;
    bool dashed = false;
  };
  struct Text {
    double x = 0, y = 0;  ///< of its baseline
    std::string text;
    double size = 10;
    Colour colour{28, 33, 41};
    int align = -1;  ///< -1: begins at x, 0: its middle is there, 1: ends there
    bool bold = false;
  };
  struct Dot {
    double x = 0, y = 0, radius = 1;
    Colour colour{28, 33, 41};
    bool hollow = false;
  };
  std::string id;
  std::string alt;  ///< what it shows, read aloud
  double width = 600, height = 200;
  std::vector<std::variant<Path, Text, Dot>> marks;  ///< the later above the earlier
  std::string caption;

  void line(std::vector<std::array<double, 2>> points, Colour colour, double stroke_width = 1, bool dashed = false);
  void area(std::vector<std::array<double, 2>> points, Colour colour, double opacity = 1);
  void box(double x, double y, double w, double h, Colour colour, double opacity = 1);
  void text(double x, double y, std::string what, double size, Colour colour, int align = -1, bool bold = false);
};
struct Columns {
  std::vector<SheetBlocks> columns;
  std::vector<double> widths;  ///< shares; empty: all alike
};
struct PageBreak {};

}  // namespace sheet

struct SheetBlock {
  std::variant<sheet::Heading, sheet::Paragraph, sheet::Band, sheet::Facts, sheet::Table, sheet::Pictures, sheet::Bars,
               sheet::Signature, sheet::Drawing, sheet::Plot, sheet::Columns, sheet::PageBreak>
      is;
};

/// A4, upright. Texts are UTF-8; what is not is shown as U+FFFD.
struct Sheet {
  std::string title, code;
  std::string footer;  ///< at the foot of each page, left of its number
  std::map<std::string, std::string>
      marks;  ///< for programs: kept in the HTML as <meta name="osteotome-KEY">, not shown
  SheetBlocks blocks;
  /// From a new page on, as large as `blocks` are by themselves: what came to a page that may be signed already, so it
  /// is in no html_without_signature. Nor is the mark "after", which is of it.
  SheetBlocks after;
  int pages =
      2;  ///< made smaller, down to seven tenths, until it fits on so many; longer only where that is not enough
};

/// Self-contained: pictures inside, no scripts, nothing from elsewhere. Same sheet, same bytes.
[[nodiscard]] std::string sheet_html(const Sheet& sheet);
/// PDF 1.4 with the fonts it uses and text that can be selected; tagged, so that it can be read aloud. Same sheet and
/// same fonts on the machine, same bytes: it holds no date. Error(failed) where the machine has no font at all.
[[nodiscard]] std::string sheet_pdf(const Sheet& sheet);

/// Parts of pages that are not sheets. A drawing as SVG, as wide as what it stands in; with its caption below it.
[[nodiscard]] std::string svg_of(const sheet::Drawing& drawing);
/// Of text and of attributes in double quotes; what is not UTF-8 is U+FFFD.
[[nodiscard]] std::string html_escaped(std::string_view text);
[[nodiscard]] std::string base64_of(std::string_view bytes);
/// "data:image/png;base64,..."
[[nodiscard]] std::string png_url_of(const Picture& picture);

/// The HTML as it would be without the text of its signature and without Sheet::after, to tell whether anything else
/// changed.
[[nodiscard]] std::string html_without_signature(std::string_view html);
/// Of HTML that sheet_html wrote. What cannot be read is not there.
[[nodiscard]] std::map<std::string, Picture> pictures_of_html(std::string_view html);
[[nodiscard]] std::map<std::string, std::vector<double>> bars_of_html(std::string_view html);
/// Empty where there is none.
[[nodiscard]] std::string mark_of_html(std::string_view html, std::string_view key);

}  // namespace osteo
