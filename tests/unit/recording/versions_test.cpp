// Sessions of other versions: what can be read of them, and what not.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/recording/export.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/bone/plates.h"
#include "other_session.h"

namespace osteo {
namespace {

using nlohmann::ordered_json;

fs::path fresh(const std::string& name) {
  const auto p = fs::temp_directory_path() / ("osteo-versions-" + std::to_string(::getpid()) + "-" + name);
  fs::remove_all(p);
  return p;
}

SessionHeader header(const std::string& program) {
  SessionHeader h;
  h.program_version = program;
  h.bone_hash = "abc";
  return h;
}

std::vector<TickRecord> some_ticks(std::uint64_t first, std::size_t n) {
  std::vector<TickRecord> t(n);
  for (std::size_t i = 0; i < n; ++i) {
    t[i].tick = first + i;
    t[i].device.position_mm = {static_cast<float>(i), 0.1F, -3};
    t[i].flags = 1U << (i % 20);
    t[i].structure = 0xfffffff0U + static_cast<std::uint32_t>(i % 16);
    t[i].thickness_mm = 1.5F;
    t[i].work_us = 3.25F;
  }
  return t;
}

bool has(const std::vector<std::string>& lines, const std::string& word) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& l) { return l.find(word) != std::string::npos; });
}

std::string refusal(const fs::path& path) {
  try {
    static_cast<void>(read_session(path));
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::corrupt);
    return std::string(e.what()) + " / " + e.advice();
  }
  return "read";
}

// Another field, burr, action, kind of record, kind of frame and kind of note.
TEST(Versions, ALaterSessionIsReadByThisVersion) {
  const auto path = fresh("later.oss"), out = fresh("later.csv");
  const auto ticks = some_ticks(0, 50);
  {
    test::OtherWriter w(path, header("later"), test::with_pulse(), [](ordered_json& j) {
      j["instruments"].push_back({{"name", "laser 1 mm"}, {"kind", "laser"}});
      j["actions"]["99"] = "glue";
      j["records"]["nerve"] = {{"part", 9},
                               {"fields", {{{"name", "v_mv"}, {"type", "f64"}, {"unit", "mV"}, {"role", "result"}}}}};
      j["what comes next"] = {1, 2, 3};
    });
    SceneAction glue;
    glue.kind = 99;
    glue.tick = 3;
    w.records<SceneAction>(action_record_table().part, action_record_table().fields, std::vector{glue});
    w.part(9, 2, std::vector<std::byte>(16));
    w.ticks(ticks);
    const std::string note = "{\"tick\":7,\"kind\":\"twitch\",\"value\":{\"mv\":0.5}}\n";
    w.part(kNotesPart, note.size(), std::as_bytes(std::span(note)));
    w.records<VoxelChange>(change_table().part, change_table().fields, std::vector<VoxelChange>{{8, 0.5F}});
    w.end_frame(2, 0, 50);
    w.frame(42, 50, 50, "nobody knows");
    w.ticks(some_ticks(50, 3));
    w.end_frame(2, 50, 53);
    w.finish({53, "bone", "", 1, "", 0, 0});
  }
  const Session s = read_session(path);
  ASSERT_EQ(s.ticks.size(), 53u);
  for (std::size_t i = 0; i < ticks.size(); ++i)
    ASSERT_EQ(first_difference(s.tick_fields, &s.ticks[i], &ticks[i]), nullptr) << i;
  EXPECT_EQ(s.ticks[5].work_us, 3.25F) << "fields behind the added one too";
  ASSERT_EQ(s.actions.size(), 1u);
  EXPECT_EQ(s.actions[0].action.kind, 99u);
  ASSERT_EQ(s.changes.size(), 1u);
  ASSERT_EQ(s.notes.size(), 1u);
  EXPECT_EQ(s.notes[0].kind, "twitch");
  EXPECT_EQ(s.notes[0].json, "{\"mv\":0.5}");
  EXPECT_TRUE(s.end);
  EXPECT_TRUE(has(s.newer, "pulse_bpm") && has(s.newer, "'nerve'") && has(s.newer, "1 frame of a kind 42"))
      << s.newer.size();
  EXPECT_EQ(s.newer.size(), 3u);
  EXPECT_EQ(s.not_replayable, "") << "the servo was not fed with what is new";
  EXPECT_EQ(s.tools.size(), instrument_library().size()) << "a laser that nobody took is no matter";
  export_session(SessionReader(path), out, {});
  const std::string actions = read_text(export_files(out)[1]), notes = read_text(export_files(out)[2]);
  EXPECT_NE(actions.find(",glue,"), std::string::npos) << actions;
  EXPECT_NE(notes.find("0.007,7,\"twitch\",\"{\"\"mv\"\":0.5}\""), std::string::npos) << notes;
  for (const auto& f : export_files(out)) fs::remove(f);
  fs::remove(path);
}

