#include "osteo/core/base/json.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "osteo/core/base/json_document.h"

namespace osteo {
namespace {

std::string refusal(const std::string& text) {
  try {
    const JsonFile file(text, "f.json");
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    return e.what();
  }
  return "taken";
}

TEST(Json, EveryValueKnowsItsLine) {
  // Numbers end with the character behind them: that may be the end of the line.
  const JsonFile file(
      "{ // a comment\n \"a\": 1\n,\"b\": [2,\n 3\n ],\n\n \"c\": { \"d\": \"x\", /* and\n another */ \"e\": -4.5e2\n} "
      ",\"f\": "
      "true,\"g\":null}",
      "f.json");
  const JsonValue& r = file.root();
  ASSERT_EQ(r.members.size(), 5u);
  EXPECT_EQ(r.line, 1u);
  EXPECT_EQ(r.find("a")->line, 2u);
  EXPECT_EQ(r.find("b")->line, 3u);
  EXPECT_EQ(r.find("b")->items[0].line, 3u);
  EXPECT_EQ(r.find("b")->items[1].line, 4u);
  EXPECT_EQ(r.find("c")->line, 7u);
  EXPECT_EQ(r.find("c")->find("d")->text, "x");
  EXPECT_EQ(r.find("c")->find("e")->line, 8u);
  EXPECT_EQ(r.find("c")->find("e")->number, -450);
  EXPECT_TRUE(r.find("f")->flag);
  EXPECT_EQ(r.find("f")->line, 9u);
  EXPECT_EQ(r.find("g")->kind, JsonValue::Kind::null);
  EXPECT_EQ(r.find("h"), nullptr);
}

TEST(Json, WhatIsNoJsonIsToldWithItsLineAndWithoutTheLibrarysName) {
  for (const auto& [text, line] : {std::pair{"{\n\n \"a\": }", "line 3"},
                                   {"", "line 1"},
                                   {"{\n\"a\": 1\n", "line 2"},
                                   {"{\"a\": 1}\n{}", "line 2"},
                                   {"{\n\"a\": NaN}", "line 2"},
                                   {"{\n\"a\": 1e999}", "line 2"},
                                   {"{\n\"a\": 'x'}", "line 2"}}) {
    const std::string what = refusal(text);
    EXPECT_NE(what.find(std::string("'f.json' ") + line + ": this is not valid JSON"), std::string::npos) << what;
    EXPECT_EQ(what.find("json.exception"), std::string::npos) << what;
    EXPECT_EQ(what.find("column"), std::string::npos) << what;
  }
  EXPECT_NE(refusal("{\"a\": 1,\n \"a\": 2}").find("line 2: the key \"a\" is there twice"), std::string::npos);
  EXPECT_NE(refusal(std::string(100000, '[')).find("nested more than 64 deep"), std::string::npos);
  EXPECT_EQ(refusal("\xEF\xBB\xBF{}"), "taken");
}

enum class Colour : int { red, green };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(Colour) {
  return {"red", "green"};
}

struct Part {
  double kerf_mm = 0.5;
  int piece = 3;
  bool drill = true;
  std::string plate = "none";
  std::array<double, 3> at_mm{};
  std::vector<int> pieces;
  Colour colour = Colour::red;
  using Params = Part;
  static void describe(Part& p, auto& visit) {
    visit({"kerf_mm", "how wide", "mm", 0.1, 2}, p.kerf_mm);
    visit({"piece", "which", "", 0, 9}, p.piece);
    visit({"drill", "turns"}, p.drill);
    visit({"plate", "which plate"}, p.plate);
    visit({"at_mm", "where", "mm", -100, 100, true}, p.at_mm);
    visit({"pieces", "some", "", 0, 9}, p.pieces);
    visit({"colour", "of it"}, p.colour);
  }
};

TEST(Json, FieldsAreReadStrictly) {
  const auto read = [](const std::string& members, Part& p) -> std::string {
    const JsonFile file("{\n" + members + "}", "f.json");
    try {
      file.read(file.root(), "action 2", fields_of<Part>(p));
    } catch (const Error& e) {
      return e.what() + std::string(" / ") + e.advice();
    }
    return "read";
  };
  Part p;
  EXPECT_EQ(read(R"("at_mm": [1, -2.5, 3e1], "pieces": [4, 0], "colour": "green", "drill": false, "piece": 7)", p),
            "read");
  EXPECT_EQ(p.at_mm, (std::array<double, 3>{1, -2.5, 30}));
  EXPECT_EQ(p.pieces, (std::vector<int>{4, 0}));
  EXPECT_EQ(p.colour, Colour::green);
  EXPECT_FALSE(p.drill);
  EXPECT_EQ(p.piece, 7);
  EXPECT_EQ(p.kerf_mm, 0.5);  // what is not named stays
  const std::string at = R"("at_mm": [0, 0, 0], )";
  for (const auto& [members, says] : std::vector<std::pair<std::string, std::string>>{
           {at + "\n\"kerf\": 1", "line 3: action 2: the key \"kerf\" is not known: did you mean \"kerf_mm\"?"},
           {at + "\"kerf_m\": 1", "did you mean \"kerf_mm\"?"},
           {at + "\"dril\": false", "did you mean \"drill\"?"},
           {at + "\"drill_on\": false", "did you mean \"drill\"?"},
           {at + "\"x\": 1", "known are kerf_mm, piece"},
           {at + "\"kerf_mm\": 100", "\"kerf_mm\" is 100 but must be between 0.1 mm and 2 mm"},
           {at + "\"kerf_mm\": -1", "must be between"},
           {at + "\"kerf_mm\": \"1\"", "\"kerf_mm\" must be a number"},
           {at + "\"kerf_mm\": null", "\"kerf_mm\" must be a number"},
           {at + "\"piece\": 1.5", "not a whole number"},
           {at + "\"piece\": 10", "must be between 0 and 9"},
           {at + "\"drill\": \"false\"", "\"drill\" must be true or false"},
           {at + "\"drill\": 0", "\"drill\" must be true or false"},
           {at + "\"plate\": 3", "\"plate\" must be a text"},
           {at + "\"colour\": \"blue\"", "'blue' is not one of red, green"},
           {at + "\"pieces\": [1.5]", "not a whole number"},
           {at + "\"pieces\": [10]", "must be between 0 and 9"},
           {at + "\"pieces\": 1", "must be whole numbers, as in [1, 2]"},
           {"\"at_mm\": [0, 0]", "must be three numbers"},
           {"\"at_mm\": [0, 0, 101]", "\"at_mm\" is 101 but must be between -100 mm and 100 mm"},
           {"", "\"at_mm\" is missing: where, mm"}}) {
    Part q;
    const std::string what = read(members, q);
    EXPECT_NE(what.find("'f.json' line "), std::string::npos) << what;
    EXPECT_NE(what.find(says), std::string::npos) << members << " -> " << what;
  }
  const JsonFile list("[]", "f.json");
  EXPECT_THROW(list.allow(list.root(), "", {}), Error);
}

TEST(Json, SchemaOfAFieldSaysWhatReadingChecks) {
  Part p;
  const auto fields = fields_of<Part>(p);
  EXPECT_EQ(field_schema(fields[0]).dump(),
            R"({"type":"number","minimum":0.1,"maximum":2.0,"default":0.5,"description":"how wide [mm]"})");
  EXPECT_EQ(field_schema(fields[4]).dump(),
            R"({"type":"array","items":{"type":"number"},"minItems":3,"maxItems":3,"description":"where [mm]"})");
  EXPECT_EQ(field_schema(fields[6]).dump(), R"({"enum":["red","green"],"default":"red","description":"of it"})");
}

TEST(JsonFile, ReadsSingleValuesWithTheirPlace) {
  const JsonFile file("{\"format\": 1,\n\"n\": 7,\n\"x\": 0.5,\n\"t\": \"word\",\n\"l\": [1, 2]}", "f.json",
                      ExitCode::corrupt);
  file.require_format("format");
  const auto at = [&](const char* key) -> const JsonValue& { return file.need(file.root(), "", key); };
  EXPECT_TRUE(at("n").whole);
  EXPECT_FALSE(at("x").whole);
  EXPECT_EQ(file.number(at("n"), "\"n\"", 0, 7), 7);
  EXPECT_EQ(file.text(at("t"), "\"t\""), "word");
  EXPECT_EQ(file.list(at("l"), "\"l\"", 2).size(), 2u);
  const auto says = [](const std::string& what, auto&& read) {
    try {
      static_cast<void>(read());
      ADD_FAILURE() << what;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::corrupt);
      EXPECT_EQ(e.what(), what);
    }
  };
  says("'f.json' line 2: \"n\" is 7 and must be from 0 to 6", [&] { return file.number(at("n"), "\"n\"", 0, 6); });
  says("'f.json' line 2: \"n\" is 7 and must be at least 8", [&] { return file.number(at("n"), "\"n\"", 8); });
  says("'f.json' line 4: \"t\" must be a number", [&] { return file.number(at("t"), "\"t\""); });
  says("'f.json' line 3: \"x\" must be a text in quotes", [&] { return file.text(at("x"), "\"x\""); });
  says("'f.json' line 5: \"l\" must have 3 items", [&] { return file.list(at("l"), "\"l\"", 3).size(); });
  says("'f.json' line 1: here: \"z\" is missing", [&] { return file.need(file.root(), "here", "z").line; });
  says("'f.json' line 1: \"other\": 1 is missing", [&] { return file.require_format("other"), 0; });
  says("'f.json' line 2: \"n\" must be 1", [&] { return file.require_format("n"), 0; });
}

TEST(JsonDocument, BracesMakeWhatTheyLookLike) {
  Json j{{"whole", 1}, {"number", 1.0}, {"text", "a\"b"}, {"list", {1, 2.5, "x"}}, {"pairs", {{"a", 1}, {"b", false}}}};
  j["more"]["deep"] = {"one"};
  j["steps"].push_back({{"id", "ct"}});
  j["steps"].back()["done"] = true;
  j["null"];
  j["empty"] = Json::list();
  j["none"] = Json::object();
  const std::map<std::string, int> map{{"z", 1}, {"a", 2}};
  j["map"] = map;
  j["array"] = std::array<double, 2>{0.1, 1e300};
  j["texts"] = std::vector<std::string>{"p", "q"};
  EXPECT_EQ(
      j.dump(),
      R"({"whole":1,"number":1.0,"text":"a\"b","list":[1,2.5,"x"],"pairs":{"a":1,"b":false},"more":{"deep":["one"]},)"
      R"("steps":[{"id":"ct","done":true}],"null":null,"empty":[],"none":{},"map":{"a":2,"z":1},"array":[0.1,1e+300],"texts":["p","q"]})");
  EXPECT_EQ(Json({{"a", {1, 2}}, {"b", Json::object()}}).dump(2), "{\n  \"a\": [\n    1,\n    2\n  ],\n  \"b\": {}\n}");
  EXPECT_EQ(Json::parse(j.dump(1)).value(), j);
  EXPECT_FALSE(Json::parse("{\"a\": }"));
  j.erase("whole");
  EXPECT_EQ(j.find("whole"), nullptr);
  EXPECT_EQ(j.find("number")->number(), 1.0);
  EXPECT_NE(Json(1), Json("1"));
  EXPECT_EQ(Json(1), Json(1.0));
}

