#include "osteo/hospital/batch/batch.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iostream>
#include <thread>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/hospital/batch/table.h"

namespace osteo {
namespace {

std::string what_is_wrong(const std::string& table) {
  const std::vector<std::string> known{"lower", "structures"}, paths{"structures"};
  try {
    static_cast<void>(read_batch_table(table, "/data/t.csv", known, paths));
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    return e.what() + std::string(" | ") + e.advice();
  }
  return {};
}

TEST(BatchTable, RowsAreCasesAndPathsAreFromItsFolder) {
  const std::vector<std::string> known{"lower", "structures"}, paths{"structures"};
  const auto rows = read_batch_table(
      "case,source,lower,structures,mask.fill_mm3\nA-1,ct/a,400,labels.nrrd,\n\"b_2\",/abs/b.nrrd,,,5\n", "/data/t.csv",
      known, paths);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].source, "/data/ct/a");
  EXPECT_EQ(rows[0].settings,
            (std::map<std::string, std::string>{{"lower", "400"}, {"structures", "/data/labels.nrrd"}}));
  EXPECT_EQ(rows[1].code, "b_2");
  EXPECT_EQ(rows[1].source, "/abs/b.nrrd");
  EXPECT_EQ(rows[1].settings, (std::map<std::string, std::string>{{"mask.fill_mm3", "5"}}));
}

TEST(BatchTable, WhatIsWrongIsToldWithItsLine) {
  EXPECT_NE(what_is_wrong("case\nA\n").find("line 1: there is no column 'source'"), std::string::npos);
  EXPECT_NE(what_is_wrong("case,source,lowr\nA,a,1\n").find("did you mean 'lower'?"), std::string::npos);
  EXPECT_NE(what_is_wrong("case,source\nA,a\nB,b\na,c\n").find("line 4: the case 'a' is there already, in line 2"),
            std::string::npos);
  EXPECT_NE(what_is_wrong("case,source\nA,a\n\nB,\n").find("line 4: the case 'B' has no source"), std::string::npos);
  EXPECT_NE(what_is_wrong("case,source\n").find("there are no cases"), std::string::npos);
  EXPECT_NE(what_is_wrong("").find("there is no column"), std::string::npos);
  EXPECT_NE(what_is_wrong("case,source\nA,\"a\n").find("a quote is not closed"), std::string::npos);
  for (const char* code : {"..", ".", "../x", "a/b", "a\\b", "/etc", "-o", "_x", "a b", "a.b", "", "a\xc3\xa4", "'"})
    EXPECT_NE(what_is_wrong("case,source\n" + std::string(code) + ",a\n").find("is no code of a case"),
              std::string::npos)
        << code;
  EXPECT_NE(what_is_wrong("case,source\n" + std::string(65, 'a') + ",a\n").find("is no code"), std::string::npos);
  EXPECT_EQ(what_is_wrong("case,source\n" + std::string(64, 'a') + ",a\n"), "");
}

