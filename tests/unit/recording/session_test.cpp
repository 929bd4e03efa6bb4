#include <gtest/gtest.h>

#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/recording/haptic_settings.h"
#include "osteo/session/recording/recorder.h"
#include "osteo/session/recording/script.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/simulation/bone/burr.h"
#include "osteo/simulation/haptics/texture.h"

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
  EXPECT_EQ(parse_hardness(loaded("\"hardness_file\": \"" + law.filename().string() + "\"").hardness_json, "").exponent,
            2);
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

// A texture that a case names is kept as it is felt: what the header holds is read to the same model. Without one there
// is no key.
TEST(SessionFile, KeepsTheTexture) {
  const auto path = fresh("texture"), file = fresh("textured.json"), texture = fresh("texture.json");
  write_file(
      texture,
      R"({"osteotome_texture": 1, "rate_hz": 1000, "force_n": [1], "speed_mm_s": [20], "models": [{"force_n": 1, "speed_mm_s": 20, "ar": [-1.2, 0.7], "noise_n2": 0.01}]})");
  write_file(file, "{\"osteotome_haptics\": 1, \"texture_file\": \"" + texture.filename().string() + "\"}");
  SessionHeader h = header();
  { const SessionWriter w(path, h); }
  EXPECT_EQ(read_session(path).header.haptics.texture_json, "");
  fs::remove(path);
  load_haptic_settings(file, h.haptics);
  { const SessionWriter w(path, h); }
  EXPECT_EQ(read_session(path).header.haptics.texture_json, h.haptics.texture_json);
  EXPECT_NEAR(parse_texture(h.haptics.texture_json, "").nodes.at(0).reflection.at(1), 0.7, 1e-12);
  fs::remove(texture);
  write_file(texture, R"({"osteotome_texture": 1})");
  EXPECT_THROW(load_haptic_settings(file, h.haptics), Error);
  fs::remove(texture);
  EXPECT_THROW(load_haptic_settings(file, h.haptics), Error);
  for (const auto& p : {path, file}) fs::remove(p);
}