// The files of earlier versions stay the same to the byte: hashes of records depend on it.
TEST(JsonDocument, NumbersAndTextsAreWrittenAsTheLibraryWritesThem) {
  using nlohmann::ordered_json;
  std::mt19937_64 random(5);
  for (int n = 0; n < 200000; ++n) {
    const std::uint64_t bits = random();
    double d = 0;
    std::memcpy(&d, &bits, sizeof d);
    if (n % 2 == 0) d = std::ldexp(static_cast<double>(bits >> 20), -static_cast<int>(n % 60));
    if (n % 5 == 0) d = std::round(d * 1e3) / 1e3;
    ASSERT_EQ(Json(d).dump(), ordered_json(d).dump());
    if (std::isfinite(d)) {
      ASSERT_EQ(Json::parse(Json(d).dump())->number(), d);
    }
  }
  for (const double d : {0.0, -0.0, 1.0, 1e15, 1e16, 1e-5, 123456789.0, 5e-324, std::nan(""), HUGE_VAL})
    EXPECT_EQ(Json(d).dump(), ordered_json(d).dump());
  EXPECT_EQ(Json(0.1F).dump(), ordered_json(0.1F).dump());
  EXPECT_EQ(Json(std::uint64_t{18446744073709551615U}).dump(), "18446744073709551615");
  EXPECT_EQ(Json(std::int64_t{-9223372036854775807}).dump(), "-9223372036854775807");
  for (const char* text : {"", "plain", "a\tb\n\"\\", "\x01\x7f", "\u00e9\u20ac", "\xff broken \xc3"})
    EXPECT_EQ(Json(text).dump(), ordered_json(text).dump(-1, ' ', false, ordered_json::error_handler_t::replace))
        << text;
}

}  // namespace
}  // namespace osteo