// One table, as spreadsheets of different languages and systems write it.
TEST(BatchTable, IsReadAsSpreadsheetsWriteIt) {
  const std::vector<std::string> known{"lower", "names"}, paths;
  const std::string name = "M\xc3\xbcller \xf0\x9f\xa6\xb4.nrrd";  // an umlaut, and a character beyond the first 65,536
  const std::string plain = "case,source,lower,names\nA," + name + ",400,\"1=a, 2=b\"\nB,b.nrrd,,\n";
  const auto rows_of = [&](const std::string& text) { return read_batch_table(text, "/data/t.csv", known, paths); };
  const auto same = [&](const std::string& text, std::size_t line = 3) {
    const auto rows = rows_of(text);
    ASSERT_EQ(rows.size(), 2U) << text;
    EXPECT_EQ(rows[0].source, "/data/" + name);
    EXPECT_EQ(rows[0].settings, (std::map<std::string, std::string>{{"lower", "400"}, {"names", "1=a, 2=b"}}));
    EXPECT_EQ(rows[1].code, "B");
    EXPECT_EQ(rows[1].line, line);
  };
  const auto replaced = [](std::string text, const std::string& what, const std::string& by) {
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
      text.replace(at, what.size(), by);
    return text;
  };
  const auto utf16 = [](const std::string& text, bool big) {
    std::string out = big ? "\xfe\xff" : "\xff\xfe";
    const auto unit = [&](unsigned c) {
      const char high = static_cast<char>(c >> 8), low = static_cast<char>(c & 0xff);
      out += big ? std::string{high, low} : std::string{low, high};
    };
    for (std::size_t at = 0; at < text.size(); ++at) {
      const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[at + i]); };
      if (byte(0) < 0x80) {
        unit(byte(0));
      } else if (byte(0) < 0xe0) {
        unit((byte(0) & 0x1fU) << 6 | (byte(1) & 0x3fU)), at += 1;
      } else {
        const unsigned c =
            ((byte(0) & 7U) << 18 | (byte(1) & 0x3fU) << 12 | (byte(2) & 0x3fU) << 6 | (byte(3) & 0x3fU)) - 0x10000;
        unit(0xd800 + (c >> 10)), unit(0xdc00 + (c & 0x3ff)), at += 3;
      }
    }
    return out;
  };
  const std::string semicolons = "case;source;lower;names\nA;" + name + ";400;1=a, 2=b\nB;b.nrrd;;\n",
                    tabs = replaced(semicolons, ";", "\t");
  for (const std::string& text : {plain, semicolons, tabs}) {
    same(text);
    same("\xef\xbb\xbf" + text);
    same(replaced(text, "\n", "\r\n"));
    same(replaced(text, "\n", "\r"));
    same(utf16(text, false));
    same(utf16(replaced(text, "\n", "\r\n"), true));
  }
  same("sep=;\r\n" + semicolons, 4);
  // What a spreadsheet leaves behind: rows of nothing, of any length.
  same(plain + ",,,\n,,,\n\n,\n");
  same(semicolons + ";;;\n;\r\n");
  same(replaced(plain, "B,", ",,,\nB,"), 4);
  // A quoted field keeps what separates elsewhere, and its lines.
  const auto rows = rows_of("case;source\n\"A\";\"x;y,z\n;;\n\"\"1\"\".nrrd\"\n");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].source, "/data/x;y,z\n;;\n\"1\".nrrd");
}

