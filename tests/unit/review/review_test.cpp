// A review made by hand: what its page and its JSON say, and that it asks for nothing; and the parts of its scene.
#include "osteo/assessment/review/review.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "evidence/scene.h"
#include "osteo/assessment/review/heat_sheet.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/translate.h"
#include "osteo/display/view/pictures.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/bone/instrument.h"
#include "scene_parts.h"
#include "scratch.h"

namespace osteo {
namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

Picture grey(int width, int height) {
  return {width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(3 * width * height), 128)};
}

// 12 s of a session in which a nerve was injured and 31 mm3 went unseen.
Review example() {
  Review r;
  r.labels = {"Scripted: a file of strokes moved the hand, no person did."};
  r.score.values = {measured("duration_s", 12),
                    measured("drilling_s", 8),
                    measured("removed_mm3", 120),
                    measured("seen_share", 0.7),
                    measured("hidden_mm3", 31),
                    measured("touches", 2, "facial nerve"),
                    measured("touched_s", 0.4, "facial nerve"),
                    measured("injured_s", 0.4, "facial nerve"),
                    measured("force_p95_n", 1.5),
                    not_measured("region_per_voxel", "no reference")};
  r.score.moments = {{3, {1, 2, 3}, "reached by a rotating burr", "facial nerve", -0.1, 0}};
  r.findings = findings_of(r.score, nullptr, nullptr);
  r.timeline.known.assign(120, 1);
  r.timeline.drilling.assign(120, 1);
  for (auto* const v : {&r.timeline.force_n, &r.timeline.speed_mm_s, &r.timeline.distance_mm, &r.timeline.removed_mm3,
                        &r.timeline.seen_mm3, &r.timeline.hidden_mm3, &r.timeline.unknown_mm3})
    v->assign(120, 0.5F);
  r.timeline.structure.assign(120, 6);
  r.timeline.tool.assign(120, 0);
  r.timeline.at_mm.assign(120, {1, 2, 3});
  r.timeline.structure_names[6] = "facial nerve";
  r.timeline.events = {
      {EventKind::injury, 3, 3.4, "a turning burr reached the facial nerve", "facial nerve", true, {1, 2, 3}},
      {EventKind::note, 5, 5, "note: </script><script>alert(1)</script>", {}, false, {}}};
  r.pictures = {{"before", "Before", grey(32, 24)},
                {"after", "After", grey(32, 24)},
                {"injury-facial-nerve", "the nerve \"here\"", grey(32, 24)}};
  TriMesh m = review::dots_at({{1, 2, 3}}, 1, 10);
  r.meshes = {{"after", "bone, after", {237, 224, 196}, m}};
  r.hidden_mm3 = 31;
  r.seen_mm3 = 72;
  return r;
}

// The page in a language, and the JSON as it always is.
TEST(ReviewPage, IsInTheLanguageAndItsFilesAreNot) {
  const std::string english = review_html(example()), json = review_json(example()).dump();
  EXPECT_EQ(english.find("\"texts\""), std::string::npos) << "nothing to look up";
  for (const auto& [language, heading, number] :
       {std::tuple{Language::german, "Befunde", "1,5 N"}, std::tuple{Language::spanish, "Hallazgos", "1,5 N"},
        std::tuple{Language::french, "Constats", "1,5 N"}, std::tuple{Language::chinese, "发现", "1.5 N"}}) {
    const InLanguage theirs(language);
    Review r = example();
    {
      const EnglishHere files;
      r.findings = example().findings;
    }
    r.shown.findings = findings_of(r.score, nullptr, nullptr);
    r.shown.labels = {tr("Scripted: a file of strokes moved the hand, no person did.")};
    const std::string html = review_html(r);
    EXPECT_NE(html.find(std::string("<h2>") + heading + "</h2>"), std::string::npos) << heading;
    EXPECT_NE(html.find(number), std::string::npos) << heading;
    EXPECT_NE(html.find(r.shown.findings.list[0].text), std::string::npos) << heading;
    EXPECT_EQ(html.find(r.findings.list[0].text), std::string::npos) << heading;
    EXPECT_NE(html.find("\"texts\""), std::string::npos) << "what the script says";
    EXPECT_EQ(review_json(r).dump(), json) << heading;
    EXPECT_EQ(review_sheet(r).title, tr("Review of a session"));
  }
  EXPECT_EQ(review_html(example()), english);
}

