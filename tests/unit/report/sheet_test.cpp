// A sheet written as HTML and PDF: whole, readable again, the same for the same, and on its pages.
#include "osteo/core/report/sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "layout.h"
#include "plot.h"

namespace osteo {
namespace {

Picture gradient(int width, int height) {
  Picture p{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const int v : {x * 5, y * 7, x * y}) p.rgb.push_back(static_cast<std::uint8_t>(v & 255));
    }
  }
  return p;
}

Sheet example(int rows = 3) {
  Sheet s;
  s.title = "Report";
  s.code = "tabod-kiruz";
  s.footer = "foot";
  s.marks["state"] = "abc\"<>&";
  s.blocks.push_back({sheet::Band{"Good", "nothing was guessed", Tone::good}});
  s.blocks.push_back({sheet::Facts{{{"Slices", "140"}, {"Distance", "1 mm"}, {"Kernel", "YA"}}, 2}});
  s.blocks.push_back({sheet::Pictures{{{"one", gradient(31, 17), "first"}, {"two", gradient(8, 9), "second"}}, 20}});
  s.blocks.push_back({sheet::Bars{"bars", -100, 100, 50, {0, 0.25, 1, 0.5}, {{20, "threshold", Tone::bad}}, "HU", 30}});
  sheet::Table t{{"name", "size"}, {}, {2, 1}};
  for (int r = 0; r < rows; ++r) t.rows.push_back({{"row " + std::to_string(r), Tone::plain}, {"1 mm", Tone::caution}});
  s.blocks.push_back({t});
  s.blocks.push_back({sheet::Columns{{{{sheet::Heading{"left"}}}, {{sheet::Paragraph{"right"}}}}, {}}});
  s.blocks.push_back({sheet::Signature{"", "", "", "not approved"}});
  return s;
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}
std::size_t pages(const std::string& pdf) {
  return count(pdf, "/Type /Page") - count(pdf, "/Type /Pages");
}

TEST(Sheet, ADrawingIsTheSameLinesInBoth) {
  sheet::Drawing d;
  d.id = "d";
  d.alt = "force \"over\" time";
  d.width = 100;
  d.height = 50;
  d.line({{0, 0}, {10.123, 20}}, {255, 0, 0}, 2, true);
  d.box(1, 2, 3, 4, {0, 0, 255}, 0.5);
  d.text(50, 25, "a < b", 8, {0, 0, 0}, 0);
  const std::string svg = svg_of(d);
  EXPECT_NE(svg.find("aria-label=\"force &quot;over&quot; time\""), std::string::npos);
  EXPECT_NE(svg.find("<path d=\"M0 0L10.12 20\" fill=\"none\" stroke=\"#ff0000\" stroke-width=\"2\""),
            std::string::npos);
  EXPECT_NE(svg.find("<path d=\"M1 2L4 2L4 6L1 6Z\" fill=\"#0000ff\" opacity=\"0.5\"/>"), std::string::npos);
  EXPECT_NE(svg.find("text-anchor=\"middle\">a &lt; b</text>"), std::string::npos);
  Sheet s = example();
  const std::string without = sheet_pdf(s);
  s.blocks.push_back({d});
  EXPECT_NE(sheet_html(s).find(svg), std::string::npos);
  const std::string with = sheet_pdf(s);
  EXPECT_GT(with.size(), without.size());
  EXPECT_EQ(pages(with), pages(without));
  EXPECT_EQ(sheet_pdf(s), with);
}

TEST(Sheet, WhatTheHtmlHoldsCanBeReadAgain) {
  const std::string html = sheet_html(example());
  const auto pictures = pictures_of_html(html);
  ASSERT_EQ(pictures.size(), 2U);
  EXPECT_EQ(pictures.at("one").rgb, gradient(31, 17).rgb);
  EXPECT_EQ(pictures.at("two").width, 8);
  EXPECT_EQ(bars_of_html(html).at("bars"), (std::vector<double>{0, 0.25, 1, 0.5}));
  EXPECT_EQ(mark_of_html(html, "state"), "abc&quot;&lt;&gt;&amp;");
  EXPECT_EQ(mark_of_html(html, "nothing"), "");
  EXPECT_EQ(html.find("http"), std::string::npos);
  EXPECT_EQ(html.find("<script"), std::string::npos);
  // Cut anywhere it gives what is whole, and never fails.
  for (std::size_t n = 0; n < html.size(); n += 997) {
    EXPECT_LE(pictures_of_html(html.substr(0, n)).size(), 2U);
    static_cast<void>(bars_of_html(html.substr(0, n)));
  }
}