TEST(BatchTable, WhatIsNoTextIsToldWithItsLine) {
  EXPECT_NE(what_is_wrong("case,source\nA,a\nB,M\xfcller\n").find("line 3: a letter that is not in UTF-8"),
            std::string::npos);
  EXPECT_NE(what_is_wrong("case,source\nB,M\xfcller\n").find("CSV UTF-8"), std::string::npos);
  for (const char* bad :
       {"\xc3", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf5\x80\x80\x80", "\xf4\x90\x80\x80", "\x80"})
    EXPECT_NE(what_is_wrong("case,source\nA," + std::string(bad) + "\n").find("line 2: a letter"), std::string::npos)
        << bad;
  EXPECT_NE(what_is_wrong(std::string("c\0a\0s\0e\0", 8)).find("line 1: there is a zero byte"), std::string::npos);
  EXPECT_NE(what_is_wrong(std::string("\xff\xfe"
                                      "a\0\n\0\0\xd8"
                                      "b\0",
                                      10))
                .find("line 2: half a character"),
            std::string::npos);
  EXPECT_NE(what_is_wrong(std::string("\xff\xfe"
                                      "a\0b",
                                      5))
                .find("line 1: half a character"),
            std::string::npos);
  EXPECT_NE(what_is_wrong("case;source\n;a.nrrd\n").find("line 2: '' is no code"), std::string::npos);
  EXPECT_NE(what_is_wrong("case;source\nA;b;c\n").find("line 2: 3 fields where the first line names 2"),
            std::string::npos);
}

TEST(BatchTable, ValuesOfAllRowsAreAskedAboutBeforeAnything) {
  const std::vector<std::string> known{"lower"}, paths;
  std::string text = "case,source,lower\n";
  for (int i = 0; i < 40; ++i)
    text += "C" + std::to_string(i) + ",a," + (i % 10 == 5 ? "abc" : i == 17 ? "99999" : "300") + "\n";
  const auto rows = read_batch_table(text, "/data/t.csv", known, paths);
  int asked = 0;
  const auto check = [&](const std::map<std::string, std::string>& settings) {
    ++asked;
    if (settings.at("lower") != "300")
      throw Error(ExitCode::usage, "lower: '" + settings.at("lower") + "' is no number", "give one");
  };
  try {
    check_batch_table(rows, "/data/t.csv", check);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::usage);
    EXPECT_STREQ(e.what(), "'/data/t.csv' line 7: lower: 'abc' is no number (and 4 more: lines 17, 19, 27, 37)");
    EXPECT_EQ(e.advice(), "give one");
  }
  EXPECT_EQ(asked, 3);
  check_batch_table(std::span(rows).first(5), "/data/t.csv", check);
}

TEST(BatchNames, AreNotInMessages) {
  const fs::path source = "/data/JONES_1953/ct.nrrd";
  EXPECT_EQ(without_names("'/data/JONES_1953/ct.nrrd' is damaged", source), "'(name withheld)' is damaged");
  EXPECT_EQ(without_names("stage 'scan': 'ct.nrrd' is damaged", source), "stage 'scan': '(name withheld)' is damaged");
  EXPECT_EQ(without_names("file /data/JONES_1953/ct.nrrd/IM JONES 1 is bad", source), "file (name withheld)");
  EXPECT_EQ(without_names("there is no flag '--lower'; that isn't known, it's wrong", source),
            "there is no flag '--lower'; that isn't known, it's wrong");
  EXPECT_EQ(without_names("", source), "");
  EXPECT_EQ(without_names("the folder '/data/empty' is empty", "/data/empty"), "the folder '(name withheld)' is empty");
  EXPECT_EQ(without_names("an odd ' mark", source), "an odd ' mark");
}

class BatchRun : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  fs::path out_ = folder_.path() / "out";

  [[nodiscard]] std::vector<BatchCase> table(const std::vector<std::string>& codes) const {
    std::vector<BatchCase> rows;
    for (const std::string& code : codes) {
      const fs::path source = folder_.path() / ("scan-of-" + code);
      if (!fs::exists(source)) std::ofstream(source) << code;
      rows.push_back({rows.size() + 2, code, source, {}});
    }
    return rows;
  }
  // Each try leaves a line in a file of the case's own.
  [[nodiscard]] int tries_of(const std::string& code) const {
    std::ifstream in(folder_.path() / ("tries-" + code));
    int lines = 0;
    for (std::string line; std::getline(in, line);) ++lines;
    return lines;
  }
  [[nodiscard]] CaseWork work(const std::function<int(const std::string&, int tries)>& what) const {
    return [this, what](const BatchCase& row, const fs::path& folder) {
      const int before = tries_of(row.code);
      std::ofstream(folder_.path() / ("tries-" + row.code), std::ios::app) << "x\n";
      const int code = what(row.code, before + 1);
      if (code == 0) fs::create_directories(folder);
      return code;
    };
  }
  [[nodiscard]] BatchResult run(const std::vector<BatchCase>& rows, const CaseWork& w, BatchOptions options = {},
                                const Context& context = {}) const {
    options.out = out_;
    return run_batch(rows, options, w, context);
  }
  [[nodiscard]] CaseRecord record(const std::string& code) const {
    const fs::path file = out_ / "records" / (code + ".json");
    return CaseRecord::from_json(read_text(file), file.string());
  }
};

TEST_F(BatchRun, OneBadCaseStopsNoOther) {
  const auto rows = table({"good", "refused", "broken", "crash", "last"});
  BatchOptions options;
  options.jobs = 2;
  options.retries = 1;
  const BatchResult r =
      run(rows, work([](const std::string& code, int) {
            if (code == "refused") {
              std::cout << R"({"error": {"exit_code": 4, "message": "'/x/y.dcm' is torn", "advice": "send it again"},
                                    "verdict": {"status": "refused", "findings": [{"code": "GAPS"}, {"code": "GAPS"}]}})";
              return 4;
            }
            if (code == "broken") return 7;
            if (code == "crash") ::raise(SIGKILL);
            std::cout << R"({"stages": [{"report": {"mask_volume_mm3": 12.5}}, {"report": {"triangles": 40}}]})";
            return 0;
          }),
          options);
  EXPECT_EQ(r.cases, 5U);
  EXPECT_EQ(r.done, 2U);
  EXPECT_EQ(r.refused, 1U);
  EXPECT_EQ(r.failed, 1U);
  EXPECT_EQ(r.resources, 1U);
  EXPECT_EQ(r.waiting, 0U);
  EXPECT_EQ(record("good").volume_mm3, 12.5);
  EXPECT_EQ(record("good").triangles, 40);
  EXPECT_EQ(record("refused").why, "'(name withheld)' is torn");
  EXPECT_EQ(record("refused").findings, std::vector<std::string>{"GAPS"});
  EXPECT_EQ(record("crash").tries, 2);
  EXPECT_EQ(tries_of("crash"), 2);
  EXPECT_NE(record("crash").why.find("ended by signal 9"), std::string::npos);
  // The report says the same three times, and nothing of where the scans are.
  const std::string page = read_text(out_ / "report.html"), csv = read_text(out_ / "report.csv"),
                    json = read_text(out_ / "report.json");
  EXPECT_NE(page.find("Batch: 2 of 5 cases done"), std::string::npos);
  EXPECT_NE(csv.find("refused,refused,4,refused,GAPS,"), std::string::npos);
  const Json parsed = Json::parse(json).value();
  EXPECT_EQ(parsed.find("rows")->items().size(), 5U);
  EXPECT_EQ(*parsed.find("done")->number(), 2);
  for (const std::string& text : {page, csv, json}) EXPECT_EQ(text.find("scan-of"), std::string::npos);
}