TEST(ReviewPage, SaysWhatWasFoundAndAsksForNothing) {
  const std::string html = review_html(example());
  EXPECT_NE(html.find("A rotating burr reached the facial nerve once, for 0.4 s in all."), std::string::npos);
  EXPECT_NE(html.find("31 mm³ of bone (30 %) was removed unseen."), std::string::npos);
  EXPECT_NE(html.find("<b>Scripted:</b>"), std::string::npos);
  EXPECT_NE(html.find("no reference"), std::string::npos);
  // The label comes before all that is said.
  EXPECT_LT(html.find("Scripted"), html.find("A rotating burr"));
  EXPECT_LT(html.find("id=\"finding-injury-facial-nerve\""), html.find("id=\"finding-hidden\""));
  EXPECT_EQ(count(html, "http"), 1U);  // http-equiv
  for (const char* const way : {"//cdn", "url(", "@import", "<link", "<iframe", "fetch(", "XMLHttpRequest", "import(",
                                "WebSocket", "sendBeacon"})
    EXPECT_EQ(html.find(way), std::string::npos) << way;
  // Pictures: each with what is read aloud, inside the page.
  EXPECT_EQ(count(html, "<img "), 3U);
  EXPECT_EQ(count(html, "src=\"data:image/png;base64,"), 3U);
  EXPECT_NE(html.find("alt=\"the nerve &quot;here&quot;\""), std::string::npos);
  EXPECT_EQ(html, review_html(example()));
}

TEST(ReviewPage, WhatPeopleWriteIsText) {
  const std::string html = review_html(example());
  EXPECT_EQ(count(html, "<script>alert"), 0U);
  EXPECT_EQ(count(html, "<script"), 2U);
  EXPECT_EQ(count(html, "</script>"), 2U);
  EXPECT_NE(html.find("note: &lt;/script&gt;"), std::string::npos);
}

TEST(ReviewPage, ItsDataCanBeReadAndMeshesAreWhole) {
  const std::string html = review_html(example());
  const std::string opens = "id=\"review-data\">";
  const auto from = html.find(opens) + opens.size();
  const auto data = Json::parse(html.substr(from, html.find("</script>", from) - from));
  ASSERT_TRUE(data);
  EXPECT_EQ(*data->find("timeline")->find("samples")->number(), 120);
  EXPECT_EQ(*data->find("timeline")->find("events")->items()[1].find("what")->text(),
            "note: </script><script>alert(1)</script>");
  const Json& mesh = data->find("meshes")->items()[0];
  EXPECT_EQ(*mesh.find("count")->number(), 3 * 2 * 32 * 15);
  EXPECT_EQ(mesh.find("points")->text()->size(), (17 * 32 * 3 * 2 + 2) / 3 * 4U);
  EXPECT_EQ(mesh.find("triangles")->text()->size(), (3 * 2 * 32 * 15 * 2 + 2) / 3 * 4U);
}

TEST(ReviewPage, HardCasesHaveAWord) {
  Review nothing;
  nothing.score.values = {measured("duration_s", 0), measured("removed_mm3", 0),
                          not_measured("seen_share", "nothing was removed"),
                          not_measured("touches", "the case has no structures")};
  nothing.score.words = {"nothing was removed"};
  nothing.findings = findings_of(nothing.score, nullptr, nullptr);
  nothing.left_out = {"pictures and the view in 3D were not asked for"};
  const std::string html = review_html(nothing);
  for (const char* const said : {"No bone was removed.", "Nothing was recorded.", "the case has no structures",
                                 "There is nothing to tell.", "pictures and the view in 3D were not asked for"})
    EXPECT_NE(html.find(said), std::string::npos) << said;
  EXPECT_EQ(html.find("<canvas"), std::string::npos);
  EXPECT_EQ(html.find("id=\"comparison\""), std::string::npos);
  EXPECT_FALSE(sheet_pdf(review_sheet(nothing)).empty());
}

