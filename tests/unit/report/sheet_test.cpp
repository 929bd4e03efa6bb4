// A sheet written as HTML and PDF: whole, readable again, the same for the same, and on its pages.
#include "osteo/report/sheet.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "layout.h"

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
  closed.blocks.back() = {sheet::Signature{"A. Łukasiewicz", "2031-02-03", std::string(300, 'w') + " long", "approved", Tone::good}};
  EXPECT_NE(sheet_html(open), sheet_html(closed));
  EXPECT_EQ(html_without_signature(sheet_html(open)), html_without_signature(sheet_html(closed)));
  closed.footer += ".";
  EXPECT_NE(html_without_signature(sheet_html(open)), html_without_signature(sheet_html(closed)));
}

TEST(Sheet, PicturesShareTheWidth) {
  const sheet::Pictures row{{{"a", gradient(40, 20), ""}, {"b", gradient(20, 20), ""}}, 50};
  EXPECT_NEAR(report::row_height_mm(row, 61, 1), 20, 1e-9);   // 2 h + 1 h = 60
  EXPECT_NEAR(report::row_height_mm(row, 600, 1), 50, 1e-9);  // as high as wished
}

}  // namespace
}  // namespace osteo