// A burr that came later, and stands where it belongs, gives all behind it other numbers: names count.
TEST(Versions, InstrumentsAndPlatesGoByTheirNames) {
  const auto path = fresh("renumbered.oss");
  const std::vector<std::string> used{"cutting 1 mm", "diamond 7 mm", "suction tube 8 Fr", "hook 2 mm", "saw 25 mm"};
  const std::uint32_t plate = static_cast<std::uint32_t>(plate_library().size()) - 1;
  const std::string plate_name = plate_library()[plate].name;
  for (const bool shorter : {false, true}) {
    SessionHeader h = header("earlier");
    h.haptics.tool_methods[instrument_index("saw 25 mm")] = ContactMethod::proxy;
    ordered_json instruments, plates;
    fs::remove(path);
    {
      test::OtherWriter w(path, h, test::tick_fields(), [&](ordered_json& j) {
        // A library without half the burrs, or one that begins with the saw.
        test::renumber(
            j["instruments"], [&](const std::string& name) { return !shorter || name.find("taper") == name.npos; },
            !shorter);
        test::renumber(
            j["plates"], [](const std::string&) { return true; }, true);
        // Sessions of 0.1 call suction tubes so.
        for (auto& i : j["instruments"])
          if (shorter && i["name"] == "suction tube 8 Fr") i["name"] = "sucker 8 Fr";
        instruments = j["instruments"];
        plates = j["plates"];
        for (auto& t : j["haptics"]["tool_methods"]) t[0] = test::number_in(instruments, "saw 25 mm");
      });
      auto ticks = some_ticks(0, used.size());
      for (std::size_t n = 0; n < used.size(); ++n)
        ticks[n].device.tool =
            static_cast<std::uint8_t>(test::number_in(instruments, shorter && n == 2 ? "sucker 8 Fr" : used[n]));
      SceneAction grip = SceneAction::grip(test::number_in(plates, plate_name)),
                  away = SceneAction::grip(SceneAction::kNobody);
      SceneAction off = SceneAction::detach(1);
      w.records<SceneAction>(action_record_table().part, action_record_table().fields, std::vector{grip, away, off});
      w.ticks(ticks);
      w.end_frame(2, 0, ticks.size());
    }
    const Session s = read_session(path);
    ASSERT_EQ(s.ticks.size(), used.size());
    for (std::size_t n = 0; n < used.size(); ++n) EXPECT_EQ(instrument_of(s.ticks[n].device.tool).name, used[n]);
    EXPECT_EQ(s.header.haptics.tool_methods, h.haptics.tool_methods);
    EXPECT_EQ(s.tools.at(s.ticks[3].device.tool), "hook 2 mm");
    EXPECT_FALSE(s.numbered_alike);
    ASSERT_EQ(s.actions.size(), 3u);
    EXPECT_EQ(s.actions[0].action.item, plate);
    EXPECT_EQ(s.actions[1].action.item, SceneAction::kNobody);
    EXPECT_EQ(s.actions[2].action.item, 1u) << "a fixed plate has a number of the scene";
  }
  fs::remove(path);
}

TEST(Versions, AnInstrumentThatIsNotKnownIsRefusedByItsName) {
  const auto path = fresh("laser.oss");
  const auto write = [&](std::uint8_t tool, std::uint32_t plate) {
    fs::remove(path);
    test::OtherWriter w(path, header("later"), test::tick_fields(), [](ordered_json& j) {
      j["instruments"].insert(j["instruments"].begin() + 3,
                              ordered_json::object({{"name", "laser 1 mm"}, {"kind", "laser"}}));
      j["plates"].push_back(ordered_json::object({{"name", "mesh 9"}}));
    });
    auto ticks = some_ticks(0, 3);
    ticks[1].device.tool = tool;
    w.records<SceneAction>(action_record_table().part, action_record_table().fields,
                           std::vector{SceneAction::grip(plate)});
    w.ticks(ticks);
    w.end_frame(2, 0, 3);
  };
  write(4, 0);
  EXPECT_EQ(instrument_of(read_session(path).ticks[1].device.tool).name, instrument_library()[3].name);
  write(3, 0);
  EXPECT_NE(refusal(path).find("recorded with the instrument 'laser 1 mm', which this version does not know"),
            std::string::npos)
      << refusal(path);
  write(4, static_cast<std::uint32_t>(plate_library().size()));
  EXPECT_NE(refusal(path).find("the plate 'mesh 9'"), std::string::npos) << refusal(path);
  fs::remove(path);
}