TEST(ReviewJson, HoldsWhatThePageSays) {
  const Review r = example();
  const auto j = Json::parse(review_json(r).dump());
  ASSERT_TRUE(j);
  EXPECT_EQ(*j->find("osteotome_review")->number(), 1);
  const Json& findings = *j->find("findings")->find("findings");
  ASSERT_EQ(findings.items().size(), r.findings.list.size());
  const std::string html = review_html(r);
  for (const Json& f : findings.items()) EXPECT_NE(html.find(html_escaped(*f.find("text")->text())), std::string::npos);
  EXPECT_EQ(*findings.items()[0].find("severity")->text(), "serious");
  EXPECT_EQ(j->find("labels")->items().size(), 1U);
}

TEST(ReviewFolder, IsWrittenWholeAndReplacesOnlyAReview) {
  const test::ScratchFolder scratch;
  const Review r = example();
  write_review(r, scratch / "r", false);
  for (const char* const file : {"review.html", "review.json", "review.pdf"})
    EXPECT_TRUE(fs::exists(scratch / "r" / file)) << file;
  EXPECT_EQ(read_text(scratch / "r" / "review.pdf").substr(0, 5), "%PDF-");
  EXPECT_THROW(write_review(r, scratch / "r", false), Error);
  write_review(r, scratch / "r", true);
  write_file(scratch / "r" / "thesis.txt", "mine");
  try {
    write_review(r, scratch / "r", true);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::cannot_write);
  }
  EXPECT_EQ(read_text(scratch / "r" / "thesis.txt"), "mine");
}

TEST(ReviewScene, RemovedVoxelsAreASurfaceAroundThem) {
  const World world = test::solid_world(
      [](Vec3 p) {
        return 8 - std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
      },
      0.5, 24);
  const BrickGrid& bone = world.bodies()[0].body->bone;
  std::vector<VisibilityMetric::Voxel> voxels;
  for (VoxelKey k = 0; k < bone.brick_count() * BrickGrid::kVoxels; ++k) {
    const Vec3 at = place_of_voxel_mm(bone, k);
    if (length(at) < 4) voxels.push_back({VisibilityMetric::Seen::hidden, 0, at, 0.125F});
  }
  const TriMesh blob = review::blob_of(voxels, world, {});
  const double mm3 = 0.125 * static_cast<double>(voxels.size());
  EXPECT_NEAR(enclosed_volume_mm3(blob), mm3, 0.03 * mm3);
  EXPECT_LT(length(review::around({Vec3{1, 0, 0}, Vec3{3, 0, 0}}).centre_mm - Vec3{2, 0, 0}), 1e-9);
  // Fewer triangles, the same ball.
  const TriMesh coarse = review::simplified(blob, blob.triangles.size() / 4, 0.1);
  EXPECT_LE(coarse.triangles.size(), blob.triangles.size() / 3);
  EXPECT_NEAR(enclosed_volume_mm3(coarse), mm3, 0.08 * mm3);
  EXPECT_EQ(coarse.normals.size(), coarse.points_mm.size());
}

TEST(ReviewScene, OneLooksFromWhereItIsSeen) {
  // A block with a shaft of 3 mm from above: what lies at its bottom is seen from above only, whatever is wished.
  const World world = test::solid_world(
      [](Vec3 p) {
        const double box = 8 - std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
        const double shaft = p.z > -2
                                 ? std::hypot(p.x, p.y) - 1.5
                                 : std::hypot(std::hypot(p.x, p.y) > 1.5 ? std::hypot(p.x, p.y) - 1.5 : 0.0, p.z + 2);
        return std::min(box, shaft);
      },
      0.5, 24);
  const std::vector<Vec3> bottom{{0, 0, -2.2}, {0.4, 0, -2.2}, {0, -0.4, -2.2}};
  const review::Lookout from = review::look_at_places(world, bottom, normalized({1, 0, 0.3}));
  EXPECT_EQ(from.seen_share, 1);
  EXPECT_GT(from.eye.z, 0.9);
  // What lies in the middle of the block is seen from nowhere.
  EXPECT_EQ(review::look_at_places(world, {{5, 5, 0}}, {0, 0, 1}).seen_share, 0);
}