TEST(SessionFile, RoundTrip) {
  const auto path = fresh("round");
  {
    SessionWriter w(path, header());
    w.append({{}, some_ticks(0, 100), {{5, 0.5F}, {3, 0.9F}, {5, 0.25F}}, {}});
    w.append({{}, some_ticks(100, 7), {}, {}});
    w.finish({107, "bone", "surface", 26.75, {}, 0, 0});
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
    {"t_s": 5, "attach": {"plate": "miniplate-4", "at_mm": [0, 0, 1], "x": [0, 1, 0], "fragments": [0, 1]}})");
  const auto actions = actions_of(s, 1000);
  ASSERT_EQ(actions.size(), 2u + 50u + 1u);
  EXPECT_EQ(actions[0].tick, 1000u);
  EXPECT_EQ(actions[0].saw_cut().kerf_mm, 0.9);
  EXPECT_EQ(actions[2].tick, 3000u);
  EXPECT_NEAR(actions[51].transform().shift_mm.z, 10, 1e-12);
  EXPECT_NEAR(actions[51].transform().rotation.column[0].y, 1, 1e-12);
  EXPECT_NEAR(actions[26].transform().shift_mm.z, 5, 1e-12);
  EXPECT_EQ(actions.back().transform().rotation.column[0], (Vec3{0, 1, 0}));
  // Each that is named, in this order.
  const auto switched = actions_of(with(R"({"t_s": 1, "simulate": {"heat": true, "dust": false}})"), 1000);
  ASSERT_EQ(switched.size(), 2u);
  EXPECT_TRUE(switched[0].is(ActionKind::simulate) && switched[1].is(ActionKind::simulate));
  EXPECT_EQ(switched[0].item, static_cast<std::uint32_t>(Simulated::dust));
  EXPECT_EQ(switched[0].values[0], 0);
  EXPECT_EQ(switched[1].item, static_cast<std::uint32_t>(Simulated::heat));
  EXPECT_EQ(switched[1].values[0], 1);
  // As version 0.1 called them; not both.
  const Script old =
      with(R"({"t_s": 5, "attach": {"plate": "miniplate-4", "at_mm": [0, 0, 1], "x": [0, 1, 0], "pieces": [0, 1]}})");
  const auto attached = actions_of(old, 1000);
  ASSERT_EQ(attached.size(), 1u);
  EXPECT_EQ(attached[0].other, 1u);
  for (const auto& [bad, word] :
       {std::pair{R"({"t_s": 1, "dance": {}})", "action 1"},
        {R"({"t_s": 1, "attach": {"plate": "miniplate-4", "at_mm": [0,0,0], "pieces": [0], "fragments": [0]}})",
         "pieces"},
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
    for (std::uint64_t b = 0; b < 5; ++b)
      w.append({{}, some_ticks(b * 10, 10), {{static_cast<VoxelKey>(b), 0.5F}}, {}});
    w.finish({50, "bone", "surface", 1, {}, 0, 0});
  }
  const std::string whole = read_text(path);
  const auto cut = fresh("cut2");
  std::size_t least = 1000;
  std::uint32_t header_bytes = 0;
  std::memcpy(&header_bytes, whole.data() + 8, sizeof header_bytes);
  for (std::size_t n = whole.size() - 1; n > 32 + header_bytes; n -= 13) {
    std::ofstream(cut, std::ios::binary) << whole.substr(0, n);
    const Session s = read_session(cut);
    EXPECT_FALSE(s.end.has_value());
    EXPECT_EQ(s.ticks.size(), 10 * s.changes.size()) << "ticks and what they changed are there together, or not";
    EXPECT_LE(s.ticks.size(), least);
    least = s.ticks.size();
  }
}

TEST(SessionFile, DamageInTheMiddleIsNotOverlooked) {
  const auto path = fresh("damage");
  {
    SessionWriter w(path, header());
    for (std::uint64_t b = 0; b < 5; ++b) w.append({{}, some_ticks(b * 10, 10), {}, {}});
    w.finish({50, "bone", "surface", 1, {}, 0, 0});
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
  EXPECT_NE(message("{}").find("\"osteotome_strokes\" is missing"), std::string::npos);
  EXPECT_NE(
      message(R"({"osteotome_strokes":1,"burr":{"kind":"cutting","diameter_mm":4.5},"axis":[0,0,1],"waypoints":[]})")
          .find("4.5 mm"),
      std::string::npos);
  EXPECT_NE(
      message(
          R"({"osteotome_strokes":1,"burr":{"kind":"cutting","diameter_mm":4},"axis":[0,0,1],"waypoints":[{"t_s":1,"at_mm":[0,0,0]},{"t_s":1,"at_mm":[0,0,0]}]})")
          .find("waypoint 2"),
      std::string::npos);
}

// A whole script, of which single lines are exchanged.
TEST(Script, IsReadStrictlyAndErrorsSayFileAndLine) {
  const auto path = fresh("strict.json");
  const std::string head = "{ \"osteotome_strokes\": 1, \"about\": \"a test\", \"$schema\": \"script.schema.json\",\n";
  const std::string burr = "  \"burr\": { \"kind\": \"cutting\", \"diameter_mm\": 3, \"shape\": \"taper\" },\n";
  const std::string axis = "  \"axis\": [0, 0, 1],\n";
  const std::string points =
      "  \"waypoints\": [ { \"t_s\": 0, \"at_mm\": [0, 0, 8], \"drill\": false },\n{ \"t_s\": 1, \"at_mm\": [0, 0, 5] "
      "} ]";
  const auto message = [&](const std::string& text) -> std::string {
    fs::remove(path);
    write_file(path, text);
    try {
      static_cast<void>(load_script(path));
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::usage);
      return e.what() + std::string(" / ") + e.advice();
    }
    return "read";
  };
  const auto with_points = [&](const std::string& p) {
    return message(head + burr + axis + "  \"waypoints\": [\n" + p + "\n] }");
  };
  const auto with_action = [&](const std::string& a) {
    return message(head + burr + axis + points + ",\n\"actions\": [\n" + a + "\n] }");
  };
  ASSERT_EQ(message(head + burr + axis + points + "}"), "read");
  const Script script = load_script(path);
  EXPECT_EQ(script.tool, burr_index(BurrKind::cutting, 3, BurrShape::taper));
  EXPECT_FALSE(script.waypoints[0].drill_on);
  EXPECT_TRUE(script.waypoints[1].drill_on);

  const auto expect = [&](const std::string& got, const std::string& line, const std::string& says) {
    EXPECT_NE(got.find("'" + path.string() + "' line " + line + ": "), std::string::npos) << got;
    EXPECT_NE(got.find(says), std::string::npos) << got;
    EXPECT_EQ(got.find("exception"), std::string::npos) << got;
  };
  // The head.
  expect(message(head + burr + axis + points + ",\n\"acts\": [] }"), "6", "\"acts\" is not known");
  expect(message(head + axis + points + "}"), "1", "\"burr\" is missing");
  expect(message(head + burr + points + "}"), "1", "\"axis\" is missing");
  expect(message(head + burr + axis + "\"waypoints\": {} }"), "4", "\"waypoints\" must be as in");
  expect(message(head + burr + "  \"axis\": [0, 0, 0],\n" + points + "}"), "3", "has no length");
  expect(message(head + "\"burr\": { \"kind\": \"tungsten\", \"diameter_mm\": 4 },\n" + axis + points + "}"), "2",
         "burr: \"kind\": 'tungsten' is not one of cutting, diamond");
  expect(message(head + "\"burr\": { \"kind\": \"cutting\", \"diameter_mm\": 4,\n\"shape\": \"cube\" },\n" + axis +
                 points + "}"),
         "3", "'cube' is not one of ball");
  expect(message(head + "\"burr\": { \"kind\": \"cutting\", \"diameter_mm\": 2.5 },\n" + axis + points + "}"), "2",
         "no burr of 2.5 mm");
  expect(message("{ \"osteotome_strokes\": 2,\n" + burr + axis + points + "}"), "1", "\"osteotome_strokes\" is 2");
  expect(message(head + burr + axis + points + ",\n}"), "6", "not valid JSON");
  expect(message(head + burr + axis + points +
                 ", \"camera\": { \"centre_mm\": [0, 0, 0], \"radius_mm\": -2, \"eye\": [1, 0, 0] } }"),
         "5", "camera: \"radius_mm\" is -2");
  // Waypoints.
  expect(with_points("{ \"t_s\": 0, \"at_mm\": [0, 0, 8],\n\"drill_on\": false }"), "6",
         "waypoint 1: the key \"drill_on\" is not known: did you mean \"drill\"?");
  expect(with_points("{ \"t_s\": 0, \"at_mm\": [0, 0, 8], \"dril\": false }"), "5", "did you mean \"drill\"?");
  expect(with_points("{ \"t_s\": 1e12, \"at_mm\": [0, 0, 8] }"), "5",
         "\"t_s\" is 1e+12 but must be between 0 s and 21600 s");
  expect(with_points("{ \"t_s\": -1, \"at_mm\": [0, 0, 8] }"), "5", "\"t_s\" is -1");
  expect(with_points("{ \"t_s\": 1, \"at_mm\": [1e300, 0, 8] }"), "5", "\"at_mm\" is 1e+300 but must be");
  expect(with_points("{ \"t_s\": 1, \"at_mm\": [NaN, 0, 8] }"), "5", "not valid JSON");
  expect(with_points("{ \"t_s\": 1, \"at_mm\": [0, 8] }"), "5", "must be three numbers");
  expect(with_points("{ \"t_s\": 1 }"), "5", "waypoint 1: \"at_mm\" is missing");
  expect(with_points("{ \"t_s\": 1, \"at_mm\": [0, 0, 0] },\n{ \"t_s\": 0.5, \"at_mm\": [0, 0, 0] }"), "6",
         "waypoint 2: times must rise");
  expect(with_points(""), "4", "there are no waypoints");
  expect(with_points("{ \"t_s\": 0, \"at_mm\": [0, 0, 0] }"), "4", "takes no time");
  const std::string cavity = "{ \"t_s\": 1, \"cavity\": { \"centre_mm\": [0, 0, 0], \"towards\": [0, 0, -1], ";
  EXPECT_EQ(with_points(cavity + "\"radius_mm\": 3, \"depth_mm\": 2, \"over_s\": 4 } }"), "read");
  expect(with_points(cavity + "\"radius_mm\": -3, \"depth_mm\": 2, \"over_s\": 4 } }"), "5",
         "waypoint 1, cavity: \"radius_mm\" is -3");
  expect(with_points(cavity + "\"radius_mm\": 3, \"depth_mm\": 2, \"over_s\": 1e9 } }"), "5", "\"over_s\" is 1e+09");
  expect(with_points(cavity + "\"radius_mm\": 3, \"depth_mm\": 2, \"over_s\": 4, \"turns\": 2 } }"), "5",
         "did you mean \"turns_per_s\"?");
  expect(with_points(cavity + "\"radius_mm\": 3, \"depth_mm\": 2, \"over_s\": 4 }, \"at_mm\": [0, 0, 0] }"), "5",
         "\"at_mm\" is not known");
  expect(with_points("{ \"t_s\": 2, \"at_mm\": [0, 0, 0] },\n" + cavity +
                     "\"radius_mm\": 3, \"depth_mm\": 2, \"over_s\": 4 } }"),
         "6", "times must rise");
  expect(with_points("{ \"t_s\": 1, \"cavity\": { \"centre_mm\": [0, 0, 0], \"towards\": [0, 0, 0], \"radius_mm\": 3, "
                     "\"depth_mm\": 2, "
                     "\"over_s\": 4 } }"),
         "5", "\"towards\" is a direction");
  // Actions.
  expect(with_action("{ \"t_s\": 0.1, \"split\": {} },\n{ \"t_s\": 0.2, \"saw\": { \"at_mm\": [0, 0, 0], \"normal\": "
                     "[1, 0, 0],\n\"kerf\": 3 } }"),
         "9", "action 2, saw: the key \"kerf\" is not known: did you mean \"kerf_mm\"?");
  const std::string saw = "{ \"t_s\": 0.2, \"saw\": { \"at_mm\": [0, 0, 0], \"normal\": [1, 0, 0], ";
  EXPECT_EQ(with_action(saw + "\"kerf_mm\": 1, \"length_mm\": 0, \"depth_mm\": 5, \"piece\": 2 } }"), "read");
  for (const std::string bad : {"\"kerf_mm\": 100", "\"kerf_mm\": 0", "\"length_mm\": -5", "\"depth_mm\": -1",
                                "\"piece\": -2", "\"piece\": 1.5"})
    expect(with_action(saw + bad + " } }"), "7", "action 1, saw: \"" + bad.substr(1, bad.find('"', 1) - 1) + "\"");
  expect(with_action(saw + "\"along\": [2, 0, 0] } }"), "7", "\"along\" lies along \"normal\"");
  expect(with_action("{ \"t_s\": 0.2, \"saw\": { \"at_mm\": [0, 0, 0], \"normal\": [0, 0, 0] } }"), "7",
         "\"normal\" is a direction");
  expect(with_action("{ \"t_s\": 0.2, \"split\": {}, \"undo\": {} }"), "7", "more than one thing");
  expect(with_action("{ \"t_s\": 0.2 }"), "7", "nothing that can be done");
  expect(with_action("{ \"split\": {} }"), "7", "action 1: \"t_s\" is missing");
  expect(with_action("{ \"t_s\": 0.2, \"sav\": {} }"), "7", "did you mean \"saw\"?");
  expect(with_action("{ \"t_s\": 0.2, \"undo\": { \"steps\": 2 } }"), "7", "\"steps\" is not known");
  expect(with_action("{ \"t_s\": 0.2, \"undo\": true }"), "7", "must be an object");
  expect(with_action("{ \"t_s\": 0.2, \"move\": { \"piece\": 0, \"over_s\": -1 } }"), "7", "\"over_s\" is -1");
  expect(with_action("{ \"t_s\": 0.2, \"move\": { \"piece\": 0, \"over_s\": 1e9 } }"), "7", "\"over_s\" is 1e+09");
  expect(with_action("{ \"t_s\": 0.2, \"move\": { \"piece\": 0, \"axis\": [0, 0, 0] } }"), "7",
         "\"axis\" is a direction");
  expect(with_action("{ \"t_s\": 0.2, \"attach\": { \"plate\": \"tin\", \"at_mm\": [0, 0, 0], \"pieces\": [0] } }"),
         "7", "tin");
  for (const std::string pieces : {"[]", "[0, 1, 2]", "[1, 1]"})
    expect(with_action("{ \"t_s\": 0.2, \"attach\": { \"plate\": \"miniplate-4\", \"at_mm\": [0, 0, 0], \"pieces\": " +
                       pieces + " } }"),
           "7", "\"fragments\" are one, or two");
  expect(with_action("{ \"t_s\": 0.2, \"suction\": { \"at_mm\": [0, 0, 0], \"radius_mm\": 150 } }"), "7",
         "\"radius_mm\" is 150 but must be");
  expect(with_action("{ \"t_s\": 0.2, \"suction\": { \"radius_mm\": 5 } }"), "7", "\"at_mm\" is missing");
  EXPECT_EQ(with_action("{ \"t_s\": 0.2, \"suction\": { \"mm3_per_s\": 0 } }"), "read");
  expect(with_action("{ \"t_s\": 0.2, \"irrigate\": { \"mm3_per_s\": 50 } }"), "7", "\"at_mm\" is missing");
  expect(with_action("{ \"t_s\": 0.2, \"simulate\": {} }"), "7", "it names neither");
  expect(with_action("{ \"t_s\": 0.2, \"simulate\": { \"water\": true } }"), "7", "\"water\" is not known");
  expect(with_action("{ \"t_s\": 0.2, \"open\": { \"number\": 1, \"opening_mm\": -3 } }"), "7", "\"opening_mm\" is -3");
  EXPECT_EQ(with_action("{ \"t_s\": 5000, \"split\": {} }"), "read");
  EXPECT_EQ(load_script(path).seconds(), 5000);
  fs::remove(path);
}

// A move leaves as it was what it does not name.
TEST(Script, MovesGoOnFromWhereThePieceIs) {
  const auto path = fresh("moves.json");
  write_file(path, R"({"osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [0, 0, 1],
    "waypoints": [{"t_s": 0, "at_mm": [0, 0, 0]}], "actions": [{"t_s": 1, "move": {"piece": 2, "shift_mm": [0, 0, 10], "turn_deg": 90}},
    {"t_s": 2, "move": {"piece": 2, "shift_mm": [0, 5, 10]}}, {"t_s": 3, "move": {"piece": 2, "turn_deg": 0}}]})");
  const auto actions = actions_of(load_script(path), 1000);
  ASSERT_EQ(actions.size(), 3u);
  EXPECT_NEAR(actions[1].transform().rotation.column[0].y, 1, 1e-12);
  EXPECT_EQ(actions[1].transform().shift_mm, (Vec3{0, 5, 10}));
  EXPECT_NEAR(actions[2].transform().rotation.column[0].x, 1, 1e-12);
  EXPECT_EQ(actions[2].transform().shift_mm, (Vec3{0, 5, 10}));
  fs::remove(path);
}

