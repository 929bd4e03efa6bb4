// The sheet as one HTML file, and what can be read back from it.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "layout.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "plot.h"

namespace osteo {
namespace {

using namespace report;

constexpr std::string_view kSignatureBegin = "<!--signature-->", kSignatureEnd = "<!--/signature-->";
constexpr std::string_view kAfterBegin = "<!--after-->", kAfterEnd = "<!--/after-->\n";
constexpr std::string_view kAfterMark = "<meta name=\"osteotome-after\"", kMarkEnd = ">\n";

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string escaped(std::string_view text) {
  return html_escaped(text);
}

std::string from_base64(std::string_view text) {
  std::array<int, 256> value{};
  value.fill(-1);
  for (std::size_t d = 0; d < kDigits.size(); ++d) value[static_cast<unsigned char>(kDigits[d])] = static_cast<int>(d);
  std::string out;
  std::uint32_t v = 0;
  int bits = 0;
  for (const char c : text) {
    const int d = value[static_cast<unsigned char>(c)];
    if (d < 0) break;
    v = v << 6 | static_cast<std::uint32_t>(d);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    out += static_cast<char>(v >> bits & 255);
  }
  return out;
}

std::string tone_class(Tone tone) {
  constexpr const char* kNames[] = {"", "quiet", "good", "caution", "bad"};
  return kNames[static_cast<int>(tone)];
}

std::string two_digits(double v) {
  return format_number(std::round(v * 100) / 100);
}

void write(std::ostream& out, const SheetBlocks& blocks, double scale, double width_mm);

void write_table(std::ostream& out, const sheet::Table& t) {
  out << "<table>";
  if (!t.widths.empty()) {
    double all = 0;
    for (const double w : t.widths) all += w;
    out << "<colgroup>";
    for (const double w : t.widths) out << "<col style=\"width:" << two_digits(100 * w / all) << "%\">";
    out << "</colgroup>";
  }
  if (!t.head.empty()) {
    out << "<thead><tr>";
    for (const std::string& h : t.head) out << "<th>" << escaped(h) << "</th>";
    out << "</tr></thead>";
  }
  out << "<tbody>\n";
  for (const auto& row : t.rows) {
    out << "<tr>";
    for (const sheet::Cell& c : row) {
      out << "<td";
      if (c.tone != Tone::plain) out << " class=\"" << tone_class(c.tone) << "\"";
      out << '>' << sign(c.tone) << escaped(c.text) << "</td>";
    }
    out << "</tr>\n";
  }
  out << "</tbody></table>\n";
}

void write_bars(std::ostream& out, const sheet::Bars& b) {
  const double w = 600, line = 17, marks = line * static_cast<double>(b.marks.size()), h = b.height_mm * 5.2,
               base = marks + h;
  const double most = b.heights.empty() ? 0 : *std::max_element(b.heights.begin(), b.heights.end());
  const double step = w / static_cast<double>(std::max<std::size_t>(1, b.heights.size()));
  const auto at = [&](double v) { return w * (v - b.from) / (b.to - b.from); };
  out << "<svg id=\"" << escaped(b.id) << "\" class=\"bars\" role=\"img\" aria-label=\"" << escaped(b.axis)
      << "\" viewBox=\"-12 0 " << w + 24 << ' ' << base + 38 << "\" data-heights=\"";
  for (std::size_t i = 0; i < b.heights.size(); ++i) out << (i > 0 ? " " : "") << format_number(b.heights[i]);
  out << "\">\n<g fill=\"#949eb0\">";
  for (std::size_t i = 0; i < b.heights.size(); ++i) {
    const double height = most > 0 ? h * b.heights[i] / most : 0;
    if (height > 0)
      out << "<rect x=\"" << two_digits(step * static_cast<double>(i)) << "\" y=\"" << two_digits(base - height)
          << "\" width=\"" << two_digits(step * 0.92) << "\" height=\"" << two_digits(height) << "\"/>";
  }
  const std::string quiet = css(ink(Tone::quiet));
  out << "</g>\n<line x1=\"0\" x2=\"" << w << "\" y1=\"" << base << "\" y2=\"" << base << "\" stroke=\"" << quiet
      << "\"/>\n";
  for (double v = std::ceil(b.from / b.tick) * b.tick; v <= b.to; v += b.tick)
    out << "<text x=\"" << two_digits(at(v)) << "\" y=\"" << base + 15
        << "\" text-anchor=\"middle\" font-size=\"12\" fill=\"" << quiet << "\">" << tick_text(v) << "</text>";
  for (std::size_t m = 0; m < b.marks.size(); ++m) {
    const double px = std::clamp(at(b.marks[m].at), 0.0, w), py = line * static_cast<double>(m);
    const std::string c = css(ink(b.marks[m].tone));
    const bool left = px > 0.6 * w;
    out << "\n<line x1=\"" << two_digits(px) << "\" x2=\"" << two_digits(px) << "\" y1=\"" << py << "\" y2=\"" << base
        << "\" stroke=\"" << c << "\" stroke-width=\"1.5\"/><text x=\"" << two_digits(px + (left ? -4 : 4)) << "\" y=\""
        << py + 12 << "\" font-size=\"13\"" << (left ? " text-anchor=\"end\"" : "") << " fill=\"" << c << "\">"
        << escaped(b.marks[m].text) << "</text>";
  }
  out << "\n<text x=\"" << w / 2 << "\" y=\"" << base + 32 << "\" text-anchor=\"middle\" font-size=\"12\" fill=\""
      << quiet << "\">" << escaped(b.axis) << "</text></svg>\n";
}

void write_signature(std::ostream& out, const sheet::Signature& s) {
  const auto field = [&](const char* cls, const char* name, const std::string& text) {
    out << "<div class=\"" << cls << "\"><div class=\"line\">" << escaped(text) << "</div><div class=\"quiet\">" << name
        << "</div></div>";
  };
  out << kSignatureBegin << "<section class=\"signature " << tone_class(s.tone) << "\"><b class=\""
      << tone_class(s.tone) << "\">" << sign(s.tone) << escaped(s.state) << "</b><div class=\"fields\">";
  field("by", tr("approved by"), s.by);
  field("date", tr("date"), s.date);
  field("note", tr("note"), s.note);
  out << "</div></section>" << kSignatureEnd << '\n';
}

struct Writer {
  std::ostream& out;
  double scale, width_mm;
  void operator()(const sheet::Heading& h) const { out << "<h2>" << escaped(h.text) << "</h2>\n"; }
  void operator()(const sheet::Paragraph& p) const {
    out << "<p class=\"" << tone_class(p.tone) << "\">" << sign(p.tone) << escaped(p.text) << "</p>\n";
  }
  void operator()(const sheet::Band& b) const {
    out << "<div class=\"band\" style=\"background:" << css(wash(b.tone)) << ";border-color:" << css(ink(b.tone))
        << "\"><b class=\"" << tone_class(b.tone) << "\">" << sign(b.tone) << escaped(b.word) << "</b><span>"
        << escaped(b.text) << "</span></div>\n";
  }
  void operator()(const sheet::Facts& f) const {
    const auto n = static_cast<std::size_t>(std::max(1, f.columns));
    const std::size_t each = (f.rows.size() + n - 1) / n;
    out << "<div class=\"columns\">";
    for (std::size_t c = 0; c < n; ++c) {
      out << "<dl>";
      for (std::size_t r = c * each; r < std::min(f.rows.size(), (c + 1) * each); ++r)
        out << "<dt>" << escaped(f.rows[r].first) << "</dt><dd>" << escaped(f.rows[r].second) << "</dd>\n";
      out << "</dl>";
    }
    out << "</div>\n";
  }
  void operator()(const sheet::Table& t) const { write_table(out, t); }
  void operator()(const sheet::Pictures& p) const {
    const double height = row_height_mm(p, width_mm, 0.8);
    out << "<div class=\"pictures\">";
    for (const sheet::Image& i : p.row) {
      const double width = i.picture.height > 0 ? height * i.picture.width / i.picture.height : height;
      // In sizes of the text, so that a print made smaller makes the pictures smaller too.
      out << "<figure style=\"width:" << two_digits(width / (kTextPt * kPtMm)) << "rem\"><img id=\"" << escaped(i.id)
          << "\" alt=\"" << escaped(i.caption) << "\" width=\"" << i.picture.width << "\" height=\"" << i.picture.height
          << "\" src=\"" << png_url_of(i.picture) << "\">";
      if (!i.caption.empty()) out << "<figcaption>" << escaped(i.caption) << "</figcaption>";
      out << "</figure>\n";
    }
    out << "</div>\n";
  }
  void operator()(const sheet::Bars& b) const { write_bars(out, b); }
  void operator()(const sheet::Drawing& d) const {
    out << "<figure>" << svg_of(d);
    if (!d.caption.empty()) out << "<figcaption>" << escaped(d.caption) << "</figcaption>";
    out << "</figure>\n";
  }
  void operator()(const sheet::Plot& p) const {
    out << "<div class=\"plot\">" << svg_of(drawing_of(p, width_mm / kPtMm)) << "</div>\n";
  }
  void operator()(const sheet::Signature& s) const { write_signature(out, s); }
  void operator()(const sheet::Columns& c) const {
    double all = 0;
    const auto share = [&](std::size_t i) { return i < c.widths.size() ? c.widths[i] : 1.0; };
    for (std::size_t i = 0; i < c.columns.size(); ++i) all += share(i);
    const double room = width_mm - 3.2 * static_cast<double>(c.columns.empty() ? 0 : c.columns.size() - 1);
    out << "<div class=\"columns\">";
    for (std::size_t i = 0; i < c.columns.size(); ++i) {
      out << "<div style=\"flex:" << two_digits(share(i)) << "\">";
      write(out, c.columns[i], scale, room * share(i) / all);
      out << "</div>";
    }
    out << "</div>\n";
  }
  void operator()(const sheet::PageBreak&) const { out << "<div class=\"page\"></div>\n"; }
};

void write(std::ostream& out, const SheetBlocks& blocks, double scale, double width_mm) {
  for (const SheetBlock& b : blocks) std::visit(Writer{out, scale, width_mm}, b.is);
}

std::string style_of(double scale) {
  std::ostringstream s;
  s << "html{font:16px/1.3 'Liberation Sans',Arial,Helvetica,sans-serif;color:" << css(ink(Tone::plain))
    << ";background:#fff}\n"
       "body{margin:1.5rem auto;max-width:"
    << two_digits((kPageWidth - 2 * kMargin) / (kTextPt * kPtMm))
    << "rem;padding:0 1rem}\n"
       "header{display:flex;justify-content:space-between;border-bottom:.12rem solid #1a406b;margin-bottom:.7rem}\n"
       "h1{font-size:1.85rem;margin:0;color:#1a406b}header b{font-size:1.85rem}\n"
       "h2{font-size:1.19rem;margin:.7rem 0 .25rem;color:#1a406b;break-after:avoid}\n"
       "p{margin:0 0 .5rem}figure{margin:0;min-width:0}img{display:block;width:100%;height:auto}\n"
       "figcaption{font-size:.82rem;color:"
    << css(ink(Tone::quiet))
    << "}\n"
       ".pictures{display:flex;gap:.28rem;margin-bottom:.5rem;break-inside:avoid}\n"
       ".columns{display:flex;gap:1.15rem;margin-bottom:.3rem}.columns>*{flex:1;min-width:0}\n"
       "dl{display:grid;grid-template-columns:30% 1fr;gap:.14rem .4rem;margin:0 0 "
       ".3rem;font-size:.96rem;align-content:start}\n"
       "dt{color:"
    << css(ink(Tone::quiet))
    << "}dd{margin:0}\n"
       "table{border-collapse:collapse;width:100%;font-size:.92rem;margin-bottom:.5rem}\n"
       "th{text-align:left;font-weight:bold;color:"
    << css(ink(Tone::quiet))
    << ";border-bottom:.1rem solid #d1d6de}td{border-bottom:.05rem solid #d1d6de;vertical-align:top}\n"
       "th,td{padding:.1rem .3rem .1rem 0}tr{break-inside:avoid}\n"
       ".band{display:flex;align-items:baseline;border-left:.28rem solid;padding:.4rem "
       ".7rem;margin-bottom:.5rem;break-inside:avoid}\n"
       ".band b{font-size:1.3rem;flex:0 0 20%}\n"
       ".bars,.drawing{width:100%;display:block}.plot{margin-bottom:.4rem;break-inside:avoid}\n"
       ".signature{padding:.5rem "
       ".7rem;background:#f1f2f5;height:6.1rem;overflow:hidden;box-sizing:border-box;break-inside:avoid}\n"
       ".signature b{font-size:1.12rem}.fields{display:flex;gap:1rem;align-items:flex-end;height:3.9rem}\n"
       ".by{flex:2}.date{flex:1}.note{flex:3}.line{border-bottom:.05rem solid #666;min-height:1.3em}.fields "
       ".quiet{font-size:.8rem}\n"
       "footer{font-size:.8rem;color:"
    << css(ink(Tone::quiet)) << ";margin-top:.6rem}\n";
  for (const Tone t : {Tone::quiet, Tone::good, Tone::caution, Tone::bad})
    s << '.' << tone_class(t) << "{color:" << css(ink(t)) << "}";
  for (const Tone t : {Tone::good, Tone::caution, Tone::bad})
    s << ".signature." << tone_class(t) << "{color:inherit;background:" << css(wash(t)) << "}";
  // Text is as large as on paper; a browser sets lines a little wider than the PDF, hence the last few percent.
  s << "\n@page{size:A4;margin:" << kMargin
    << "mm}\n@media print{html{font-size:" << two_digits(kTextPt * scale * 0.965)
    << "pt;-webkit-print-color-adjust:exact;print-color-adjust:exact}body{margin:0;padding:0;max-width:none}.page{"
       "break-before:page}}\n"
       "@media screen{.page{border-top:.1rem dashed #bbb;margin:1.2rem 0}}\n";
  return s.str();
}

// The value of `attribute` in the tag that has this id or name; empty where there is none.
std::string_view attribute_of(std::string_view tag, std::string_view attribute) {
  const std::string begin = " " + std::string(attribute) + "=\"";
  const auto at = tag.find(begin);
  if (at == std::string_view::npos) return {};
  const auto from = at + begin.size(), end = tag.find('"', from);
  return end == std::string_view::npos ? std::string_view() : tag.substr(from, end - from);
}

template <class Take>
void each_tag(std::string_view html, std::string_view opening, const Take& take) {
  for (auto at = html.find(opening); at != std::string_view::npos; at = html.find(opening, at + 1)) {
    const auto end = html.find('>', at);
    if (end == std::string_view::npos) return;
    take(html.substr(at, end - at));
    at = end;
  }
}

}  // namespace

std::string html_escaped(std::string_view text) {
  std::string out;
  for (const char c : valid_utf8(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string base64_of(std::string_view bytes) {
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t v = 0;
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t b = 0; b < 3; ++b) v = v << 8 | (b < n ? static_cast<unsigned char>(bytes[i + b]) : 0U);
    for (std::size_t d = 0; d < 4; ++d) out += d <= n ? kDigits[v >> (18 - 6 * d) & 63] : '=';
  }
  return out;
}

std::string png_url_of(const Picture& picture) {
  return "data:image/png;base64," + base64_of(png_of(picture));
}

std::string svg_of(const sheet::Drawing& d) {
  std::ostringstream out;
  const auto rgb = [](const sheet::Drawing::Colour& c) { return css({c[0] / 255.0, c[1] / 255.0, c[2] / 255.0}); };
  out << "<svg id=\"" << escaped(d.id) << "\" class=\"drawing\" role=\"img\" aria-label=\"" << escaped(d.alt)
      << "\" viewBox=\"0 0 " << two_digits(d.width) << ' ' << two_digits(d.height) << "\">\n";
  for (const auto& mark : d.marks) {
    if (const auto* const t = std::get_if<sheet::Drawing::Text>(&mark)) {
      out << "<text x=\"" << two_digits(t->x) << "\" y=\"" << two_digits(t->y) << "\" font-size=\""
          << two_digits(t->size) << "\" fill=\"" << rgb(t->colour) << '"'
          << (t->align == 0  ? " text-anchor=\"middle\""
              : t->align > 0 ? " text-anchor=\"end\""
                             : "")
          << (t->bold ? " font-weight=\"bold\"" : "") << '>' << escaped(t->text) << "</text>\n";
      continue;
    }
    if (const auto* const dot = std::get_if<sheet::Drawing::Dot>(&mark)) {
      out << "<circle cx=\"" << two_digits(dot->x) << "\" cy=\"" << two_digits(dot->y) << "\" r=\""
          << two_digits(dot->radius) << "\" fill=\"" << (dot->hollow ? "#fff" : rgb(dot->colour)) << "\" stroke=\""
          << rgb(dot->colour) << "\" stroke-width=\"0.7\"/>\n";
      continue;
    }
    const auto& p = std::get<sheet::Drawing::Path>(mark);
    out << "<path d=\"";
    for (std::size_t n = 0; n < p.points.size(); ++n)
      out << (n == 0 ? 'M' : 'L') << two_digits(p.points[n][0]) << ' ' << two_digits(p.points[n][1]);
    out << (p.fill ? "Z\" fill=\"" + rgb(*p.fill) : std::string("\" fill=\"none")) << '"';
    if (p.stroke)
      out << " stroke=\"" << rgb(*p.stroke) << "\" stroke-width=\"" << two_digits(p.width)
          << "\" stroke-linejoin=\"round\"";
    if (p.dashed) out << " stroke-dasharray=\"" << two_digits(4 * p.width) << ' ' << two_digits(3 * p.width) << '"';
    if (p.opacity < 1) out << " opacity=\"" << two_digits(p.opacity) << '"';
    out << "/>\n";
  }
  out << "</svg>\n";
  return std::move(out).str();
}

std::string sheet_html(const Sheet& s) {
  const double scale = fitting_scale(s);
  std::ostringstream out;
  out << "<!DOCTYPE html>\n<html lang=\"" << tr_of("the language of these texts, as HTML names it", "en")
      << "\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
         "content=\"width=device-width\">\n";
  for (const auto& [key, value] : s.marks)
    out << "<meta name=\"osteotome-" << escaped(key) << "\" content=\"" << escaped(value) << "\">\n";
  out << "<title>" << escaped(s.title + " " + s.code) << "</title>\n<style>\n"
      << style_of(scale) << "</style></head>\n<body>\n<header><h1>" << escaped(s.title) << "</h1><b>" << escaped(s.code)
      << "</b></header>\n";
  write(out, s.blocks, scale, kPageWidth - 2 * kMargin);
  if (!s.after.empty()) {
    out << kAfterBegin;
    write(out, {{sheet::PageBreak{}}}, scale, kPageWidth - 2 * kMargin);
    write(out, s.after, scale, kPageWidth - 2 * kMargin);
    out << kAfterEnd;
  }
  out << "<footer>" << escaped(s.footer) << "</footer>\n</body></html>\n";
  return std::move(out).str();
}

std::string html_without_signature(std::string_view html) {
  std::string rest(html);
  const auto begin = rest.find(kSignatureBegin), end = rest.find(kSignatureEnd);
  if (begin != std::string::npos && end != std::string::npos && end >= begin) rest.erase(begin, end - begin);
  for (const auto& [from, to] : {std::pair{kAfterBegin, kAfterEnd}, std::pair{kAfterMark, kMarkEnd}}) {
    const auto at = rest.find(from), until = at == std::string::npos ? at : rest.find(to, at);
    if (until != std::string::npos) rest.erase(at, until + to.size() - at);
  }
  return rest;
}

std::map<std::string, Picture> pictures_of_html(std::string_view html) {
  std::map<std::string, Picture> found;
  each_tag(html, "<img ", [&](std::string_view tag) {
    constexpr std::string_view kData = "data:image/png;base64,";
    const std::string_view id = attribute_of(tag, "id"), source = attribute_of(tag, "src");
    if (id.empty() || !source.starts_with(kData)) return;
    Picture picture = picture_of_png(from_base64(source.substr(kData.size())));
    if (picture.width > 0) found[std::string(id)] = std::move(picture);
  });
  return found;
}

std::map<std::string, std::vector<double>> bars_of_html(std::string_view html) {
  std::map<std::string, std::vector<double>> found;
  each_tag(html, "<svg ", [&](std::string_view tag) {
    const std::string_view id = attribute_of(tag, "id"), text = attribute_of(tag, "data-heights");
    std::vector<double> heights;
    for (const char *at = text.data(), *end = at + text.size(); at < end; ++at) {
      double v = 0;
      const auto [next, error] = std::from_chars(at, end, v);
      if (error != std::errc()) return;
      heights.push_back(v);
      at = next;
    }
    if (!id.empty()) found[std::string(id)] = std::move(heights);
  });
  return found;
}

std::string mark_of_html(std::string_view html, std::string_view key) {
  std::string found;
  each_tag(html, "<meta name=\"osteotome-" + std::string(key) + "\"",
           [&](std::string_view tag) { found = attribute_of(tag, "content"); });
  return found;
}

}  // namespace osteo