TEST(Stills, ShowPartsWhereTheyAreAndCutThemOpen) {
  const auto ball = std::make_shared<const TriMesh>(review::dots_at({{10, 20, 30}}, 5, 1));
  const auto core = std::make_shared<const TriMesh>(review::dots_at({{10, 20, 30}}, 1, 1));
  const std::vector<StillPart> parts{{ball, {0.9, 0.9, 0.2}, 1, true}, {core, {0.1, 0.2, 0.9}, 1, false}};
  Still s;
  s.centre_mm = {10, 20, 30};
  s.radius_mm = 10;
  s.parts = {0, 1};
  s.scale_bar = false;
  s.width = s.height = 100;
  Still cut = s;
  cut.cut_mm = 0;
  const std::vector<Still> stills{s, cut};
  const auto pictures = draw_stills(parts, stills);
  ASSERT_EQ(pictures.size(), 2U);
  const auto at = [](const Picture& p, int x, int y) {
    return &p.rgb[static_cast<std::size_t>(3 * (y * p.width + x))];
  };
  const auto yellow = [](const std::uint8_t* c) { return c[0] > 2 * c[2] && c[0] > 60; };
  const auto blue = [](const std::uint8_t* c) { return c[2] > 2 * c[0]; };
  EXPECT_TRUE(yellow(at(pictures[0], 50, 50)));
  EXPECT_TRUE(blue(at(pictures[1], 50, 50)));    // what it hid
  EXPECT_TRUE(yellow(at(pictures[1], 40, 50)));  // 2 mm off: the far side, from within
  EXPECT_TRUE(yellow(at(pictures[0], 28, 50)));  // 4.4 mm off
  for (const int x : {2, 20, 97}) EXPECT_GT(at(pictures[0], x, 50)[2], 200) << x;  // beyond it: the ground
}

// Pressed by a diamond burr from above: the section is red there, grey far off, and nothing is painted where there is
// no bone.
TEST(HeatSheet, ASectionShowsWhereItWasHot) {
  const World world = test::solid_world(
      [](Vec3 p) { return std::min(8 - std::abs(p.x), std::min(6 - std::abs(p.y), 4 - std::abs(p.z))); }, 0.5, 24);
  const StructureMap ball = test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        return length(p - Vec3{0, 0, 1}) < 1.5 ? 1 : 0;
      },
      {{1, "ball", {}}}, 0.5, 24);
  HeatReader heat(world, &ball, 1000);
  heat.keep_history();
  TickRecord r;
  r.device.position_mm = {0, 0, 5.6F};
  r.device.tool = static_cast<std::uint8_t>(burr_index(BurrKind::diamond, 4));
  r.force_n = {0, 0, 3};
  r.normal_force_n = 3;
  r.speed_rpm = 40000;
  for (r.tick = 0; r.tick < 3000; ++r.tick) heat.tick(r, {});
  const Picture p = review::heat_section(heat, &ball, {0, 0, 0}, {1, 0, 0}, {0, 0, -1}, 24, 240);
  const auto at = [&](double x, double z) {
    const auto column = static_cast<std::size_t>(std::lround(120 + 10 * x)),
               row = static_cast<std::size_t>(std::lround(120 - 10 * z));
    const std::size_t n = 3 * (row * 240 + column);
    return std::array<int, 3>{p.rgb[n], p.rgb[n + 1], p.rgb[n + 2]};
  };
  const auto hot = at(0.25, 3.55), cold = at(-7.2, -3.2), air = at(0, 8), warm = at(3.1, 3.1);
  EXPECT_GT(hot[0] - hot[1], 60) << hot[0] << " " << hot[1] << " " << hot[2];
  EXPECT_LT(std::abs(cold[0] - cold[2]), 30);
  EXPECT_GT(cold[0], 150);
  EXPECT_LT(air[0], 60);
  EXPECT_GT(warm[0] - warm[2], cold[0] - cold[2]) << "between the two";
  const Sheet sheet = review::heat_sheet(heat, &ball, {}, "press");
  const std::string html = sheet_html(sheet);
  EXPECT_NE(html.find("ball"), std::string::npos);
  EXPECT_EQ(pictures_of_html(html).size(), 3U);
  EXPECT_NE(html.find("Nothing clinical"), std::string::npos);
  // How far a figure can be trusted stands beside it.
  EXPECT_NE(html.find("right within 1 %, two cells (1 mm)"), std::string::npos);
  // Nothing drilled, nothing warm: said so.
  const HeatReader idle(world, nullptr, 1000);
  const std::string cool = sheet_html(review::heat_sheet(idle, nullptr, {}, "idle"));
  EXPECT_NE(cool.find("no bone that is left was warmer"), std::string::npos);
  EXPECT_TRUE(pictures_of_html(cool).empty());
}

}  // namespace
}  // namespace osteo