// Schema and reader go by one declaration: every range that the schema tells is the reader's, every key it does not
// know is rejected.
TEST(Script, SchemaAndReaderAgree) {
  const auto schema = nlohmann::json::parse(script_schema());
  const auto path = fresh("schema.json");
  const auto taken = [&](const nlohmann::json& script) {
    fs::remove(path);
    write_file(path, script.dump());
    try {
      static_cast<void>(load_script(path));
    } catch (const Error&) {
      return false;
    }
    return true;
  };
  const nlohmann::json whole = nlohmann::json::parse(
      R"({"osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [0, 0, 1],
      "waypoints": [{"t_s": 1, "at_mm": [0, 0, 0]}]})");
  ASSERT_TRUE(taken(whole));
  for (const auto& key : schema["required"]) {
    auto less = whole;
    less.erase(key.get<std::string>());
    EXPECT_FALSE(taken(less)) << key;
  }
  int ranges = 0;
  for (const auto& form : schema["properties"]["actions"]["items"]["oneOf"]) {
    EXPECT_FALSE(form["additionalProperties"]);
    const std::string name = form["required"][1];
    const auto& keys = form["properties"][name]["properties"];
    // Something right for every key.
    nlohmann::json right = nlohmann::json::object();
    for (const auto& [key, k] : keys.items()) {
      if (key == "plate")
        right[key] = "miniplate-4";
      else if (key == "fragments")
        right[key] = {0, 1};
      else if (k.value("type", "") == "array")
        right[key] = key == "along" ? nlohmann::json{0, 1, 0} : nlohmann::json{1, 0, 0};
      else
        right[key] = k.contains("default") ? k["default"] : k["minimum"];
    }
    const auto with = [&](const nlohmann::json& action) {
      auto script = whole;
      script["actions"] = {{{"t_s", 0.5}, {name, action}}};
      return taken(script);
    };
    EXPECT_TRUE(with(right)) << name << right;
    auto more = right;
    more["another"] = 1;
    EXPECT_FALSE(with(more)) << name;
    for (const auto& key : form["properties"][name]["required"]) {
      auto less = right;
      less.erase(key.get<std::string>());
      EXPECT_FALSE(with(less)) << name << key;
    }
    for (const auto& [key, k] : keys.items()) {
      if (!k.contains("maximum")) continue;
      ++ranges;
      for (const char* const end : {"minimum", "maximum"}) {
        auto edge = right, beyond = right;
        const double v = k[end];
        edge[key] = k[end];
        if (k.value("type", "") == "integer") edge[key] = static_cast<int>(v);
        beyond[key] = v + (std::string(end) == "minimum" ? -1 : 1);
        EXPECT_TRUE(with(edge)) << name << key << v;
        EXPECT_FALSE(with(beyond)) << name << key << v;
      }
    }
  }
  EXPECT_GT(ranges, 15);
  fs::remove(path);
}

