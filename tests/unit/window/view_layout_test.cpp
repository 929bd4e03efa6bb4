// The main view around the bone: rectangles, sizes, colours, wheel, marks, first steps, the page at the end. No screen.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "marks.h"
#include "palette.h"
#include "state_facts.h"
#include "steps.h"
#include "tool_wheel.h"
#include "view_layout.h"
#include "work_done.h"

namespace osteo {
namespace {

struct Size {
  int width, height;
};
constexpr Size kSizes[] = {{1024, 700}, {1280, 800}, {1920, 1080}, {2560, 1440}, {3840, 2160}};

std::vector<ScreenBox> boxes_of(const ViewLayout& l) {
  std::vector<ScreenBox> all;
  for (const ScreenBox& b : {l.tray, l.side, l.view, l.state, l.cuts[0], l.cuts[1], l.cuts[2], l.page}) {
    if (!b.empty()) all.push_back(b);
  }
  return all;
}

// Nothing outside, nothing twice, nothing left: whatever the size, the layout and the size of text.
TEST(ViewLayout, BoxesTileTheWindow) {
  for (const Size s : kSizes) {
    for (const double by_hand : {0.6, 1.0, 1.7, 2.5}) {
      const auto em = static_cast<float>(
          kTextPixels * scale_that_fits(automatic_scale(1, s.width, s.height), by_hand, s.width, s.height));
      for (const Layout wanted : {Layout::operate, Layout::plan, Layout::review}) {
        const auto boxes = boxes_of(lay_out(wanted, s.width, s.height, em));
        float area = 0;
        for (std::size_t a = 0; a < boxes.size(); ++a) {
          area += boxes[a].width * boxes[a].height;
          EXPECT_GE(boxes[a].x, 0);
          EXPECT_GE(boxes[a].y, 0);
          EXPECT_LE(boxes[a].right(), static_cast<float>(s.width));
          EXPECT_LE(boxes[a].bottom(), static_cast<float>(s.height));
          for (std::size_t b = 0; b < a; ++b) {
            const bool apart = boxes[a].right() <= boxes[b].x || boxes[b].right() <= boxes[a].x ||
                               boxes[a].bottom() <= boxes[b].y || boxes[b].bottom() <= boxes[a].y;
            EXPECT_TRUE(apart) << s.width << " layout " << static_cast<int>(wanted) << " boxes " << a << " " << b;
          }
        }
        EXPECT_NEAR(area, static_cast<float>(s.width) * static_cast<float>(s.height), 1e-5F * area);
      }
    }
  }
}

// A column at the right makes the pictures narrower; together they still tile the window.
TEST(ViewLayout, AColumnTakesFromThePicturesAlone) {
  for (const Size s : kSizes) {
    for (const Layout wanted : {Layout::operate, Layout::plan}) {
      const auto em = static_cast<float>(kTextPixels *
                                         scale_that_fits(automatic_scale(1, s.width, s.height), 1, s.width, s.height));
      ViewLayout l = lay_out(wanted, s.width, s.height, em);
      const ViewLayout before = l;
      const ScreenBox column = take_column(l, 19 * em);
      EXPECT_NEAR(column.width, 19 * em, 1);
      EXPECT_EQ(column.right(), static_cast<float>(s.width));
      EXPECT_EQ(column.bottom(), l.state.y);
      EXPECT_EQ(l.state, before.state);
      EXPECT_EQ(l.tray, before.tray);
      auto boxes = boxes_of(l);
      boxes.push_back(column);
      float area = 0;
      for (std::size_t a = 0; a < boxes.size(); ++a) {
        area += boxes[a].width * boxes[a].height;
        for (std::size_t b = 0; b < a; ++b)
          EXPECT_TRUE(boxes[a].right() <= boxes[b].x || boxes[b].right() <= boxes[a].x ||
                      boxes[a].bottom() <= boxes[b].y || boxes[b].bottom() <= boxes[a].y);
      }
      EXPECT_NEAR(area, static_cast<float>(s.width) * static_cast<float>(s.height), 1e-5F * area);
      for (const ScreenBox& over : l.over) EXPECT_LE(over.right(), l.view.right());
    }
  }
  ViewLayout review = lay_out(Layout::review, 1280, 800, 16);
  EXPECT_TRUE(take_column(review, 300).empty());
}

// What is shown for a while takes its strip from the pictures alone, and together they still tile the window.
TEST(ViewLayout, AStripTakesFromThePicturesAlone) {
  for (const Size s : kSizes) {
    const auto em =
        static_cast<float>(kTextPixels * scale_that_fits(automatic_scale(1, s.width, s.height), 1, s.width, s.height));
    for (const Layout wanted : {Layout::operate, Layout::plan}) {
      for (const float high : {13.5F * em, 1e5F}) {
        const ViewLayout before = lay_out(wanted, s.width, s.height, em);
        ViewLayout l = before;
        const ScreenBox strip = take_strip(l, high);
        ASSERT_FALSE(strip.empty());
        EXPECT_EQ(l.tray, before.tray);
        EXPECT_EQ(l.state, before.state);
        for (const ScreenBox& b : l.over) EXPECT_LE(b.bottom(), l.view.bottom());
        EXPECT_EQ(strip.bottom(), l.state.y);
        EXPECT_LE(strip.height, high);
        auto boxes = boxes_of(l);
        boxes.push_back(strip);
        float area = 0;
        for (std::size_t a = 0; a < boxes.size(); ++a) {
          area += boxes[a].width * boxes[a].height;
          for (std::size_t b = 0; b < a; ++b)
            EXPECT_TRUE(boxes[a].right() <= boxes[b].x || boxes[b].right() <= boxes[a].x ||
                        boxes[a].bottom() <= boxes[b].y || boxes[b].bottom() <= boxes[a].y)
                << s.width << " layout " << static_cast<int>(wanted) << " boxes " << a << " " << b;
        }
        EXPECT_NEAR(area, static_cast<float>(s.width) * static_cast<float>(s.height), 1e-5F * area);
        // More than half of the pictures it never takes.
        EXPECT_GE(l.view.height * 2 + 2, before.view.height);
      }
    }
    ViewLayout review = lay_out(Layout::review, s.width, s.height, em);
    EXPECT_TRUE(take_strip(review, 13 * em).empty());
  }
}

// The least size of all shows every layout at its usual text.
TEST(ViewLayout, AllLayoutsFitTheSizesTheyAreFor) {
  for (const Size s : kSizes) {
    const auto em = static_cast<float>(
        std::lround(kTextPixels * scale_that_fits(automatic_scale(1, s.width, s.height), 1, s.width, s.height)));
    EXPECT_GE(em, 16);
    for (const Layout wanted : {Layout::operate, Layout::plan}) {
      const ViewLayout l = lay_out(wanted, s.width, s.height, em);
      EXPECT_EQ(l.shown, wanted) << s.width << ": " << l.why.shown;
      EXPECT_TRUE(l.why.empty());
    }
    // Operate is for the picture, also with its cuts on it; and they are squares within it, apart from each other.
    const ViewLayout l = lay_out(Layout::operate, s.width, s.height, em);
    EXPECT_GE(l.picture_share(s.width, s.height), kPictureShare) << s.width;
    EXPECT_LT(l.picture_share(s.width, s.height), 0.88) << s.width << ": cuts no smaller than they must be";
    EXPECT_EQ(l.over[1].empty(), s.width < 1200);
    for (std::size_t c = 0; c < 3; ++c) {
      if (l.over[c].empty()) continue;
      EXPECT_EQ(l.over[c].width, l.over[c].height);
      EXPECT_LE(l.over[c].right(), l.view.right());
      EXPECT_LE(l.over[c].bottom(), l.view.bottom());
      if (c > 0) {
        EXPECT_GE(l.over[c].y, l.over[c - 1].bottom());
      }
    }
    // As the person dragged them, within limits.
    EXPECT_GT(lay_out(Layout::operate, s.width, s.height, em, l.over[0].width + 16).over[0].width, l.over[0].width);
    EXPECT_LE(lay_out(Layout::operate, s.width, s.height, em, 1e5F).over[0].bottom(), l.view.bottom());
  }
}

// Beside four pictures of one size, where the text leaves room for it.
TEST(ViewLayout, PlanHasASideAndFourPicturesOfOneSize) {
  for (const Size s : kSizes) {
    const auto em = static_cast<float>(
        std::lround(kTextPixels * scale_that_fits(automatic_scale(1, s.width, s.height), 1, s.width, s.height)));
    const ViewLayout l = lay_out(Layout::plan, s.width, s.height, em);
    EXPECT_NEAR(l.side.width, 18 * em, 1) << s.width;
    EXPECT_EQ(l.side.height, l.state.y);
    for (const ScreenBox& c : l.cuts) {
      EXPECT_NEAR(c.width, l.view.width, 1);
      EXPECT_NEAR(c.height, l.view.height, 1);
    }
  }
  EXPECT_TRUE(lay_out(Layout::plan, 1100, 900, 20).side.empty());
  // On 1920 x 1080 with text of twice the size four pictures have room beside their list.
  EXPECT_EQ(lay_out(Layout::plan, 1920, 1080, 32).shown, Layout::plan);
  EXPECT_FALSE(lay_out(Layout::plan, 1920, 1080, 32).side.empty());
  EXPECT_TRUE(lay_out(Layout::operate, 1920, 1080, 16).side.empty());
}

TEST(ViewLayout, WithoutRoomItSaysWhy) {
  const ViewLayout l = lay_out(Layout::plan, 1024, 470, 16);
  EXPECT_EQ(l.shown, Layout::operate);
  EXPECT_NE(l.why.english.find("no room"), std::string::npos);
  // However small: a window is dragged through all sizes.
  for (int w = 200; w < 700; w += 90) {
    for (const Layout wanted : {Layout::operate, Layout::plan, Layout::review}) {
      for (const ScreenBox& b : boxes_of(lay_out(wanted, w, 150, 16))) EXPECT_GE(b.width, 0);
    }
  }
}

// Where the state's parts have no room beside each other they have two rows; the bone is never squeezed out.
TEST(ViewLayout, TextOfTwiceTheSizeLeavesRoomForTheBone) {
  for (const Size s : kSizes) {
    for (const double by_hand : {1.0, 1.25, 1.5, 1.75, 2.0}) {
      const auto em = static_cast<float>(std::lround(
          kTextPixels * scale_that_fits(automatic_scale(1, s.width, s.height), by_hand, s.width, s.height)));
      const ViewLayout l = lay_out(Layout::operate, s.width, s.height, em);
      EXPECT_EQ(l.two_rows, l.state.width < 904 * l.unit) << s.width << " at " << by_hand;
      EXPECT_GE(l.view.width, 400 * l.unit);
      EXPECT_GE(l.view.height, 220 * l.unit);
      EXPECT_FALSE(l.over[0].empty()) << "a cut lies on it";
      EXPECT_LE(l.over[0].bottom() + 40 * l.unit, l.view.bottom()) << "and its foot below it";
      EXPECT_GE(l.free_width(), 328 * l.unit) << "beside it a card";
      const ViewLayout review = lay_out(Layout::review, s.width, s.height, em);
      EXPECT_GE(review.view.width, 200 * l.unit) << "beside the page";
      EXPECT_EQ(review.page.width + review.view.width, static_cast<float>(s.width));
    }
  }
}

TEST(ViewLayout, TwoLayoutsInTurns) {
  EXPECT_EQ(next_layout(Layout::operate), Layout::plan);
  EXPECT_EQ(next_layout(Layout::plan), Layout::operate);
  EXPECT_EQ(next_layout(Layout::review), Layout::operate);
}

TEST(Scale, TextKeepsItsShareOfALargeScreen) {
  EXPECT_EQ(automatic_scale(1, 1024, 700), 1);
  EXPECT_EQ(automatic_scale(1, 3840, 2160), 2);
  EXPECT_EQ(automatic_scale(2.5, 3840, 2160), 2.5);
  EXPECT_EQ(automatic_scale(1, 3840, 1080), 1);  // wide, not large
  // By hand from there; never so large that nothing else has room.
  EXPECT_NEAR(next_scale(next_scale(1, 1), -1), 1, 1e-12);
  EXPECT_EQ(next_scale(2.5, 1), 2.5);
  EXPECT_LE(scale_that_fits(1, 2.5, 1024, 700), 2);
  // Text of twice the size is that large in each of the sizes (WCAG 2.2, 1.4.4).
  for (const Size s : kSizes) {
    const double automatic = automatic_scale(1, s.width, s.height);
    EXPECT_EQ(scale_that_fits(automatic, 2, s.width, s.height), 2 * automatic) << s.width;
  }
}

// --- colours: IEC 61966-2-1 to linear light; contrast as WCAG 2.1 defines it; dichromats after Vienot, Brettel and
// Mollon 1999

std::array<double, 3> linear(Colour c) {
  const auto one = [](float v) {
    return v <= 0.04045F ? static_cast<double>(v) / 12.92 : std::pow((static_cast<double>(v) + 0.055) / 1.055, 2.4);
  };
  return {one(c.red), one(c.green), one(c.blue)};
}
double luminance(const std::array<double, 3>& l) {
  return 0.2126 * l[0] + 0.7152 * l[1] + 0.0722 * l[2];
}

// The table of docs/design/window.md, in every theme.
TEST(Palette, WordsCanBeReadOnTheirGround) {
  for (const ThemeName name : {ThemeName::dark, ThemeName::light, ThemeName::high_contrast}) {
    const Theme& t = theme_of(name);
    for (const Colour ground : {t.ground, t.surface, t.raised}) {
      EXPECT_GE(contrast(t.text, ground), 12);
      EXPECT_GE(contrast(t.quiet, ground), 4.5);
    }
    for (const Colour ground : {t.surface, t.raised}) {
      EXPECT_GE(contrast(t.accent, ground), 3);
      EXPECT_GE(contrast(t.line, ground), 3);
    }
    // What is told in a status' colour is never fainter than a large text may be.
    use_theme(name);
    for (const Colour c :
         {palette::kYellow, palette::kOrange, palette::kSkyBlue, palette::kVermillion, palette::kGreen})
      EXPECT_GE(contrast(ink_of(c), t.surface), 4.2);
  }
  use_theme(ThemeName::light);
  EXPECT_EQ(ink_of(palette::kYellow), theme().text);
  use_theme(ThemeName::dark);
  EXPECT_EQ(ink_of(palette::kYellow), palette::kYellow);
  EXPECT_GE(contrast({0, 0, 0}, palette::kVermillion), 4.5);  // a contact
  EXPECT_NEAR(contrast({0, 0, 0}, {1, 1, 1}), 21, 1e-6);
  EXPECT_NEAR(contrast({0.5F, 0.5F, 0.5F}, {0.5F, 0.5F, 0.5F}), 1, 1e-9);
}

// Every two states differ for protanopes and deuteranopes too, and each has a word and a sign of its own.
TEST(Palette, StatesDifferForTheColourBlind) {
  const double kProtan[3][3] = {{0.11238, 0.88762, 0}, {0.11238, 0.88762, 0}, {0.00401, -0.00401, 1}};
  const double kDeutan[3][3] = {{0.29275, 0.70725, 0}, {0.29275, 0.70725, 0}, {-0.02234, 0.02234, 1}};
  const Nearness states[] = {Nearness::far, Nearness::near, Nearness::close, Nearness::touched};
  for (const auto& m : {kProtan, kDeutan}) {
    for (const Nearness a : states) {
      for (const Nearness b : states) {
        if (a >= b) continue;
        const auto seen = [&](Nearness n) {
          const auto l = linear(look_of(n).colour);
          std::array<double, 3> out{};
          for (std::size_t r = 0; r < 3; ++r) out[r] = m[r][0] * l[0] + m[r][1] * l[1] + m[r][2] * l[2];
          return out;
        };
        const auto x = seen(a), y = seen(b);
        const double lightness =
            (std::max(luminance(x), luminance(y)) + 0.05) / (std::min(luminance(x), luminance(y)) + 0.05);
        const double blue = std::abs(x[2] - y[2]);
        EXPECT_TRUE(lightness > 1.3 || blue > 0.2)
            << static_cast<int>(a) << " " << static_cast<int>(b) << ": " << lightness << ", " << blue;
        EXPECT_STRNE(look_of(a).word, look_of(b).word);
        EXPECT_NE(look_of(a).corners, look_of(b).corners);
      }
    }
  }
}

// --- wheel

TEST(ToolWheel, EachDirectionIsATool) {
  ToolWheel wheel;
  wheel.show(100, 100);
  EXPECT_EQ(wheel.chosen(), -1);
  wheel.point(0.5F, 0.5F);  // the hand trembles where it was opened
  EXPECT_EQ(wheel.chosen(), -1);
  const auto count = static_cast<int>(wheel_items().size());
  for (int n = 0; n < count; ++n) {
    const float angle = 2 * 3.14159265F * static_cast<float>(n) / static_cast<float>(count);
    wheel.point(5 * std::sin(angle), -5 * std::cos(angle));
    EXPECT_EQ(wheel.chosen(), n);
  }
  // By keys, round and round.
  wheel.show(0, 0);
  wheel.turn(1);
  EXPECT_EQ(wheel.chosen(), 0);
  wheel.turn(-1);
  EXPECT_EQ(wheel.chosen(), count - 1);
  wheel.turn(1);
  EXPECT_EQ(wheel.chosen(), 0);
}

TEST(ToolWheel, EachOfItsToolsHasAKey) {
  for (const WheelItem& item : wheel_items()) EXPECT_FALSE(key_name(item.command, item.value).empty()) << item.word;
}

// --- marks

TEST(Ruler, MeasuresBetweenTwoPoints) {
  Ruler ruler;
  ruler.turn(true);
  EXPECT_FALSE(ruler.click({1, 2, 3}));
  EXPECT_FALSE(ruler.length_mm());
  const auto note = ruler.click({1, 5, 7});
  ASSERT_TRUE(note);
  EXPECT_EQ(*ruler.length_mm(), 5);
  const auto j = nlohmann::json::parse(*note);
  EXPECT_EQ(j["length_mm"], 5);
  EXPECT_EQ(j["to_mm"], nlohmann::json({1, 5, 7}));
  EXPECT_FALSE(ruler.click({0, 0, 0}));  // the next one
  EXPECT_EQ(ruler.points_mm().size(), 1U);
  ruler.turn(false);
  EXPECT_TRUE(ruler.points_mm().empty());
}

TEST(PinnedNotes, AreNumberedAndKeepWhatWasWritten) {
  PinnedNotes notes;
  EXPECT_FALSE(notes.pin({}, " \t"));
  const auto first = notes.pin({1, 2, 3.00049}, "  \"spine\" of Henle ");
  ASSERT_TRUE(first);
  const auto j = nlohmann::json::parse(*first);
  EXPECT_EQ(j["number"], 1);
  EXPECT_EQ(j["text"], "\"spine\" of Henle");
  EXPECT_EQ(j["at_mm"][2], 3);
  // Cut at a letter's end, not within it.
  std::string umlauts;
  for (int n = 0; n < 200; ++n) umlauts += "\xC3\xA4";
  const auto second = notes.pin({}, "x" + umlauts);
  ASSERT_TRUE(second);
  EXPECT_EQ(notes.all().back().number, 2);
  EXPECT_EQ(notes.all().back().text.size(), PinnedNotes::kMaxBytes - 1);
  EXPECT_FALSE(nlohmann::json::parse(*second, nullptr, false).is_discarded());
  notes.clear();
  ASSERT_TRUE(notes.pin({}, "again"));
  EXPECT_EQ(notes.all().back().number, 1);
}

TEST(ScaleBar, IsARoundNumberThatFits) {
  for (double pixels_per_mm = 0.3; pixels_per_mm < 300; pixels_per_mm *= 1.37) {
    const double mm = scale_bar_mm(pixels_per_mm, 250);
    EXPECT_LE(mm * pixels_per_mm, 250 * (1 + 1e-9));
    EXPECT_GT(mm * pixels_per_mm, 250 / 2.6);
    const double digit = mm / std::pow(10, std::floor(std::log10(mm * 1.0001)));
    EXPECT_TRUE(std::abs(digit - 1) < 1e-9 || std::abs(digit - 2) < 1e-9 || std::abs(digit - 5) < 1e-9) << mm;
  }
}

// --- first steps

TEST(FirstSteps, AreTickedOffByWhatCameOfThem) {
  FirstSteps list;
  StepFacts now;
  now.magnification = 2;
  now.dust = true;
  now.removed_mm3 = 7;  // of the session that this one goes on from
  list.see(now);
  EXPECT_EQ(list.next(), 0);
  now.removed_mm3 = 7.2;  // a touch
  list.see(now);
  EXPECT_FALSE(list.steps()[0].done);
  now.removed_mm3 = 8;
  list.see(now);
  EXPECT_TRUE(list.steps()[0].done);
  now.undone = true;
  list.see(now);
  now.undone = false;
  now.tilted_rad = 0.05;
  list.see(now);
  EXPECT_EQ(list.next(), 2);
  now.retracted = true;
  list.see(now);
  EXPECT_EQ(list.next(), 3) << "hardly tilted";
  now.tilted_rad = 0.2;
  now.sucked_mm3 = 0.01;  // a sucker that was held in the air
  list.see(now);
  EXPECT_EQ(list.next(), 4);
  now.sucked_mm3 = 0.3;
  now.magnification = 3;
  list.see(now);
  EXPECT_EQ(list.next(), 6);
  now.sawn_mm3 = 3;
  list.see(now);
  list.renew();  // another session: what was done stays done, what was there counts for nothing
  now.fixtures = 1;
  list.see(now);
  EXPECT_EQ(list.next(), 7);
  now.fixtures = 2;
  list.see(now);
  EXPECT_EQ(list.next(), 8);
  now.measured_mm = 4;
  now.pictured = true;
  list.see(now);
  EXPECT_EQ(list.next(), 10);
  now.ended = true;
  list.see(now);
  EXPECT_EQ(list.next(), -1);
  ASSERT_EQ(list.steps().size(), 11U);
}

TEST(FirstSteps, WithoutDustNothingIsAskedOfTheSucker) {
  FirstSteps list;
  StepFacts now;
  now.magnification = 2;
  list.see(now);
  EXPECT_EQ(list.steps()[4].name(), "Suction");
  EXPECT_FALSE(list.steps()[4].possible);
  now.removed_mm3 = 1;
  now.undone = now.retracted = true;
  now.tilted_rad = 1;
  list.see(now);
  EXPECT_EQ(list.steps()[static_cast<std::size_t>(list.next())].name(), "Zoom") << "it is passed over";
}

// --- what the burr does now

Labels one_voxel_nerve() {
  Labels labels;
  labels.frame.dims = {8, 8, 8};
  const auto voxels = make_voxels<std::uint8_t>(512);
  voxels[292] = 6;
  labels.voxels = voxels;
  labels.structures = {{6, "facial nerve", {1, 1, 0}}};
  return labels;
}

TEST(StateFacts, ADistanceSaysHowUncertainTheBoundaryIs) {
  Labels labels = one_voxel_nerve();
  TickRecord tick;
  tick.structure = 6;
  tick.clearance_mm = 1.24F;
  for (const auto& [within, text] : {std::pair{0.0, "1.2 mm"}, {0.6, "1.2 ± 0.6 mm"}, {INFINITY, "1.2 ± ? mm"}}) {
    labels.structures[0].within_mm = within;
    const StructureMap map(labels);
    EXPECT_EQ(state_of_tick(tick, &map, 1000).distance, text);
  }
}

TEST(StateFacts, TellHowWarmItIs) {
  const StructureMap map(one_voxel_nerve());
  TickRecord tick;
  StateFacts far = state_of_tick(tick, &map, 1000), near = far, hot = far, worst = far;
  report_warmth(far, {41.7, {{6, 40.25}}}, tick, &map);
  EXPECT_EQ(far.warmth, "bone up to 42 C");
  EXPECT_EQ(far.warning, "");
  tick.structure = 6;
  report_warmth(near, {41.7, {{6, 40.25}}}, tick, &map);
  EXPECT_EQ(near.warmth, "40.2 C");
  report_warmth(hot, {70, {{6, 47.4}}}, tick, &map);
  EXPECT_EQ(hot.warning, map.name_of(6) + " is at 47 C: stop, and rinse");
  EXPECT_FALSE(hot.alarm);
  report_warmth(worst, {70, {{6, 58}}}, tick, &map);
  EXPECT_TRUE(worst.alarm);
  // A case without structures; a scene without heat.
  StateFacts none = state_of_tick({}, nullptr, 1000);
  EXPECT_EQ(none.warmth, "");
  report_warmth(none, {50, {}}, {}, nullptr);
  EXPECT_EQ(none.warmth, "bone up to 50 C");
}

TEST(StateFacts, TellWhatTheTickTells) {
  TickRecord tick;
  tick.tick = 187000;
  tick.device.tool = 3;
  StateFacts f = state_of_tick(tick, nullptr, 1000);
  EXPECT_EQ(f.tool, "cutting 4 mm");
  EXPECT_EQ(f.speed, "still");
  EXPECT_FALSE(f.turning);
  EXPECT_EQ(f.under, "-");
  EXPECT_EQ(f.structure, "none in this case");
  EXPECT_EQ(f.nearness, Nearness::unknown);
  EXPECT_EQ(f.time, "3:07");
  EXPECT_EQ(f.warning, "");
  tick.speed_rpm = 41180;
  tick.force_n = {3, 0, 4};
  tick.thickness_mm = 2.34F;
  tick.flags = kShaftContact;
  f = state_of_tick(tick, nullptr, 1000);
  EXPECT_EQ(f.speed, "41000 rpm");
  EXPECT_EQ(f.force, "5.00 N");
  EXPECT_EQ(f.force_share, 1);
  EXPECT_EQ(f.under, "2.3 mm");
  EXPECT_EQ(f.warning, "the shaft touches bone");
  EXPECT_FALSE(f.alarm);
  // The worse comes first.
  tick.thickness_mm = 10;
  tick.flags |= kEscape | kPlateInHand;
  f = state_of_tick(tick, nullptr, 1000);
  EXPECT_EQ(f.under, "over 10 mm");
  EXPECT_EQ(f.tool, "plate in the hand");
  EXPECT_TRUE(f.alarm);
  EXPECT_EQ(f.warning, "the burr is buried in bone");
}

// --- the page at the end

TEST(EndFacts, TellWhatWasDone) {
  WorkDone work;
  TickRecord tick;
  tick.device.tool = 3;
  tick.speed_rpm = 40000;
  tick.removed_mm3 = 0.01F;
  for (int n = 0; n < 3000; ++n) work.tick(tick, {});
  tick.speed_rpm = 0;
  tick.removed_mm3 = 0;
  tick.device.tool = 5;  // only held
  work.tick(tick, {});
  work.action(SceneAction::plain(ActionKind::undo));
  SessionFacts session;
  session.folder = "case/sessions/4";
  session.seconds = 3725;
  session.removed_mm3 = 30;
  session.has_structures = true;
  session.structures = {{"facial nerve", 0.7, 0, 0}, {"dura", 0, 0.2, 0}, {"sigmoid sinus", 0, 0.5, 0.25}};
  const EndFacts facts = end_facts(session, work);
  const auto value = [&](const std::string& what) {
    for (const EndLine& l : facts.lines) {
      if (l.what == what) return l;
    }
    return EndLine{what, "not there", Nearness::unknown};
  };
  EXPECT_EQ(value("time").value, "1:02:05");
  EXPECT_EQ(value("bone drilled away").value, "30.0 mm³");
  EXPECT_EQ(value("    cutting 4 mm").value, "30.0 mm³ in 0:03");
  EXPECT_EQ(value("taken back").value, "1");
  EXPECT_EQ(value("score").value, "not there");
  EXPECT_EQ(value("facial nerve").nearness, Nearness::near);
  EXPECT_EQ(value("dura").nearness, Nearness::close);
  EXPECT_EQ(value("sigmoid sinus").nearness, Nearness::touched);
  EXPECT_NE(value("sigmoid sinus").value.find("INJURED"), std::string::npos);
  EXPECT_EQ(facts.summary, "1:02:05 min, 30 mm³ of bone");
  session.removed_mm3 = 0.2;
  EXPECT_EQ(end_facts(session, work).summary, "1:02:05 min, 0.2 mm³ of bone") << "as if nothing had been removed";
  session.score = "81 of 100";
  EXPECT_EQ(end_facts(session, work).lines[1].value, "81 of 100");
}

}  // namespace
}  // namespace osteo
