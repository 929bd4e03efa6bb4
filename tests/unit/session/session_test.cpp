#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/session/haptic_settings.h"
#include "osteo/session/recorder.h"
#include "osteo/session/script_file.h"
#include "osteo/session/session_file.h"

namespace osteo {
namespace {

fs::path fresh(const std::string& name) {
  const auto p = fs::temp_directory_path() / ("osteo-session-" + std::to_string(::getpid()) + "-" + name);
  fs::remove_all(p);
  return p;
}

std::vector<TickRecord> some_ticks(std::uint64_t first, std::size_t n) {
  std::vector<TickRecord> t(n);
  for (std::size_t i = 0; i < n; ++i) {
    t[i].tick = first + i;
    t[i].device.position_mm = {static_cast<float>(i), 0.1F, -3};
    t[i].removed_mm3 = 0.25F;
  }
  return t;
}

SessionHeader header() {
  SessionHeader h;
  h.program_version = "test";
  h.bone_hash = "abc";
  h.rate_hz = 2000;
  h.haptics.params.contact.stiffness_n_per_mm = 1.25;
  return h;
}

TEST(HapticSettings, HardnessIsAutomaticUnlessSaid) {
  const auto file = fresh("hardness.json"), law = fresh("law.json");
  std::ofstream(law) << R"({"osteotome_hardness": 1, "exponent": 2})";
  const auto loaded = [&](const std::string& settings) {
    std::ofstream(file) << R"({"osteotome_haptics": 1, )" + settings + "}";
    HapticSetup setup;
    load_haptic_settings(file, setup);
    return setup;
  };
  EXPECT_FALSE(HapticSetup{}.hardness.has_value());
  EXPECT_EQ(loaded(R"("hardness": true)").hardness, true);
  EXPECT_EQ(loaded(R"("hardness": false)").hardness, false);
  EXPECT_FALSE(loaded(R"("hardness": "auto")").hardness.has_value());
  EXPECT_EQ(parse_hardness(loaded("\"hardness_file\": \"" + law.filename().string() + "\"").hardness_json, "").exponent, 2);
  EXPECT_THROW(loaded(R"("hardness": "yes")"), Error);
  EXPECT_THROW(loaded(R"("hardness": 1)"), Error);
  std::ofstream(law) << R"({"osteotome_hardness": 1, "exponent": 20})";
  EXPECT_THROW(loaded("\"hardness_file\": \"" + law.filename().string() + "\""), Error);
  // What is printed can be read again, and says the same.
  for (const std::optional<bool> on : {std::optional<bool>{}, std::optional<bool>{true}, std::optional<bool>{false}}) {
    HapticSetup setup;
    setup.hardness = on;
    std::ofstream(file) << haptic_settings_json(setup);
    HapticSetup again;
    again.hardness = false;
    load_haptic_settings(file, again);
    EXPECT_EQ(again.hardness, on);
  }
  fs::remove(file);
  fs::remove(law);
}

TEST(SessionFile, KeepsTheLawOfHardness) {
  const auto path = fresh("law");
  SessionHeader h = header();
  h.haptics.hardness = true;
  h.haptics.hardness_json = default_hardness_json();
  { const SessionWriter w(path, h); }
  EXPECT_EQ(read_session(path).header.haptics.hardness, true);
  EXPECT_EQ(read_session(path).header.haptics.hardness_json, default_hardness_json());
  fs::remove(path);
}

TEST(SessionFile, RoundTrip) {
  const auto path = fresh("round");
  {
    SessionWriter w(path, header());
    w.append(some_ticks(0, 100), std::vector<VoxelChange>{{5, 0.5F}, {3, 0.9F}, {5, 0.25F}});
    w.append(some_ticks(100, 7), {});
    w.finish({107, "bone", "surface", 26.75, {}});
  }
  const Session s = read_session(path);
  EXPECT_EQ(s.header.rate_hz, 2000);
  EXPECT_EQ(s.header.haptics.params.contact.stiffness_n_per_mm, 1.25);
  ASSERT_EQ(s.ticks.size(), 107u);
  EXPECT_EQ(s.ticks[42].device.position_mm[0], 42.0F);
  ASSERT_EQ(s.changes.size(), 2u);  // the last of each voxel
  EXPECT_EQ(s.changes[1].voxel, 5u);
  EXPECT_EQ(s.changes[1].density, 0.25F);
  ASSERT_TRUE(s.end.has_value());
  EXPECT_EQ(s.end->surface_hash, "surface");
}

TEST(SessionFile, ActionsStandBetweenTheChangesAroundThem) {
  const auto path = fresh("actions");
  {
    StreamReader reader(1 << 10, 1 << 12);
    Recorder recorder(reader, path, header());
    auto ticks = some_ticks(0, 30);
    const auto send = [&](std::size_t t) {
      ticks[t].voxels_changed = 1;
      reader.changes.push(VoxelChange{static_cast<VoxelKey>(t), 0.5F});
      reader.ticks.push(ticks[t]);
    };
    for (std::size_t t = 0; t < 10; ++t) send(t);
    SceneAction saw = SceneAction::saw({{1, 2, 3}, {0, 1, 0}});
    saw.tick = 10;
    reader.actions.push(saw);
    recorder.drain();  // the action is here, its tick not yet
    for (std::size_t t = 10; t < 30; ++t) {
      if (t == 25) {
        SceneAction undo = SceneAction::plain(ActionKind::undo);
        undo.tick = 25;
        reader.actions.push(undo);
      }
      send(t);
    }
    recorder.drain();
    SceneAction last = SceneAction::split(4);
    last.tick = 30;
    reader.actions.push(last);  // the tick that did not come
    recorder.stop();
  }
  const Session s = read_session(path);
  ASSERT_EQ(s.ticks.size(), 30u);
  ASSERT_EQ(s.actions.size(), 3u);
  EXPECT_EQ(s.actions[0].changes_before, 10u);
  EXPECT_EQ(s.actions[0].action.saw_cut().at_mm, (Vec3{1, 2, 3}));
  EXPECT_EQ(s.actions[1].changes_before, 25u);
  EXPECT_TRUE(s.actions[1].action.is(ActionKind::undo));
  EXPECT_EQ(s.actions[2].changes_before, 30u);
  EXPECT_EQ(s.actions[2].action.values[0], 4);
}

TEST(Script, ActionsAreReadAndErrorsSayWhich) {
  const auto path = fresh("deeds.json");
  const auto with = [&](const std::string& actions) {
    std::filesystem::remove(path);
    write_file(path, R"({"osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [0, 0, 1],
      "waypoints": [{"t_s": 0, "at_mm": [0, 0, 0]}], "actions": [)" +
                         actions + "]}");
    return load_script(path);
  };
  const Script s = with(R"({"t_s": 1, "saw": {"at_mm": [1, 2, 3], "normal": [0, 0, 2], "kerf_mm": 0.9}},
    {"t_s": 2, "split": {}}, {"t_s": 3, "move": {"piece": 1, "shift_mm": [0, 0, 10], "turn_deg": 90, "over_s": 1}},
    {"t_s": 5, "attach": {"plate": "miniplate-4", "at_mm": [0, 0, 1], "x": [0, 1, 0], "pieces": [0, 1]}})");
  const auto actions = actions_of(s, 1000);
  ASSERT_EQ(actions.size(), 2u + 50u + 1u);
  EXPECT_EQ(actions[0].tick, 1000u);
  EXPECT_EQ(actions[0].saw_cut().kerf_mm, 0.9);
  EXPECT_EQ(actions[2].tick, 3000u);
  EXPECT_NEAR(actions[51].transform().shift_mm.z, 10, 1e-12);
  EXPECT_NEAR(actions[51].transform().rotation.column[0].y, 1, 1e-12);
  EXPECT_NEAR(actions[26].transform().shift_mm.z, 5, 1e-12);
  EXPECT_EQ(actions.back().transform().rotation.column[0], (Vec3{0, 1, 0}));
  for (const auto& [bad, word] : {std::pair{R"({"t_s": 1, "dance": {}})", "action 1"},
                                  {R"({"t_s": 1, "split": {}}, {"t_s": 0, "undo": {}})", "action 2"},
                                  {R"({"t_s": 1, "attach": {"plate": "tin", "at_mm": [0,0,0], "pieces": [0]}})", "tin"},
                                  {R"({"t_s": 1, "saw": {}})", "at_mm"}}) {
    try {
      with(bad);
      FAIL() << bad;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
    }
  }
}

TEST(SessionFile, CutAnywhereKeepsWhatWasWholeBefore) {
  const auto path = fresh("cut");
  {
    SessionWriter w(path, header());
    for (std::uint64_t b = 0; b < 5; ++b) w.append(some_ticks(b * 10, 10), std::vector<VoxelChange>{{static_cast<VoxelKey>(b), 0.5F}});
    w.finish({50, "bone", "surface", 1, {}});
  }
  const std::string whole = read_text(path);
  const auto cut = fresh("cut2");
  std::size_t least = 1000;
  std::uint32_t header_bytes = 0;
  std::memcpy(&header_bytes, whole.data() + 8, sizeof header_bytes);
  for (std::size_t n = whole.size() - 1; n > 16 + header_bytes; n -= 13) {
    std::ofstream(cut, std::ios::binary) << whole.substr(0, n);
    const Session s = read_session(cut);
    EXPECT_FALSE(s.end.has_value());
    EXPECT_EQ(s.ticks.size() % 10, 0u);
    EXPECT_LE(s.ticks.size(), least);
    least = s.ticks.size();
  }
}

TEST(SessionFile, DamageInTheMiddleIsNotOverlooked) {
  const auto path = fresh("damage");
  {
    SessionWriter w(path, header());
    for (std::uint64_t b = 0; b < 5; ++b) w.append(some_ticks(b * 10, 10), {});
    w.finish({50, "bone", "surface", 1, {}});
  }
  std::string bytes = read_text(path);
  bytes[bytes.size() / 2] ^= 0x10;
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_THROW(static_cast<void>(read_session(path)), Error);
  std::ofstream(path, std::ios::binary) << "not a session at all, but long enough to look at";
  EXPECT_THROW(static_cast<void>(read_session(path)), Error);
}

TEST(SessionFile, IsNeverOverwritten) {
  const auto path = fresh("twice");
  { SessionWriter w(path, header()); }
  EXPECT_THROW(SessionWriter(path, header()), Error);
}

TEST(Script, RoundTripAndErrorsSayWhere) {
  Script s;
  s.tool = burr_index(BurrKind::diamond, 3);
  s.axis = {0, 0.6, 0.8};
  s.waypoints = {{0, {1, 2, 3}, false}, {1.5, {4, 5, 6}, true}};
  const auto path = fresh("strokes.json");
  write_file(path, script_json(s));
  const Script back = load_script(path);
  EXPECT_EQ(back.tool, s.tool);
  EXPECT_EQ(back.axis, s.axis);
  EXPECT_EQ(back.waypoints[1].at_mm, (Vec3{4, 5, 6}));
  EXPECT_FALSE(back.waypoints[0].drill_on);
  const auto message = [&](const std::string& text) -> std::string {
    write_file(path, text);
    try {
      static_cast<void>(load_script(path));
    } catch (const Error& e) {
      return e.what();
    }
    return "read";
  };
  EXPECT_NE(message("{}").find("header"), std::string::npos);
  EXPECT_NE(message(R"({"osteotome_strokes":1,"burr":{"kind":"cutting","diameter_mm":4.5},"axis":[0,0,1],"waypoints":[]})").find("4.5 mm"),
            std::string::npos);
  EXPECT_NE(
      message(
          R"({"osteotome_strokes":1,"burr":{"kind":"cutting","diameter_mm":4},"axis":[0,0,1],"waypoints":[{"t_s":1,"at_mm":[0,0,0]},{"t_s":1,"at_mm":[0,0,0]}]})")
          .find("waypoint 2"),
      std::string::npos);
}

}  // namespace
}  // namespace osteo