// The other way round: this version's reader before a field was added, which is the same as a file that lacks one.
TEST(Versions, AnEarlierSessionWithoutAFieldIsRead) {
  const auto path = fresh("earlier.oss"), out = fresh("earlier.csv");
  {
    test::OtherWriter w(path, header("earlier"), test::without("thickness_mm"));
    w.ticks(some_ticks(0, 20));
    w.end_frame(2, 0, 20);
  }
  const Session s = read_session(path);
  ASSERT_EQ(s.ticks.size(), 20u);
  EXPECT_EQ(s.ticks[7].thickness_mm, 0);
  EXPECT_EQ(s.ticks[7].structure, 0xfffffff7U);
  EXPECT_EQ(s.tick_fields.size() + 1, tick_table().fields.size());
  EXPECT_TRUE(s.newer.empty());
  EXPECT_EQ(s.not_replayable, "");
  const TickRecord same = s.ticks[7];
  TickRecord thicker = same;
  thicker.thickness_mm = 4;
  EXPECT_EQ(first_difference(s.tick_fields, &same, &thicker), nullptr) << "what it does not tell is not compared";
  export_session(SessionReader(path), out, {});
  EXPECT_EQ(read_text(out).find("thickness_mm"), std::string::npos);
  EXPECT_NE(read_text(out).find("clearance_mm"), std::string::npos);
  for (const auto& f : export_files(out)) fs::remove(f);
  fs::remove(path);
}

// What a session begins with; older ones do not tell of heat.
TEST(Versions, DustAndHeatOfTheBeginningAreInTheHeader) {
  const auto path = fresh("begins.oss");
  for (const bool on : {true, false}) {
    SessionHeader h = header("this");
    h.heat = on;
    h.dust = !on;
    {
      test::OtherWriter w(path, h, test::tick_fields());
      w.ticks(some_ticks(0, 5));
      w.end_frame(2, 0, 5);
    }
    EXPECT_EQ(read_session(path).header.heat, on);
    EXPECT_EQ(read_session(path).header.dust, !on);
  }
  SessionHeader h = header("older");
  h.heat = true;
  {
    test::OtherWriter w(path, h, test::tick_fields(), [](ordered_json& j) { EXPECT_EQ(j.erase("heat"), 1U); });
    w.ticks(some_ticks(0, 5));
    w.end_frame(2, 0, 5);
  }
  EXPECT_FALSE(read_session(path).header.heat);
  fs::remove(path);
}

TEST(Versions, NumbersOfAnotherTypeAreConverted) {
  const auto path = fresh("types.oss");
  struct Wide {
    std::uint64_t tick;
    double x_mm;
    std::uint64_t flags, tool;
    float voxels_changed;
  };
  const std::vector<RecordField> fields{{"tick", FieldType::u64, offsetof(Wide, tick), "", ""},
                                        {"x_mm", FieldType::f64, offsetof(Wide, x_mm), "", "", FieldRole::input},
                                        {"flags", FieldType::u64, offsetof(Wide, flags), "", ""},
                                        {"tool", FieldType::u64, offsetof(Wide, tool), "", "", FieldRole::input},
                                        {"voxels_changed", FieldType::f32, offsetof(Wide, voxels_changed), "", ""}};
  {
    test::OtherWriter w(path, header("wide"), fields);
    w.records<Wide>(tick_table().part, fields, std::vector<Wide>{{0, 1.5, 7, 3, 2}, {1, -2.25, 0x80000001U, 400, -1}});
    w.end_frame(2, 0, 2);
  }
  const Session s = read_session(path);
  ASSERT_EQ(s.ticks.size(), 2u);
  EXPECT_EQ(s.ticks[1].device.position_mm[0], -2.25F);
  EXPECT_EQ(s.ticks[1].flags, 0x80000001U);
  EXPECT_EQ(s.ticks[0].device.tool, 3);
  EXPECT_EQ(s.ticks[1].device.tool, 0) << "out of range";
  EXPECT_EQ(s.ticks[0].voxels_changed, 2u);
  EXPECT_EQ(s.ticks[1].voxels_changed, 0u) << "out of range";
  fs::remove(path);
}