TEST(Sheet, TextIsNotMarkup) {
  Sheet s = example();
  s.blocks.push_back({sheet::Paragraph{"<script>alert(1)</script> a\x01z \xff & \"quoted\""}});
  const std::string html = sheet_html(s);
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_NE(html.find("&lt;script&gt;"), std::string::npos);
  EXPECT_NE(html.find("a z \xef\xbf\xbd &amp; &quot;quoted"), std::string::npos);
  EXPECT_FALSE(sheet_pdf(s).empty());
}

TEST(Sheet, SameSheetSameBytes) {
  EXPECT_EQ(sheet_html(example()), sheet_html(example()));
  const std::string pdf = sheet_pdf(example());
  EXPECT_EQ(pdf, sheet_pdf(example()));
  EXPECT_EQ(pdf.find("/CreationDate"), std::string::npos);
  EXPECT_TRUE(pdf.starts_with("%PDF-1."));
  EXPECT_NE(pdf.find("/FontFile"), std::string::npos);  // embedded
}

// Each object's place in the table at the end is where that object begins.
void expect_whole(const std::string& pdf) {
  const std::size_t table = std::stoul(pdf.substr(pdf.rfind("startxref\n") + 10));
  ASSERT_EQ(pdf.compare(table, 7, "xref\n0 "), 0);
  const std::size_t n = std::stoul(pdf.substr(table + 7)), entries = pdf.find('\n', table + 7) + 1;
  EXPECT_EQ(n - 1, count(pdf, " 0 obj\n"));
  for (std::size_t object = 1; object < n; ++object) {
    const std::string begin = std::to_string(object) + " 0 obj\n";
    EXPECT_EQ(pdf.compare(std::stoul(pdf.substr(entries + 20 * object, 10)), begin.size(), begin), 0) << begin;
  }
}

TEST(Sheet, APdfSaysWhatItsPartsAre) {
  Sheet s = example();
  s.blocks.push_back({sheet::Drawing{"d", "Łuk (a) \xff", 100, 50, {}, "below"}});
  s.blocks.push_back({sheet::Pictures{{{"mute", gradient(8, 9), ""}}, 9}});  // decoration
  const std::string pdf = sheet_pdf(s);
  expect_whole(pdf);
  const auto parts = [&pdf](const std::string& name) { return count(pdf, "/StructElem\n   /S /" + name + "\n"); };
  EXPECT_EQ(count(pdf, "/MarkInfo << /Marked true >>"), 1U);
  EXPECT_EQ(count(pdf, "/Lang (en)"), 1U);
  EXPECT_EQ(parts("Document"), 1U);
  EXPECT_EQ(parts("H1"), 1U);
  EXPECT_EQ(parts("H2"), 1U);
  EXPECT_EQ(parts("Table"), 1U);
  EXPECT_EQ(parts("TR"), 4U);
  EXPECT_EQ(parts("TH"), 2U);
  EXPECT_EQ(count(pdf, "/Scope /Column"), 2U);
  EXPECT_EQ(parts("TD"), 6U);
  EXPECT_EQ(parts("LI"), 6U);      // three facts, three fields of the signature
  EXPECT_EQ(parts("LBody"), 3U);   // which are empty
  EXPECT_EQ(parts("Figure"), 4U);  // two pictures, bars, drawing
  EXPECT_EQ(parts("Caption"), 3U);
  // What figures show, in their order, in UTF-16.
  std::size_t at = 0;
  for (const char* const alt :
       {"<FEFF00660069007200730074>", "<FEFF007300650063006F006E0064>",
        "<FEFF00480055003B0020007400680072006500730068006F006C0064>", "<FEFF01410075006B00200028006100290020FFFD>"}) {
    at = pdf.find("/S /Figure\n   /Alt " + std::string(alt), at);
    ASSERT_NE(at, std::string::npos) << alt;
  }
  // One that goes over pages is one table still, and the title is there once.
  const std::string many = sheet_pdf(example(400));
  expect_whole(many);
  EXPECT_GT(pages(many), 2U);
  EXPECT_EQ(count(many, "/StructElem\n   /S /Table\n"), 1U);
  EXPECT_EQ(count(many, "/StructElem\n   /S /TR\n"), 401U);
  EXPECT_EQ(count(many, "/StructElem\n   /S /H1\n"), 1U);
}

TEST(Sheet, IsMadeSmallerBeforeItIsLonger) {
  EXPECT_EQ(pages(sheet_pdf(example(3))), 1U);
  EXPECT_EQ(report::fitting_scale(example(3)), 1);
  const Sheet fuller = example(115);
  EXPECT_LT(report::fitting_scale(fuller), 1);
  EXPECT_EQ(pages(sheet_pdf(fuller)), 2U);
  EXPECT_GT(pages(sheet_pdf(example(400))), 2U);
  Sheet broken = example(3);
  broken.blocks.insert(broken.blocks.begin() + 2, {sheet::PageBreak{}});
  EXPECT_EQ(pages(sheet_pdf(broken)), 2U);
}