TEST(HapticSettings, ErrorsSayFileAndLine) {
  const auto path = fresh("haptics.json");
  const auto message = [&](const std::string& text) -> std::string {
    fs::remove(path);
    write_file(path, text);
    try {
      HapticSetup setup;
      load_haptic_settings(path, setup);
    } catch (const Error& e) {
      return e.what();
    }
    return "read";
  };
  EXPECT_EQ(message("{ \"osteotome_haptics\": 1, // as printed\n\"stiffness_n_per_mm\": 2, \"hardness\": false, "
                    "\"tools\": { \"diamond\": "
                    "\"proxy\" } }"),
            "read");
  for (const auto& [members, says] : {std::pair{"\"stifness_n_per_mm\": 2", "did you mean \"stiffness_n_per_mm\"?"},
                                      {"\"stiffness_n_per_mm\": \"2\"", "must be a number"},
                                      {"\"hardness\": 1", "must be true, false or"},
                                      {"\"method\": \"magic\"", "'magic' is not one of"},
                                      {"\"tools\": { \"wooden\": \"proxy\" }", "no instrument is a \"wooden\""},
                                      {"\"tools\": { \"diamond\": 3 }", "\"diamond\" must be a text"},
                                      {"\"tools\": []", "must be an object"},
                                      {"\"stiffness_n_per_mm\": }", "not valid JSON"}}) {
    const std::string what = message(std::string("{ \"osteotome_haptics\": 1,\n\n") + members + " }");
    EXPECT_NE(what.find("'" + path.string() + "' line 3: "), std::string::npos) << what;
    EXPECT_NE(what.find(says), std::string::npos) << what;
    EXPECT_EQ(what.find("exception"), std::string::npos) << what;
  }
  fs::remove(path);
}

}  // namespace
}  // namespace osteo
