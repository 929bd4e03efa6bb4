// What mouse and keys do in the editor, without a screen.
#include "edit_control.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "cut_picture.h"
#include "edit_subject.h"
#include "folders.h"

namespace osteo {
namespace {

struct Editor {
  explicit Editor(std::array<int, 3> dims = {60, 50, 40})
      : ct(test::walnut(dims)), document(ct, test::start_of(ct, 300)), control(document) {
    for (int v = 0; v < 3; ++v) control.resize(v, 400, 300);
    control.fit();
  }
  // Where a point lies in a view.
  [[nodiscard]] SlicePointer at(int view, Vec3 mm, bool shift = false, bool ctrl = false) const {
    const auto p = control.view(view).pixel(mm);
    return {view, p[0], p[1], shift, ctrl};
  }
  void click(SlicePointer p) {
    control.move(p);
    control.press(p, SliceButton::left);
    control.release(p, SliceButton::left);
  }
  void drag(SlicePointer from, SlicePointer to, SliceButton button = SliceButton::left) {
    control.move(from);
    control.press(from, button);
    control.move(to);
    control.release(to, button);
  }
  void settle() {
    do {
      control.tick();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } while (control.busy());
    control.tick();
  }
  Image ct;
  EditDocument document;
  EditControl control;
};

TEST(EditControl, EveryKeyIsToldAndEveryTellingHasAKey) {
  std::set<EditKey> reported, has;
  for (const EditHelpLine& l : edit_help_lines()) reported.insert(l.commands.begin(), l.commands.end());
  for (const EditKeyRow& r : edit_key_table()) {
    has.insert(r.does);
    // Found by exactly its keys, and no two rows want the same.
    const EditKeyRow* const found =
        find_edit_key(r.code, r.with == EditKeyRow::With::control || r.with == EditKeyRow::With::control_shift,
                      r.with == EditKeyRow::With::shift || r.with == EditKeyRow::With::control_shift);
    EXPECT_EQ(found, &r);
  }
  EXPECT_EQ(reported, has);
  EXPECT_EQ(find_edit_key('1', true, false), nullptr);
}

TEST(EditControl, TheGuideHasTheTableOfKeys) {
  std::ifstream in(source_folder().string() + "/docs/guides/edit.md");
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_NE(text.str().find(edit_help_table()), std::string::npos) << "docs/guides/edit.md lacks this table:\n"
                                                                   << edit_help_table();
}

TEST(EditControl, PixelsAndMillimetresGoBothWaysInEachView) {
  Editor e;
  for (int v = 0; v < 3; ++v) {
    const Vec3 p = e.control.view(v).world(123, 45);
    const auto back = e.control.view(v).pixel(p);
    EXPECT_NEAR(back[0], 123, 1e-9);
    EXPECT_NEAR(back[1], 45, 1e-9);
  }
  // The patient's left is on the right, the front of an axial slice above, the head of the others above.
  const auto& axial = e.control.view(0);
  EXPECT_GT(axial.world(300, 0).x, axial.world(100, 0).x);
  EXPECT_GT(axial.world(0, 200).y, axial.world(0, 100).y);
  EXPECT_LT(e.control.view(1).world(0, 200).z, e.control.view(1).world(0, 100).z);
  EXPECT_GT(e.control.view(2).world(300, 0).y, e.control.view(2).world(100, 0).y);
}

TEST(EditControl, ScrollingGoesFromSliceToSliceAndStopsAtTheEnds) {
  Editor e;
  const auto [slice, slices] = e.control.slice(0);
  EXPECT_EQ(slices, 40);
  e.control.wheel({0, 10, 10}, 1);
  EXPECT_EQ(e.control.slice(0).first, slice + 1);
  EXPECT_NEAR(e.control.cross_mm().z, e.ct.frame.world_from_index({0, 0, double(slice)}).z, 1e-9);
  e.control.wheel({0, 10, 10}, -3);
  EXPECT_EQ(e.control.slice(0).first, slice - 2);
  for (int n = 0; n < 100; ++n) e.control.wheel({0, 10, 10}, -1);
  EXPECT_EQ(e.control.slice(0).first, 1);
  for (int n = 0; n < 100; ++n) e.control.wheel({0, 10, 10}, 1);
  EXPECT_EQ(e.control.slice(0).first, 40);
  e.control.move({2, 10, 10});
  const int sagittal = e.control.slice(2).first;
  EXPECT_TRUE(e.control.key(*find_edit_key('F', false, false)));
  EXPECT_EQ(e.control.slice(2).first, sagittal + 1);
  EXPECT_TRUE(e.control.key(*find_edit_key('B', false, false)));
  EXPECT_EQ(e.control.slice(2).first, sagittal);
}

TEST(EditControl, CrosshairLinksTheViewsZoomKeepsWhatIsUnderTheMouse) {
  Editor e;
  const Vec3 there = e.ct.frame.world_from_index({12, 30, 22});
  e.control.move(e.at(0, there, true));
  EXPECT_NEAR(e.control.cross_mm().x, there.x, 1e-9);
  EXPECT_NEAR(e.control.cross_mm().y, there.y, 1e-9);
  EXPECT_EQ(e.control.view(2).through_mm, e.control.cross_mm());
  e.control.move({0, 5, 5});  // without Shift nothing moves
  EXPECT_NEAR(e.control.cross_mm().x, there.x, 1e-9);
  const Vec3 under = e.control.view(1).world(90, 70);
  const double before = e.control.view(1).mm_per_pixel;
  e.control.wheel({1, 90, 70, false, true}, 2);
  EXPECT_LT(e.control.view(1).mm_per_pixel, before);
  EXPECT_LT(length(e.control.view(1).world(90, 70) - under), 1e-9);
  const Vec3 centre = e.control.view(1).centre_mm;
  e.drag({1, 100, 100}, {1, 110, 105}, SliceButton::middle);
  EXPECT_NEAR(length(e.control.view(1).centre_mm - centre), std::hypot(10, 5) * e.control.view(1).mm_per_pixel, 1e-9);
  const double scale = e.control.view(1).mm_per_pixel;
  e.drag({1, 100, 100}, {1, 100, 120}, SliceButton::right);
  EXPECT_LT(e.control.view(1).mm_per_pixel, scale);
  e.control.fit();
  EXPECT_NEAR(e.control.view(1).mm_per_pixel, before, 1e-9);
}

TEST(EditControl, WindowAndLevelByDragPresetsAndBack) {
  Editor e;
  e.drag({0, 100, 100}, {0, 150, 80});
  EXPECT_DOUBLE_EQ(e.control.hu.width, 1200);
  EXPECT_DOUBLE_EQ(e.control.hu.level, 480);
  for (int p = 0; p < 3; ++p) {
    EXPECT_TRUE(e.control.key(*find_edit_key(291 + p, false, false)));
    EXPECT_EQ(e.control.hu.width, grey_presets()[static_cast<std::size_t>(p)].hu.width);
    EXPECT_EQ(e.control.hu.level, grey_presets()[static_cast<std::size_t>(p)].hu.level);
  }
  e.control.double_click({0, 100, 100, false, true});
  EXPECT_EQ(e.control.hu.width, 1000);
  EXPECT_EQ(e.control.enlarged(), -1);
  e.control.double_click({1, 100, 100});
  EXPECT_EQ(e.control.enlarged(), 1);
  e.control.double_click({1, 100, 100});
  EXPECT_EQ(e.control.enlarged(), -1);
}

TEST(EditControl, ReadsWhatIsUnderTheMouse) {
  Editor e;
  const Vec3 there = e.ct.frame.world_from_index({30, 25, 20});
  e.control.go_to(there);
  e.control.move(e.at(0, there));
  const std::string hu = std::to_string(e.ct.at(30, 25, 20)) + " HU";
  EXPECT_NE(e.control.readout().find(hu), std::string::npos) << e.control.readout() << " lacks " << hu;
  EXPECT_EQ(e.control.readout().substr(0, 2), "L ");
  e.control.move({0, -500, 0});
  EXPECT_NE(e.control.readout().find("outside the scan"), std::string::npos);
  e.control.move({-1, 0, 0});
  EXPECT_TRUE(e.control.readout().empty());
  EXPECT_EQ(place_text({-1, -2, -3}), "R 1.0  A 2.0  F 3.0");
}

TEST(EditControl, BrushAndEraserDrawWhereTheMouseGoesAndUndoTakesItBack) {
  Editor e;
  e.control.take(EditTool::brush);
  e.control.brush_radius_mm = 1.5;
  const Vec3 a = e.ct.frame.world_from_index({30, 25, 20}), b = e.ct.frame.world_from_index({36, 25, 20});
  e.control.go_to(a);
  const std::string before = e.document.hash();
  e.drag(e.at(0, a), e.at(0, b));
  EXPECT_TRUE(e.document.bone().at(30, 25, 20));
  EXPECT_TRUE(e.document.bone().at(33, 25, 20));
  EXPECT_TRUE(e.document.bone().at(36, 25, 20));
  EXPECT_EQ(e.document.steps(), 1U);
  EXPECT_TRUE(e.control.unsaved());
  EXPECT_NE(e.control.message().find("brush 3 mm"), std::string::npos) << e.control.message();
  e.control.take(EditTool::eraser);
  e.click(e.at(0, a));
  EXPECT_FALSE(e.document.bone().at(30, 25, 20));
  EXPECT_TRUE(e.control.key(*find_edit_key('Z', true, false)));
  EXPECT_TRUE(e.document.bone().at(30, 25, 20));
  EXPECT_TRUE(e.control.key(*find_edit_key('Z', true, false)));
  EXPECT_EQ(e.document.hash(), before);
  EXPECT_TRUE(e.control.key(*find_edit_key('Y', true, false)));
  EXPECT_TRUE(e.document.bone().at(36, 25, 20));
  // Another tool in the middle of a stroke ends it.
  e.control.take(EditTool::brush);
  e.control.press(e.at(0, b), SliceButton::left);
  EXPECT_TRUE(e.document.in_stroke());
  e.control.take(EditTool::look);
  EXPECT_FALSE(e.document.in_stroke());
  const double radius = e.control.brush_radius_mm;
  e.control.take(EditTool::brush);
  e.control.wheel({0, 10, 10, true}, 1);
  EXPECT_GT(e.control.brush_radius_mm, radius);
}

TEST(EditControl, ThresholdShowsAtOnceAndIsMadeBesideTheWindow) {
  Editor e;
  EXPECT_NEAR(e.control.lower_hu, 300, 5);  // as the mask is
  EXPECT_FALSE(e.control.live());
  e.control.take(EditTool::threshold);
  e.control.set_threshold(600, 32767);
  ASSERT_TRUE(e.control.live());
  EXPECT_EQ(e.control.live()->lower_hu, 600);
  EXPECT_EQ(e.document.steps(), 0U);
  e.control.apply();
  EXPECT_TRUE(e.control.busy());
  // Meanwhile nothing else is changed.
  e.control.undo();
  EXPECT_NE(e.control.message().find("wait"), std::string::npos);
  EXPECT_FALSE(e.control.add_structure("too early"));
  e.settle();
  EXPECT_EQ(e.document.steps(), 1U);
  EXPECT_EQ(e.document.bone(), BitMask(e.ct, 600, 32767));
  EXPECT_NE(e.control.message().find("removed"), std::string::npos) << e.control.message();
}

TEST(EditControl, AStoppedOneChangesNothing) {
  Editor e({200, 150, 100});
  const std::string before = e.document.hash();
  e.control.take(EditTool::smooth);
  e.control.smooth_mm = 3;
  e.control.apply();
  e.control.cancel();
  e.settle();
  if (e.document.steps() == 0) {  // else it was quicker than the key
    EXPECT_EQ(e.document.hash(), before);
    EXPECT_NE(e.control.message().find("stopped"), std::string::npos) << e.control.message();
  }
  EXPECT_EQ(e.control.tool(), EditTool::smooth);
  e.control.cancel();
  EXPECT_EQ(e.control.tool(), EditTool::look);
}

TEST(EditControl, PieceByClickBoxByDrag) {
  Editor e;
  const Vec3 middle = e.ct.frame.world_from_index({30, 25, 20});
  e.document.apply(ThresholdEdit{20000, 32767});
  e.document.apply(BrushEdit{0, false, 2, {middle}});
  e.document.apply(BrushEdit{0, false, 2, {middle + Vec3{10, 0, 0}}});
  e.control.go_to(middle);
  e.control.take(EditTool::piece);
  e.click(e.at(0, middle));
  e.settle();
  EXPECT_FALSE(e.document.bone().at(30, 25, 20));
  EXPECT_GT(e.document.volume_mm3(0), 20);
  e.control.undo();
  e.click(e.at(0, middle, true));  // with Shift it alone stays
  e.settle();
  EXPECT_TRUE(e.document.bone().at(30, 25, 20));
  e.click(e.at(0, middle + Vec3{10, 0, 0}));
  e.settle();
  EXPECT_NE(e.control.message().find("no bone"), std::string::npos) << e.control.message();

  e.control.take(EditTool::box);
  e.drag(e.at(0, middle - Vec3{3, 4, 0}), e.at(0, middle + Vec3{5, 6, 0}));
  EXPECT_NEAR(e.control.box_lo_mm[0], middle.x - 3, 0.01);
  EXPECT_NEAR(e.control.box_hi_mm[1], middle.y + 6, 0.01);
  e.drag(e.at(2, middle - Vec3{0, 4, 2}), e.at(2, middle + Vec3{0, 6, 3}));
  EXPECT_NEAR(e.control.box_lo_mm[0], middle.x - 3, 0.01);  // a sagittal drag leaves left and right
  EXPECT_NEAR(e.control.box_lo_mm[2], middle.z - 2, 0.01);
  EXPECT_NEAR(e.control.box_hi_mm[2], middle.z + 3, 0.01);
  e.control.apply(BoxChoice::clear_inside);
  e.settle();
  EXPECT_FALSE(e.document.bone().at(30, 25, 20));
}

TEST(EditControl, RulerMeasuresMillimetres) {
  Editor e;
  e.control.take(EditTool::ruler);
  const Vec3 a = e.ct.frame.world_from_index({10, 10, 20});
  e.control.go_to(a);
  e.drag(e.at(0, a), e.at(0, a + Vec3{3, 4, 0}));
  ASSERT_TRUE(e.control.ruler_mm);
  EXPECT_NEAR(length((*e.control.ruler_mm)[1] - (*e.control.ruler_mm)[0]), 5, 1e-9);
  EXPECT_EQ(e.document.steps(), 0U);
}

TEST(EditControl, StructuresArePaintedShownAndSaved) {
  Editor e;
  EXPECT_TRUE(e.control.add_structure("facial nerve"));
  EXPECT_FALSE(e.control.add_structure("facial nerve"));
  EXPECT_NE(e.control.message().find("already"), std::string::npos);
  EXPECT_EQ(e.control.structure, 1);
  e.control.take(EditTool::brush);
  EXPECT_NE(e.control.hint().find("facial nerve"), std::string::npos);
  const Vec3 p = e.ct.frame.world_from_index({30, 25, 20});
  e.control.go_to(p);
  e.click(e.at(0, p));
  EXPECT_GT(e.document.volume_mm3(1), 10);
  e.control.saved(e.document.version());
  EXPECT_FALSE(e.control.unsaved());
  e.control.show_structure(1, false);
  EXPECT_TRUE(e.control.unsaved());
  EXPECT_EQ(e.document.steps(), 2U);  // looking is no step
}

TEST(CutPicture, DrawsGreyOutlineAndStructures) {
  const Image ct = test::flat(Frame{{40, 40, 40}, {1, 1, 1}, {}, {}}, 400);
  EditDocument d(ct, test::start_of(ct, 500));
  const Vec3 c{20, 20, 20};
  d.apply(BrushEdit{0, false, 6, {c}});
  SliceView view{Plane::axial, c, c, 0.25, 200, 200};
  CutLook look;
  std::vector<std::uint32_t> pixels;
  draw_cut(view, d, look, pixels);
  const auto at = [&](Vec3 p) {
    const auto q = view.pixel(p);
    return pixels[static_cast<std::size_t>(std::lround(q[1])) * 200 + static_cast<std::size_t>(std::lround(q[0]))];
  };
  const std::uint32_t grey = 0xff7f7f7fU,
                      edge = 0xff000000U | kBoneColour[0] | kBoneColour[1] << 8 | kBoneColour[2] << 16;
  EXPECT_EQ(at(c), grey);  // level is middle grey; within, no outline
  EXPECT_EQ(at({10, 10, 20}), grey);
  EXPECT_EQ(at({-2, 20, 20}), 0xff000000U);  // beside the scan
  std::size_t outline = 0;
  for (const std::uint32_t p : pixels) outline += p == edge ? 1 : 0;
  EXPECT_GT(outline, 100U);
  EXPECT_LT(outline, 400U);
  look.outlines = false;
  draw_cut(view, d, look, pixels);
  EXPECT_EQ(std::count(pixels.begin(), pixels.end(), edge), 0);
  look.outlines = true;
  look.live = ThresholdEdit{300, 500};  // all of it: tinted, and no edge of the picture is an outline
  draw_cut(view, d, look, pixels);
  EXPECT_NE(at(c), grey);
  d.apply(AddStructureEdit{1, "x", {10, 20, 250}, StructureRole::at_risk});
  d.apply(BrushEdit{1, false, 3, {c}});
  look.live.reset();
  draw_cut(view, d, look, pixels);
  EXPECT_GT(at(c) >> 16 & 255, 0x7fU + 20);  // towards its blue
  d.show(1, false);
  draw_cut(view, d, look, pixels);
  EXPECT_EQ(at(c), grey);
}

TEST(EditControl, WhatANetworkFindsIsOneStepAndItsDoubtfulPlacesAreListed) {
  Editor e;
  EditFound found;
  found.structures.frame = e.ct.frame;
  const auto v = make_voxels<std::uint8_t>(e.ct.frame.voxel_count());
  std::fill_n(v.get(), e.ct.frame.voxel_count(), std::uint8_t{0});
  v[40] = 7;
  found.structures.voxels = v;
  found.structures.structures = {{.value = 7, .name = "facial nerve", .rgb = {250, 220, 50}}};
  found.places = {{{1, 2, 3}, 7, "facial nerve", 5}};
  found.note = "facial nerve differs";
  e.control.find_structures("structures by ear", [&](const Context& context) {
    context.progress(0.5);
    return found;
  });
  EXPECT_TRUE(e.control.busy());
  EXPECT_NE(e.control.message().find("structures by ear"), std::string::npos);
  e.settle();
  EXPECT_EQ(e.document.steps(), 1U);
  EXPECT_EQ(e.document.undo_text(), "structures by ear");
  ASSERT_EQ(e.document.structures().size(), 1U);
  ASSERT_EQ(e.control.places.size(), 1U);
  // Its value in the document, not the network's.
  EXPECT_EQ(e.control.places[0].structure, e.document.structures()[0].is.value);
  EXPECT_EQ(e.document.labels()[40], e.document.structures()[0].is.value);
  EXPECT_NE(e.control.message().find("facial nerve differs"), std::string::npos);
  EXPECT_TRUE(e.control.unsaved());
  e.control.undo();
  EXPECT_TRUE(e.document.structures().empty());

  // Esc stops it, and an error is said; the document stays as it is in both.
  std::atomic<bool> begun{false};
  e.control.find_structures("structures by ear", [&](const Context& context) -> EditFound {
    begun = true;
    for (;;) {
      context.check_cancelled();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  while (!begun) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  e.control.cancel();
  e.settle();
  EXPECT_EQ(e.control.message(), "stopped; nothing was changed");
  e.control.find_structures("structures by ear",
                            [](const Context&) -> EditFound { throw Error(ExitCode::no_input, "no network there"); });
  e.settle();
  EXPECT_EQ(e.control.message(), "no network there");
  EXPECT_EQ(e.document.steps(), 0U);
  // What a run reported before it ended so is not the next one's.
  e.control.find_structures("structures by ear", [](const Context& context) -> EditFound {
    context.report("disagreement", std::string("of the first run"));
    throw Error(ExitCode::cancelled, "stopped");
  });
  e.settle();
  std::size_t reported = 99;
  e.control.find_structures("structures by ear", [&](const Context& context) {
    reported = context.take_report().size();
    return found;
  });
  e.settle();
  EXPECT_EQ(reported, 0U);
}

TEST(EditWorker, TheLatestPictureWins) {
  const Image ct = test::walnut({90, 80, 70});
  EditWorker worker;
  for (int lower = 200; lower <= 600; lower += 20)
    worker.preview({ct, ThresholdEdit{double(lower), 32767}, nullptr, {}, 50000});
  std::optional<Preview> last;
  while (worker.previewing() || !last) {
    if (auto p = worker.take_preview()) last = std::move(p);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (auto p = worker.take_preview()) last = std::move(p);
  const Preview wanted = make_preview({ct, ThresholdEdit{600, 32767}, nullptr, {}, 50000});
  EXPECT_EQ(last->bone.points_mm, wanted.bone.points_mm);
  EXPECT_EQ(last->bone.triangles, wanted.bone.triangles);
  EXPECT_GT(wanted.bone.triangles.size(), 1000U);
}

}  // namespace
}  // namespace osteo