TEST(Versions, WhatTheServoCannotRepeatIsSaid) {
  const auto path = fresh("inputs.oss");
  const auto why = [&](const std::vector<RecordField>& fields, const std::function<void(ordered_json&)>& change = {}) {
    { test::OtherWriter w(path, header("other"), fields, change); }
    return SessionReader(path).outline().not_replayable;
  };
  EXPECT_EQ(why(test::tick_fields()), "");
  EXPECT_NE(why(test::with_pulse(FieldRole::input)).find("'pulse_bpm'"), std::string::npos);
  EXPECT_NE(why(test::without("buttons")).find("'buttons'"), std::string::npos);
  EXPECT_NE(why(test::tick_fields(), [](ordered_json& j) { j["kernels"]["contact"] = 1000; }).find("other bits"),
            std::string::npos);
  // The guards of before are here still.
  EXPECT_EQ(SessionReader(path).header().haptics.params.guard.law, 5);
  for (const int contact : {2, 3, 4, 5}) {
    EXPECT_EQ(why(test::tick_fields(), [&](ordered_json& j) { j["kernels"]["contact"] = contact; }), "");
    EXPECT_EQ(SessionReader(path).header().haptics.params.guard.law, contact - 1);
    EXPECT_EQ(ordered_json::parse(header_json(SessionReader(path).header()))["kernels"]["contact"], contact);
  }
  EXPECT_NE(why(test::tick_fields(), [](ordered_json& j) { j["kernels"]["contact"] = 1; }), "");
  EXPECT_NE(why(test::tick_fields(),
                [](ordered_json& j) {
                  j["hands"] = 5;
                  while (j["haptics"]["devices"].size() < 5)
                    j["haptics"]["devices"].push_back(j["haptics"]["devices"][0]);
                })
                .find("5 hands"),
            std::string::npos);
  EXPECT_NE(why(test::tick_fields(), [](ordered_json& j) { j["haptics"]["params"]["magic"] = "2"; }).find("'magic'"),
            std::string::npos);
  EXPECT_NE(why(test::tick_fields(), [](ordered_json& j) { j["haptics"]["params"]["method"] = "magic"; }).find("magic"),
            std::string::npos);
  fs::remove(path);
}

// Records of several hands stand behind each other, with one number.
TEST(Versions, HandsShareTheNumberOfTheirTick) {
  const auto path = fresh("hands.oss");
  const auto write = [&](bool whole) {
    SessionHeader h = header("hands");
    h.haptics.more_devices.resize(1);
    std::vector<TickRecord> ticks;
    for (const TickRecord& t : some_ticks(0, 5)) {
      ticks.insert(ticks.end(), 2, t);
      ticks.back().hand = 1;
    }
    if (!whole) ticks.erase(ticks.begin() + 3);
    test::OtherWriter w(path, h, test::tick_fields());
    w.ticks(ticks);
    w.end_frame(2, 0, 5);
  };
  write(true);
  EXPECT_EQ(read_session(path).ticks.size(), 10u);
  EXPECT_EQ(read_session(path).tick_records, 10u);
  EXPECT_EQ(read_session(path).ticks[5].tick, 2u);
  write(false);
  EXPECT_NE(refusal(path).find("tick 1 is missing"), std::string::npos) << refusal(path);
  fs::remove(path);
}

TEST(Versions, OtherFormatsAreRefusedWithAdvice) {
  const auto path = fresh("format.oss");
  std::ofstream(path, std::ios::binary) << "OSF1 and so on, as it was written before the records were described";
  EXPECT_NE(refusal(path).find("format 1"), std::string::npos);
  EXPECT_NE(refusal(path).find("use the version it was recorded with"), std::string::npos);
  {
    test::OtherWriter w(path, header("osteotome 9"), test::tick_fields(),
                        [](ordered_json& j) { j["osteotome_session"] = 3; });
  }
  EXPECT_NE(refusal(path).find("format 3, recorded by osteotome 9"), std::string::npos) << refusal(path);
  {
    test::OtherWriter w(path, header("odd"), test::tick_fields(),
                        [](ordered_json& j) { j["records"]["tick"]["fields"][3]["type"] = "i128"; });
  }
  EXPECT_NE(refusal(path).find("'i128'"), std::string::npos) << refusal(path);
  { test::OtherWriter w(path, header("odd"), test::without("tick")); }
  EXPECT_NE(refusal(path).find("lacks 'tick'"), std::string::npos) << refusal(path);
  for (const char* const key : {"records", "haptics", "kernels", "instruments", "actions"}) {
    {
      test::OtherWriter w(path, header("odd"), test::tick_fields(), [&](ordered_json& j) { j.erase(key); });
    }
    EXPECT_NE(refusal(path).find("damaged"), std::string::npos) << key << refusal(path);
  }
  {
    test::OtherWriter w(path, header("odd"), test::tick_fields(), [&](ordered_json& j) { j["actions"]["saw"] = "3"; });
  }
  EXPECT_NE(refusal(path).find("damaged header"), std::string::npos) << refusal(path);
  fs::remove(path);
}

