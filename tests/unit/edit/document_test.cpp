// Correcting a mask: each operation against what it must give by a slow and plain way, the history, and the file.
#include "osteo/imaging/edit/document.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "edit_subject.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/edit/edit_file.h"
#include "scratch.h"

namespace osteo {
namespace {

using test::oblique_frame;
using test::start_of;
using test::walnut;

TEST(BitMask, HoldsWhatBytesHoldWhateverTheWidth) {
  for (const int nx : {1, 7, 63, 64, 65, 130}) {
    const Image ct = walnut({nx, 9, 5});
    const BitMask mask(ct, 200, 900);
    std::uint64_t n = 0;
    for (int k = 0; k < 5; ++k) {
      for (int j = 0; j < 9; ++j) {
        for (int i = 0; i < nx; ++i) {
          const bool in = ct.at(i, j, k) >= 200 && ct.at(i, j, k) <= 900;
          EXPECT_EQ(mask.at(i, j, k), in);
          n += in ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(mask.count(), n);
    EXPECT_EQ(BitMask(ct.frame.dims, mask.bytes()), mask);
    std::uint64_t in_runs = 0, outside = 0;
    for (const auto& r : mask.runs(true)) in_runs += r.end - r.begin;
    for (const auto& r : mask.runs(false)) outside += r.end - r.begin;
    EXPECT_EQ(in_runs, n);
    EXPECT_EQ(outside, static_cast<std::uint64_t>(nx) * 45 - n);
  }
}

TEST(BitMask, ThresholdTakesNumbersThatAreNotWholeAndOnesThatNoVoxelHas) {
  const Image ct = walnut({40, 10, 4});
  EXPECT_EQ(BitMask(ct, 299.5, 5000), BitMask(ct, 300, 5000));
  EXPECT_EQ(BitMask(ct, -32768, 32767).count(), 1600U);
  EXPECT_EQ(BitMask(ct, 32767.5, 40000).count(), 0U);
}

TEST(BitMask, CoarseKeepsTheVolume) {
  const Image ct = walnut({70, 50, 30});
  const BitMask mask(ct, 300, 3000);
  for (const std::size_t most : {500U, 5000U, 1000000U}) {
    const CoarseMask c = coarse(mask, ct.frame, most), same = coarse(ct, 300, 3000, most, 1);
    EXPECT_LE(c.filled.size(), most);
    EXPECT_EQ(c.filled, same.filled);
    double sum = 0;
    for (const float f : c.filled) sum += static_cast<double>(f);
    EXPECT_NEAR(sum * c.frame.voxel_volume_mm3(), static_cast<double>(mask.count()) * ct.frame.voxel_volume_mm3(),
                1e-3 * static_cast<double>(mask.count()));
  }
}

TEST(EditDocument, BrushIsTheBallThatWasAskedFor) {
  for (const Frame& frame : {Frame{{40, 30, 20}, {0.5, 0.7, 1.1}, {-3, 4, 5}, {}}, oblique_frame({40, 30, 20})}) {
    const Image ct = test::flat(frame, 0);
    EditDocument d(ct, start_of(ct, 300));
    const Vec3 a = frame.world_from_index({10.3, 11.2, 9}), b = frame.world_from_index({24.1, 17.8, 12.4});
    const EditOutcome done = d.apply(BrushEdit{0, false, 3.2, {a, b}});
    EXPECT_TRUE(done.changed);
    // Points are kept to a micrometre.
    std::uint64_t n = 0, doubtful = 0;
    for (int k = 0; k < 20; ++k) {
      for (int j = 0; j < 30; ++j) {
        for (int i = 0; i < 40; ++i) {
          const Vec3 p = frame.world_from_index({double(i), double(j), double(k)});
          const double t = std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0, 1.0), r = length(p - a - (b - a) * t);
          if (std::abs(r - 3.2) < 0.003) {
            ++doubtful;
            continue;
          }
          EXPECT_EQ(d.bone().at(i, j, k), r < 3.2);
          n += r < 3.2 ? 1 : 0;
        }
      }
    }
    EXPECT_GT(n, 300U);
    EXPECT_NEAR(done.added_mm3, static_cast<double>(n) * frame.voxel_volume_mm3(),
                static_cast<double>(doubtful) * frame.voxel_volume_mm3() + 1e-9);
    // Drawn live, dab by dab, it is the same.
    EditDocument live(ct, start_of(ct, 300));
    live.begin_stroke(BrushEdit{0, false, 3.2, {}});
    live.add_point(a);
    live.add_point(b);
    EXPECT_TRUE(live.in_stroke());
    live.end_stroke();
    EXPECT_EQ(live.hash(), d.hash());
  }
}

TEST(EditDocument, BoxGoesByTheBodysAxesAlsoOnAnObliqueGrid) {
  const Image ct = test::flat(oblique_frame({30, 28, 26}), 1000);
  const Vec3 m = ct.frame.centre_mm();
  const BoxEdit box{{m.x - 4, m.y - 5, m.z - 3}, {m.x + 6, m.y + 2, m.z + 4}, BoxChoice::clear_inside};
  for (const BoxChoice choice : {BoxChoice::clear_inside, BoxChoice::keep_inside}) {
    EditDocument d(ct, start_of(ct, 300));
    BoxEdit b = box;
    b.choice = choice;
    d.apply(b);
    std::size_t inside = 0;
    for (int k = 0; k < 26; ++k) {
      for (int j = 0; j < 28; ++j) {
        for (int i = 0; i < 30; ++i) {
          const Vec3 p = ct.frame.world_from_index({double(i), double(j), double(k)});
          bool in = true;
          for (std::size_t a = 0; a < 3; ++a) in = in && p[a] >= b.lo_mm[a] && p[a] <= b.hi_mm[a];
          inside += in ? 1 : 0;
          EXPECT_EQ(d.bone().at(i, j, k), in == (choice == BoxChoice::keep_inside));
        }
      }
    }
    EXPECT_GT(inside, 100U);
  }
}

TEST(EditDocument, IslandsByClickAndBySize) {
  const Image ct = test::flat(Frame{{60, 20, 20}, {0.5, 0.5, 0.5}, {}, {}}, 0);
  EditDocument d(ct, start_of(ct, 300));
  const auto ball = [&](double x, double r) { d.apply(BrushEdit{0, false, r, {{x, 5, 5}}}); };
  ball(5, 3);
  ball(14, 2);
  ball(22, 1);
  const double all = d.volume_mm3(0);
  EditOutcome done = d.apply(IslandEdit{{14, 5, 5}, IslandChoice::remove});
  EXPECT_NEAR(done.removed_mm3, 4.0 / 3 * M_PI * 8, 3);
  EXPECT_NEAR(d.volume_mm3(0), all - done.removed_mm3, 1e-9);
  EXPECT_TRUE(d.undo());
  EXPECT_NEAR(d.volume_mm3(0), all, 1e-9);
  done = d.apply(IslandEdit{{14, 5, 5}, IslandChoice::keep});
  EXPECT_NEAR(d.volume_mm3(0), 4.0 / 3 * M_PI * 8, 3);
  d.undo();
  done = d.apply(IslandSizeEdit{10, 0});
  EXPECT_EQ(done.note, "1 component removed, 2 left");
  done = d.apply(IslandSizeEdit{0, 1});
  EXPECT_NEAR(d.volume_mm3(0), 4.0 / 3 * M_PI * 27, 6);
  // Where there is none, nothing is done, and it says why.
  const std::size_t steps = d.steps();
  done = d.apply(IslandEdit{{28, 1, 1}, IslandChoice::remove});
  EXPECT_FALSE(done.changed);
  EXPECT_EQ(done.note, "there is no bone at that point");
  EXPECT_EQ(d.steps(), steps);
}

TEST(EditDocument, FillsWhatIsEnclosedAndNotLarger) {
  const Image ct = test::flat(Frame{{50, 24, 24}, {1, 1, 1}, {}, {}}, 0);
  EditDocument d(ct, start_of(ct, 300));
  d.apply(BrushEdit{0, false, 9, {{12, 12, 12}, {36, 12, 12}}});
  const double solid = d.volume_mm3(0);
  d.apply(BrushEdit{0, true, 2, {{12, 12, 12}}});                 // 33 mm3
  d.apply(BrushEdit{0, true, 4, {{30, 12, 12}}});                 // 268 mm3
  d.apply(BrushEdit{0, true, 1.5, {{21, 12, 12}, {21, 12, 0}}});  // a bay: open to the outside
  const double bay = 2 * M_PI * 1.5 * 1.5;
  const double carved = d.volume_mm3(0);
  EditOutcome done = d.apply(FillEdit{100});
  EXPECT_EQ(done.note, "1 cavity filled, 1 larger left");
  EXPECT_NEAR(done.added_mm3, 33, 1);
  done = d.apply(FillEdit{1000});
  EXPECT_EQ(done.note, "1 cavity filled, 0 larger left");
  EXPECT_GT(d.volume_mm3(0), carved + 280);
  EXPECT_LT(d.volume_mm3(0), solid - bay);
}

// The same by the definition: all weights, voxel by voxel.
TEST(EditDocument, SmoothingIsTheWeightedMajorityAndStaysWithinItsLimit) {
  for (const auto& [spacing, radius] :
       {std::pair{Vec3{0.5, 0.5, 0.5}, 0.5}, {Vec3{0.5, 0.5, 1.25}, 1.3}, {Vec3{0.4, 0.6, 2}, 1.3}}) {
    Image ct = walnut({131, 37, 23});
    ct.frame.spacing_mm = spacing;
    EditDocument d(ct, start_of(ct, 300));
    const BitMask before = d.bone();
    const EditOutcome done = d.apply(SmoothEdit{radius});
    EXPECT_TRUE(done.changed);
    EXPECT_GT(done.added_mm3 + done.removed_mm3, 0);
    std::array<int, 3> n{};
    std::array<std::vector<double>, 3> weight;
    double total = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      n[a] = static_cast<int>(std::floor(radius / spacing[a] + 1e-9));
      for (int i = 0; i <= 2 * n[a]; ++i)
        weight[a].push_back(std::tgamma(2 * n[a] + 1) / (std::tgamma(i + 1) * std::tgamma(2 * n[a] - i + 1)));
      total *= std::pow(4, n[a]);
    }
    for (int k = 0; k < 23; ++k) {
      for (int j = 0; j < 37; ++j) {
        for (int i = 0; i < 131; ++i) {
          double sum = 0;
          for (int dk = -n[2]; dk <= n[2]; ++dk) {
            for (int dj = -n[1]; dj <= n[1]; ++dj) {
              for (int di = -n[0]; di <= n[0]; ++di) {
                const bool in =
                    before.at(std::clamp(i + di, 0, 130), std::clamp(j + dj, 0, 36), std::clamp(k + dk, 0, 22));
                sum += in ? std::round(weight[0][static_cast<std::size_t>(di + n[0])]) *
                                std::round(weight[1][static_cast<std::size_t>(dj + n[1])]) *
                                std::round(weight[2][static_cast<std::size_t>(dk + n[2])])
                          : 0;
              }
            }
          }
          const bool wanted = 2 * sum == total ? before.at(i, j, k) : 2 * sum > total;
          ASSERT_EQ(d.bone().at(i, j, k), wanted) << i << " " << j << " " << k << " radius " << radius;
        }
      }
    }
  }
  Image ct = walnut({20, 20, 20});
  EditDocument d(ct, start_of(ct, 300));
  EXPECT_THROW(static_cast<void>(d.apply(SmoothEdit{0.05})), Error);
}

TEST(EditDocument, StructuresAreAddedPaintedChangedAndDeleted) {
  const Image ct = walnut({40, 30, 20});
  EditDocument d(ct, start_of(ct, 300));
  const std::string start = d.hash();
  EXPECT_EQ(d.free_value(), 1);
  d.apply(AddStructureEdit{1, "facial nerve", {250, 220, 40}, StructureRole::at_risk});
  d.apply(AddStructureEdit{2, "helper", {1, 2, 3}, StructureRole::landmark});
  EXPECT_THROW(static_cast<void>(d.apply(AddStructureEdit{2, "another", {1, 2, 3}, StructureRole::landmark})), Error);
  EXPECT_THROW(static_cast<void>(d.apply(AddStructureEdit{3, "helper", {1, 2, 3}, StructureRole::landmark})), Error);
  EXPECT_THROW(static_cast<void>(d.apply(BrushEdit{7, false, 2, {{5, 5, 5}}})), Error);
  const Vec3 at = ct.frame.world_from_index({20, 15, 10});
  const EditOutcome painted = d.apply(BrushEdit{1, false, 3, {at}});
  EXPECT_NEAR(painted.added_mm3, d.volume_mm3(1), 1e-9);
  EXPECT_GT(d.volume_mm3(1), 50);
  const std::string bone_only = EditDocument(ct, start_of(ct, 300)).bone_labels().structures.empty() ? d.hash() : "";
  d.apply(BrushEdit{2, false, 1, {at}});
  const double left = d.volume_mm3(1);
  EXPECT_LT(left, painted.added_mm3);
  d.apply(BrushEdit{1, true, 10, {at}});  // takes only what is structure 1
  EXPECT_EQ(d.volume_mm3(1), 0);
  EXPECT_GT(d.volume_mm3(2), 0);
  d.undo();
  d.undo();
  EXPECT_EQ(d.hash(), bone_only);
  d.apply(ChangeStructureEdit{1, "chorda", {9, 9, 9}, StructureRole::landmark});
  EXPECT_EQ(d.structure(1)->is.name, "chorda");
  EXPECT_TRUE(d.structure_labels(StructureRole::at_risk).structures.empty());
  d.undo();
  const Labels out = d.structure_labels(StructureRole::at_risk);
  ASSERT_EQ(out.structures.size(), 1U);
  EXPECT_EQ(out.structures[0].name, "facial nerve");
  EXPECT_EQ(out.at(20, 15, 10), 1);
  d.apply(AddStructureEdit{3, "never painted", {1, 2, 3}, StructureRole::at_risk});
  EXPECT_EQ(d.structure_labels(StructureRole::at_risk).structures.size(), 1U);
  d.undo();
  d.apply(DeleteStructureEdit{1});
  EXPECT_EQ(d.structure(1), nullptr);
  EXPECT_EQ(d.volume_mm3(1), 0);
  d.undo();
  EXPECT_NEAR(d.volume_mm3(1), painted.added_mm3, 1e-9);
  while (d.undo()) {
  }
  EXPECT_EQ(d.hash(), start);
}

// What a network finds comes as one step, in place of structures of the same names.
TEST(EditDocument, StructuresOfALabelMapAreOneStep) {
  const Image ct = walnut({20, 18, 16});
  EditDocument d(ct, start_of(ct, 300));
  d.apply(AddStructureEdit{4, "nerve", {9, 8, 7}, StructureRole::landmark});
  d.apply(BrushEdit{4, false, 1, {ct.frame.world_from_index({3, 3, 3})}});
  const std::string before = d.hash();
  Labels found;
  found.frame = ct.frame;
  const auto v = make_voxels<std::uint8_t>(ct.frame.voxel_count());
  std::fill_n(v.get(), ct.frame.voxel_count(), std::uint8_t{0});
  // The sinus where the old nerve was: deleting the one must not take of the other.
  v[static_cast<std::ptrdiff_t>(found.offset(3, 3, 3))] = 2;
  v[static_cast<std::ptrdiff_t>(found.offset(9, 9, 9))] = 1;
  found.voxels = v;
  found.structures = {{.value = 1, .name = "nerve", .rgb = {1, 2, 3}},
                      {.value = 2, .name = "sinus", .rgb = {4, 5, 6}},
                      {.value = 3, .name = "none", .rgb = {}}};
  const EditOutcome done = d.apply_together(structures_of(found, d), "structures by a network");
  EXPECT_TRUE(done.changed);
  EXPECT_EQ(d.steps(), 3U);
  EXPECT_EQ(d.undo_text(), "structures by a network");
  ASSERT_EQ(d.structures().size(), 2U);
  ASSERT_NE(d.structure(4), nullptr);
  EXPECT_EQ(d.structure(4)->is.name, "nerve");
  EXPECT_EQ(d.structure(4)->is.rgb, (std::array<std::uint8_t, 3>{9, 8, 7}));
  EXPECT_EQ(d.structure(4)->role, StructureRole::landmark);
  EXPECT_EQ(d.labels()[found.offset(9, 9, 9)], 4);
  EXPECT_EQ(d.labels()[found.offset(3, 3, 3)], d.structures()[0].is.value);
  EXPECT_EQ(d.structures()[0].is.name, "sinus");
  EXPECT_DOUBLE_EQ(d.volume_mm3(4), ct.frame.voxel_volume_mm3());
  const std::string after = d.hash();
  EXPECT_TRUE(d.undo());
  EXPECT_EQ(d.hash(), before);
  EXPECT_EQ(d.redo_text(), "structures by a network");
  EXPECT_TRUE(d.redo());
  EXPECT_EQ(d.hash(), after);
  // What a file holds of it leads there as well.
  EditDocument again(ct, start_of(ct, 300));
  apply_edits(again, recipe_of(d));
  EXPECT_EQ(again.hash(), after);

  // One that cannot be done undoes those before it.
  const std::vector<EditOperation> bad{DeleteStructureEdit{4}, VoxelsEdit{4, "0 1"}};
  EXPECT_THROW(d.apply_together(bad, "x"), Error);
  EXPECT_THROW(d.apply_together({ThresholdEdit{}}, "x"), Error);
  EXPECT_EQ(d.hash(), after);
  EXPECT_EQ(d.steps(), 3U);
  found.frame.origin_mm.x += 1;
  EXPECT_THROW(static_cast<void>(structures_of(found, d)), Error);
}

// What a network says of a structure goes along into the file, and files of before have none of it.
TEST(EditFile, WhatAProgramSaysOfAStructureIsKept) {
  const Image ct = walnut({20, 18, 16});
  EditDocument d(ct, start_of(ct, 300));
  Labels found;
  found.frame = ct.frame;
  const auto v = make_voxels<std::uint8_t>(ct.frame.voxel_count());
  std::fill_n(v.get(), ct.frame.voxel_count(), std::uint8_t{0});
  v[100] = 1, v[200] = 2;
  found.voxels = v;
  found.structures = {
      {.value = 1, .name = "nerve", .origin = "a network, version 1", .within_mm = 0.6, .doubt = "short \"x\""},
      {.value = 2,
       .name = "sinus",
       .origin = "a network, version 1",
       .within_mm = std::numeric_limits<double>::infinity()}};
  d.apply_together(structures_of(found, d), "structures by a network");
  d.apply(AddStructureEdit{9, "drawn", {1, 2, 3}, StructureRole::at_risk});
  const std::string text = edits_text(recipe_of(d));
  std::vector<AddStructureEdit> read;
  for (const EditOperation& o : parse_edits(text, "edits.json").operations)
    if (const auto* const add = std::get_if<AddStructureEdit>(&o)) read.push_back(*add);
  ASSERT_EQ(read.size(), 3U);
  EXPECT_EQ(read[0].origin, "a network, version 1");
  EXPECT_EQ(read[0].within_mm, 0.6);
  EXPECT_EQ(read[0].doubt, "short \"x\"");
  EXPECT_LT(read[1].within_mm, 0);
  EXPECT_EQ(read[1].doubt, "");
  EXPECT_EQ(read[2].origin, "");
  // As files of before have it.
  const std::string drawn = text.substr(text.find("drawn"));
  EXPECT_EQ(drawn.find("origin"), std::string::npos) << drawn;
}

TEST(EditDocument, TakesOverStructuresAlsoFromAnotherGrid) {
  const Image ct = walnut({40, 30, 20});
  Labels coarse_map;
  coarse_map.frame = Frame{{20, 15, 10}, ct.frame.spacing_mm * 2, ct.frame.world_from_index({0.5, 0.5, 0.5}), {}};
  const auto v = make_voxels<std::uint8_t>(3000);
  std::fill_n(v.get(), 3000, std::uint8_t{0});
  v[(5 * 15 + 7) * 20 + 10] = 9;
  coarse_map.voxels = v;
  EditDocument d(ct, start_of(ct, 300), &coarse_map);
  EXPECT_NEAR(d.volume_mm3(9), 8 * ct.frame.voxel_volume_mm3(), 1e-9);
  ASSERT_NE(d.structure(9), nullptr);
  EXPECT_EQ(d.structure(9)->is.name, "structure 9");
  // And what another program found, as voxels.
  const VoxelsEdit found = voxels_of(d.structure_labels(StructureRole::at_risk), 9, 4);
  d.apply(AddStructureEdit{4, "found", {1, 1, 1}, StructureRole::at_risk});
  d.apply(found);
  EXPECT_NEAR(d.volume_mm3(4), 8 * ct.frame.voxel_volume_mm3(), 1e-9);
  EXPECT_EQ(d.volume_mm3(9), 0);
  EXPECT_THROW(static_cast<void>(d.apply(VoxelsEdit{4, "23999 2"})), Error);
  EXPECT_THROW(static_cast<void>(d.apply(VoxelsEdit{4, "1 x"})), Error);
  EXPECT_TRUE(d.apply(VoxelsEdit{4, "23999 1"}).changed);
}

TEST(EditDocument, AThresholdCanKeepWhatWasDoneAfterTheLast) {
  const Image ct = walnut({40, 30, 20});
  EditDocument d(ct, start_of(ct, 300));
  const Vec3 air = ct.frame.world_from_index({2, 2, 2});
  d.apply(BrushEdit{0, false, 1.5, {air}});
  const EditOutcome both = d.commit(d.plan(d.with_later_steps({500, 32767})));
  EXPECT_TRUE(both.changed);
  EXPECT_EQ(both.text, "threshold from 500 HU");
  EXPECT_TRUE(d.bone().at(2, 2, 2));
  EXPECT_EQ(d.operations().size(), 2U);  // the first stroke is vain since
  const std::string kept = d.hash();
  d.apply(ThresholdEdit{500, 32767});
  EXPECT_FALSE(d.bone().at(2, 2, 2));
  EXPECT_EQ(d.operations().size(), 1U);
  d.undo();
  EXPECT_EQ(d.hash(), kept);
  d.undo();
  EXPECT_TRUE(d.bone().at(2, 2, 2));
  EXPECT_EQ(d.steps(), 1U);
}

TEST(EditDocument, AStalePlanIsRefusedAndACancelledOneDoesNothing) {
  const Image ct = walnut({40, 30, 20});
  EditDocument d(ct, start_of(ct, 300));
  BonePlan plan = d.plan({FillEdit{100}});
  d.apply(BrushEdit{0, false, 1.5, {ct.frame.world_from_index({2, 2, 2})}});
  const std::string hash = d.hash();
  EXPECT_THROW(d.commit(std::move(plan)), Error);
  std::atomic<bool> stop{true};
  Context context;
  context.set_cancel_flag(&stop);
  EXPECT_THROW(static_cast<void>(d.apply(FillEdit{100}, context)), Error);
  EXPECT_EQ(d.hash(), hash);
  EXPECT_EQ(d.steps(), 1U);
}

TEST(EditFile, SavedAndDoneAgainItIsTheSameBitForBit) {
  const Image ct = walnut({50, 40, 30});
  const Labels start = start_of(ct, 300);
  EditDocument d(ct, start);
  std::mt19937 random(7);
  for (int i = 0; i < 60; ++i) test::random_action(d, random);
  d.apply(AddStructureEdit{d.free_value(), "last \xc3\xa9", {1, 2, 3}, StructureRole::at_risk});
  d.show(d.structures().back().is.value, false);
  const std::string text = edits_text(recipe_of(d));
  for (const int threads : {1, 3}) {
    EditDocument again(ct, start);
    Context context;
    context.threads = threads;
    apply_edits(again, parse_edits(text, "edits.json"), context);
    EXPECT_EQ(again.hash(), d.hash());
    EXPECT_FALSE(again.structures().back().shown);
    EXPECT_EQ(edits_text(recipe_of(again)), text);
    while (again.undo()) {
    }
    EXPECT_EQ(again.hash(), again.start_hash());
  }
}

TEST(EditFile, AnotherScanIsRefusedAnotherStartIsTold) {
  const Image ct = walnut({40, 30, 20});
  EditDocument d(ct, start_of(ct, 300));
  d.apply(BrushEdit{0, true, 4, {ct.frame.centre_mm()}});
  const EditRecipe recipe = recipe_of(d);
  Image other = walnut({40, 30, 20}, 2);
  EditDocument wrong(other, start_of(other, 300));
  try {
    apply_edits(wrong, recipe);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    EXPECT_NE(std::string(e.what()).find("another CT"), std::string::npos);
  }
  Image moved = ct;
  moved.frame.origin_mm.x += 1;
  EditDocument shifted(moved, start_of(moved, 300));
  EXPECT_THROW(apply_edits(shifted, recipe), Error);
  std::string warned;
  Context context;
  context.on_log([&](LogLevel, std::string_view text) { warned += text; });
  EditDocument lower(ct, start_of(ct, 200));
  apply_edits(lower, recipe, context);
  EXPECT_NE(warned.find("began from another mask"), std::string::npos);
  EXPECT_FALSE(lower.bone().at(20, 15, 10));
  EditRecipe spoilt = recipe;
  std::get<BrushEdit>(spoilt.operations[0]).radius_mm = 5;
  EditDocument fresh(ct, start_of(ct, 300));
  try {
    apply_edits(fresh, spoilt);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::corrupt);
  }
}

TEST(EditFile, IsReadStrictly) {
  const Image ct = walnut({20, 20, 20});
  EditDocument d(ct, start_of(ct, 300));
  d.apply(BrushEdit{0, true, 2, {ct.frame.centre_mm()}});
  d.apply(ThresholdEdit{250, 2000});
  const std::string good = edits_text(recipe_of(d));
  static_cast<void>(parse_edits(good, "e"));
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& why) {
    std::string text = good;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    try {
      static_cast<void>(parse_edits(text, "e.json"));
      FAIL() << text;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("e.json"), std::string::npos) << e.what();
      EXPECT_NE((std::string(e.what()) + e.advice()).find(why), std::string::npos) << e.what() << " | " << e.advice();
    }
  };
  refused("\"threshold\"", "\"treshold\"", "did you mean 'threshold'");
  refused("\"lower_hu\":250.0", "\"lower_hu\":2500", "above its upper");
  refused("\"lower_hu\":250.0,", "", "lower_hu");
  refused("\"lower_hu\":250.0", "\"lower_hu\":250,\"extra\": 1", "extra");
  refused("\"hidden\": []", "\"hidden\": [300]", "hidden");
  refused("\"osteotome_edits\": 1", "\"osteotome_edits\": 2", "osteotome_edits");
}

