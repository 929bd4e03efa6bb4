// A printed report as plain values: what it says, in the order in which it is read. Written once as HTML and once as PDF.
#pragma once
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "osteo/data/data.h"

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
/// The line to sign: empty texts are lines to write on. Always of the same height, so that what is signed looks as before.
struct Signature {
  std::string by, date, note;
  std::string state;  ///< "not approved", "approved", "approved before the last change: no longer valid"
  Tone tone = Tone::plain;
};
struct Columns {
  std::vector<SheetBlocks> columns;
  std::vector<double> widths;  ///< shares; empty: all alike
};
struct PageBreak {};

}  // namespace sheet

struct SheetBlock {
  std::variant<sheet::Heading, sheet::Paragraph, sheet::Band, sheet::Facts, sheet::Table, sheet::Pictures, sheet::Bars, sheet::Signature,
               sheet::Columns, sheet::PageBreak>
      is;
};

/// A4, upright. Texts are UTF-8; what is not is shown as U+FFFD.
struct Sheet {
  std::string title, code;
  std::string footer;                        ///< at the foot of each page, left of its number
  std::map<std::string, std::string> marks;  ///< for programs: kept in the HTML as <meta name="osteotome-KEY">, not shown
  SheetBlocks blocks;
  int pages = 2;  ///< made smaller, down to seven tenths, until it fits on so many; longer only where that is not enough
};

/// Self-contained: pictures inside, no scripts, nothing from elsewhere. Same sheet, same bytes.
[[nodiscard]] std::string sheet_html(const Sheet& sheet);
/// PDF 1.5 with the fonts it uses and text that can be selected. Same sheet and same fonts on the machine, same bytes: it holds no date.
/// Error(failed) where the machine has no font at all.
[[nodiscard]] std::string sheet_pdf(const Sheet& sheet);

/// The HTML as it would be without the text of its signature, to tell whether anything else changed.
[[nodiscard]] std::string html_without_signature(std::string_view html);
/// Of HTML that sheet_html wrote. What cannot be read is not there.
[[nodiscard]] std::map<std::string, Picture> pictures_of_html(std::string_view html);
[[nodiscard]] std::map<std::string, std::vector<double>> bars_of_html(std::string_view html);
/// Empty where there is none.
[[nodiscard]] std::string mark_of_html(std::string_view html, std::string_view key);

}  // namespace osteo
