#include "looks.h"

#include <gtest/gtest.h>

namespace osteo {
namespace {

TEST(Looks, AreReadBackAsTheyWereNoted) {
  CutsLook cuts;
  cuts.window_hu = 350.5;
  cuts.level_hu = -40;
  cuts.preset = 1;
  cuts.along_tool = true;
  cuts.follow = cuts.removed = false;
  const Note notes[] = {{1, "structure", note_of(7, "sigmoid sinus", StructureLook::hidden)},
                        {2, "cuts", note_of(CutsLook{})},
                        {3, "camera", "{}"},
                        {4, "structure", note_of(6, "a \"nerve\"", StructureLook::clear)},
                        {5, "structure", note_of(7, "sigmoid sinus", StructureLook::clear)},
                        {6, "cuts", note_of(cuts)},
                        {7, "structure", R"({"structure":300,"name":"","look":"clear"})"},
                        {8, "structure", R"({"structure":8,"name":"","look":"loud"})"},
                        {9, "cuts", "yes"}};
  const Looks looks = looks_of(notes);
  EXPECT_EQ(looks.structures,
            (std::map<std::uint8_t, StructureLook>{{6, StructureLook::clear}, {7, StructureLook::clear}}));
  ASSERT_TRUE(looks.cuts);
  EXPECT_EQ(*looks.cuts, cuts);
  EXPECT_EQ(looks.unreadable, 3U);
  EXPECT_FALSE(looks_of({}).cuts);
}

TEST(Looks, OfCutsAreNotedOnceTheyHaveSettled) {
  CutsNotes notes;
  notes.begin();
  CutsLook look;
  EXPECT_FALSE(notes.next(look, 0));
  EXPECT_FALSE(notes.next(look, 5));  // as usual
  look.level_hu = 500;
  EXPECT_FALSE(notes.next(look, 6));
  look.level_hu = 520;
  EXPECT_FALSE(notes.next(look, 6.4));
  EXPECT_FALSE(notes.next(look, 6.8));
  EXPECT_EQ(notes.next(look, 7), note_of(look));
  EXPECT_FALSE(notes.next(look, 8));
  notes.begin();  // another session: said again
  EXPECT_FALSE(notes.next(look, 9));
  EXPECT_TRUE(notes.next(look, 10));
}

}  // namespace
}  // namespace osteo
