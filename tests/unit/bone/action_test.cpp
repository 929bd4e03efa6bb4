#include "osteo/simulation/bone/action.h"

#include <gtest/gtest.h>

#include <set>

#include "bar.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/world.h"

namespace osteo {
namespace {

using test::bar;

TEST(Action, EveryKindHasItsRowUnderItsNumberAndName) {
  ASSERT_EQ(action_table().size(), static_cast<std::size_t>(ActionKind::behind_last) - 1);
  std::set<std::string_view> names;
  std::uint32_t number = 1;
  for (const ActionRow& row : action_table()) {
    EXPECT_EQ(static_cast<std::uint32_t>(row.kind), number);
    EXPECT_EQ(find_row(number++), &row);
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_FALSE(row.help.empty());
    EXPECT_LE(row.values.size(), SceneAction{}.values.size());
    for (const ActionValue& v : row.values) EXPECT_TRUE(!v.name.empty() && !v.unit.empty()) << row.name;
    EXPECT_EQ(name_of(SceneAction::plain(row.kind)), row.name);
  }
  EXPECT_EQ(find_row(0), nullptr);
  EXPECT_EQ(find_row(number), nullptr);
  SceneAction later;
  later.kind = number;
  EXPECT_EQ(name_of(later), "?");
  EXPECT_FALSE(World(bar(0.5, 0.4)).act(later).done);
}

// What a row says of a kind is what World::act does: each is done once, in a world where it can be.
TEST(Action, RowsSayWhatTheWorldDoes) {
  const SawCut middle{{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1.0};
  const RigidTransform shifted{Mat3{}, {0, 0, 3}};
  const auto plate = std::uint32_t{0};
  const SceneAction lying = SceneAction::attach(plate, {{}, {-8, 0, 4}}, 0);
  for (const ActionRow& row : action_table()) {
    World w(bar(0.5, 0.4));
    SceneAction a = SceneAction::plain(row.kind);
    switch (row.kind) {
      case ActionKind::saw:
        a = SceneAction::saw(middle);
        break;
      case ActionKind::split:
        w.act(SceneAction::saw(middle));
        a = SceneAction::split(1);
        break;
      case ActionKind::move:
        a = SceneAction::move(0, shifted);
        break;
      case ActionKind::grip:
        a = SceneAction::grip(plate);
        break;
      case ActionKind::guide:
        a.item = 1;  // leads hand 0
        break;
      case ActionKind::cutting_guide:
        a = SceneAction::cutting_guide({{2, 0, 0}, {1, 0, 0}, 2});
        break;
      case ActionKind::attach:
        a = lying;
        break;
      case ActionKind::detach:
        ASSERT_TRUE(w.act(lying).done);
        a = SceneAction::detach(1);
        break;
      case ActionKind::open: {
        w.act(SceneAction::saw(middle));
        w.act(SceneAction::split(1));
        const auto distractor = static_cast<std::uint32_t>(plate_index("distractor"));
        const auto put = w.act(SceneAction::attach(distractor, {{}, {2, 0, 4}}, 0, 1));
        ASSERT_TRUE(put.done) << put.message;
        a = SceneAction::open(1, 3);
        break;
      }
      case ActionKind::undo:
        w.act(SceneAction::saw(middle));
        break;
      case ActionKind::posture:
        EXPECT_FALSE(w.act(a).done) << "nothing is down";
        a = SceneAction::posture({0, 0, -1});
        break;
      default:
        break;
    }
    ASSERT_TRUE(w.act(SceneAction::plain(ActionKind::hold)).done);
    const std::string before = w.hash();
    const auto effect = w.act(a);
    EXPECT_EQ(effect.done, !row.by_servo) << row.name << ": " << effect.message;
    EXPECT_EQ(w.hash() != before, row.changes_world) << row.name;
    EXPECT_EQ(w.held(), !row.ends_hold) << row.name;
    // Who finds another bone than before must not be overtaken by the burr.
    EXPECT_TRUE(effect.changed.empty() || row.reads_bone) << row.name;
    EXPECT_TRUE(!row.changes_world || row.changes_touch) << row.name;
  }
}

TEST(Action, HandsHoldTheirOwnPlates) {
  World w(bar(0.5, 0.4));
  ASSERT_TRUE(w.act(SceneAction::grip(2, {}, 1)).done);
  EXPECT_EQ(w.grip(0).plate, SceneAction::kNobody);
  EXPECT_EQ(w.grip(1).plate, 2u);
  EXPECT_FALSE(w.act(SceneAction::grip(2, {}, kMaxHands)).done);
  SceneAction attach = SceneAction::attach(2, {{}, {-8, 0, 4}}, 0);
  ASSERT_TRUE(w.act(attach).done);
  EXPECT_EQ(w.grip(1).plate, 2u) << "it was another hand's";
  attach.hand = 1;
  ASSERT_TRUE(w.act(attach).done);
  EXPECT_EQ(w.grip(1).plate, SceneAction::kNobody);
}

}  // namespace
}  // namespace osteo
