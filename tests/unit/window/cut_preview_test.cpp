// What the saw would cut is said before it does.
#include "cut_preview.h"

#include <gtest/gtest.h>

#include <cmath>

#include "bar.h"
#include "scratch.h"
#include "work_done.h"

namespace osteo {
namespace {

// A nerve of 1 mm along y through the bar, at x 3.
StructureMap nerve() {
  Labels l;
  constexpr double h = 0.4;
  l.frame.dims = {100, 60, 50};
  l.frame.spacing_mm = {h, h, h};
  l.frame.origin_mm = Vec3{-49.5, -29.5, -24.5} * h;
  const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < l.frame.dims[2]; ++k)
    for (int j = 0; j < l.frame.dims[1]; ++j)
      for (int i = 0; i < l.frame.dims[0]; ++i) {
        const Vec3 p = l.frame.world_from_index({double(i), double(j), double(k)});
        v[at++] = std::hypot(p.x - 3, p.z) < 1 ? 1 : 0;
      }
  l.voxels = v;
  l.structures = {{1, "facial nerve", {}}};
  return StructureMap(l);
}

TEST(CutPreview, SaysWhatWouldBeCutAndWhatIsNearest) {
  const World world(test::bar(0.5, 0));
  const StructureMap map = nerve();
  const std::string bone = world.hash();
  CutPreview preview;
  SawCut cut{{3, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1};
  preview.look(world, &map, cut, 0);
  EXPECT_TRUE(preview.cuts());
  EXPECT_EQ(preview.text().find("would cut the facial nerve ("), 0U) << preview.text();
  // The same plane is not looked at again, another one soon.
  cut.at_mm.x = 6;
  preview.look(world, &map, cut, 0.01);
  EXPECT_TRUE(preview.cuts());
  preview.look(world, &map, cut, 0.01 + CutPreview::kEveryS);
  EXPECT_FALSE(preview.cuts());
  EXPECT_TRUE(preview.text() == "nearest: the facial nerve, 1.5 mm" ||
              preview.text() == "nearest: the facial nerve, 1.4 mm" ||
              preview.text() == "nearest: the facial nerve, 1.6 mm")
      << preview.text();
  cut.at_mm.x = -13;
  preview.look(world, &map, cut, 2);
  EXPECT_EQ(preview.text(), "no structure within 5 mm");
  // No bone, no blade; no structures, nothing to say.
  cut.at_mm.x = 18;
  preview.look(world, &map, cut, 4);
  EXPECT_EQ(preview.text(), "");
  cut.at_mm.x = 3;
  preview.look(world, &map, cut, 6);
  EXPECT_TRUE(preview.cuts());
  preview.look(world, nullptr, cut, 8);
  EXPECT_FALSE(preview.cuts());
  EXPECT_EQ(world.hash(), bone) << "nothing was cut";
}

TEST(CutPreview, TheEndPageTellsOfACut) {
  SessionFacts facts;
  facts.has_structures = true;
  facts.structures = {{"sigmoid sinus", 1.5, 0, 0}};
  facts.structures.push_back({"dura", 0, 2, 1.5});
  facts.add_cut("facial nerve", "saw", 0.25);
  facts.add_cut("facial nerve", "saw", 0.25);
  facts.add_cut("dura", "burr", 3.1);
  facts.add_cut("chorda", "shaft", 1);
  facts.add_cut("malleus", "shaft", 0);
  const EndFacts end = end_facts(facts, WorkDone());
  const auto line = [&](const std::string& what) {
    for (const EndLine& l : end.lines) {
      if (l.what == what) return l;
    }
    return EndLine{};
  };
  EXPECT_EQ(line("facial nerve").value, "INJURED: cut through by the saw, 0.5 mm³ of it");
  EXPECT_EQ(line("dura").value, "INJURED: touched by the rotating burr for 1.50 s, 3.1 mm³ of it");
  EXPECT_EQ(line("chorda").value, "INJURED: the shaft went through it, 1 mm³ of it");
  EXPECT_EQ(line("malleus").value, "contact with the shaft");
  EXPECT_EQ(line("malleus").nearness, Nearness::close);
  EXPECT_EQ(line("facial nerve").nearness, Nearness::touched);
  EXPECT_EQ(line("sigmoid sinus").value, "never nearer than 1.5 mm");
  EXPECT_TRUE(line("critical structures").value.empty());
}

// A folder that was deleted while the session ran was told as kept.
TEST(EndPage, SaysKeptOnlyOfWhatIsThere) {
  const test::ScratchFolder scratch;
  EXPECT_EQ(kept_text(scratch.path()), "What was recorded is kept: " + scratch.path().string());
  EXPECT_EQ(kept_text(scratch / "1"), "Nothing of it is kept: " + (scratch / "1").string() + " was deleted or moved");
}

}  // namespace
}  // namespace osteo