TEST(Sheet, ASignatureChangesNothingElse) {
  Sheet open = example(100), closed = example(100);
  closed.blocks.back() = {
      sheet::Signature{"A. Łukasiewicz", "2031-02-03", std::string(300, 'w') + " long", "approved", Tone::good}};
  EXPECT_NE(sheet_html(open), sheet_html(closed));
  EXPECT_EQ(html_without_signature(sheet_html(open)), html_without_signature(sheet_html(closed)));
  // What comes to a signed page later has a page of its own, and leaves what was signed as large as it was.
  closed.after = {{sheet::Heading{"Later"}}, {sheet::Paragraph{std::string(9000, 'l')}}};
  closed.marks["after"] = "of this";
  const std::string more = sheet_html(closed);
  EXPECT_NE(more.find("Later"), std::string::npos);
  EXPECT_EQ(mark_of_html(more, "after"), "of this");
  EXPECT_EQ(html_without_signature(sheet_html(open)), html_without_signature(more));
  EXPECT_GT(pages(sheet_pdf(closed)), pages(sheet_pdf(open)));
  closed.footer += ".";
  EXPECT_NE(html_without_signature(sheet_html(open)), html_without_signature(sheet_html(closed)));
}

TEST(Sheet, PicturesShareTheWidth) {
  const sheet::Pictures row{{{"a", gradient(40, 20), ""}, {"b", gradient(20, 20), ""}}, 50};
  EXPECT_NEAR(report::row_height_mm(row, 61, 1), 20, 1e-9);   // 2 h + 1 h = 60
  EXPECT_NEAR(report::row_height_mm(row, 600, 1), 50, 1e-9);  // as high as wished
}

TEST(Plot, MarksLieWithinItAndValuesWhereTheyBelong) {
  sheet::Plot p;
  p.title = "t";
  p.x = {0, 10, 5, "x", {}};
  p.y = {0, 1, 0.5, "", {}};
  p.lines.push_back({{{-10, 0.5}, {20, 0.5}}, Tone::bad, false});
  p.lines.push_back({{{2, 2}, {8, 3}}, Tone::bad, false});
  p.points.push_back({{{5, 0.5}, {5, 2}}, Tone::plain, true});
  p.boxes.push_back({5, 2, 0.1, 0.25, 0.5, 0.75, 0.9});
  const sheet::Drawing drawing = report::drawing_of(p, 200);
  const double height = p.height_mm / report::kPtMm;
  EXPECT_EQ(drawing.width, 200);
  EXPECT_NEAR(drawing.height, height, 1e-9);
  int dots = 0, red = 0, texts = 0;
  std::array<double, 2> dot{};
  double left = 0, right = 0;
  const auto within = [&](double x, double y) {
    EXPECT_GE(x, 0);
    EXPECT_LE(x, 200);
    EXPECT_GE(y, 0);
    EXPECT_LE(y, height);
  };
  const auto bad = static_cast<std::uint8_t>(std::lround(255 * report::ink(Tone::bad).r));
  for (const auto& mark : drawing.marks) {
    if (const auto* const d = std::get_if<sheet::Drawing::Dot>(&mark)) {
      ++dots;
      dot = {d->x, d->y};
      EXPECT_TRUE(d->hollow);
      within(d->x, d->y);
    } else if (const auto* const t = std::get_if<sheet::Drawing::Text>(&mark)) {
      ++texts;
      within(t->x, t->y);
    } else {
      const auto& path = std::get<sheet::Drawing::Path>(mark);
      for (const auto& a : path.points) within(a[0], a[1]);
      if (!path.stroke || (*path.stroke)[0] != bad) continue;
      ++red;
      left = path.points[0][0];
      right = path.points[1][0];
      EXPECT_NEAR(path.points[0][1], path.points[1][1], 1e-9);
    }
  }
  EXPECT_EQ(dots, 1);  // the other lies outside
  EXPECT_EQ(red, 1);   // cut at the axes; the second never meets them
  EXPECT_NEAR(dot[0], (left + right) / 2, 1e-9);
  EXPECT_GE(texts, 7);  // title, name, three ticks each way
  Sheet s = example();
  s.blocks.push_back({p});
  const std::string html = sheet_html(s);
  EXPECT_NE(html.find("class=\"plot\""), std::string::npos);
  EXPECT_EQ(html, sheet_html(s));
  EXPECT_EQ(sheet_pdf(s), sheet_pdf(s));
}

}  // namespace
}  // namespace osteo