TEST(EditHistory, ForgetsWhatItMayAndMakesItAgain) {
  const Image ct = walnut({72, 64, 50});
  const Labels start = start_of(ct, 300);
  EditDocument all(ct, start), little(ct, start, nullptr, {20000});
  std::mt19937 a(3), b(3);
  std::vector<std::string> states{all.hash()};
  for (int i = 0; i < 40; ++i) {
    test::random_action(all, a, false);
    test::random_action(little, b, false);
    if (all.steps() == states.size()) states.push_back(all.hash());
  }
  ASSERT_GT(all.history_bytes(), 60000U);
  EXPECT_LT(little.history_bytes(), all.history_bytes() / 2);
  EXPECT_EQ(little.hash(), all.hash());
  for (std::size_t s = states.size() - 1; s-- > 0;) {
    ASSERT_TRUE(little.undo());
    ASSERT_EQ(little.hash(), states[s]) << s;
  }
  EXPECT_FALSE(little.undo());
  for (std::size_t s = 1; s < states.size(); ++s) {
    ASSERT_TRUE(little.redo());
    ASSERT_EQ(little.hash(), states[s]) << s;
  }
  EXPECT_FALSE(little.redo());
}

// Random actions; undone to the start it is the start, done again it is the end, and so it is from the file.
// OSTEO_EDIT_ACTIONS=100000 for the long one.
TEST(EditFuzz, UndoToTheStartIsTheStart) {
  const char* const wanted = std::getenv("OSTEO_EDIT_ACTIONS");
  const int actions = wanted != nullptr ? std::atoi(wanted) : 1500;
  const Image ct = walnut({40, 36, 30});
  const Labels start = start_of(ct, 300);
  EditDocument d(ct, start);
  const std::string first = d.hash();
  std::mt19937 random(11);
  std::vector<std::string> at_step{first};  // the state after so many steps, where it is known
  for (int i = 0; i < actions; ++i) {
    const std::size_t before = d.steps();
    test::random_action(d, random, true);
    const std::size_t now = d.steps();
    if (i % 16 != 0 && now > before) continue;
    if (now < before && now < at_step.size() && !at_step[now].empty()) {
      ASSERT_EQ(d.hash(), at_step[now]) << "action " << i;
    }
    at_step.resize(now + 1);
    at_step[now] = d.hash();
  }
  const std::string last = d.hash();
  const std::size_t steps = d.steps();
  const std::string file = edits_text(recipe_of(d));
  while (d.undo()) {
  }
  EXPECT_EQ(d.hash(), first);
  std::size_t redone = 0;
  while (d.steps() < steps && d.redo()) ++redone;
  EXPECT_EQ(redone, steps);
  EXPECT_EQ(d.hash(), last);
  EditDocument again(ct, start);
  apply_edits(again, parse_edits(file, "edits.json"));
  EXPECT_EQ(again.hash(), last);
  if (wanted != nullptr)
    std::printf("%d actions, %zu steps, history %.1f MB\n", actions, steps,
                static_cast<double>(d.history_bytes()) / 1e6);
}

}  // namespace
}  // namespace osteo