// A disk that fills up in mid-case is told as that, tried again, and the next run does what is left; the others go on.
TEST_F(BatchRun, ADiskWithoutRoomIsNoFaultOfTheCase) {
  const auto rows = table({"told", "short", "denied", "last"});
  BatchOptions options;
  options.retries = 0;
  bool full = true;
  const auto disk = work([&full](const std::string& code, int) {
    if (!full || code == "last") return 0;
    if (code == "told")
      std::cout
          << R"({"error": {"exit_code": 6, "message": "cannot write 'x': No space left on device", "advice": ""}})";
    if (code == "short")
      std::cout
          << R"({"error": {"exit_code": 6, "message": "cannot write 'x': the file is incomplete", "advice": "free some space, or write to another disk"}})";
    if (code == "denied")
      std::cout
          << R"({"error": {"exit_code": 6, "message": "cannot write 'x': Permission denied", "advice": "choose a folder that you may write to"}})";
    return 6;
  });
  BatchResult r = run(rows, disk, options);
  EXPECT_EQ(r.done, 1U);
  EXPECT_EQ(r.resources, 2U);
  EXPECT_EQ(r.failed, 1U);
  EXPECT_EQ(record("denied").state, CaseState::failed);
  full = false;
  r = run(rows, disk, options);
  EXPECT_EQ(r.done, 3U);
  EXPECT_EQ(record("short").state, CaseState::done);
  EXPECT_EQ(tries_of("denied"), 1);  // not tried again: nothing that it depends on has changed
}

TEST_F(BatchRun, WhatIsDoneIsNotDoneAgain) {
  const auto rows = table({"a", "b", "c"});
  const auto flaky = work([](const std::string& code, int tries) { return code == "b" && tries < 2 ? 4 : 0; });
  EXPECT_EQ(run(rows, flaky).refused, 1U);
  BatchResult r = run(rows, flaky);
  EXPECT_EQ(r.untouched, 3U);  // nothing has changed: what was rejected would be rejected again
  EXPECT_EQ(tries_of("b"), 1);
  BatchOptions again;
  again.retry_failed = true;
  r = run(rows, flaky, again);
  EXPECT_EQ(r.untouched, 2U);
  EXPECT_EQ(r.done, 3U);
  // A source that has changed, a case that is gone, a damaged record, another pipeline.
  std::ofstream(rows[0].source) << "another, longer scan";
  fs::remove_all(out_ / "cases" / "b");
  std::ofstream(out_ / "records" / "c.json") << "{ \"osteotome_batch_case\": 1, \"ca";
  r = run(rows, flaky);
  EXPECT_EQ(r.untouched, 0U);
  EXPECT_EQ(r.done, 3U);
  EXPECT_EQ(run(rows, flaky).untouched, 3U);
  BatchOptions other;
  other.key = "another pipeline";
  EXPECT_EQ(run(rows, flaky, other).untouched, 0U);
}