// Frames whose checksum is right and whose contents are not: rejected, whatever they hold.
TEST(Versions, FramesThatDoNotHoldWhatTheySay) {
  const auto path = fresh("wrong.oss");
  const auto with = [&](const std::function<void(test::OtherWriter&)>& fill) {
    test::OtherWriter w(path, header("wrong"), test::tick_fields());
    fill(w);
    return refusal(path);
  };
  EXPECT_NE(with([](auto& w) { w.frame(2, 0, 1, "not compressed"); }).find("cannot be decompressed"),
            std::string::npos);
  EXPECT_NE(with([](auto& w) {
              w.part(1, 1000, std::vector<std::byte>(50));
              w.end_frame(2, 0, 1000);
            }).find("fewer than it says"),
            std::string::npos);
  EXPECT_NE(with([](auto& w) {
              w.part(77, 1, std::vector<std::byte>(8));
              w.end_frame(2, 0, 0);
            }).find("does not describe"),
            std::string::npos);
  EXPECT_NE(with([](auto& w) {
              w.ticks(some_ticks(0, 4));
              w.end_frame(2, 0, 5);
            }).find("tick 4 is missing"),
            std::string::npos);
  EXPECT_NE(with([](auto& w) {
              w.ticks(some_ticks(0, 4));
              w.end_frame(2, 0, 3);
            }).find("tick 3 is missing"),
            std::string::npos);
  EXPECT_NE(with([](auto& w) {
              w.ticks(some_ticks(3, 4));
              w.end_frame(2, 3, 7);
            }).find("tick 0 is missing"),
            std::string::npos);
  EXPECT_NE(with([](auto& w) { w.end_frame(2, 5, 3); }).find("ends before it begins"), std::string::npos);
  EXPECT_NE(with([](auto& w) {
              const std::string text = "{\"tick\":-1}\n";
              w.part(kNotesPart, text.size(), std::as_bytes(std::span(text)));
              w.end_frame(2, 0, 0);
            }).find("note that is not valid"),
            std::string::npos);
  EXPECT_NE(with([](auto& w) {
              const std::byte two[2]{};
              w.part(1, 0, two);
              w.end_frame(2, 0, 0);
            }).find("fewer than it says"),
            std::string::npos);
  fs::remove(path);
}

// Random bits through the code and back, in all types.
TEST(Records, EveryBitComesBack) {
  std::mt19937_64 random(3);
  for (const RecordTable* const table : {&tick_table(), &change_table(), &action_record_table()}) {
    FileTable file{table->part, 0, false, {}};
    for (const RecordField& f : table->fields) {
      file.fields.push_back({f.type, &f});
      file.bytes += size_of(f.type);
    }
    for (const std::size_t n : {1, 2, 257}) {
      std::vector<std::uint64_t> in((n * table->memory_bytes + 7) / 8), out(in.size());
      for (auto& v : in) v = random();
      std::vector<std::byte> bytes;
      put_records(bytes, table->fields, in.data(), n, table->memory_bytes);
      ASSERT_EQ(bytes.size(), n * file.bytes);
      get_records(file, bytes, n, out.data(), table->memory_bytes);
      // What no field covers is not written: a change's density before it (4 bytes), an action's padding.
      std::vector<std::uint8_t> covered(table->memory_bytes);
      for (const RecordField& f : table->fields)
        std::fill_n(covered.begin() + f.offset, size_of(f.type), std::uint8_t{1});
      const auto left_out = static_cast<std::size_t>(std::count(covered.begin(), covered.end(), 0));
      EXPECT_EQ(left_out, table == &change_table() ? 4U : table == &tick_table() ? 0U : 4U) << table->name;
      auto* const bytes_in = reinterpret_cast<std::uint8_t*>(in.data());
      const auto* const bytes_out = reinterpret_cast<const std::uint8_t*>(out.data());
      std::size_t different = 0;
      for (std::size_t b = 0; b < n * table->memory_bytes; ++b)
        different += bytes_out[b] != (covered[b % table->memory_bytes] != 0 ? bytes_in[b] : 0) ? 1 : 0;
      EXPECT_EQ(different, 0U) << table->name;
    }
  }
}

}  // namespace
}  // namespace osteo