TEST_F(BatchRun, OneThatHangsOrEatsMemoryIsEnded) {
  const auto rows = table({"hangs", "eats", "good"});
  BatchOptions options;
  options.jobs = 3;
  options.retries = 0;
  options.seconds = 3;
  options.memory_mb = 500;
  const BatchResult r = run(rows, work([](const std::string& code, int) {
                              if (code == "hangs") {
                                for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
                              }
                              if (code == "eats") {
                                try {
                                  std::vector<std::vector<char>> held;
                                  for (;;) {
                                    held.emplace_back(40'000'000, 'x');
                                    std::this_thread::sleep_for(std::chrono::milliseconds(20));
                                  }
                                } catch (const std::bad_alloc&) {
                                  return 9;
                                }
                              }
                              return 0;
                            }),
                            options);
  EXPECT_EQ(r.resources, 2U);
  EXPECT_EQ(r.done, 1U);
  EXPECT_NE(record("hangs").why.find("not done within 0.05 min"), std::string::npos) << record("hangs").why;
  EXPECT_NE(record("eats").why.find("needs more than 500 MB"), std::string::npos) << record("eats").why;
}

TEST_F(BatchRun, StopsCleanlyAndGoesOnLater) {
  const auto rows = table({"one", "two", "three"});
  std::atomic<bool> cancel{false};
  Context context;
  context.set_cancel_flag(&cancel);
  // Done when the first record is there: what runs then is interrupted.
  context.on_progress([&](double fraction, std::string_view) {
    if (fraction > 0.3) cancel = true;
  });
  const fs::path hang = folder_.path() / "hang";
  std::ofstream(hang) << "x";
  const auto slow = work([&](const std::string& code, int) {
    if (code == "two" && fs::exists(hang)) {
      ::signal(SIGTERM, SIG_DFL);
      for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
    }
    return 0;
  });
  try {
    BatchOptions options;
    options.jobs = 2;
    static_cast<void>(run(rows, slow, options, context));
    FAIL() << "it was not stopped";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::cancelled);
  }
  const Json report = Json::parse(read_text(out_ / "report.json")).value();
  EXPECT_EQ(*report.find("done")->number(), 1);
  EXPECT_EQ(*report.find("waiting")->number(), 2);
  fs::remove(hang);
  const BatchResult r = run(rows, slow);
  EXPECT_EQ(r.done, 3U);
  EXPECT_EQ(r.untouched, 1U);
  EXPECT_EQ(tries_of("one"), 1);
}

TEST_F(BatchRun, BeginsNoCaseOnAFullDisk) {
  const auto rows = table({"one", "two"});
  BatchOptions options;
  options.keep_free_mb = 1e12;
  const BatchResult r = run(rows, work([](const std::string&, int) { return 0; }), options);
  EXPECT_NE(r.stopped.find("MB are free"), std::string::npos);
  EXPECT_EQ(r.waiting, 2U);
  EXPECT_EQ(tries_of("one"), 0);
}

TEST_F(BatchRun, OnlySomeAreDoneWhereAsked) {
  const auto rows = table({"one", "two", "three"});
  const auto good = work([](const std::string&, int) { return 0; });
  BatchOptions options;
  options.only = {"two"};
  const BatchResult r = run(rows, good, options);
  EXPECT_EQ(r.cases, 1U);
  EXPECT_EQ(r.done, 1U);
  EXPECT_FALSE(fs::exists(out_ / "report.html"));
  EXPECT_EQ(write_batch_report(rows, out_).done, 1U);
  options.only = {"four"};
  EXPECT_THROW(static_cast<void>(run(rows, good, options)), Error);
  EXPECT_EQ(run(rows, good).untouched, 1U);
}

TEST_F(BatchRun, TouchesNothingThatIsNotItsOwn) {
  const auto rows = table({"one"});
  const auto good = work([](const std::string&, int) { return 0; });
  fs::create_directories(out_);
  std::ofstream(out_ / "letter.txt") << "dear";
  try {
    static_cast<void>(run(rows, good));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::cannot_write);
  }
  EXPECT_EQ(tries_of("one"), 0);
  EXPECT_FALSE(fs::exists(out_ / "batch.json"));
  // Another run at work in the same folder.
  fs::remove(out_ / "letter.txt");
  static_cast<void>(run(rows, good));
  const int fd = ::open((out_ / "batch.json").c_str(), O_RDONLY);
  ASSERT_EQ(::flock(fd, LOCK_EX | LOCK_NB), 0);
  EXPECT_THROW(static_cast<void>(run(rows, good)), Error);
  ::close(fd);
  EXPECT_EQ(run(rows, good).untouched, 1U);
}

}  // namespace
}  // namespace osteo
